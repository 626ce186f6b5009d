//! morton: keys against the reference's, exactly but for coordinates within their rounding of a
//! cell's face; places against its order.

use std::ops::RangeInclusive;

use crate::bounded::{Bounded, Random};
use crate::harness::Gpu;
use glam::DVec3;
use nimbus::gpu::Compiler;
use nimbus::layout::facet::{FacetRecord, KeyBits, RegionBoundsRecord};
use nimbus::layout::particle::{GroupRecord, PlacedRecord};
use nimbus::passes::morton::{Morton, ParticleBuffers};
use nimbus::passes::sort::{Count, Sort};
use nimbus::reference::{morton, sort};

type Entry = [u32; 2];
type Bounds = (DVec3, DVec3);

const N: usize = 20_000;

/// Points of some regions, some of them outside their region's bounds.
struct Cloud {
    positions: Vec<[f32; 3]>,
    regions: Vec<u32>,
    /// Relative to `origin`.
    bounds: Vec<Bounds>,
    origin: DVec3,
}

impl Cloud {
    fn new(n_regions: u32) -> Cloud {
        let mut random = Random(u64::from(n_regions));
        let origin = DVec3::new(1e4, -3.0, 0.1);
        let corner = |r: &mut Random| DVec3::from([0; 3].map(|_| f64::from(r.within(-20.0, 20.0))));
        let bounds: Vec<Bounds> = (0..n_regions)
            .map(|_| {
                let low = corner(&mut random);
                let extent = DVec3::from([0; 3].map(|_| f64::from(random.within(0.5, 30.0))));
                (low, low + extent)
            })
            .collect();
        // Runs of points, a region each.
        let regions: Vec<u32> = (0..N).map(|i| (i * n_regions as usize / N) as u32).collect();
        let positions = regions
            .iter()
            .map(|&region| {
                let (low, high) = bounds[region as usize];
                [0, 1, 2].map(|k| {
                    let wide = 0.02 * (high[k] - low[k]);
                    random.within(low[k] - wide, high[k] + wide)
                })
            })
            .collect();
        Cloud { positions, regions, bounds, origin }
    }

    fn records(&self) -> Vec<RegionBoundsRecord> {
        let bits = KeyBits::of(self.bounds.len() as u32);
        let of = |b: &Bounds| {
            RegionBoundsRecord::new((b.0 + self.origin, b.1 + self.origin), self.origin, bits)
        };
        self.bounds.iter().map(of).collect()
    }

    /// Entries of the points as facets.
    fn facet_entries(&self, gpu: &mut Gpu, compiler: &Compiler) -> Vec<Entry> {
        let pass = Morton::new(&gpu.device, compiler).expect("morton");
        let facet =
            |(&position, &i_region)| FacetRecord { position, i_region, ..FacetRecord::default() };
        let facets =
            gpu.upload(&self.positions.iter().zip(&self.regions).map(facet).collect::<Vec<_>>());
        let (bounds, entries) = (gpu.upload(&self.records()), gpu.buffer::<Entry>(N));
        let n = self.positions.len();
        gpu.run(|rec| {
            pass.record_facets(
                rec,
                [&facets, &bounds, &entries],
                n as u32,
                self.bounds.len() as u32,
            )
        });
        gpu.download(&entries, n)
    }

    /// Entries of the points as particles, two groups a region.
    fn particle_entries(&self, gpu: &mut Gpu, compiler: &Compiler) -> Vec<Entry> {
        let pass = Morton::new(&gpu.device, compiler).expect("morton");
        let placed = |&position: &[f32; 3]| PlacedRecord { position, sigma: 1.0 };
        let placed = gpu.upload(&self.positions.iter().map(placed).collect::<Vec<_>>());
        let i_group: Vec<u32> = self.regions.iter().zip(0..).map(|(r, i)| 2 * r + i % 2).collect();
        let group = |g: u32| GroupRecord { i_region: g / 2, ..GroupRecord::default() };
        let groups: Vec<GroupRecord> = (0..2 * self.bounds.len() as u32).map(group).collect();
        let (i_group, groups, bounds) =
            (gpu.upload(&i_group), gpu.upload(&groups), gpu.upload(&self.records()));
        let entries = gpu.buffer::<Entry>(N);
        let n = self.positions.len();
        let buffers = ParticleBuffers {
            placed: &placed,
            i_group: &i_group,
            groups: &groups,
            bounds: &bounds,
            entries: &entries,
        };
        gpu.run(|rec| pass.record_particles(rec, &buffers, n as u32, self.bounds.len() as u32));
        gpu.download(&entries, n)
    }

