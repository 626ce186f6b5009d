//! Integration along one ray through overlapping blobs, piece by piece: the part with a closed form
//! in closed form, the rest by Gauss–Kronrod.

use glam::DVec3;

use crate::model::cloud::SQRT_TAU;
use crate::reference::shade::{SeenLight, below};

/// Greatest length of a piece for the rules, σ of its narrowest blob. Over 3 σ the rule of 7 has
/// three points for each bend of a Gaussian, so it cannot miss one.
const RESOLVED_SIGMAS: f64 = 3.0;
/// Greatest optical depth of a piece for the rules. e^{−τ} falls to 2 %, and the rules' first
/// points (at 0.4 % and 2.5 % of the piece) see its beginning.
const RESOLVED_DEPTH: f64 = 4.0;
/// Greatest number of halvings. Below 2⁻⁴⁸ of a range, view depths cannot tell a piece's ends
/// apart.
const MAX_LEVEL: u32 = 48;
/// Least share of a ray's tolerance for a piece, so that narrow pieces do not chase their own
/// rounding.
const LEAST_SHARE: f64 = 1e-6;
/// Share of a piece's tolerance for blobs that its points neglect.
const SHARE_OF_FAINT: f64 = 0.1;

/// A blob along a ray. Lengths are view depths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RayBlob {
    /// Foot of its centre on the ray.
    pub center: f64,
    /// Standard deviation along the ray: σ/|d|.
    pub width: f64,
    /// τ of the whole line.
    pub depth: f64,
    /// Radiance of the blob.
    pub radiance: DVec3,
    /// Factor on it along the ray.
    pub light: SeenLight,
    /// Beginning of the blob: less than `OMITTED` of optical depth lies before it, all blobs
    /// together.
    pub from: f64,
    /// End of the blob.
    pub to: f64,
}

/// Integral along a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RayIntegral {
    /// Emitted light that reaches the eye.
    pub color: DVec3,
    /// Optical depth.
    pub tau: f64,
    /// Estimated error of the colour, greatest channel.
    pub error: f64,
}

/// A blob within a piece.
#[derive(Debug, Clone, Copy)]
struct Active {
    i: usize,
    /// Share of its optical depth before the piece.
    below: f64,
    /// Optical depth within the piece.
    tau: f64,
    /// Greatest difference of its radiance from the piece's mean, greatest channel.
    excess: f64,
}

impl RayBlob {
    fn radiance_at(&self, z: f64) -> DVec3 {
        self.light.at((z - self.center) / self.width) * self.radiance
    }
}

/// Integrator with scratch memory that rays share.
#[derive(Debug, Default)]
pub(super) struct RayIntegrator {
    /// Blobs of the pieces from the whole ray down to the current one, one list after the other.
    lists: Vec<usize>,
    active: Vec<Active>,
    /// The radiance that a piece has in closed form.
    mean: DVec3,
}

/// A piece [a, b] of the range, `level` halvings down.
#[derive(Debug, Clone, Copy)]
struct Piece {
    a: f64,
    b: f64,
    level: u32,
    /// Start of its blobs in [`RayIntegrator::lists`].
    first: usize,
}

impl RayIntegrator {
    /// Integrates a ray to the error `tolerance`, which all pieces share.
    pub fn integrate(&mut self, passed: &[RayBlob], tolerance: f64) -> RayIntegral {
        let mut ray = RayIntegral { color: DVec3::ZERO, tau: 0.0, error: 0.0 };
        let a = passed.iter().map(|p| p.from).fold(f64::INFINITY, f64::min);
        let b = passed.iter().map(|p| p.to).fold(f64::NEG_INFINITY, f64::max);
        if a < b {
            self.lists.clear();
            self.lists.extend(0..passed.len());
            let whole = Piece { a, b, level: 0, first: 0 };
            self.visit(passed, whole, (tolerance, b - a), &mut ray);
        }
        ray
    }

    fn visit(
        &mut self,
        passed: &[RayBlob],
        piece: Piece,
        accuracy: (f64, f64),
        ray: &mut RayIntegral,
    ) {
        let Piece { a, b, level, first } = piece;
        let own = self.lists.len();
        for k in first..own {
            let i = self.lists[k];
            if passed[i].from < b && passed[i].to > a {
                self.lists.push(i);
            }
        }
        let tau = self.look(passed, a, b, own);
        let through = (-ray.tau).exp();
        let (tolerance, length) = accuracy;
        let share = tolerance * ((b - a) / length).max(LEAST_SHARE);
        // Greatest effect of the blobs' order within the piece.
        let bound = through * self.active.iter().map(|k| k.tau * k.excess).sum::<f64>();
        let mean = self.mean;
        let found = if bound <= share {
            Some((DVec3::ZERO, bound))
        } else {
            let left_out = self.leave_out_faint(through, bound, share);
            let narrowest =
                self.active.iter().map(|k| passed[k.i].width).fold(f64::INFINITY, f64::min);
            let is_resolved = b - a <= RESOLVED_SIGMAS * narrowest && tau <= RESOLVED_DEPTH;
            if is_resolved || level == MAX_LEVEL {
                let (value, error) = self.quadrature(passed, (a, b), ray.tau);
                let error = if is_resolved { error + left_out } else { bound };
                (error <= share || level == MAX_LEVEL).then_some((value, error))
            } else {
                None
            }
        };
        match found {
            Some((value, error)) => {
                ray.color += through * -libm::expm1(-tau) * mean + value;
                ray.error += error;
                ray.tau += tau;
            }
            None => {
                let middle = 0.5 * (a + b);
                let half = Piece { level: level + 1, first: own, ..piece };
                let n_lists = self.lists.len();
                self.visit(passed, Piece { b: middle, ..half }, accuracy, ray);
                self.lists.truncate(n_lists);
                self.visit(passed, Piece { a: middle, ..half }, accuracy, ray);
            }
        }
        self.lists.truncate(own);
    }

