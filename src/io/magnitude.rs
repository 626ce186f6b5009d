//! How great and how small an input's numbers may be, so that the f32 arithmetic on the device
//! carries all that is made of them. f32's normal numbers run from 1.2e-38 to 3.4e38.
//!
//! A number of at most 1e15 can be squared and summed over a vector (3e30), and a length can be
//! multiplied with a wave number or divided by a distance of 1e-15 (1e30), with orders of magnitude
//! left for constants. Three such factors are too many, so the one place that has a cube, a blob's
//! mass κ (2π)^{3/2} σ³, is checked itself.

use glam::DVec3;

use super::toml_section::Bounds;
use crate::model::cloud::{Cloud, CloudSource, Group, SIGMA_PER_RADIUS, mass};
use crate::model::disc::Disc;

/// Coordinates, lengths, times, κ, optical depths, irradiance, colours.
pub const GREATEST: f64 = 1e15;
/// Lengths that something is divided by: σ, wavelengths, the near distance. Its square is 1e-30,
/// and 1e15 / 1e-15 is 1e30: both are normal numbers.
pub const LEAST: f64 = 1e-15;
/// Box edges are only multiplied with numbers that have 24 bits: 1e-30 · 2⁻²⁴ is 6e-38, still a
/// normal number.
pub const LEAST_EXTENT: f64 = 1e-30;
/// κ σ and the mass κ (2π)^{3/2} σ³, and with both κ σ², which lies between them. κ and σ of 1e15
/// give κ σ = 1e30.
pub const GREATEST_PRODUCT: f64 = 1e37;
/// A factor on an irradiance that colours are a factor on too: 1e15 · 1e15 · 1e6 is 1e36.
pub const GREATEST_SHARE: f64 = 1e6;

/// n_s: a lobe a thousandth of a degree wide. A narrower one has no number between two neighbouring
/// directions in f32.
pub const GREATEST_EXPONENT: f64 = 1e6;
/// Nearer to a point light than this the irradiance does not grow: 1e15 / (1e-9)² is 1e33, still a
/// normal number.
pub const LEAST_LIGHT_RADIUS: f64 = 1e-9;

/// Either sign.
pub const COORDINATE: Bounds = Bounds::Within(-GREATEST, GREATEST);
/// What cannot be negative.
pub const AMOUNT: Bounds = Bounds::Within(0.0, GREATEST);
/// What is divided by.
pub const DIVISOR: Bounds = Bounds::Within(LEAST, GREATEST);

/// The fewest digits that read back as the same number; with an exponent where plain digits would
/// run long.
pub fn shortest(v: f64) -> String {
    let plain = v == 0.0 || (1e-4..1e9).contains(&v.abs());
    if plain { format!("{v}") } else { format!("{v:e}") }
}

/// What is expected of a coordinate, where `v` is none.
pub fn wrong_coordinate(v: f64) -> Option<String> {
    (!is_carried(v))
        .then(|| format!("a number from {} to {}", shortest(-GREATEST), shortest(GREATEST)))
}

/// What is expected of a size, where `v` is none: 0, or a number from `least` (0 where any will do)
/// on.
pub fn wrong_size(v: f64, least: f64) -> Option<String> {
    if v == 0.0 || (least..=GREATEST).contains(&v) {
        return None;
    }
    let greatest = shortest(GREATEST);
    Some(match least {
        0.0 => format!("a number from 0 to {greatest}"),
        _ => format!("0 or a number from {} to {greatest}", shortest(least)),
    })
}

/// Whether a place can be handed to the device.
pub fn is_carried_place(place: DVec3) -> bool {
    place.to_array().into_iter().all(is_carried)
}

fn is_carried(v: f64) -> bool {
    v.abs() <= GREATEST
}

