//! Checks that f32 carries what is computed from a cloud whose keys are each in their range: the
//! places, widths, extinctions and masses of its blobs.

use crate::io::bounds::{Bounds, GREATEST, LEAST, rounded, shortest};
use crate::model::cloud::{Cloud, CloudSource, Group, SIGMA_PER_RADIUS};
use crate::model::disc::Disc;
use crate::model::particle_list::Summary;

/// Upper limit of κ σ and of the mass κ (2π)^{3/2} σ³, and so of κ σ², which lies between them. κ
/// and σ of 1e15 give κ σ = 1e30; f32 ends at 3.4e38.
const GREATEST_PRODUCT: f64 = 1e37;

/// A quantity of a group's blobs and its upper limit.
struct Limit {
    name: &'static str,
    greatest: f64,
    of: fn(&Group) -> f64,
}

const PLACES: Limit = Limit {
    name: "places",
    greatest: GREATEST,
    of: |g| (g.center.abs() + g.half_extent).max_element(),
};
const SIGMA: Limit = Limit { name: "σ", greatest: GREATEST, of: Group::sigma_widest };
const KAPPA: Limit =
    Limit { name: "κ = optical_depth / (√(2π) σ)", greatest: GREATEST, of: |g| g.kappa_max };
const MASS: Limit =
    Limit { name: "κ (2π)^{3/2} σ³", greatest: GREATEST_PRODUCT, of: |g| g.mass_max };
const DEPTH: Limit =
    Limit { name: "κ σ", greatest: GREATEST_PRODUCT, of: |g| g.kappa_max * g.sigma_widest() };

/// Returns the first quantity of a cloud's particles, not yet grown, that f32 does not carry.
/// `lines` are the lines of the particles in their file, if it is text.
pub fn out_of_range(cloud: &Cloud, lines: &[usize]) -> Option<String> {
    let groups = cloud.groups(0, 0);
    match &cloud.source {
        CloudSource::Boxes { boxes, law } => {
            let range = Bounds::Within(LEAST, GREATEST);
            let is_wrong = |(i, scaled): &(usize, f64)| {
                let is_point = boxes[*i].radius_max == 0.0 || law.radius_scale == 0.0;
                !is_point && !range.contains(*scaled)
            };
            let scaled = boxes.iter().map(|b| b.radius_max * law.radius_scale).enumerate();
            // The largest, where several are too large.
            match scaled.filter(is_wrong).max_by(|a, b| a.1.total_cmp(&b.1)) {
                Some((i, scaled)) => Some(format!(
                    "box {i}: radius times `radius_scale`: expected 0 or {range}, found {}",
                    rounded(scaled)
                )),
                None => exceeded(&groups, &[KAPPA, MASS, DEPTH])
                    .map(|(i, name, what)| format!("box {i}: {name}: {what}")),
            }
        }
        CloudSource::Disc(disc) => disc_out_of_range(disc, &groups),
        // The reader of weather files has checked that the numbers are those of air.
        CloudSource::Animated(_) => None,
        CloudSource::Particles(list) => {
            let Summary { mass_max, i_heaviest: i, .. } = *list.summary();
            let what = at_most(GREATEST_PRODUCT, mass_max)?;
            let place = match lines.get(i) {
                Some(line) => format!("line {line}"),
                None => format!("particle {i} (from 0)"),
            };
            Some(format!("{place}: {}: {what}", MASS.name))
        }
    }
}

/// Returns the first quantity of a cloud's particles at the end of its growth that f32 does not
/// carry. The quantities change monotonically on the way.
pub fn out_of_range_when_grown(cloud: &Cloud) -> Option<String> {
    if cloud.growth.is_none() {
        return None;
    }
    let to = cloud.growth.to;
    let groups: Vec<Group> = cloud.groups(0, 0).iter().map(|g| g.grown(to)).collect();
    // A cloud that does not grow may reach as far: its origin and its blobs are limited apart.
    let places = Limit { greatest: 2.0 * GREATEST, ..PLACES };
    if let Some((_, name, what)) = exceeded(&groups, &[places, SIGMA, MASS, DEPTH]) {
        return Some(format!("{name}, grown: {what}"));
    }
    let (sigma, least) = (least_sigma(cloud) * to, LEAST * SIGMA_PER_RADIUS);
    (sigma < least).then(|| {
        format!("σ, shrunk: expected at least {}, found {}", shortest(least), rounded(sigma))
    })
}

/// Returns the least σ other than 0 of a cloud's blobs, or of the largest blobs of its boxes;
/// infinite where all are 0.
fn least_sigma(cloud: &Cloud) -> f64 {
    let sigmas: Vec<f64> = match &cloud.source {
        CloudSource::Particles(list) => {
            list.iter().map(|p| p.sigma * p.shape.narrowest()).collect()
        }
        _ => cloud.groups(0, 0).iter().map(|g| g.sigma_max).collect(),
    };
    sigmas.into_iter().filter(|sigma| *sigma > 0.0).fold(f64::INFINITY, f64::min)
}

fn disc_out_of_range(disc: &Disc, groups: &[Group]) -> Option<String> {
    let lift = disc.condensation.map_or(0.0, |c| c.lift * disc.warmth);
    let product = |name, found| at_most(GREATEST_PRODUCT, found).map(|what| (0, name, what));
    exceeded(groups, &[PLACES, SIGMA, KAPPA, MASS, DEPTH])
        .or_else(|| product("buoyancy · warmth · cooling time", disc.rise()))
        .or_else(|| product("warmth · base_lift", lift))
        .map(|(_, name, what)| format!("its particles' {name}: {what}"))
}

/// Returns the group that exceeds the first exceeded limit the most, the limit's name, and what was
/// expected and found.
fn exceeded(groups: &[Group], limits: &[Limit]) -> Option<(usize, &'static str, String)> {
    limits.iter().find_map(|limit| {
        let found = groups.iter().map(limit.of).enumerate();
        let (i, greatest) = found.max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some((i, limit.name, at_most(limit.greatest, greatest)?))
    })
}

fn at_most(greatest: f64, found: f64) -> Option<String> {
    (found > greatest)
        .then(|| format!("expected at most {}, found {}", shortest(greatest), rounded(found)))
}