    /// Fills `active` with the blobs listed from `first` on, over [a, b], and `mean` with about
    /// their mean radiance. Returns their optical depth.
    fn look(&mut self, passed: &[RayBlob], a: f64, b: f64, first: usize) -> f64 {
        self.active.clear();
        let (mut tau, mut weighted) = (0.0, DVec3::ZERO);
        for &i in &self.lists[first..] {
            let p = &passed[i];
            let at = |z: f64| below((z.clamp(p.from, p.to) - p.center) / p.width);
            let from = at(a);
            let own = p.depth * (at(b) - from);
            tau += own;
            weighted += own * p.radiance_at(0.5 * (a.max(p.from) + b.min(p.to)));
            // The rule's points count from the beginning of the blob or the piece.
            self.active.push(Active { i, below: from, tau: own, excess: 0.0 });
        }
        let mean = if tau > 0.0 { weighted / tau } else { DVec3::ZERO };
        for k in &mut self.active {
            // Light is greatest or least at an end: it is linear, or 0.
            let p = &passed[k.i];
            let excess = |z: f64| (p.radiance_at(z) - mean).abs().max_element();
            k.excess = excess(a.max(p.from)).max(excess(b.min(p.to)));
        }
        self.mean = mean;
        tau
    }

    /// Removes faint blobs from `active` and returns their greatest effect: as light their share of
    /// the `bound`, as shadow their optical depth times all of it.
    fn leave_out_faint(&mut self, through: f64, bound: f64, share: f64) -> f64 {
        let faint = SHARE_OF_FAINT * share / self.active.len().max(1) as f64;
        let mut left_out = 0.0;
        self.active.retain(|k| {
            let most = k.tau * (through * k.excess + bound);
            let is_faint = most <= faint;
            left_out += if is_faint { most } else { 0.0 };
            !is_faint
        });
        left_out
    }

    /// Returns ∫ Σ β_j (L_j − L̄) e^{−τ} over [a, b], where τ is `tau` before it, and the
    /// difference of the two rules.
    fn quadrature(&self, passed: &[RayBlob], (a, b): (f64, f64), tau: f64) -> (DVec3, f64) {
        let half = 0.5 * (b - a);
        let at = |x: f64| self.source(passed, 0.5 * (a + b) + half * x, tau);
        let middle = at(0.0);
        let (mut kronrod, mut gauss) = (KRONROD[7] * middle, GAUSS[3] * middle);
        for (i, x) in NODES.iter().enumerate() {
            let both = at(*x) + at(-*x);
            kronrod += KRONROD[i] * both;
            if i % 2 == 1 {
                gauss += GAUSS[i / 2] * both;
            }
        }
        (half * kronrod, half * (kronrod - gauss).abs().max_element())
    }

    /// Returns Σ β_j (L_j − L̄) e^{−τ} at view depth z.
    fn source(&self, passed: &[RayBlob], z: f64, tau: f64) -> DVec3 {
        let (mut tau, mut sum) = (tau, DVec3::ZERO);
        for k in &self.active {
            let p = &passed[k.i];
            if z <= p.from {
                continue;
            }
            let x = (z.min(p.to) - p.center) / p.width;
            tau += p.depth * (below(x) - k.below);
            if z < p.to {
                sum += p.depth / (SQRT_TAU * p.width)
                    * (-0.5 * x * x).exp()
                    * (p.radiance_at(z) - self.mean);
            }
        }
        (-tau).exp() * sum
    }
}

/// Gauss–Kronrod (7, 15) as in QUADPACK (Piessens et al. 1983), dqk15: positive nodes from the
/// outermost on, the weights of both rules, the middle's last. Every second node is a Gauss node.
const NODES: [f64; 7] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
];
const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_225,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_83,
];
const GAUSS: [f64; 4] = [
    0.129_484_966_168_869_7,
    0.279_705_391_489_276_64,
    0.381_830_050_505_118_9,
    0.417_959_183_673_469_4,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rules_are_exact_to_their_degrees() {
        // Gauss's 7 points are exact to degree 13, Kronrod's 15 to degree 22 (by symmetry 23), and
        // no further.
        let rule = |weights: &dyn Fn(usize) -> f64, middle: f64, power: i32| {
            let sides: f64 = (0..7).map(|i| 2.0 * weights(i) * NODES[i].powi(power)).sum();
            sides + if power == 0 { middle } else { 0.0 }
        };
        let kronrod = |power| rule(&|i| KRONROD[i], KRONROD[7], power);
        let gauss = |power| rule(&|i| if i % 2 == 1 { GAUSS[i / 2] } else { 0.0 }, GAUSS[3], power);
        for power in (0..=22).step_by(2) {
            let exact = 2.0 / f64::from(power + 1);
            assert!((kronrod(power) - exact).abs() < 1e-15, "{power}");
            assert_eq!((gauss(power) - exact).abs() < 1e-15, power <= 13, "{power}");
        }
        assert!((kronrod(24) - 2.0 / 25.0).abs() > 1e-15);
    }
}
