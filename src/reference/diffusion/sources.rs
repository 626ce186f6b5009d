//! Light of suns and lamps that is scattered for the first time, cell by cell.

use glam::{DMat3, DVec3};

use crate::model::grid::GridSpec;
use crate::model::light::Light;
use crate::model::medium::MeanMedium;
use crate::reference::parallel::parallel_map;
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
}

impl DiffusionMedium {
    /// Returns the numbers for a grid: c is 1 over the mean chord 4V/A of its box.
    pub fn new(mean: MeanMedium, grid: &GridSpec) -> DiffusionMedium {
        DiffusionMedium { mean, inverse_chord: grid.inverse_chord() }
    }

    /// Returns D = 1/(3σ(1 − ϖg) + c) at an extinction.
    pub fn reach(&self, extinction: f64) -> DVec3 {
        let MeanMedium { albedo, g, .. } = self.mean;
        let loss = DVec3::ONE - albedo * g;
        (3.0 * extinction * loss + DVec3::splat(self.inverse_chord)).recip()
    }
}

/// Light of suns and lamps in the cells.
#[derive(Debug, Clone)]
pub struct Sources {
    /// Q0: light that is scattered, W m⁻³.
    pub scattered: Vec<DVec3>,
    /// q = D(3Q1 + cF₀): D times three times the momentum that it keeps, with the sky's where a
    /// scene has surfaces or ground; a row an axis, W m⁻².
    pub carried: Vec<[DVec3; 3]>,
    /// Fluence of suns and lamps, and their flux along each axis, means over the cell, W m⁻².
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
        let MeanMedium { albedo, g, straight: f } = of.mean;
        let (depth, kept) = (DVec3::ONE - albedo * f, DVec3::ONE - albedo * g);
        let spec = obstacles.spec;
        let found = parallel_map(obstacles.cells.len(), |c| {
            let p = spec.center(c);
            let receiver = Receiver { position: p, i_region: u32::MAX };
            let (mut fluence, mut flux, mut fallen) = (DVec3::ZERO, DMat3::ZERO, DVec3::ZERO);
            let mut direct = 0.0;
            for light in lights.iter().filter(|light| has_sky_flux || !light.is_sky()) {
                let way = light.arrival(p);
                let tau = obstacles.depths(&[receiver], std::slice::from_ref(light))[0];
                if tau >= BARRED {
                    continue;
                }
                if light.is_sky() {
                    fallen += light.energy() * (-tau * kept).exp();
                    continue;
                }
                let e = light.energy() * way.falloff * (-tau * depth).exp();
                direct += e.element_sum() / 3.0;
                let e = e * mean_over(obstacles.cells[c] * depth * chord(spec.edges(), way.toward));
                fluence += e;
                // A column an axis.
                for axis in 0..3 {
                    *flux.col_mut(axis) -= e * way.toward[axis];
                }
            }
            let extinction = obstacles.cells[c];
            let of_suns = [fluence, flux.x_axis, flux.y_axis, flux.z_axis];
            let mut carried = [0, 1, 2].map(|axis| {
                3.0 * of.reach(extinction) * albedo * (g - f) * extinction * flux.col(axis)
            });
            carried[1] -= of.reach(extinction) * of.inverse_chord * fallen;
            (albedo * (1.0 - f) * extinction * fluence, (carried, of_suns, direct))
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

/// Returns the mean of light over its way through a cell of the depth `depth`, over the light at
/// the middle.
fn mean_over(depth: DVec3) -> DVec3 {
    (0.5 * depth)
        .to_array()
        .map(|h| if h > 0.0 { h.min(20.0).sinh() / h.min(20.0) } else { 1.0 })
        .into()
}
