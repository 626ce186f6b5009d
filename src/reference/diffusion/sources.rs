//! Light of suns and lamps that is scattered for the first time, cell by cell.

use glam::{DMat3, DVec3};

use crate::model::grid::GridSpec;
use crate::model::light::Light;
use crate::model::medium::MeanMedium;
use crate::model::parallel::parallel_map;
use crate::reference::scatter::BARRED;
use crate::reference::transmit::{Obstacles, Receiver};

/// Fluence or φ, and the flux along each axis.
pub(super) type Moments = [DVec3; 4];

/// Numbers that diffusion depends on, besides densities and lights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiffusionMedium {
    /// ϖ, g and f.
    pub mean: MeanMedium,
    /// c: inverse length that bounds how far light travels where nothing scatters.
    pub inverse_chord: f64,
    /// Extinction beyond which a cell counts as no denser, 1/length.
    pub densest: f64,
}

impl DiffusionMedium {
    /// Returns the numbers for a grid: c is 1 over the mean chord 4V/A of its box.
    pub fn new(mean: MeanMedium, grid: &GridSpec) -> DiffusionMedium {
        DiffusionMedium { mean, inverse_chord: grid.inverse_chord(), densest: mean.densest(grid) }
    }

    /// Returns D = 1/(3σ(1 − ϖg) + c) at an extinction.
    pub fn reach(&self, extinction: f64) -> DVec3 {
        let MeanMedium { albedo, g, .. } = self.mean;
        let loss = DVec3::ONE - albedo * g;
        (3.0 * extinction.min(self.densest) * loss + DVec3::splat(self.inverse_chord)).recip()
    }
}

/// Light of suns and lamps in the cells.
#[derive(Debug, Clone, Default)]
pub struct Sources {
    /// Q0: light that is scattered, W m⁻³.
    pub scattered: Vec<DVec3>,
    /// q = D(3Q1 + cF₀): D times three times the momentum that it keeps, with the sky's where a
    /// scene has surfaces or ground; a row an axis, W m⁻².
    pub carried: Vec<[DVec3; 3]>,
    /// Fluence of suns and lamps and their flux along each axis, means over the cell, W m⁻².
    pub of_suns: Vec<Moments>,
    /// U: fluence of suns and lamps, mean over the channels, W m⁻².
    pub direct: Vec<f64>,
}

impl Sources {
    /// Returns the sources in the cells of `obstacles`, with the flux of the sky if it is wanted.
    pub fn new(
        of: &DiffusionMedium,
        obstacles: &Obstacles<'_>,
        lights: &[Light],
        has_sky_flux: bool,
    ) -> Sources {
        let MeanMedium { albedo, g, straight: f, .. } = of.mean;
        let (depth, kept) = (DVec3::ONE - albedo * f, DVec3::ONE - albedo * g);
        let spec = obstacles.spec;
        let found = parallel_map(obstacles.cells.len(), |c| {
            let (p, whole) = (spec.center(c), obstacles.cells[c]);
            let extinction = whole.min(of.densest);
            let receiver = Receiver { position: p, i_region: u32::MAX };
            let (mut fluence, mut flux, mut fallen) = (DVec3::ZERO, DMat3::ZERO, [DVec3::ZERO; 3]);
            let (mut direct, mut from_middle) = (0.0, DVec3::ZERO);
            for light in lights.iter().filter(|light| has_sky_flux || !light.is_sky()) {
                let way = light.arrival(p);
                let tau = obstacles.depths(&[receiver], std::slice::from_ref(light))[0];
                if tau >= BARRED {
                    continue;
                }
                if let Light::Sky { irradiance, tilt, .. } = light {
                    let passed = irradiance * (-tau * kept).exp();
                    fallen.iter_mut().zip(tilt.flux()).for_each(|(f, along)| *f += along * passed);
                    continue;
                }
                let e = light.energy() * way.falloff;
                direct += (e * (-tau * depth).exp()).element_sum() / 3.0;
                let chord = chord(spec.edges(), way.toward);
                // Where the march finds less than half of the cell, light is whole at the face.
                let front = (tau - 0.5 * whole * chord).max(0.0);
                let own = [whole * chord, extinction * chord];
                let (mean, share) = in_cell(front, own, depth, kept);
                let e = e * mean;
                fluence += e;
                from_middle += share * e;
                // A column an axis.
                for axis in 0..3 {
                    *flux.col_mut(axis) -= e * way.toward[axis];
                }
            }
            let of_suns = [fluence, flux.x_axis, flux.y_axis, flux.z_axis];
            let carried = [0, 1, 2].map(|axis| {
                let of_suns = 3.0 * albedo * (g - f) * extinction * flux.col(axis);
                of.reach(extinction) * (of_suns + of.inverse_chord * fallen[axis])
            });
            (albedo * (1.0 - f) * extinction * from_middle, (carried, of_suns, direct))
        });
        let (scattered, rest): (Vec<DVec3>, Vec<_>) = found.into_iter().unzip();
        let direct = rest.iter().map(|(.., direct)| *direct).collect();
        let (carried, of_suns) = rest.into_iter().map(|(carried, suns, _)| (carried, suns)).unzip();
        Sources { scattered, carried, of_suns, direct }
    }
}

