//! Count by distance, C (4) to (6), at the edge: no distance and an endless one, no size, as many
//! as 32 bits hold, one for all.

use glam::DVec3;

use super::case::{Case, Comparison, Found};
use super::desk::Desk;
use super::scenes::{PLAIN, blob, with_particles};
use crate::error::Result;
use crate::model::cloud::Group;
use crate::model::count::{Count, DrawnCount, MIN_DRAWN};
use crate::reference::count::weights;
use crate::reference::rounding::U_F32;

pub const CASES: &[Case] = &[
    Case {
        name: "count/at-the-eye",
        what: "a cloud at distance 0, and one behind the eye (a negative distance): all of it",
        bound: "0",
        run: at_the_eye,
    },
    Case {
        name: "count/nowhere",
        what: "distances that are huge, infinite or no numbers: nothing, and no factor that is odd",
        bound: "0",
        run: nowhere,
    },
    Case {
        name: "count/no-size",
        what: "clouds whose size falls to 0: nothing, and no factor that is odd",
        bound: "0",
        run: no_size,
    },
    Case {
        name: "count/most",
        what: "2^32 - 1 particles, all of them or nearly: the count stays within 32 bits",
        bound: "2^-52 of the count",
        run: most,
    },
    Case {
        name: "count/conserved",
        what: "the sum of all optical depths as the count falls to 1: what it was",
        bound: "3 u of f32's factors",
        run: conserved,
    },
    Case {
        name: "count/weights",
        what: "each particle's factor against the reference, from all of them to a \
            millionth of one",
        bound: "3 u of f32's factors, and 2^-52 of the count",
        run: each_weight,
    },
    Case {
        name: "count/drawn",
        what: "opacity of coincident blobs as the device draws fewer of them: what all \
            together have",
        bound: "(1e-6 + 16 u) tau, and 2^-23 a layer",
        run: drawn,
    },
];

const COUNT: Count = Count { a: 280.0, d0: 1.0, normalised: false, conserve: true };

/// What the device is told of a group of `n`: factors on κ, particle by particle that is drawn.
fn told(n: u32, drawn: &DrawnCount) -> (u32, f64, f64) {
    let record = crate::layout::particle::DrawnRecord::new(&group(n), drawn, 0);
    (record.end, f64::from(record.kappa_scale), f64::from(record.last_weight))
}

fn group(n: u32) -> Group {
    Group {
        facing_from: glam::DVec3::ZERO,
        aspects: [1.0; 3],
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
        kappa_max: 1.0,
        mass_max: 1.0,
        gust_reach: 0.0,
    }
}

fn at_the_eye(_: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for d in [0.0, -0.0, -1e-300, -3.0, -1e300, f64::NEG_INFINITY] {
        for n in [1, 7, 1_000_000] {
            let (end, scale, last) = told(n, &COUNT.drawn(n, COUNT.share(1.0, d)));
            for (value, truth) in [(f64::from(end), f64::from(n)), (scale, 1.0), (last, 1.0)] {
                c.add(value, truth, 0.0, || format!("{n} particles at {d:e}"));
            }
        }
    }
    Ok(c.into())
}

/// Adds that nothing is drawn, and that what would be multiplied is finite.
fn nothing(c: &mut Comparison, drawn: &DrawnCount, what: &str) {
    let (end, scale, last) = told(1000, drawn);
    c.add(f64::from(end), 0.0, 0.0, || format!("particles {what}"));
    c.holds(scale.is_finite() && last.is_finite(), || format!("finite factors {what}"));
}

fn nowhere(_: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for d in [1e6, 1e30, 1e300, f64::MAX, f64::INFINITY, f64::NAN] {
        nothing(&mut c, &COUNT.drawn(1000, COUNT.share(1.0, d)), &format!("at {d:e}"));
    }
    Ok(c.into())
}

fn no_size(_: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for scale in [1e-4, 1e-30, 1e-120, 5e-324, 0.0, f64::NAN] {
        nothing(&mut c, &COUNT.drawn(1000, COUNT.share(scale, 1.0)), &format!("of size {scale:e}"));
    }
    Ok(c.into())
}

