//! Bounces: light on straight ways between cells, and what diffusion makes of its change.

use glam::DVec3;

use super::moments::flux_through_faces;
use super::multigrid::Multigrid;
use super::orders::{self, High, Sent, high_orders, of_order};
use super::sources::{DiffusionMedium, Moments, Sources};
use super::system::{AtFaces, System};
use super::ways::Ways;
use crate::model::grid::GridSpec;
use crate::model::medium::MeanMedium;
use crate::model::parallel::parallel_map;

/// Returns 24 directions. The means of 1, of a cosine over its half and of its square over them are
/// those over the sphere.
pub(super) fn directions() -> [DVec3; 24] {
    // 2a + b = 3/2 and 2a² + b² = 1.
    let root = 6f64.sqrt();
    let (short, long) = (0.5 - root / 12.0, 0.5 + root / 6.0);
    std::array::from_fn(|i| {
        let mut d = DVec3::splat(short);
        d[i / 8] = long;
        let sign = |bit: usize| if i >> bit & 1 == 1 { -1.0 } else { 1.0 };
        d * DVec3::new(sign(0), sign(1), sign(2))
    })
}

/// Cycles for the change by a bounce: the next bounce finds what is left.
const CYCLES_OF_CHANGE: u32 = 1;

/// The cells that bounces lead between.
pub(super) struct Bounces<'a> {
    pub of: &'a DiffusionMedium,
    pub grid: &'a GridSpec,
    /// Extinction by cell.
    pub cells: &'a [f64],
}

impl Bounces<'_> {
    /// Returns what suns and lamps make each cell send out, over s σ and times 4π: ϖ'U, 3ϖ'g'W
    /// along each axis, and the high orders.
    pub fn arrived(&self, sources: &Sources) -> Vec<Sent> {
        let [even, forward] = self.of.mean.scattered();
        let of = |([u, x, y, z], high): (&Moments, &High)| Sent {
            low: [even * *u, forward * *x, forward * *y, forward * *z],
            high: self.scattered(high),
        };
        sources.of_suns.iter().zip(&sources.of_suns_high).map(of).collect()
    }

    /// Returns what is scattered of light by high orders.
    fn scattered(&self, high: &High) -> High {
        let ([even, _], shares) = (self.of.mean.scattered(), self.of.mean.high_orders());
        std::array::from_fn(|k| of_order(k, shares) * even * high[k])
    }

    /// Returns the light after `n` bounces of `light`, and what cells scatter of it by high orders.
    pub fn after(
        &self,
        n: u32,
        ways: &Ways<'_>,
        arrived: &[Sent],
        light: Vec<Moments>,
    ) -> (Vec<Moments>, Vec<High>) {
        let high = vec![High::default(); light.len()];
        (0..n).fold((light, high), |(light, high), _| self.next(ways, arrived, (&light, &high)))
    }

    /// Returns the light after one more bounce of `light`, with what diffusion makes of the change.
    fn next(
        &self,
        ways: &Ways<'_>,
        arrived: &[Sent],
        (light, high): (&[Moments], &[High]),
    ) -> (Vec<Moments>, Vec<High>) {
        let MeanMedium { albedo, g, straight: f, .. } = self.of.mean;
        let ([even, forward], weakened) = (self.of.mean.scattered(), self.of.mean.weakened());
        let sent = |c: usize, toward: DVec3| {
            let along = |m: &Moments| -(m[1] * toward.x + m[2] * toward.y + m[3] * toward.z);
            let (own, sun) = (&light[c], &arrived[c]);
            let of_high = orders::along(&high[c], -toward) + orders::along(&sun.high, -toward);
            even * own[0] + forward * along(own) + sun.low[0] + along(&sun.low) + of_high
        };
        let all = directions();
        let found: Vec<(Moments, High)> = parallel_map(light.len(), |c| {
            let (mut sum, mut high) = ([DVec3::ZERO; 4], High::default());
            for d in all {
                let above = if d.y > 0.0 { 1.0 } else { 0.0 };
                let l = ways.radiance(c, (d, above), |sky| sky, |k| sent(k, d)) / all.len() as f64;
                let add = [l, -l * d.x, -l * d.y, -l * d.z];
                sum.iter_mut().zip(add).for_each(|(sum, l)| *sum += l);
                high.iter_mut().zip(high_orders(-d)).for_each(|(sum, y)| *sum += y * l);
            }
            (sum, self.scattered(&high))
        });
        let (found, high): (Vec<Moments>, Vec<High>) = found.into_iter().unzip();
        let change = |c: usize, k: usize| found[c][k] - light[c][k];
        // Where cells are opaque, diffusion is right and the change is rounding.
        let edge = self.grid.edges().min_element();
        let counts = |c: usize| {
            let depth = self.cells[c] * weakened * edge;
            self.cells[c] / (depth * depth).max(DVec3::ONE)
        };
        let of_axis = |c: usize| {
            let times = 3.0 * self.of.reach(self.cells[c]) * albedo * (g - f) * counts(c);
            [1, 2, 3].map(|k| times * change(c, k))
        };
        let cells = 0..self.cells.len();
        let sources = Sources {
            scattered: cells
                .clone()
                .map(|c| albedo * (1.0 - f) * counts(c) * change(c, 0))
                .collect(),
            carried: cells.map(of_axis).collect(),
            ..Sources::default()
        };
        let series = AtFaces::InSeries;
        let system = System::new(self.of, self.grid, self.cells, &sources, &[], None, series);
        let phi = Multigrid::new(system, self.grid.edges()).solve(CYCLES_OF_CHANGE);
        let more = flux_through_faces(self.of, self.grid, self.cells, (&sources, series), &phi);
        let all = found.iter().zip(more);
        (all.map(|(a, b)| std::array::from_fn(|k| a[k] + b[k])).collect(), high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_have_the_means_of_the_sphere() {
        let all = directions();
        let mean = |of: &dyn Fn(DVec3) -> f64| all.iter().map(|d| of(*d)).sum::<f64>() / 24.0;
        for axis in DVec3::AXES {
            assert!(mean(&|d| d.dot(axis)).abs() < 1e-15);
            assert!((mean(&|d| d.dot(axis).max(0.0)) - 0.25).abs() < 1e-15);
            assert!((mean(&|d| d.dot(axis).powi(2)) - 1.0 / 3.0).abs() < 1e-15);
        }
        assert!(all.iter().all(|d| (d.length() - 1.0).abs() < 1e-15));
    }
}
