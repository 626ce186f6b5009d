//! How blobs that overlap are composed (passes.md "slices").

use super::group::Group;
use super::named::named;

named! {
    /// How blobs that overlap are composed.
    pub enum Overlap {
        /// One after the other, each at its centre's depth.
        Thin = "thin",
        /// Slice by slice, each blob by its own share of a slice.
        Slices = "slices",
        /// The faster one at the scene's first frame.
        Auto = "auto",
    }
}

/// Thickness of a slice by default, mean σ. Thinner slices no longer hold a blob, thicker ones mix
/// what lies apart (studies.md, "draw.overlap and draw.slice").
pub const SLICE: f64 = 1.25;

/// Returns the number of slices that a blob is dealt among. Thicker slices hold it in fewer, which
/// cost less. Four in place of these have 1.01 (2.2 σ, three) and 0.96 (3 σ, two) of the error
/// against the volume in study-cloud, and 1.00 and 0.74 in study-both.
pub fn n_parts(slice: f64) -> u32 {
    match slice {
        s if s < 1.75 => 4,
        s if s < 2.75 => 3,
        _ => 2,
    }
}

/// The most slices between a scene's nearest and farthest particle.
pub const MAX_SLICES: f64 = 1000.0;

/// Returns the thickness of a slice of `slice` σ. The σ is a mean over the particles of `groups`,
/// as they have grown. It is weighted by the areas that they cover: Σσ³/Σσ². Every particle counts
/// with its group's own such mean. All centres lie within
/// `radius` of a point, and the slice is not thinner than 1/[`MAX_SLICES`] of that sphere.
pub fn slice_length(slice: f64, groups: &[Group], radius: f64) -> f64 {
    let sum = |power: i32| -> f64 {
        groups.iter().map(|g| f64::from(g.n_particles) * sigma(g).powi(power)).sum()
    };
    let mean = sum(3) / sum(2);
    // Without particles, or where they have no size, no slice has anything in it.
    if mean > 0.0 { (slice * mean).max(2.0 * radius / MAX_SLICES) } else { 1.0 }
}

/// Returns σ of a group's particles: that of the ball of an ellipsoid's volume.
fn sigma(group: &Group) -> f64 {
    group.sigma_by_area * group.aspects[1].cbrt()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn group(n_particles: u32, sigma: f64, aspect: f64) -> Group {
        Group {
            i_cloud: 0,
            i_first: 0,
            n_particles,
            center: DVec3::ZERO,
            cloud_center: DVec3::ZERO,
            facing_from: DVec3::ZERO,
            scale: 1.0,
            half_extent: DVec3::ONE,
            sigma_max: sigma,
            sigma_y_max: sigma,
            sigma_mean: sigma,
            sigma_by_area: sigma,
            aspects: [aspect; 3],
            turned_max: 0.0,
            kappa_max: 1.0,
            mass_max: 1.0,
            gust_reach: 0.0,
        }
    }

    #[test]
    fn thicker_slices_hold_a_blob_in_fewer() {
        let slices = [0.1, SLICE, 1.74, 1.75, 2.74, 2.75, 10.0];
        assert_eq!(slices.map(n_parts), [4, 4, 4, 3, 3, 2, 2]);
    }

    #[test]
    fn slices_are_as_thick_as_the_blobs_that_cover_most() {
        let one = group(10, 0.5, 1.0);
        assert_eq!(slice_length(1.25, &[one], 4.0), 0.625);
        // (4·1 + 1·8)/(4·1 + 1·4) = 3/2.
        let two = [group(4, 1.0, 1.0), group(1, 2.0, 1.0), group(0, 9.0, 1.0)];
        assert!((slice_length(2.0, &two, 4.0) - 3.0).abs() < 1e-15);
        // As it has grown; by the ball of an ellipsoid's volume.
        assert!((slice_length(1.0, &[one.grown(3.0)], 4.0) - 1.5).abs() < 1e-15);
        assert!((slice_length(1.0, &[group(7, 1.0, 0.125)], 4.0) - 0.5).abs() < 1e-15);
    }

    #[test]
    fn slices_are_not_too_many_and_never_without_thickness() {
        let most = slice_length(0.1, &[group(3, 1e-9, 1.0)], 50.0);
        assert!((100.0 / most - MAX_SLICES).abs() < 1e-9);
        for groups in [&[][..], &[group(0, 1.0, 1.0)], &[group(5, 0.0, 1.0)]] {
            assert_eq!(slice_length(1.0, groups, 2.0), 1.0);
        }
    }
}
