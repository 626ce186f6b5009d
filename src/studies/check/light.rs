//! The light of a frame in f64: all of it where time allows, else that of some facets.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use glam::DVec3;

use crate::model::parallel::parallel_map;
use crate::model::philox::{philox4x32_10, uniform};
use crate::model::shade::FacetSlope;
use crate::model::sky::Haze;
use crate::reference::picture::{FrameReference, PixelShares, SecondOf};

/// Second word of the Philox key: a check shares no random numbers with pixels and paths.
const KEY: u32 = 0x6368_6b73;
/// Facets whose second reflection is computed at a time.
const N_AT_ONCE: usize = 16;
/// Pixels that are computed beyond the budget, unless they take long.
const N_LEAST: usize = 32;
/// Time after which no further pixel is computed, even if fewer than [`N_LEAST`] are: a check is to
/// take seconds.
const LONGEST: Duration = Duration::from_secs(10);

/// The facets whose second reflection is needed.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    /// All facets that the pixels show.
    seen: BTreeSet<u32>,
    /// Pixels and two of their facets each, drawn by their share; in an order that spreads the
    /// first ones over the picture.
    drawn: Vec<(usize, [u32; 2])>,
}

impl Plan {
    /// Draws facets of the pixels that have `shares`.
    pub fn new(shares: &[PixelShares]) -> Plan {
        let seen = shares.iter().flat_map(|s| s.of.iter().map(|(i, _)| *i)).collect();
        let draw = |k: usize| {
            let words = philox4x32_10([0, KEY], [k as u32, 0, 0, 0]);
            let of = &shares[k].of;
            let whole = whole(&shares[k]);
            let pick = |word: u32| {
                let mut left = uniform(word) * whole;
                let found = of.iter().find(|(_, share)| {
                    left -= share;
                    left < 0.0
                });
                found.or(of.last()).map(|(i, _)| *i)
            };
            Some((words[2], k, [pick(words[0])?, pick(words[1])?]))
        };
        let mut drawn: Vec<(u32, usize, [u32; 2])> = (0..shares.len()).filter_map(draw).collect();
        drawn.sort_unstable();
        Plan { seen, drawn: drawn.into_iter().map(|(_, k, facets)| (k, facets)).collect() }
    }

    /// Returns whether `light` has all facets that are seen.
    pub fn is_whole(&self, light: &Light) -> bool {
        self.seen.iter().all(|i| light.second.contains_key(i))
    }
}

fn whole(shares: &PixelShares) -> f64 {
    shares.of.iter().map(|(_, share)| share).sum()
}

/// The light of a frame in f64; without any, that of the device is taken as right.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Light {
    /// First reflection of every facet.
    pub first: Vec<DVec3>,
    /// Second reflection of some facets, with its estimated error.
    pub second: BTreeMap<u32, (DVec3, f64)>,
    /// The frame's [`FrameReference::grid_error`].
    pub grid_error: f64,
    /// The frame's [`FrameReference::slopes`].
    pub slopes: Vec<FacetSlope>,
}

impl Light {
    /// Computes the light that `plan` needs: the second reflection of all facets that are seen if
    /// that fits into `budget`, else of those of as many pixels as do.
    pub fn compute(
        frame: &FrameReference,
        plan: &Plan,
        second: &SecondOf<'_>,
        budget: Duration,
    ) -> Light {
        let (first, grid_error) = (frame.radiance.clone(), frame.grid_error);
        let slopes = frame.slopes.clone();
        let mut light = Light { first, second: BTreeMap::new(), grid_error, slopes };
        let begin = Instant::now();
        let n_least = N_LEAST.min(plan.drawn.len());
        for pixels in plan.drawn[..n_least].chunks(N_AT_ONCE / 2) {
            light.add(second, pixels.iter().flat_map(|(_, facets)| *facets));
            if begin.elapsed() > budget.max(LONGEST) {
                return light;
            }
        }
        let each_s = begin.elapsed().as_secs_f64() / light.second.len().max(1) as f64;
        let n_left = plan.seen.len() - light.second.len();
        if each_s * n_left as f64 <= budget.as_secs_f64() {
            light.add(second, plan.seen.iter().copied());
            return light;
        }
        for pixels in plan.drawn[n_least..].chunks(N_AT_ONCE / 2) {
            if begin.elapsed() > budget {
                break;
            }
            light.add(second, pixels.iter().flat_map(|(_, facets)| *facets));
        }
        light
    }

    /// Returns the light as it is seen behind `air`, by facet.
    pub fn behind(&self, air: impl Fn(usize) -> Haze) -> Light {
        let first = |(i, l): (usize, &DVec3)| air(i).over(*l);
        let second =
            |(i, (l, error)): (&u32, &(DVec3, f64))| (*i, (air(*i as usize).through * *l, *error));
        Light {
            first: self.first.iter().enumerate().map(first).collect(),
            second: self.second.iter().map(second).collect(),
            ..self.clone()
        }
    }

    fn add(&mut self, second: &SecondOf<'_>, facets: impl Iterator<Item = u32>) {
        let new: BTreeSet<u32> = facets.filter(|i| !self.second.contains_key(i)).collect();
        let new: Vec<u32> = new.into_iter().collect();
        let found = parallel_map(new.len(), |k| {
            let found = second(new[k] as usize);
            (new[k], (found.radiance, found.error))
        });
        self.second.extend(found);
    }

    /// Returns the number of facets whose second reflection is known.
    pub fn n_second(&self) -> usize {
        self.second.len()
    }

