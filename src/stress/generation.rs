//! Particles of boxes: boxes without extent, huge boxes, needles, distant boxes, extreme radii.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use super::case::{Case, Comparison};
use super::context::StressContext;
use super::scenes::{LAW, SEED, UNLIT, box_scene, centred_box, change_camera};
use crate::error::{Error, Result};
use crate::layout::particle::ParticleRecord;
use crate::model::boxes::{CloudBox, Form, MAX_ATTEMPTS, radius_factor, radius_shape};
use crate::model::cloud::SIGMA_PER_RADIUS;
use crate::passes::generate::FOLDED;
use crate::reference::generate::{Generated, generate_particle, uniforms};
use crate::reference::place::placed_bound;
use crate::reference::rounding::{ParticleBound, U_F32, particle_bound, radius_bound};

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "generation/unit",
        what: "an ordinary box, for comparison with the other cases",
        bound: "running error analysis of each particle (reference::rounding)",
        check: |ctx, c| particles(ctx, c, centred_box(2000, [2.0, 1.5, 1.0], 1.0)),
    },
    Case {
        name: "generation/flat",
        what: "a box without extent: every particle at its centre",
        bound: "running error analysis of each particle",
        check: |ctx, c| particles(ctx, c, centred_box(500, [0.0; 3], 1.0)),
    },
    Case {
        name: "generation/tiny",
        what: "a box of side 1e-30",
        bound: "running error analysis of each particle",
        check: |ctx, c| particles(ctx, c, centred_box(500, [1e-30; 3], 1.0)),
    },
    Case {
        name: "generation/huge",
        what: "a box of side 1e30, where sines have arbitrary values: inside the box, where \
            the uniforms put them",
        bound: "3 pi/4 of the sines, and 4 u of the box",
        check: |ctx, c| spread(ctx, c, centred_box(500, [1e30; 3], 1.0)),
    },
    Case {
        name: "generation/wide",
        what: "a box of side 2000, where f32 and f64 accept different attempts: inside the box, \
            where the uniforms put them",
        bound: "3 pi/4 of the sines, and 4 u of the box",
        check: |ctx, c| spread(ctx, c, centred_box(4000, [2000.0; 3], 1.0)),
    },
    Case {
        name: "generation/needle",
        what: "a box of 40 x 0.001 x 0.001, which rejects nearly every attempt",
        bound: "running error analysis of each particle, folds included",
        check: |ctx, c| particles(ctx, c, centred_box(2000, [40.0, 1e-3, 1e-3], 1.0)),
    },
    Case {
        name: "generation/plate",
        what: "a box of 20 x 0.0001 x 20",
        bound: "running error analysis of each particle, folds included",
        check: |ctx, c| particles(ctx, c, centred_box(2000, [20.0, 1e-4, 20.0], 1.0)),
    },
    Case {
        name: "generation/folded",
        what: "a box in which 64 attempts fail: as many folded particles as in the reference, \
            all inside",
        bound: "0 in the count of decided folds; |offset| <= half of the box",
        check: folded,
    },
    Case {
        name: "generation/no-radius",
        what: "particles of radius 0: an empty picture",
        bound: "0",
        check: no_radius,
    },
    Case {
        name: "generation/huge-radius",
        what: "particles of radii up to 1e6, too large for the reduction of the sine",
        bound: "running error analysis; beyond 16383 pi pi/2 either way, and rounding",
        check: huge_radius,
    },
    Case {
        name: "generation/far-left",
        what: "a box centred at -1e7: positions relative to the scene's origin",
        bound: "that of the same box at 0, and 2^-52 of 1e7",
        check: |ctx, c| far(ctx, c, -1e7),
    },
    Case {
        name: "generation/far-right",
        what: "a box centred at 1e7",
        bound: "that of the same box at 0, and 2^-52 of 1e7",
        check: |ctx, c| far(ctx, c, 1e7),
    },
    Case {
        name: "generation/none",
        what: "boxes without particles: an empty picture",
        bound: "0",
        check: none,
    },
    Case {
        name: "generation/one",
        what: "one particle",
        bound: "running error analysis",
        check: |ctx, c| particles(ctx, c, centred_box(1, [1.0; 3], 1.0)),
    },
    Case {
        name: "generation/too-many",
        what: "2^31 particles: refused with the exceeded limit, and no memory stays allocated",
        bound: "an error of the kind \"limit\"",
        check: too_many,
    },
];