    /// The cells that coordinate k of a point may have in f32. Low and scale are rounded once,
    /// difference and product once each.
    fn cells(&self, i: usize, k: usize) -> (RangeInclusive<u32>, f64) {
        let (_, axis_bits) = morton::key_bits(self.bounds.len() as u32);
        let (low, high) = self.bounds[self.regions[i] as usize];
        let p = DVec3::from(self.positions[i].map(f64::from));
        let x = morton::coordinates(p, (low, high), axis_bits)[k];
        // The record's bounds are the scene's less the origin: both of its f64 roundings are below
        // u² of its magnitude.
        let low_error = 2f64.powi(-52) * (self.origin[k].abs() + low[k].abs());
        let low =
            Bounded { error: Bounded::once(low[k]).error + low_error, ..Bounded::once(low[k]) };
        let n_cells = f64::from(1 << axis_bits);
        let scale = Bounded::once(n_cells / (high[k] - low.value)).times(Bounded::exact(1.0));
        let error = Bounded::exact(p[k]).minus(low).times(scale).error;
        (morton::cell(x - error, axis_bits)..=morton::cell(x + error, axis_bits), error)
    }

    /// Entries that are not the reference's, and how many coordinates had two cells to choose from.
    fn wrong(&self, entries: &[Entry]) -> (usize, usize) {
        let (region_bits, axis_bits) = morton::key_bits(self.bounds.len() as u32);
        let (mut n_wrong, mut n_open) = (0, 0);
        for (i, [key, index]) in entries.iter().enumerate() {
            let cells = [0, 1, 2].map(|k| self.cells(i, k).0);
            n_open += cells.iter().filter(|c| c.start() != c.end()).count();
            let found = uninterleaved(key & ((1u32 << (3 * axis_bits)) - 1));
            let right = (0..3).all(|k| cells[k].contains(&found[k]))
                && *key == morton::key(self.regions[i], found, region_bits)
                && *index as usize == i;
            n_wrong += usize::from(!right);
        }
        (n_wrong, n_open)
    }
}

/// The cells of a Morton code.
fn uninterleaved(code: u32) -> [u32; 3] {
    [0, 1, 2].map(|k| (0..10).map(|b| (code >> (3 * b + k) & 1) << b).sum())
}

fn compiler() -> Compiler {
    Compiler::new(nimbus::passes::sources(), Compiler::default_cache()).expect("shaderc")
}

#[test]
fn keys_are_the_references_but_for_coordinates_on_a_face() {
    let mut gpu = Gpu::new();
    for n_regions in [1, 2, 5, 100] {
        let cloud = Cloud::new(n_regions);
        let found = cloud.facet_entries(&mut gpu, &compiler());
        let (n_wrong, n_open) = cloud.wrong(&found);
        assert_eq!(n_wrong, 0, "{n_regions} regions");
        // A coordinate anywhere in its cell lies within its error e of a face with probability 2e:
        // the count is of independent events, and six standard deviations above their mean are not
        // met.
        let mean: f64 = (0..N).flat_map(|i| [0, 1, 2].map(|k| 2.0 * cloud.cells(i, k).1)).sum();
        println!("{n_regions} regions: {n_open} coordinates on a face, {mean:.1} expected");
        assert!((n_open as f64) < mean + 6.0 * mean.sqrt() + 1.0 && mean < 1e-3 * N as f64);
        assert_eq!(cloud.particle_entries(&mut gpu, &compiler()), found, "as particles");
    }
}

