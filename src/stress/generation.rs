//! Particles of boxes at the edge: without extent, huge, needles and plates, far away, with no
//! radius or a huge one.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::case::{Case, Comparison, Found};
use super::desk::Desk;
use super::scenes::{OPTICAL_DEPTH, PLAIN, SEED, one_box, with_boxes};
use crate::error::{Error, Result};
use crate::layout::particle::ParticleRecord;
use crate::model::boxes::{CloudBox, Form, MAX_ATTEMPTS, radius_factor, radius_shape};
use crate::model::cloud::SIGMA_PER_RADIUS;
use crate::passes::generate::FOLDED;
use crate::reference::generate::{generate_particle, uniforms};
use crate::reference::place::placed_bound;
use crate::reference::rounding::{U_F32, particle_bound, radius_bound};

pub const CASES: &[Case] = &[
    Case {
        name: "generation/unit",
        what: "an ordinary box, for comparison with the others",
        bound: "running error analysis of each particle (reference::rounding)",
        run: |desk| particles(desk, one_box(2000, [2.0, 1.5, 1.0], 1.0)),
    },
    Case {
        name: "generation/flat",
        what: "a box without extent: every particle at its centre",
        bound: "running error analysis of each particle",
        run: |desk| particles(desk, one_box(500, [0.0; 3], 1.0)),
    },
    Case {
        name: "generation/tiny",
        what: "a box of 1e-30",
        bound: "running error analysis of each particle",
        run: |desk| particles(desk, one_box(500, [1e-30; 3], 1.0)),
    },
    Case {
        name: "generation/huge",
        what: "a box of 1e30, where sines are of arguments that mean nothing: where the uniforms \
            say, and inside",
        bound: "3 pi/4 of the sines, and 4 u of the box",
        run: |desk| spread(desk, one_box(500, [1e30; 3], 1.0)),
    },
    Case {
        name: "generation/wide",
        what: "a box of 2000, where f32 and f64 decide differently: where the uniforms of the \
            attempt say, and inside",
        bound: "3 pi/4 of the sines, and 4 u of the box",
        run: |desk| spread(desk, one_box(4000, [2000.0; 3], 1.0)),
    },
    Case {
        name: "generation/needle",
        what: "a box of 40 x 0.001 x 0.001, which accepts next to nothing",
        bound: "running error analysis of each particle, folds included",
        run: |desk| particles(desk, one_box(2000, [40.0, 1e-3, 1e-3], 1.0)),
    },
    Case {
        name: "generation/plate",
        what: "a box of 20 x 0.0001 x 20",
        bound: "running error analysis of each particle, folds included",
        run: |desk| particles(desk, one_box(2000, [20.0, 1e-4, 20.0], 1.0)),
    },
    Case {
        name: "generation/folded",
        what: "a box in which 64 attempts fail: folds are counted as the reference counts them, \
            and lie inside",
        bound: "0 in the count of what is surely folded; |offset| <= half of the box",
        run: folded,
    },
    Case {
        name: "generation/no-radius",
        what: "particles of radius 0: none is drawn, and nothing is odd",
        bound: "0",
        run: no_radius,
    },
    Case {
        name: "generation/huge-radius",
        what: "particles of radii up to 1e6, beyond what the sine can reduce",
        bound: "running error analysis; beyond 16383 pi pi/2 either way, and rounding",
        run: huge_radius,
    },
    Case {
        name: "generation/far-left",
        what: "a box centred at -1e7: places relative to the scene's own origin",
        bound: "that of the same box at 0, and 2^-52 of 1e7",
        run: |desk| far(desk, -1e7),
    },
    Case {
        name: "generation/far-right",
        what: "a box centred at 1e7",
        bound: "that of the same box at 0, and 2^-52 of 1e7",
        run: |desk| far(desk, 1e7),
    },
    Case {
        name: "generation/none",
        what: "no particle at all: a picture of nothing",
        bound: "0",
        run: none,
    },
    Case {
        name: "generation/one",
        what: "one particle",
        bound: "running error analysis",
        run: |desk| particles(desk, one_box(1, [1.0; 3], 1.0)),
    },
    Case {
        name: "generation/too-many",
        what: "2^31 particles: refused with the limit that they break, and nothing is \
            left allocated",
        bound: "an error of the kind \"limit\"",
        run: too_many,
    },
];

/// What the device makes of one box.
fn made(desk: &mut Desk, b: CloudBox) -> Result<(Vec<ParticleRecord>, Vec<u32>)> {
    let scene = with_boxes(desk, PLAIN, vec![b])?;
    let mut player = desk.player(&scene, false)?;
    player.renderer.generate_now(desk.device())
}