/// What of a cloud's particles the device could not carry although each number that was given is in
/// its bounds; `lines` are those of a particle list.
pub fn beyond(cloud: &Cloud, lines: &[usize]) -> Option<String> {
    let groups = cloud.groups(0, 0);
    match &cloud.source {
        CloudSource::Boxes { boxes, radius_scale, .. } => {
            let scaled = boxes.iter().map(|b| b.radius_max * radius_scale).enumerate();
            let is_vanishing =
                |i: usize, v: f64| boxes[i].radius_max > 0.0 && *radius_scale > 0.0 && v < LEAST;
            let wrong = scaled.filter(|(i, v)| *v > GREATEST || is_vanishing(*i, *v));
            // The largest where some are too large.
            if let Some((i, v)) = wrong.max_by(|a, b| a.1.total_cmp(&b.1)) {
                let (low, high) = (shortest(LEAST), shortest(GREATEST));
                let what =
                    format!("expected 0 or a number from {low} to {high}, found {}", rounded(v));
                return Some(format!("box {i}: radius times `radius_scale`: {what}"));
            }
            let kappa = "κ = optical_depth / (√(2π) σ)";
            too_great(&groups, kappa, GREATEST, &|g| g.kappa_max)
                .or_else(|| {
                    too_great(&groups, "κ (2π)^{3/2} σ³", GREATEST_PRODUCT, &|g| g.mass_max)
                })
                .or_else(|| {
                    too_great(&groups, "κ σ", GREATEST_PRODUCT, &|g| {
                        g.kappa_max * g.sigma_widest()
                    })
                })
        }
        CloudSource::Disc(disc) => groups.first().and_then(|group| disc_beyond(disc, group)),
        // Of a weather file whose numbers are those of air.
        CloudSource::Animated(_) => None,
        CloudSource::Particles(list) => {
            let (i, heaviest) = list
                .iter()
                .map(|p| mass(p.kappa, p.sigma) * p.aspect)
                .enumerate()
                .max_by(|a, b| a.1.total_cmp(&b.1))?;
            if heaviest <= GREATEST_PRODUCT {
                return None;
            }
            let line = lines.get(i).map_or("?".to_owned(), usize::to_string);
            let (expected, found) = (shortest(GREATEST_PRODUCT), rounded(heaviest));
            Some(format!(
                "line {line}: κ (2π)^{{3/2}} σ³: expected at most {expected}, found {found}"
            ))
        }
    }
}

/// What of a cloud that is grown the device could not carry; between start and end lies nothing
/// that is greater or smaller.
pub fn grown_beyond(cloud: &Cloud) -> Option<String> {
    let to = cloud.growth.to;
    let groups: Vec<Group> = cloud.groups(0, 0).iter().map(|g| g.grown(to)).collect();
    let greatest = |of: &dyn Fn(&Group) -> f64| groups.iter().map(of).fold(0.0, f64::max);
    let places = greatest(&|g| (g.center.abs() + g.half_extent).max_element());
    let expected = |what: &str, most: f64, found: f64| {
        (found > most).then(|| {
            format!("{what}, grown: expected at most {}, found {}", shortest(most), rounded(found))
        })
    };
    let least = least_sigma(cloud) * to;
    // As great as a cloud may be that does not grow.
    expected("places", 2.0 * GREATEST, places)
        .or_else(|| expected("σ", GREATEST, greatest(&|g| g.sigma_widest())))
        .or_else(|| expected("κ (2π)^{3/2} σ³", GREATEST_PRODUCT, greatest(&|g| g.mass_max)))
        .or_else(|| {
            expected("κ σ", GREATEST_PRODUCT, greatest(&|g| g.kappa_max * g.sigma_widest()))
        })
        .or_else(|| {
            let (low, found) = (shortest(LEAST * SIGMA_PER_RADIUS), rounded(least));
            (least < LEAST * SIGMA_PER_RADIUS)
                .then(|| format!("σ, shrunk: expected at least {low}, found {found}"))
        })
        .filter(|_| !cloud.growth.is_none())
}

