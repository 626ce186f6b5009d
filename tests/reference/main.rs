//! The f64 reference on values worked by hand and published ones. Modules that are small enough are
//! tested in their own file.

use glam::DVec3;
use nimbus::model::boxes::CloudBox;

mod generate;
mod sprites;

fn one_box(n_particles: u32, extent: DVec3, radius_max: f64) -> CloudBox {
    CloudBox { n_particles, extent, center: DVec3::ZERO, radius_max }
}