    /// Returns the root mean square of the estimated errors.
    pub fn own_error(&self) -> f64 {
        let n = self.second.len().max(1) as f64;
        (self.second.values().map(|(_, error)| error * error).sum::<f64>() / n).sqrt()
    }
}

/// Two independent estimates of a pixel's difference by its light, equal if it is known; none if
/// neither of its facets was computed.
pub type Found = Option<[[f64; 4]; 2]>;

/// Returns the differences by light of all pixels. `by_device` has the first and second reflection
/// of every facet.
pub fn compare(
    shares: &[PixelShares],
    plan: &Plan,
    by_device: &[[DVec3; 2]],
    light: &Light,
) -> Vec<Found> {
    let first: Vec<DVec3> =
        by_device.iter().zip(&light.first).map(|(device, first)| device[0] - first).collect();
    let second =
        |i: u32| Some(by_device.get(i as usize)?[1] - light.second.get(&i).map(|(l, _)| *l)?);
    let pixel = |off: DVec3| off.extend(0.0).to_array();
    // Without light nothing differs.
    let of_first = |s: &PixelShares| match first.is_empty() {
        true => DVec3::ZERO,
        false => s.of.iter().map(|&(i, share)| share * first[i as usize]).sum(),
    };
    if plan.is_whole(light) {
        let whole = |s: &PixelShares| {
            let of_second = s.of.iter().filter_map(|&(i, share)| Some(share * second(i)?));
            let off = pixel(of_first(s) + of_second.sum::<DVec3>());
            Some([off, off])
        };
        return shares.iter().map(whole).collect();
    }
    let mut found: Vec<Found> = vec![None; shares.len()];
    for (k, s) in shares.iter().enumerate().filter(|(_, s)| s.of.is_empty()) {
        let off = pixel(of_first(s));
        found[k] = Some([off, off]);
    }
    for &(k, [a, b]) in &plan.drawn {
        let (of_first, whole) = (of_first(&shares[k]), whole(&shares[k]));
        let estimate = |i: u32| Some(pixel(of_first + whole * second(i)?));
        found[k] = estimate(a).zip(estimate(b)).map(|(a, b)| [a, b]);
    }
    found
}

/// Returns the root mean square difference by light.
pub fn rms(found: &[Found]) -> f64 {
    let products: Vec<f64> = found
        .iter()
        .flatten()
        .map(|[a, b]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / 4.0)
        .collect();
    let mean = products.iter().sum::<f64>() / products.len().max(1) as f64;
    // The mean of few products can be below 0. NaN stays, since it is no right light.
    if mean < 0.0 { 0.0 } else { mean.sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of four facets each with uneven shares, and the light of a device and in f64.
    fn pixels(n: u32) -> (Vec<PixelShares>, Vec<[DVec3; 2]>, Light) {
        let share = |k: u32| (0..4).map(move |i| ((k + i) % 50, 0.1 + 0.2 * f64::from(i)));
        let shares = (0..n).map(|k| PixelShares { of: share(k).collect(), alpha: 1.0 }).collect();
        let value = |i: u32, f: f64| DVec3::splat((f64::from(i) * f).sin());
        let by_device = (0..50).map(|i| [value(i, 0.3), value(i, 0.7)]).collect();
        let first = (0..50).map(|i| value(i, 0.3) + 0.01).collect();
        let second = (0..50).map(|i| (i, (value(i, 0.7) + 0.05 * value(i, 1.3), 1e-6))).collect();
        (shares, by_device, Light { first, second, grid_error: 0.0, slopes: vec![] })
    }

    /// Mean square over the first three numbers of four.
    fn mean_square(of: impl Iterator<Item = DVec3>) -> f64 {
        let (n, sum) = of.fold((0, 0.0), |(n, sum), v| (n + 1, sum + v.length_squared() / 4.0));
        sum / f64::from(n)
    }

    #[test]
    fn drawn_facets_estimate_the_square_of_the_whole_difference() {
        let (shares, by_device, light) = pixels(20_000);
        let plan = Plan::new(&shares);
        assert!(plan.is_whole(&light));
        let off = |i: usize| {
            let [first, second] = by_device[i];
            first + second - light.first[i] - light.second[&(i as u32)].0
        };
        let exact = mean_square(
            shares.iter().map(|s| s.of.iter().map(|&(i, share)| share * off(i as usize)).sum()),
        );
        let whole = rms(&compare(&shares, &plan, &by_device, &light)).powi(2);
        assert!((whole - exact).abs() < 1e-12 * exact, "{whole} {exact}");
        // A facet that no pixel has drawn makes the light incomplete without changing the samples.
        let mut partial = plan.clone();
        partial.seen.insert(999);
        let found = compare(&shares, &partial, &by_device, &light);
        assert!(!partial.is_whole(&light) && found.iter().all(Option::is_some));
        let sampled = rms(&found).powi(2);
        assert!((sampled - exact).abs() < 0.05 * exact, "{sampled} {exact}");
        // The square of one estimate would have its variance in it.
        let biased = mean_square(found.iter().flatten().map(|[a, _]| DVec3::from_slice(&a[..3])));
        assert!(biased > 1.2 * exact, "{biased} {exact}");
    }

    #[test]
    fn facets_that_were_not_computed_leave_their_pixels_out() {
        let (shares, by_device, mut light) = pixels(100);
        let plan = Plan::new(&shares);
        light.second.retain(|i, _| *i < 25);
        let n_found = compare(&shares, &plan, &by_device, &light).iter().flatten().count();
        assert!(n_found > 20 && n_found < 80, "{n_found}");
        // Light that is no number is no right light.
        light.first[3] = DVec3::NAN;
        assert!(rms(&compare(&shares, &plan, &by_device, &light)).is_nan());
    }
}
