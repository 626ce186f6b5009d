//! Keys of a Morton order within each region, model.md §7 and passes.md "morton".

use glam::DVec3;

use super::sort;

/// Returns the bits of the region and of each axis in a 32-bit key: enough for `n_regions` regions,
/// and a third of the rest, at most 10.
pub fn key_bits(n_regions: u32) -> (u32, u32) {
    let region = (0..32).find(|b| 1u64 << b >= u64::from(n_regions)).unwrap_or(32);
    (region, ((32 - region) / 3).min(10))
}

/// Returns the coordinates of `p` in cells of a region's bounds; an axis without extent has one
/// cell.
pub fn coordinates(p: DVec3, (low, high): (DVec3, DVec3), axis_bits: u32) -> [f64; 3] {
    let n = f64::from(1u32 << axis_bits);
    [0, 1, 2].map(|k| if high[k] > low[k] { (p[k] - low[k]) / (high[k] - low[k]) * n } else { 0.0 })
}

/// Returns the cell of a coordinate, clamped to the bounds; NaN is in cell 0.
pub fn cell(x: f64, axis_bits: u32) -> u32 {
    // `as` saturates, and converts NaN to 0.
    (x as u32).min((1 << axis_bits) - 1)
}

/// Returns the Morton code: bit b of x, y, z is bit 3b, 3b + 1, 3b + 2.
pub fn code(cells: [u32; 3]) -> u32 {
    let bit = |b: u32, k: usize| (cells[k] >> b & 1) << (3 * b + k as u32);
    (0..10).flat_map(|b| (0..3).map(move |k| bit(b, k))).sum()
}

/// Returns the key: region above, Morton code below.
pub fn key(region: u32, cells: [u32; 3], region_bits: u32) -> u32 {
    ((u64::from(region) << (32 - region_bits)) as u32) | code(cells)
}

/// Returns the index at each place: `positions` ordered by key, ties by index. `bounds` by region.
pub fn order(positions: &[DVec3], regions: &[u32], bounds: &[(DVec3, DVec3)]) -> Vec<u32> {
    let (region_bits, axis_bits) = key_bits(bounds.len() as u32);
    let key_of = |(p, &region): (&DVec3, &u32)| {
        let cells = coordinates(*p, bounds[region as usize], axis_bits).map(|x| cell(x, axis_bits));
        key(region, cells, region_bits)
    };
    sort::order(&positions.iter().zip(regions).map(key_of).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_shared_out() {
        // By hand: 2 regions 1 bit, 31/3 = 10; 8 regions 3 bits, 29/3 = 9; 5 regions as 8; 2^20
        // leave 12/3 = 4.
        for (n, bits) in
            [(0, (0, 10)), (1, (0, 10)), (2, (1, 10)), (3, (2, 10)), (5, (3, 9)), (8, (3, 9))]
        {
            assert_eq!(key_bits(n), bits, "{n}");
        }
        assert_eq!((key_bits(1 << 20), key_bits(u32::MAX)), ((20, 4), (32, 0)));
    }

    #[test]
    fn codes_interleave_and_regions_stand_above() {
        // By hand: x = 5 = 101b gives bits 0 and 6, y = 1 bit 1, z = 2 bit 5.
        assert_eq!(code([5, 1, 2]), 1 << 6 | 1 << 5 | 1 << 1 | 1);
        assert_eq!(code([1023; 3]), (1 << 30) - 1);
        assert_eq!(key(3, [1, 0, 0], 2), 0xC000_0001);
        assert_eq!(key(0, [1023, 0, 0], 0), 0x0924_9249);
    }

    #[test]
    fn cells_are_cut_to_the_bounds() {
        let bounds = (DVec3::new(-1.0, 2.0, 5.0), DVec3::new(1.0, 6.0, 5.0));
        assert_eq!(coordinates(DVec3::new(0.0, 3.0, 9.0), bounds, 3), [4.0, 2.0, 0.0]);
        assert_eq!(
            [0.0, 0.99, 7.5, 8.0, 1e30, -1.0, f64::NAN].map(|x| cell(x, 3)),
            [0, 0, 7, 7, 7, 0, 0]
        );
    }

    #[test]
    fn an_order_visits_the_octants_one_after_the_other() {
        let bounds = [(DVec3::ZERO, DVec3::splat(2.0)), (DVec3::ZERO, DVec3::ONE)];
        let corner =
            |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
        // The eight octants' corners backwards, then one of the next region, which no octant may
        // follow.
        let positions: Vec<DVec3> = (0..8).rev().map(corner).chain([DVec3::ZERO]).collect();
        let regions = [0, 0, 0, 0, 0, 0, 0, 0, 1];
        assert_eq!(order(&positions, &regions, &bounds), [7, 6, 5, 4, 3, 2, 1, 0, 8]);
    }
}