fn most(_: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    let n = u32::MAX;
    for share in [1.0, 1.0f64.next_down(), 1.0 - 1e-9, 0.5, 1e-3] {
        let drawn = COUNT.drawn(n, share);
        let x = f64::from(n) * share;
        c.add(f64::from(drawn.n) - 1.0 + drawn.last_weight, x, 2f64.powi(-52) * x, || {
            format!("count of share {share}")
        });
        c.holds(drawn.last_weight > 0.0 && drawn.last_weight <= 1.0, || {
            format!("the last one's weight of share {share}")
        });
    }
    for d in [0.0, -1e9] {
        c.add(f64::from(COUNT.drawn(n, COUNT.share(1e9, d)).n), f64::from(n), 0.0, || {
            format!("all, at {d:e}")
        });
    }
    Ok(c.into())
}

/// Shares from 1 down to where one of `n` is left.
fn shares(n: u32) -> impl Iterator<Item = f64> {
    (0..=200).map(move |k| f64::from(n).powf(-f64::from(k) / 200.0))
}

fn conserved(_: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for n in [1, 2, 3, 17, 1000, 1_000_000] {
        for share in shares(n) {
            let (end, scale, last) = told(n, &COUNT.drawn(n, share));
            let sum = scale * (f64::from(end) - 1.0 + last);
            // The factor and the weight are rounded to f32, and the weight is 1 at most.
            c.add(sum, f64::from(n), 3.0 * U_F32 * f64::from(n), || {
                format!("{n} particles, share {share:e}")
            });
        }
    }
    Ok(c.into())
}

fn each_weight(_: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for conserve in [true, false] {
        let count = Count { conserve, ..COUNT };
        for n in [1u32, 5, 37] {
            for k in 0..600 {
                let share = 1.0 / f64::from(n) * f64::from(n).powf(1.0 - f64::from(k) / 300.0);
                let drawn = count.drawn(n, share);
                let (end, scale, last) = told(n, &drawn);
                let truth = weights(n, share, conserve);
                if f64::from(n) * share < MIN_DRAWN {
                    continue;
                }
                for (i, truth) in (0..n).zip(truth) {
                    let value = match (i + 1).cmp(&end) {
                        std::cmp::Ordering::Less => scale,
                        std::cmp::Ordering::Equal => scale * last,
                        std::cmp::Ordering::Greater => 0.0,
                    };
                    // The last one's weight is a difference of the count.
                    let bound = 3.0 * U_F32 * truth + 2f64.powi(-52) * f64::from(n) * scale;
                    c.add(value, truth, bound, || format!("particle {i} of {n}, share {share:e}"));
                }
            }
        }
    }
    Ok(c.into())
}

fn drawn(desk: &mut Desk) -> Result<Found> {
    const N: u32 = 64;
    const TAU: f64 = 0.02;
    let mut c = Comparison::default();
    for path in ["sprites", "tiles"] {
        // Of C's formula with d0 = 1 the eye at 10 sees e^{-10/a}: from all to one.
        for a in [1e9, 20.0, 5.0, 3.0, 2.45] {
            let text = format!(
                "{PLAIN}[draw]\npath = '{path}'\ncount = 'distance'\ncount_a = \
                 {a:?}\ncount_d0 = 1.0\n"
            );
            let scene = with_particles(desk, &text, vec![blob([0.0; 3], 0.5, TAU); N as usize])?;
            let played = desk.play(&scene, 0)?;
            let middle = played.rgba[4 * (24 * 65 + 32) + 3];
            // No fewer than one of them is there, which stands for all.
            let tau = f64::from(N) * TAU;
            let truth = -(-tau).exp_m1();
            let bound = (1e-6 + 16.0 * U_F32) * tau + f64::from(N) * 2f64.powi(-23);
            c.add(f64::from(middle), truth, bound, || format!("{path}, a = {a}"));
        }
    }
    Ok(c.into())
}