/// Every particle against the reference, each at its own bound; where rounding may decide otherwise
/// only that it is inside.
fn particles(desk: &mut Desk, b: CloudBox) -> Result<Found> {
    let (records, status) = made(desk, b)?;
    let mut c = Comparison::default();
    let (mut n_open, mut n_folded) = (0, 0);
    for (i, (record, status)) in (0u32..).zip(records.iter().zip(&status)) {
        let truth = generate_particle(&b, 0, SEED, Form::Centred, OPTICAL_DEPTH, 1.0, i);
        let bound = particle_bound(&b, 0, SEED, Form::Centred, i, U_F32);
        n_folded += usize::from(status & FOLDED != 0);
        is_inside(&mut c, record, &b, i);
        if !bound.decided {
            n_open += 1;
            continue;
        }
        c.holds(status & !FOLDED == truth.n_attempts, || format!("attempts of particle {i}"));
        c.holds((status & FOLDED != 0) == truth.folded, || format!("fold of particle {i}"));
        for axis in 0..3 {
            // Below f32's least normal number products may be flushed.
            let bound = bound.position[axis] + f64::from(f32::MIN_POSITIVE);
            c.add(f64::from(record.position[axis]), truth.position[axis], bound, || {
                format!("place of particle {i}, axis {axis}")
            });
        }
        c.add(f64::from(record.sigma), truth.sigma, bound.radius * SIGMA_PER_RADIUS, || {
            format!("sigma of particle {i}")
        });
    }
    // Of a box without extent it decides all; of any other something must be left to compare.
    c.holds(n_open < records.len() || b.extent == DVec3::ZERO, || {
        "that not all is left to rounding".to_owned()
    });
    Ok(c.remark(format!("{n_folded} folded; of {n_open} rounding decides")).into())
}

fn is_inside(c: &mut Comparison, record: &ParticleRecord, b: &CloudBox, i: u32) {
    for axis in 0..3 {
        // The half is rounded to f32.
        let most = f64::from((0.5 * b.extent[axis]) as f32);
        let beyond = (f64::from(record.position[axis]).abs() - most).max(0.0);
        c.add(beyond, 0.0, 0.0, || format!("particle {i} beyond its box, axis {axis}"));
    }
}

/// Of a box so wide that sines are nothing beside it: what the uniforms of the attempt that was
/// kept say.
fn spread(desk: &mut Desk, b: CloudBox) -> Result<Found> {
    let (records, status) = made(desk, b)?;
    let mut c = Comparison::default();
    let mut n_folded = 0;
    for (i, (record, status)) in (0u32..).zip(records.iter().zip(&status)) {
        is_inside(&mut c, record, &b, i);
        c.holds(record.sigma.is_finite() && record.kappa.is_finite(), || {
            format!("a finite particle {i}")
        });
        if status & FOLDED != 0 {
            n_folded += 1;
            continue;
        }
        let u = uniforms(SEED, 0, i, (status & !FOLDED).saturating_sub(1));
        for (axis, u) in u.into_iter().take(3).enumerate() {
            // P (6): |P_x| is pi/2 and, by P (5), pi at most, and half of it is added.
            let truth = 0.5 * (2.0 * u - 1.0) * b.extent[axis];
            let bound = 0.75 * std::f64::consts::PI * 1.001 + 4.0 * U_F32 * b.extent[axis];
            c.add(f64::from(record.position[axis]), truth, bound, || {
                format!("place of particle {i}, axis {axis}")
            });
        }
    }
    Ok(c.remark(format!("{n_folded} of {} folded", status.len())).into())
}

fn folded(desk: &mut Desk) -> Result<Found> {
    let b = one_box(3000, [60.0, 1e-6, 1e-6], 1.0);
    let (records, status) = made(desk, b)?;
    let mut c = Comparison::default();
    let [mut found, mut expected] = [0u32; 2];
    for (i, (record, status)) in (0u32..).zip(records.iter().zip(&status)) {
        is_inside(&mut c, record, &b, i);
        c.holds(status & !FOLDED <= MAX_ATTEMPTS, || format!("attempts of particle {i}"));
        if particle_bound(&b, 0, SEED, Form::Centred, i, U_F32).decided {
            found += u32::from(status & FOLDED != 0);
            expected += u32::from(
                generate_particle(&b, 0, SEED, Form::Centred, OPTICAL_DEPTH, 1.0, i).folded,
            );
        }
    }
    c.add(f64::from(found), f64::from(expected), 0.0, || "folded particles".to_owned());
    c.holds(expected > 0, || "that some are folded".to_owned());
    Ok(c.remark(format!("{found} folded")).into())
}