/// Returns the length of the way through the middle of a cell.
fn chord(edges: DVec3, toward: DVec3) -> f64 {
    (edges / toward.abs().max(DVec3::splat(1e-6))).min_element()
}

/// Returns the mean light of a beam in a cell, and the share of what is scattered that would make
/// as much φ deep in the cloud if it were scattered at the cell's middle.
///
/// `front` is the optical depth before the cell, `own` that from face to face, and `counted` what
/// of it counts for diffusion. `weakened` and `kept` are the factors of the depth that weakens the
/// beam, and of the depth for diffusion.
fn in_cell(front: f64, [own, counted]: [f64; 2], weakened: DVec3, kept: DVec3) -> (DVec3, DVec3) {
    let of = |axis: usize| {
        let t = own * weakened[axis];
        if t == 0.0 {
            return (1.0, 1.0);
        }
        let absorbed = -libm::expm1(-t);
        // The mean place of what is scattered, as a share of the way.
        let place = if t < 1e-3 { 0.5 - t / 12.0 } else { 1.0 / t - (-t).exp() / absorbed };
        let middle = 0.5 * counted;
        let rise = |depth: f64| 2.0 + 3.0 * kept[axis] * (front + depth);
        let mean = absorbed / (counted * weakened[axis]);
        (mean, rise(middle.min(place * own)) / rise(middle))
    };
    let [(x, i), (y, j), (z, k)] = [0, 1, 2].map(of);
    let passed = (-front * weakened).to_array().map(f64::exp);
    (DVec3::new(x, y, z) * DVec3::from(passed), DVec3::new(i, j, k))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_takes_what_falls_on_it() {
        // Behind a depth of 1: the light before the cell less that behind it, by its depth.
        let depths = DVec3::new(0.0, 1.0, 5e4);
        let (mean, _) = in_cell(1.0, [2.0; 2], depths, DVec3::ONE);
        let expected =
            DVec3::new(1.0, ((-1f64).exp() - (-3f64).exp()) / 2.0, (-5e4f64).exp() / 1e5);
        assert!((mean - expected).abs().max_element() < 1e-16, "{mean}");
        // Never more than falls on it.
        let (mean, _) = in_cell(0.0, [4.0; 2], DVec3::ONE, DVec3::ONE);
        assert!((mean.x - 0.25 * (1.0 - (-4f64).exp())).abs() < 1e-16, "{mean}");
        // Where half of the cell counts, it has twice the light.
        let (mean, share) = in_cell(0.0, [4.0, 2.0], DVec3::ONE, DVec3::ONE);
        assert!((mean.x - 0.5 * (1.0 - (-4f64).exp())).abs() < 1e-16, "{mean}");
        let place = 1.0 - 4.0 / 4f64.exp_m1();
        assert!((share.x - (2.0 + 3.0 * place) / 5.0).abs() < 1e-15, "{share}");
    }

    #[test]
    fn light_at_the_face_of_an_opaque_cell_leaves_it_there() {
        let share = |front, own, kept| in_cell(front, [own; 2], DVec3::ONE, DVec3::splat(kept)).1.x;
        // Scattered at a depth of 1 on average, where (2 + 3)/(2 + 3 own/2) is left at the middle.
        assert!((share(0.0, 1e6, 1.0) - 5.0 / (2.0 + 1.5e6)).abs() < 1e-12);
        // Thin cells scatter at their middle, and what absorbs all has no diffusion.
        assert!((share(0.0, 1e-4, 1.0) - 1.0).abs() < 1e-8);
        assert_eq!(share(0.0, 10.0, 0.0), 1.0);
        // Behind much depth the difference is of no account.
        assert!((share(1e9, 10.0, 1.0) - 1.0).abs() < 1e-8);
        // The series meets the formula.
        assert!((share(0.0, 0.9999e-3, 1.0) - share(0.0, 1.0001e-3, 1.0)).abs() < 1e-9);
    }
}