/// Calls `check` with the index, record, attempts and fold of every particle that the device
/// generates in a box, after checking that the particle is inside. Returns the number folded.
fn each_particle(
    ctx: &mut StressContext,
    c: &mut Comparison,
    b: CloudBox,
    mut check: impl FnMut(&mut Comparison, u32, &ParticleRecord, u32, bool),
) -> Result<u32> {
    let scene = box_scene(UNLIT, vec![b])?;
    let mut player = ctx.player(&scene, false)?;
    let (records, status) = player.renderer.generate_now(ctx.device())?;
    let mut n_folded = 0;
    for (i, (record, status)) in (0u32..).zip(records.iter().zip(&status)) {
        let is_folded = status & FOLDED != 0;
        n_folded += u32::from(is_folded);
        for axis in 0..3 {
            // The device has half the extent rounded to f32.
            let most = f64::from((0.5 * b.extent[axis]) as f32);
            let beyond = (f64::from(record.position[axis]).abs() - most).max(0.0);
            c.exact(beyond, 0.0, format_args!("particle {i} outside its box, axis {axis}"));
        }
        check(c, i, record, status & !FOLDED, is_folded);
    }
    Ok(n_folded)
}

/// Returns particle `i` of a box as the reference generates it.
fn reference(b: &CloudBox, i: u32) -> Generated {
    generate_particle(b, 0, SEED, &LAW, i)
}

/// Returns the rounding bound of [`reference`].
fn reference_bound(b: &CloudBox, i: u32) -> ParticleBound {
    particle_bound(b, 0, SEED, Form::Centred, i, U_F32)
}

/// Compares every particle with the reference. A particle for which rounding may change the
/// accepted attempt must only be inside its box.
fn particles(ctx: &mut StressContext, c: &mut Comparison, b: CloudBox) -> Result<()> {
    let mut n_undecided = 0;
    let n_folded = each_particle(ctx, c, b, |c, i, record, n_attempts, is_folded| {
        let truth = reference(&b, i);
        let bound = reference_bound(&b, i);
        if !bound.decided {
            n_undecided += 1;
            return;
        }
        c.holds(n_attempts == truth.n_attempts, format_args!("attempts of particle {i}"));
        c.holds(is_folded == truth.folded, format_args!("fold of particle {i}"));
        // Products below the smallest normal number may be flushed to 0.
        let off = bound.position + f64::from(f32::MIN_POSITIVE);
        c.vector(record.position, truth.position, off, format_args!("position of particle {i}"));
        let bound = bound.radius * SIGMA_PER_RADIUS;
        c.add(record.sigma, truth.sigma, bound, format_args!("sigma of particle {i}"));
    })?;
    // In a box without extent rounding decides about every particle.
    c.holds(n_undecided < b.n_particles || b.extent == DVec3::ZERO, "some particles are decided");
    c.remark(format!("{n_folded} folded; {n_undecided} depend on rounding"));
    Ok(())
}

/// Compares every particle of a box that is wide beside the sines with the position that the
/// uniforms of its accepted attempt give.
fn spread(ctx: &mut StressContext, c: &mut Comparison, b: CloudBox) -> Result<()> {
    let n_folded = each_particle(ctx, c, b, |c, i, record, n_attempts, is_folded| {
        c.finite([&record.sigma, &record.kappa], format_args!("particle {i}"));
        if is_folded {
            return;
        }
        let u = uniforms(SEED, 0, i, n_attempts.saturating_sub(1));
        // P (6): |P_x| is at most pi/2 and, by P (5), pi; half of the sum is added.
        let truth = 0.5 * (2.0 * DVec3::from_slice(&u) - 1.0) * b.extent;
        let bound = 0.75 * PI * 1.001 + 4.0 * U_F32 * b.extent;
        c.vector(record.position, truth, bound, format_args!("position of particle {i}"));
    })?;
    c.remark(format!("{n_folded} of {} folded", b.n_particles));
    Ok(())
}