fn no_radius(desk: &mut Desk) -> Result<Found> {
    let scene = with_boxes(desk, PLAIN, vec![one_box(500, [2.0; 3], 0.0)])?;
    let played = desk.play(&scene, 0)?;
    let mut c = Comparison::default();
    for (i, p) in played.particles.iter().enumerate() {
        c.add(f64::from(p.sigma), 0.0, 0.0, || format!("sigma of particle {i}"));
    }
    for (i, v) in played.rgba.iter().enumerate() {
        c.add(f64::from(*v), 0.0, 0.0, || format!("number {i} of the picture"));
    }
    Ok(c.into())
}

fn huge_radius(desk: &mut Desk) -> Result<Found> {
    let b = one_box(2000, [2.0; 3], 1e6);
    let (records, status) = made(desk, b)?;
    let mut c = Comparison::default();
    let factor = radius_factor(Form::Centred, b.radius_max);
    for (i, (record, status)) in (0u32..).zip(records.iter().zip(&status)) {
        let attempt = (status & !FOLDED).saturating_sub(1);
        let [.., u] = uniforms(SEED, 0, i, attempt);
        let r = u * b.radius_max;
        let by_sine = r < 16_383.0 * std::f64::consts::PI;
        // Where the sine can be reduced it is P (10)'s; beyond, |pi/2 sin| <= pi/2 (1 + 4 u), and
        // the roundings of a number of 1e6.
        let (truth, bound) = match by_sine {
            true => (
                radius_shape(r),
                radius_bound(Form::Centred, b.radius_max, u, U_F32) / factor + 4.0 * U_F32 * r,
            ),
            false => (r, FRAC_PI_2 * (1.0 + 4.0 * U_F32) + 6.0 * U_F32 * r),
        };
        let radius = f64::from(record.sigma) / (factor * SIGMA_PER_RADIUS);
        c.add(radius, truth, bound, || format!("radius of particle {i}"));
    }
    Ok(c.into())
}

fn far(desk: &mut Desk, at: f64) -> Result<Found> {
    let b = one_box(1500, [2.0, 1.5, 1.0], 1.0);
    let mut scene =
        with_boxes(desk, PLAIN, vec![CloudBox { center: DVec3::new(at, at, -at), ..b }])?;
    for key in &mut scene.camera.keys {
        key.position += DVec3::new(at, at, -at);
        key.target += DVec3::new(at, at, -at);
    }
    let played = desk.play(&scene, 0)?;
    let mut c = Comparison::default();
    for (i, place) in (0u32..).zip(&played.placed) {
        let truth = generate_particle(&b, 0, SEED, Form::Centred, OPTICAL_DEPTH, 1.0, i).position;
        let bound = particle_bound(&b, 0, SEED, Form::Centred, i, U_F32);
        if !bound.decided {
            continue;
        }
        // The box's centre is the origin of all that is lit, but for f64's rounding of 1e7.
        let bound = placed_bound(bound.position, DVec3::ZERO, truth, U_F32)
            + DVec3::splat(2f64.powi(-52) * at.abs());
        for axis in 0..3 {
            c.add(f64::from(place.position[axis]), truth[axis], bound[axis], || {
                format!("place of particle {i}, axis {axis}")
            });
        }
    }
    c.holds(played.n_odd() == 0, || "a finite picture".to_owned());
    c.holds(played.rgba.iter().any(|v| *v > 0.1), || "that something is drawn".to_owned());
    Ok(c.into())
}

fn none(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for boxes in [vec![], vec![one_box(0, [1.0; 3], 1.0)], vec![one_box(0, [1.0; 3], 1.0); 3]] {
        let n = boxes.len();
        let scene = with_boxes(desk, PLAIN, boxes)?;
        let played = desk.play(&scene, 0)?;
        let n_other = played.rgba.iter().filter(|v| **v != 0.0).count();
        c.add(n_other as f64, 0.0, 0.0, || {
            format!("numbers that are not 0 in a picture of {n} empty boxes")
        });
    }
    Ok(c.into())
}

fn too_many(desk: &mut Desk) -> Result<Found> {
    let scene = with_boxes(desk, PLAIN, vec![one_box(1 << 31, [1.0; 3], 1.0)])?;
    let before = desk.device().allocated_bytes();
    let refused = match desk.player(&scene, false) {
        Err(Error::Limit { what }) => Some(what),
        Err(error) => return Err(error),
        Ok(_) => None,
    };
    let mut c = Comparison::default();
    c.holds(refused.is_some(), || "that it is refused".to_owned());
    c.add(desk.device().allocated_bytes() as f64, before as f64, 0.0, || {
        "bytes that are left allocated".to_owned()
    });
    Ok(c.remark(refused.unwrap_or_default()).into())
}