/// Of the blobs, or the boxes' greatest blobs, that have a size; infinite where none has.
fn least_sigma(cloud: &Cloud) -> f64 {
    let sigmas: Vec<f64> = match &cloud.source {
        CloudSource::Boxes { .. } | CloudSource::Disc(_) | CloudSource::Animated(_) => {
            cloud.groups(0, 0).iter().map(|g| g.sigma_max).collect()
        }
        CloudSource::Particles(list) => list.iter().map(|p| p.sigma * p.aspect.min(1.0)).collect(),
    };
    sigmas.into_iter().filter(|sigma| *sigma > 0.0).fold(f64::INFINITY, f64::min)
}

/// What of a disc's particles, anywhere in their lives, the device could not carry.
fn disc_beyond(disc: &Disc, group: &Group) -> Option<String> {
    let lift = disc.condensation.map_or(0.0, |c| c.lift * disc.warmth);
    let wrong = |what: &str, most: f64, found: f64| {
        let expected = shortest(most);
        (found > most).then(|| {
            format!("its particles' {what}: expected at most {expected}, found {}", rounded(found))
        })
    };
    wrong("places", GREATEST, (group.center.abs() + group.half_extent).max_element())
        .or_else(|| wrong("σ", GREATEST, group.sigma_max))
        .or_else(|| wrong("κ = optical_depth / (√(2π) σ)", GREATEST, group.kappa_max))
        .or_else(|| wrong("κ (2π)^{3/2} σ³", GREATEST_PRODUCT, group.mass_max))
        .or_else(|| wrong("κ σ", GREATEST_PRODUCT, group.kappa_max * group.sigma_max))
        .or_else(|| wrong("buoyancy · warmth · cooling time", GREATEST_PRODUCT, disc.rise()))
        .or_else(|| wrong("warmth · base_lift", GREATEST_PRODUCT, lift))
}

fn too_great(
    groups: &[Group],
    what: &str,
    greatest: f64,
    of: &dyn Fn(&Group) -> f64,
) -> Option<String> {
    let (i, found) = groups.iter().map(of).enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let expected = shortest(greatest);
    (found > greatest)
        .then(|| format!("box {i}: {what}: expected at most {expected}, found {}", rounded(found)))
}

/// A computed number in a message: its last digits say nothing.
pub fn rounded(v: f64) -> String {
    format!("{v:.3e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_what_f32_carries() {
        let f = |v: f64| v as f32;
        assert!((f(GREATEST) * f(GREATEST) * 1e6).is_finite());
        assert!(f(GREATEST_PRODUCT).is_finite() && (f(GREATEST) / f(LEAST)).is_finite());
        assert!(
            (f(LEAST) * f(LEAST)).is_normal() && (f(LEAST_EXTENT) * 2f32.powi(-24)).is_normal()
        );
    }

    #[test]
    fn sizes_have_two_ends_and_zero() {
        for good in [0.0, 1e-15, 1.0, 1e15] {
            assert_eq!(wrong_size(good, LEAST), None);
        }
        for bad in [-1.0, 9e-16, 1.1e15, f64::NAN] {
            assert_eq!(wrong_size(bad, LEAST).as_deref(), Some("0 or a number from 1e-15 to 1e15"));
        }
        assert_eq!(wrong_size(1e-300, 0.0), None);
        assert_eq!(wrong_size(-1.0, 0.0).as_deref(), Some("a number from 0 to 1e15"));
        assert_eq!(wrong_coordinate(-1.1e15).as_deref(), Some("a number from -1e15 to 1e15"));
        assert_eq!(wrong_coordinate(-1e15), None);
    }

    #[test]
    fn numbers_are_written_short() {
        let short = [0.0, -0.0, 0.1, -3.0, 6.12438e-7, 1e300].map(shortest);
        assert_eq!(short, ["0", "-0", "0.1", "-3", "6.12438e-7", "1e300"]);
    }
}