fn folded(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let b = centred_box(3000, [60.0, 1e-6, 1e-6], 1.0);
    let [mut found, mut expected] = [0u32; 2];
    each_particle(ctx, c, b, |c, i, _, n_attempts, is_folded| {
        c.holds(n_attempts <= MAX_ATTEMPTS, format_args!("attempts of particle {i}"));
        if reference_bound(&b, i).decided {
            let truth = reference(&b, i);
            found += u32::from(is_folded);
            expected += u32::from(truth.folded);
        }
    })?;
    c.exact(found, expected, "folded particles");
    c.holds(expected > 0, "some particles are folded");
    c.remark(format!("{found} folded"));
    Ok(())
}

fn no_radius(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let frame = ctx.render(&box_scene(UNLIT, vec![centred_box(500, [2.0; 3], 0.0)])?, 0)?;
    for p in &frame.particles {
        c.exact(p.sigma, 0.0, "sigma of a particle");
    }
    for v in frame.rgba {
        c.exact(v, 0.0, "value of the picture");
    }
    Ok(())
}

fn huge_radius(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let b = centred_box(2000, [2.0; 3], 1e6);
    let factor = radius_factor(Form::Centred, b.radius_max);
    each_particle(ctx, c, b, |c, i, record, n_attempts, _| {
        let [.., u] = uniforms(SEED, 0, i, n_attempts.saturating_sub(1));
        let r = u * b.radius_max;
        // P (10), as long as the sine's argument can be reduced; beyond, |pi/2 sin| is at most
        // pi/2 (1 + 4 u), and the result is rounded.
        let (truth, bound) = if r < 16_383.0 * PI {
            let bound = radius_bound(Form::Centred, b.radius_max, u, U_F32) / factor;
            (radius_shape(r), bound + 4.0 * U_F32 * r)
        } else {
            (r, FRAC_PI_2 * (1.0 + 4.0 * U_F32) + 6.0 * U_F32 * r)
        };
        let radius = f64::from(record.sigma) / (factor * SIGMA_PER_RADIUS);
        c.add(radius, truth, bound, format_args!("radius of particle {i}"));
    })?;
    Ok(())
}

fn far(ctx: &mut StressContext, c: &mut Comparison, at: f64) -> Result<()> {
    let b = centred_box(1500, [2.0, 1.5, 1.0], 1.0);
    let center = DVec3::new(at, at, -at);
    let mut scene = box_scene(UNLIT, vec![CloudBox { center, ..b }])?;
    change_camera(&mut scene, |p| p + center);
    let frame = ctx.render(&scene, 0)?;
    for (i, placed) in (0u32..).zip(&frame.placed) {
        let truth = reference(&b, i).position;
        let bound = reference_bound(&b, i);
        if !bound.decided {
            continue;
        }
        // The scene's origin is the box's centre but for the rounding of 1e7 in f64.
        let bound = placed_bound(bound.position, DVec3::ZERO, truth, U_F32)
            + DVec3::splat(2f64.powi(-52) * at.abs());
        c.vector(placed.position, truth, bound, format_args!("position of particle {i}"));
    }
    c.finite(&frame.rgba, "picture");
    c.holds(frame.rgba.iter().any(|v| *v > 0.1), "the picture is not empty");
    Ok(())
}

fn none(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let empty = centred_box(0, [1.0; 3], 1.0);
    for boxes in [vec![], vec![empty], vec![empty; 3]] {
        let n = boxes.len();
        let frame = ctx.render(&box_scene(UNLIT, boxes)?, 0)?;
        let n_drawn = frame.rgba.iter().filter(|v| **v != 0.0).count();
        c.exact(n_drawn as f64, 0.0, format_args!("non-zero values, {n} empty boxes"));
    }
    Ok(())
}

fn too_many(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let scene = box_scene(UNLIT, vec![centred_box(1 << 31, [1.0; 3], 1.0)])?;
    let before = ctx.device().allocated_bytes();
    match ctx.player(&scene, false) {
        Err(Error::Limit { what }) => c.remark(what),
        Err(error) => return Err(error),
        Ok(_) => c.holds(false, "2^31 particles are refused"),
    }
    c.exact(ctx.device().allocated_bytes() as f64, before as f64, "allocated bytes");
    Ok(())
}
