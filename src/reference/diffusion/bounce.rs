//! Bounces: light on straight ways between cells, and what diffusion makes of its change.

use glam::DVec3;

use super::faces::FaceLight;
use super::moments::flux_through_faces;
use super::multigrid::Multigrid;
use super::of_suns::OfSuns;
use super::second_order::{self, Second, second_order};
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

/// Returns the means of the squares of the second order's harmonics over some directions. Over the
/// sphere they are 1/5.
fn means_of_squares(all: &[DVec3]) -> [f64; 5] {
    let of = |m: usize| all.iter().map(|d| second_order(*d)[m].powi(2)).sum::<f64>();
    std::array::from_fn(|m| of(m) / all.len() as f64)
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
    /// Returns what each cell scatters of the light of suns and lamps: ϖ'U, and ϖ'W along each
    /// axis.
    pub fn arrived(&self, sources: &Sources) -> Vec<Moments> {
        let [even, _] = self.of.mean.scattered();
        sources.of_suns.iter().map(|of| of.map(|light| even * light)).collect()
    }

    /// Returns what is scattered of the second order of light.
    fn scattered(&self, second: &Second) -> Second {
        let [even, _] = self.of.mean.scattered();
        second.map(|light| self.of.mean.second * even * light)
    }

    /// Returns the light after `n` bounces of `light`, and the second order of what cells scatter
    /// of it.
    pub fn after(
        &self,
        n: u32,
        ways: &Ways<'_>,
        arrived: &[Moments],
        light: Vec<Moments>,
    ) -> (Vec<Moments>, Vec<Second>) {
        let second = vec![Second::default(); light.len()];
        let (all, g) = (directions(), self.of.mean.scattered_g());
        let of_suns: Vec<_> = arrived.iter().map(|of| OfSuns::new(of).along_all(&all, g)).collect();
        let next = |(light, second): (Vec<Moments>, Vec<Second>), _| {
            self.next(ways, &of_suns, (&light, &second))
        };
        (0..n).fold((light, second), next)
    }

    /// Returns the light after one more bounce of `light`, with what diffusion makes of the change.
    fn next(
        &self,
        ways: &Ways<'_>,
        of_suns: &[[DVec3; 24]],
        (light, second): (&[Moments], &[Second]),
    ) -> (Vec<Moments>, Vec<Second>) {
        let MeanMedium { albedo, g, straight: f, .. } = self.of.mean;
        let ([even, forward], weakened) = (self.of.mean.scattered(), self.of.mean.weakened());
        let sent = |c: usize, w: DVec3| {
            let own = &light[c];
            let along = own[1] * w.x + own[2] * w.y + own[3] * w.z;
            even * own[0] + forward * along + second_order::along(&second[c], w)
        };
        let all = directions();
        let squares = means_of_squares(&all);
        let found: Vec<(Moments, Second)> = parallel_map(light.len(), |c| {
            let (mut sum, mut second) = ([DVec3::ZERO; 4], Second::default());
            for (k, w) in all.into_iter().enumerate() {
                let above = if w.y < 0.0 { 1.0 } else { 0.0 };
                let sent = |c: usize| sent(c, w) + of_suns[c][k];
                // Light comes from -w, whose signs are the others.
                let solids = |of: &FaceLight, (axis, side), part| of.from(axis, side, part, k ^ 7);
                let l = ways.radiance(c, (-w, above), |sky| sky, solids, sent) / all.len() as f64;
                let add = [l, l * w.x, l * w.y, l * w.z];
                sum.iter_mut().zip(add).for_each(|(sum, l)| *sum += l);
                second.iter_mut().zip(second_order(w)).for_each(|(sum, y)| *sum += y * l);
            }
            let second = std::array::from_fn(|m| second[m] / (5.0 * squares[m]));
            (sum, self.scattered(&second))
        });
        let (found, second): (Vec<Moments>, Vec<Second>) = found.into_iter().unzip();
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
        (all.map(|(a, b)| std::array::from_fn(|k| a[k] + b[k])).collect(), second)
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

    #[test]
    fn the_second_order_has_its_own_sums_alone() {
        let all = directions();
        let squares = means_of_squares(&all);
        for (m, square) in squares.into_iter().enumerate() {
            let mean = |of: &dyn Fn(DVec3) -> f64| {
                all.iter().map(|d| second_order(*d)[m] * of(*d)).sum::<f64>() / 24.0
            };
            assert!(mean(&|_| 1.0).abs() < 1e-15);
            assert!(DVec3::AXES.iter().all(|axis| mean(&|d| d.dot(*axis)).abs() < 1e-15));
            for other in 0..5 {
                let expected = if other == m { square } else { 0.0 };
                assert!(
                    (mean(&|d| second_order(d)[other]) - expected).abs() < 1e-15,
                    "{m} {other}"
                );
            }
        }
        // Three harmonics like xy and two like x² − y²; together they are those of the sphere.
        assert!((squares.iter().sum::<f64>() - 1.0).abs() < 1e-15, "{squares:?}");
    }
}
