//! The number of particles by distance, C (4) to (6): no distance and infinite distance, no size,
//! the largest counts, a single particle for all.

use std::cmp::Ordering;

use glam::DVec3;

use super::case::{Case, Comparison};
use super::context::StressContext;
use super::scenes::{MIDDLE, PATHS, UNLIT, blob, render_blobs};
use crate::error::Result;
use crate::layout::particle::DrawnRecord;
use crate::model::cloud::Group;
use crate::model::count::{Count, DrawnCount, MIN_DRAWN};
use crate::reference::count::weights;
use crate::reference::rounding::U_F32;

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "count/at-the-eye",
        what: "clouds at distance 0 and behind the eye (negative distance): every particle",
        bound: "0",
        check: at_the_eye,
    },
    Case {
        name: "count/nowhere",
        what: "distances that are huge, infinite or NaN: no particle, finite factors",
        bound: "0",
        check: |_, c| {
            for d in [1e6, 1e30, 1e300, f64::MAX, f64::INFINITY, f64::NAN] {
                nothing(c, 1.0, d);
            }
            Ok(())
        },
    },
    Case {
        name: "count/no-size",
        what: "clouds whose size falls to 0: no particle, finite factors",
        bound: "0",
        check: |_, c| {
            for scale in [1e-4, 1e-30, 1e-120, 5e-324, 0.0, f64::NAN] {
                nothing(c, scale, 1.0);
            }
            Ok(())
        },
    },
    Case {
        name: "count/most",
        what: "2^32 - 1 particles, all or nearly all drawn: the count fits into 32 bits",
        bound: "2^-52 of the count",
        check: most,
    },
    Case {
        name: "count/conserved",
        what: "the sum of the optical depths is constant as the count falls to 1",
        bound: "3 u of f32's factors",
        check: conserved,
    },
    Case {
        name: "count/weights",
        what: "the factor of each particle against the reference, from all particles to a \
            millionth of one",
        bound: "3 u of f32's factors, and 2^-52 of the count",
        check: each_weight,
    },
    Case {
        name: "count/drawn",
        what: "the opacity of coincident blobs is constant as the device draws fewer of them",
        bound: "(1e-6 + 16 u) tau, and 2^-23 a layer",
        check: drawn,
    },
];

const COUNT: Count = Count { a: 280.0, d0: 1.0, normalised: false, conserve: true };

/// Returns the device's record of a group of `n` particles: the number drawn, the factor on κ and
/// the weight of the last particle.
fn record(n: u32, drawn: &DrawnCount) -> (u32, f64, f64) {
    let group = Group {
        facing_from: DVec3::ZERO,
        aspects: [1.0; 3],
        turned_max: 0.0,
        i_cloud: 0,
        i_first: 0,
        n_particles: n,
        center: DVec3::ZERO,
        cloud_center: DVec3::ZERO,
        scale: 1.0,
        half_extent: DVec3::ONE,
        sigma_max: 1.0,
        sigma_y_max: 1.0,
        sigma_mean: 1.0,
        sigma_by_area: 1.0,
        kappa_max: 1.0,
        mass_max: 1.0,
        gust_reach: 0.0,
    };
    let record = DrawnRecord::new(&group, drawn, 0);
    (record.end, f64::from(record.kappa_scale), f64::from(record.last_weight))
}

fn at_the_eye(_: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for d in [0.0, -0.0, -1e-300, -3.0, -1e300, f64::NEG_INFINITY] {
        for n in [1, 7, 1_000_000] {
            let (end, scale, last) = record(n, &COUNT.drawn(n, COUNT.share(1.0, d)));
            c.exact(end, n, format_args!("particles drawn of {n} at {d:e}"));
            c.exact(scale, 1.0, format_args!("factor of {n} particles at {d:e}"));
            c.exact(last, 1.0, format_args!("last weight of {n} particles at {d:e}"));
        }
    }
    Ok(())
}

