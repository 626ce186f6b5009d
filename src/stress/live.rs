//! Particles of discs at extreme times and with extreme parameters.

use glam::Vec3;

use super::case::{Case, Comparison};
use super::context::{DeviceFrame, StressContext};
use super::scenes::{UNLIT, parse_scene};
use crate::error::Result;
use crate::model::scene::Scene;
use crate::reference::live;
use crate::reference::rounding::U_F32;

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "live/late",
        what: "ages of 1000 slots, derived from their drift in the wind, at times up to \
            1e12 s, for periods from 1e-3 to 1e6 s",
        bound: "4 u of the drift in one period",
        check: late,
    },
    Case {
        name: "live/dead",
        what: "particles at birth and after an early end of life: kappa is 0 for these and for \
            no other particle",
        bound: "0",
        check: dead,
    },
    Case {
        name: "live/extreme",
        what: "the smallest and largest parameters that a scene may have: finite, inside the \
            bounds, not negative",
        bound: "16 u of the bounds",
        check: extreme,
    },
];

/// Number of slots of the disc.
const N: u32 = 1000;

/// Renders a disc of [`N`] slots with further keys.
fn render(ctx: &mut StressContext, keys: &str, time_s: f64) -> Result<(Scene, DeviceFrame)> {
    let text = format!("{UNLIT}[[cloud]]\nfrom = 'disc'\nparticles = {N}\n{keys}\n");
    let mut scene = parse_scene(&text)?;
    scene.time.start_s = time_s;
    let frame = ctx.render(&scene, 0)?;
    Ok((scene, frame))
}

fn late(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for period in [1e-3, 1.0, 37.3, 1e6] {
        let keys = format!(
            "radius = 0\nwarmth_k = 0\noutflow = 0\nlifetime_spread = 0\nlifetime_s = {period:e}\n\
             wind = [{:e}, 0, 0]",
            1.0 / period
        );
        for time_s in [-1e12, -1e6, -0.1, 0.0, 0.1, 1e6, 1e12] {
            let (scene, frame) = render(ctx, &keys, time_s)?;
            let center = scene.groups()[0].center.x;
            for (i, p) in (0..).zip(&frame.particles) {
                c.add(
                    f64::from(p.position[0]) + center,
                    live::age(period, time_s, i).share,
                    4.0 * U_F32,
                    format_args!("slot {i}, period {period:e} s, time {time_s:e} s"),
                );
            }
        }
    }
    Ok(())
}

fn dead(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let keys = "lifetime_s = 10\nlifetime_spread = 0.9\nbase = 'none'";
    let mut n_dead = 0;
    for time_s in [0.0, 3.3, 1e6] {
        let (scene, frame) = render(ctx, keys, time_s)?;
        let kappa_max = scene.groups()[0].kappa_max;
        let truth = live::cloud(&scene.clouds[0], time_s);
        for (i, (p, truth)) in (0..).zip(frame.particles.iter().zip(truth)) {
            let is_dead = truth.kappa == 0.0;
            n_dead += u32::from(is_dead);
            if live::age(10.0, time_s, i).share == 0.0 {
                c.exact(p.kappa, 0.0, format_args!("slot {i}, born at {time_s} s"));
            } else if is_dead {
                // At the very end of a life f32 may be a rounding early or late.
                c.add(p.kappa, 0.0, 1e-9 * kappa_max, format_args!("slot {i} at {time_s} s"));
            } else if truth.kappa > 1e-6 * kappa_max {
                c.holds(p.kappa > 0.0, format_args!("slot {i} is visible at {time_s} s"));
            }
        }
    }
    c.holds(n_dead > 100, "some particles are dead");
    c.remark(format!("{n_dead} of {} invisible", 3 * N));
    Ok(())
}

fn extreme(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const ROOM: f64 = 16.0 * U_F32;
    for keys in [
        "lifetime_s = 1e-15\ncooling_s = 1e-15",
        "lifetime_s = 1e15\ncooling_s = 1e15\nbuoyancy = 0\noutflow = 0",
        "lifetime_s = 1e15\ncooling_s = 1e-15",
        "lifetime_s = 1e-15\ncooling_s = 1e15\nbuoyancy = 1e6\nwarmth_k = 1e6",
        "sigma = 1e-15\noptical_depth = 0.001\nentrainment = 1e15\nbuoyancy = 1e-15",
        "sigma = 1e11\nsigma_spread = 0.9\noptical_depth = 1e6\ndilution = 'none'",
        "radius = 0\nwarmth_k = 0\noutflow = 0\nentrainment = 0",
        "base = 1e15\nbase_over = 1e-15\nbase_lift = 1e15",
        "base = -1e15\nbase_over = 1e15\nbase_lift = 0",
        "radius = 4e14\nwind = [1e13, -1e13, 1e13]",
        "lifetime_spread = 0.9\nsigma_spread = 0.9\nwarmth_spread = 1\nwarmth_core = 1\n\
         fade_in = 0.01\nfade_out = 0.01",
    ] {
        let (scene, frame) = render(ctx, keys, 12.3)?;
        let group = scene.groups()[0];
        let reach = group.half_extent + ROOM * (group.half_extent + group.center.abs());
        for (i, p) in frame.particles.iter().enumerate() {
            let position = Vec3::from(p.position).as_dvec3();
            c.holds(
                position.abs().cmple(reach).all(),
                format_args!("position {position} of particle {i} inside the group, {keys}"),
            );
            let [sigma, kappa] = [p.sigma, p.kappa].map(f64::from);
            c.holds(
                sigma > 0.0 && sigma <= group.sigma_max * (1.0 + ROOM),
                format_args!("sigma {sigma:e} of particle {i} within its bounds, {keys}"),
            );
            c.holds(
                (0.0..=group.kappa_max * (1.0 + ROOM)).contains(&kappa),
                format_args!("kappa {kappa:e} of particle {i} within its bounds, {keys}"),
            );
        }
        c.finite(&frame.rgba, format_args!("picture, {keys}"));
    }
    Ok(())
}
