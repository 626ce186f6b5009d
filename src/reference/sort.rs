//! Sort keys by view depth, or by distance from the eye, and their stable order, passes.md "sort".
//! Ascending keys run far to near.

use glam::DVec3;

/// Returns the view depths relative to O: z = f·placed. They keep their order when the camera moves
/// without turning.
pub fn depths(forward: DVec3, positions: &[DVec3]) -> Vec<f64> {
    positions.iter().map(|p| forward.dot(*p)).collect()
}

/// Returns the distances from the eye relative to that of O: |placed − eye| − |eye|.
pub fn distances(eye: DVec3, positions: &[DVec3]) -> Vec<f64> {
    positions.iter().map(|p| (*p - eye).length() - eye.length()).collect()
}

/// Returns m, which maps f32 to u32 monotonically: −0 just below +0, NaN beyond the infinity of its
/// sign.
fn monotone(z: f32) -> u32 {
    let bits = z.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// Returns the 32-bit key ~m(z).
pub fn key32(z: f32) -> u32 {
    !monotone(z)
}

/// Returns the 16-bit key floor((z_hi − z)·65536/(z_hi − z_lo)), clamped to 0…65535. z_hi and z_lo
/// are ± the bounding sphere's `radius`.
pub fn key16(z: f64, radius: f64) -> u32 {
    // `as` saturates, and converts NaN (of z, or 0/0 of a sphere without radius) to 0.
    (((radius - z) * 65536.0 / (2.0 * radius)).floor() as u32).min(65535)
}

/// Returns the indices in ascending order of key, ties in ascending index.
pub fn order(keys: &[u32]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..keys.len() as u32).collect();
    order.sort_by_key(|&i| keys[i as usize]);
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_32_bits_run_against_depth() {
        let far_to_near =
            [f32::INFINITY, 3.0, 1.0, 1e-40, 0.0, -0.0, -1e-40, -1.0, -3.0, f32::NEG_INFINITY];
        assert!(far_to_near.windows(2).all(|z| key32(z[0]) < key32(z[1])));
        // By hand: +0 has no bits, m = 2³¹, key = 2³¹ − 1; 1.0 is 0x3f80_0000.
        assert_eq!((key32(0.0), key32(1.0)), (0x7fff_ffff, 0x407f_ffff));
        // −1.0 is 0xbf80_0000, m = ~bits, and the key is the bits again.
        assert_eq!(key32(-1.0), 0xbf80_0000);
        assert!(
            key32(f32::NAN) < key32(f32::INFINITY) && key32(-f32::NAN) > key32(f32::NEG_INFINITY)
        );
    }

    #[test]
    fn keys_of_16_bits_clamp() {
        let key = |z| key16(z, 2.0);
        // By hand: (2 − z)·65536/4.
        assert_eq!([key(2.0), key(1.0), key(0.0), key(-1.0)], [0, 16384, 32768, 49152]);
        assert_eq!([key(-2.0), key(-9.0), key(9.0), key(f64::NAN)], [65535, 65535, 0, 0]);
        assert_eq!((key16(0.0, 0.0), key16(1.0, 0.0)), (0, 0));
    }

    #[test]
    fn ties_keep_their_index_order() {
        assert_eq!(order(&[5, 1, 5, 1, 0]), [4, 1, 3, 0, 2]);
        assert!(order(&[]).is_empty());
    }
}