#[test]
fn places_are_the_references_order() {
    let mut gpu = Gpu::new();
    let cloud = Cloud::new(7);
    let morton = Morton::new(&gpu.device, &compiler()).expect("morton");
    let sort = Sort::new(&gpu.device, &compiler(), N as u32).expect("sort");
    let entries = cloud.facet_entries(&mut gpu, &compiler());
    let (from, to) = (gpu.upload(&entries), gpu.buffer::<u32>(N));
    gpu.run(|rec| {
        sort.record(rec, &from, 32, Count::Known(N as u32))?;
        morton.record_order(rec, [&from, &to], N as u32)
    });
    let places: Vec<u32> = gpu.download(&to, N);
    assert_eq!(places, sort::order(&entries.iter().map(|e| e[0]).collect::<Vec<_>>()));
    // A region's places are its indices.
    assert!(
        places.iter().zip(&cloud.regions).all(|(&i, &region)| cloud.regions[i as usize] == region)
    );
    // The whole reference differs only where a point on a face went to the cell beside.
    let positions: Vec<DVec3> =
        cloud.positions.iter().map(|p| DVec3::from(p.map(f64::from))).collect();
    let truth = morton::order(&positions, &cloud.regions, &cloud.bounds);
    let is_open =
        |i: u32| [0, 1, 2].iter().any(|k| cloud.cells(i as usize, *k).0.clone().count() > 1);
    let closed =
        |order: &[u32]| order.iter().copied().filter(|i| !is_open(*i)).collect::<Vec<u32>>();
    assert_eq!(closed(&places), closed(&truth));
}

#[test]
fn no_extent_no_number_and_the_farthest_are_cells_too() {
    let mut gpu = Gpu::new();
    let flat = (DVec3::new(-1.0, 2.0, 0.0), DVec3::new(1.0, 2.0, 1.0));
    // Thinner than an f32 can say there.
    let thin = (DVec3::new(50.0, 0.0, 0.0), DVec3::new(50.0 + 1e-6, 8.0, 8.0));
    let cloud = Cloud {
        positions: vec![
            [0.0, 2.0, 0.5],
            [f32::NAN, 7.0, f32::NAN],
            [f32::INFINITY, f32::INFINITY, f32::NEG_INFINITY],
            [-3e38, 3e38, 3e38],
            [50.000004, 4.0, 8.0],
        ],
        regions: vec![0, 0, 0, 0, 1],
        bounds: vec![flat, thin],
        origin: DVec3::ZERO,
    };
    let found = cloud.facet_entries(&mut gpu, &compiler());
    // Two regions leave 10 bits an axis; without extent an axis has one cell, ∞·0 is no number.
    let cells = [[512, 0, 512], [0, 0, 0], [1023, 0, 0], [0, 0, 1023], [0, 512, 1023]];
    for (i, (entry, cells)) in found.iter().zip(cells).enumerate() {
        assert_eq!(*entry, [morton::key(cloud.regions[i], cells, 1), i as u32], "{i}");
    }
    assert_eq!(cloud.particle_entries(&mut gpu, &compiler()), found);
}

#[test]
fn wrong_keys_are_noticed() {
    let mut gpu = Gpu::new();
    let cloud = Cloud::new(5);
    let mut found = cloud.facet_entries(&mut gpu, &compiler());
    assert_eq!(cloud.wrong(&found).0, 0);
    for bit in [0, 13, 26, 29] {
        found[321][0] ^= 1 << bit;
        assert_eq!(cloud.wrong(&found).0, 1, "bit {bit}");
        found[321][0] ^= 1 << bit;
    }
    for (from, to) in [
        ("- bounds[region].low", ""),
        ("(spread(cell_of(x.y)) << 1)", "(spread(cell_of(x.z)) << 1)"),
        ("0x030C30C3u", "0x030C30C1u"),
        ("(32u - push.region_bits)", "(31u - push.region_bits)"),
        ("clamp(x, 0.0, float((1u << push.axis_bits) - 1u))", "x"),
    ] {
        let found =
            cloud.facet_entries(&mut gpu, &Gpu::wrong_compiler("morton_key.comp", from, to));
        assert!(cloud.wrong(&found).0 > 0, "{from} as {to}");
    }
}