/// Checks that no particle of a cloud is drawn and that its factors are finite.
fn nothing(c: &mut Comparison, scale: f64, distance: f64) {
    let (end, factor, last) = record(1000, &COUNT.drawn(1000, COUNT.share(scale, distance)));
    c.exact(end, 0.0, format_args!("particles drawn at {distance:e}, size {scale:e}"));
    c.holds(
        factor.is_finite() && last.is_finite(),
        format_args!("finite factors at {distance:e}, size {scale:e}"),
    );
}

fn most(_: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let n = u32::MAX;
    for share in [1.0, 1.0f64.next_down(), 1.0 - 1e-9, 0.5, 1e-3] {
        let drawn = COUNT.drawn(n, share);
        let x = f64::from(n) * share;
        let count = f64::from(drawn.n) - 1.0 + drawn.last_weight;
        c.add(count, x, 2f64.powi(-52) * x, format_args!("count of share {share}"));
        let is_weight = drawn.last_weight > 0.0 && drawn.last_weight <= 1.0;
        c.holds(is_weight, format_args!("last weight of share {share} within 0 and 1"));
    }
    for d in [0.0, -1e9] {
        c.exact(COUNT.drawn(n, COUNT.share(1e9, d)).n, n, format_args!("all, at {d:e}"));
    }
    Ok(())
}

fn conserved(_: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for n in [1, 2, 3, 17, 1000, 1_000_000] {
        // From all particles down to a single one.
        for k in 0..=200 {
            let share = f64::from(n).powf(-f64::from(k) / 200.0);
            let (end, scale, last) = record(n, &COUNT.drawn(n, share));
            let sum = scale * (f64::from(end) - 1.0 + last);
            // Factor and weight are rounded to f32; the weight is at most 1.
            let bound = 3.0 * U_F32 * f64::from(n);
            c.add(sum, n, bound, format_args!("{n} particles, share {share:e}"));
        }
    }
    Ok(())
}

fn each_weight(_: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for conserve in [true, false] {
        let count = Count { conserve, ..COUNT };
        for n in [1u32, 5, 37] {
            for k in 0..600 {
                let share = 1.0 / f64::from(n) * f64::from(n).powf(1.0 - f64::from(k) / 300.0);
                if f64::from(n) * share < MIN_DRAWN {
                    continue;
                }
                let (end, scale, last) = record(n, &count.drawn(n, share));
                for (i, truth) in (0..n).zip(weights(n, share, conserve)) {
                    let value = match (i + 1).cmp(&end) {
                        Ordering::Less => scale,
                        Ordering::Equal => scale * last,
                        Ordering::Greater => 0.0,
                    };
                    // The last weight is a difference of the count.
                    let bound = 3.0 * U_F32 * truth + 2f64.powi(-52) * f64::from(n) * scale;
                    c.add(
                        value,
                        truth,
                        bound,
                        format_args!("particle {i} of {n}, share {share:e}"),
                    );
                }
            }
        }
    }
    Ok(())
}

fn drawn(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const N: u32 = 64;
    // At least one particle is drawn, which stands for all of them.
    const TAU: f64 = N as f64 * 0.02;
    let blobs = vec![blob([0.0; 3], 0.5, 0.02); N as usize];
    for path in PATHS {
        // By C's formula the eye at 10 sees a share e^{-10/a}: from all of them to one.
        for a in [1e9, 20.0, 5.0, 3.0, 2.45] {
            let draw = format!("{path}\ncount = 'distance'\ncount_a = {a:?}\ncount_d0 = 1.0");
            let frame = render_blobs(ctx, UNLIT, &draw, blobs.clone())?;
            let bound = (1e-6 + 16.0 * U_F32) * TAU + f64::from(N) * 2f64.powi(-23);
            let at = format_args!("{path}, a = {a}");
            c.add(frame.channel(MIDDLE, 3), -(-TAU).exp_m1(), bound, at);
        }
    }
    Ok(())
}
