//! Sort keys by view depth and the stable order they give, model.md §11 "sort": ascending key is far to near.

use glam::DVec3;

/// View depth relative to O: z = f·placed, so that a camera that moves without turning keeps the order.
pub fn depths(forward: DVec3, positions: &[DVec3]) -> Vec<f64> {
    positions.iter().map(|p| forward.dot(*p)).collect()
}

/// m: f32 to u32, monotone over all numbers, −0 just below +0, NaN beyond the infinity of its sign.
pub fn monotone(z: f32) -> u32 {
    let bits = z.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// 32-bit key: ~m(z).
pub fn key32(z: f32) -> u32 {
    !monotone(z)
}

/// 16-bit key: floor((z_hi − z)·65536/(z_hi − z_lo)) clamped to 0…65535, where z_hi and z_lo are ± the bounding
/// sphere's `radius`.
pub fn key16(z: f64, radius: f64) -> u32 {
    // `as` saturates, and sends NaN (of z, or 0/0 of a sphere without radius) to 0.
    (((radius - z) * 65536.0 / (2.0 * radius)).floor() as u32).min(65535)
}

/// Indices in ascending order of key, ties in ascending index.
pub fn order(keys: &[u32]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..keys.len() as u32).collect();
    order.sort_by_key(|&i| keys[i as usize]);
    order
}
