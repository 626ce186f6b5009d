//! Light of suns and lamps that cells send out.

use std::f64::consts::PI;

use glam::DVec3;

use super::sources::Moments;
use crate::model::phase::Phase;

/// Light of suns and lamps that a cell scatters.
pub(super) struct OfSuns {
    /// ϖ'U.
    pub all: DVec3,
    /// The share that comes along `way`; the rest comes evenly from all sides.
    pub directed: f64,
    way: DVec3,
}

impl OfSuns {
    /// Returns that of a cell with ϖ'U, and ϖ'W along each axis. The way is that of the flux.
    pub fn new(&[all, x, y, z]: &Moments) -> OfSuns {
        let mean = |v: DVec3| v.element_sum() / 3.0;
        let (fluence, flux) = (mean(all), DVec3::new(mean(x), mean(y), mean(z)));
        let directed = if fluence > 0.0 { (flux.length() / fluence).min(1.0) } else { 0.0 };
        OfSuns { all, directed, way: flux.normalize_or_zero() }
    }

    /// Returns what is sent out along `w`, times 4π, where what comes along the way has the values
    /// `peak` of a phase function.
    fn sent(&self, peak: f64) -> DVec3 {
        self.all * (1.0 - self.directed + self.directed * peak)
    }

    /// Returns 4π times Henyey's and Greenstein's phase function from the way to `w`.
    fn lobe(&self, g: f64, w: DVec3) -> f64 {
        4.0 * PI * Phase::HenyeyGreenstein { g }.at(self.way.dot(w))
    }

    /// Returns what is sent out along `w`, times 4π, with the mean cosine g and f.
    pub fn toward(&self, w: DVec3, g: f64, f: f64) -> DVec3 {
        self.sent(self.lobe(g, w) / (1.0 - f).max(f64::MIN_POSITIVE))
    }

    /// Returns what is sent out along each of some directions, times 4π, with the mean cosine `g`.
    /// Over the directions, the mean of the lobe is 1, and that of it times the direction is g
    /// times the way, unless it would be below 0.
    pub fn along_all<const N: usize>(&self, all: &[DVec3; N], g: f64) -> [DVec3; N] {
        let lobes = all.map(|w| self.lobe(g, w));
        let mean = lobes.iter().sum::<f64>() / N as f64;
        let along: DVec3 = all.iter().zip(lobes).map(|(w, l)| l / (N as f64 * mean) * *w).sum();
        let slope = 3.0 * (g * self.way - along);
        let falls = all.iter().zip(lobes).map(|(w, l)| (-slope.dot(*w), l / mean));
        let share =
            falls.filter(|(fall, l)| fall > l).map(|(fall, l)| l / fall).fold(1.0, f64::min);
        std::array::from_fn(|k| self.sent(lobes[k] / mean + share * slope.dot(all[k])))
    }
}

#[cfg(test)]
mod tests {
    use super::super::bounce::directions;
    use super::*;

    /// A sun of fluence 2 and a lamp of 1 at a right angle to it.
    fn two_lights() -> Moments {
        [DVec3::splat(3.0), DVec3::splat(2.0), DVec3::splat(-1.0), DVec3::ZERO]
    }

    #[test]
    fn bounces_get_all_that_is_scattered_and_its_flux() {
        let of = OfSuns::new(&two_lights());
        assert!((of.directed - 5f64.sqrt() / 3.0).abs() < 1e-15);
        let all = directions();
        for g in [-0.9, -0.3, 0.0, 0.46, 0.61, 0.66] {
            let sent = of.along_all(&all, g);
            let mean = sent.iter().sum::<DVec3>() / 24.0;
            let flux = all.iter().zip(sent).map(|(w, s)| s.x * *w).sum::<DVec3>() / 24.0;
            // Some roundings of sums of 24 numbers, below 40 with g = −0.9.
            assert!((mean - 3.0).length() < 1e-13, "{g}: {mean}");
            assert!(sent.iter().all(|s| s.min_element() >= -1e-15), "{g}");
            // 24 directions do not resolve a sharper lobe.
            if g.abs() < 0.67 {
                assert!((flux - g * DVec3::new(2.0, -1.0, 0.0)).length() < 1e-13, "{g}: {flux}");
            }
        }
    }

    #[test]
    fn light_of_one_direction_has_its_phase_function() {
        let of = OfSuns::new(&[DVec3::ONE, DVec3::ONE, DVec3::ZERO, DVec3::ZERO]);
        // Straight on (1 + g)/(1 − g)², and (1 − g²)/(1 + g²)^(3/2) at a right angle.
        assert!((of.toward(DVec3::X, 0.5, 0.0).x - 6.0).abs() < 1e-14);
        assert!((of.toward(DVec3::Y, 0.5, 0.25).x - 0.75 / 1.25f64.powf(1.5) / 0.75).abs() < 1e-14);
        // Lights that meet from both sides are even.
        let of = OfSuns::new(&[DVec3::ONE, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO]);
        assert_eq!(of.toward(DVec3::X, 0.5, 0.0), DVec3::ONE);
    }
}
