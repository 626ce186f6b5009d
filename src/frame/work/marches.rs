//! The number of samples that `transmit` takes of the density grid, counted in a frame.

use glam::DVec3;

use crate::frame::packet::Packet;
use crate::layout::facet::FacetRecord;
use crate::layout::frame::{GridRecord, LIGHT_POINT, LightRecord};
use crate::model::scene::Scene;
use crate::passes::transmit::{BARRED, MAX_STEPS};

/// Returns the samples on the paths of all facets to all lights. Paths that a surface hides have
/// none: their transmittance, `[facet][light]`, is 0, or where clouds are a medium their depth that
/// of a barred way.
pub(super) fn march_samples(
    scene: &Scene,
    packet: &Packet,
    facets: &[FacetRecord],
    transmittance: &[f32],
) -> f64 {
    let is_medium = scene.lighting.mode.is_medium();
    // Without losses and without particles nothing is marched.
    if (scene.lighting.forward >= 1.0 && !is_medium) || scene.n_particles() == 0 {
        return 0.0;
    }
    let step = scene.lighting.step * f64::from(packet.grid.cell);
    let n_lights = packet.lights.len().max(1);
    let of = |(facet, through): (&FacetRecord, &[f32])| -> f64 {
        let is_clear = |v: f32| if is_medium { v < BARRED } else { v > 0.0 };
        let lit = packet.lights.iter().zip(through).filter(|(_, through)| is_clear(**through));
        lit.map(|(light, _)| samples(&packet.grid, step, vector(facet.position), light)).sum()
    };
    facets.iter().zip(transmittance.chunks(n_lights)).map(of).sum()
}

/// Returns the samples of the march from `p` to a light, in steps of `step` across cubes.
fn samples(grid: &GridRecord, step: f64, p: DVec3, light: &LightRecord) -> f64 {
    let (toward, distance) = match light.kind {
        LIGHT_POINT => {
            let offset = vector(light.position) - p;
            (offset.normalize_or(DVec3::Y), offset.length())
        }
        _ => (vector(light.toward), f64::INFINITY),
    };
    let cell = f64::from(grid.cell) * DVec3::new(1.0, f64::from(grid.aspect), 1.0);
    let low = vector(grid.low);
    let high = low + cell * DVec3::from(grid.n_cells.map(f64::from));
    let (mut enter, mut leave) = (0.0f64, distance);
    for axis in 0..3 {
        if toward[axis] != 0.0 {
            let [a, b] = [low, high].map(|face| (face[axis] - p[axis]) / toward[axis]);
            (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
        } else if p[axis] < low[axis] || p[axis] > high[axis] {
            return 0.0;
        }
    }
    let flat = DVec3::new(toward.x, toward.y * f64::from(grid.inv_aspect), toward.z);
    let n = ((leave - enter) * flat.length() / step).ceil();
    if leave > enter { n.clamp(1.0, f64::from(MAX_STEPS)) } else { 0.0 }
}

fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_march_has_a_sample_a_step_to_the_face_of_the_grid() {
        let grid = GridRecord {
            low: [0.0; 3],
            cell: 1.0,
            n_cells: [8, 8, 8],
            inv_cell: 1.0,
            aspect: 1.0,
            inv_aspect: 1.0,
            unused: [0.0; 2],
        };
        let sun = |toward| LightRecord { toward, ..LightRecord::default() };
        let up = sun([0.0, 1.0, 0.0]);
        let n = |p: [f64; 3], light: &LightRecord| samples(&grid, 0.5, DVec3::from(p), light);
        assert_eq!(n([4.0, 2.0, 4.0], &up), 12.0);
        assert_eq!(n([4.0, 2.3, 4.0], &up), 12.0);
        // Half the step, twice the samples.
        assert_eq!(samples(&grid, 0.25, DVec3::new(4.0, 2.0, 4.0), &up), 24.0);
        // Beside the grid and above it there is nothing to march through.
        assert_eq!(n([9.0, 2.0, 4.0], &up), 0.0);
        assert_eq!(n([4.0, 9.0, 4.0], &up), 0.0);
        // From below the grid all of it.
        assert_eq!(n([4.0, -3.0, 4.0], &up), 16.0);
        // A lamp ends the march.
        let lamp =
            LightRecord { kind: LIGHT_POINT, position: [4.0, 5.0, 4.0], ..LightRecord::default() };
        assert_eq!(n([4.0, 2.0, 4.0], &lamp), 6.0);
        // Steps along y are as many cells long as steps across.
        let flat = GridRecord { aspect: 0.5, inv_aspect: 2.0, ..grid };
        assert_eq!(samples(&flat, 0.5, DVec3::new(4.0, 2.0, 4.0), &up), 8.0);
    }
}
