//! Particles of discs at any time and of any law that a scene may have.

use glam::Vec3;

use super::case::{Case, Comparison, Found};
use super::desk::{Desk, Played};
use super::scenes::PLAIN;
use crate::error::Result;
use crate::model::scene::Scene;
use crate::reference::live::age;
use crate::reference::rounding::U_F32;

pub const CASES: &[Case] = &[
    Case {
        name: "live/late",
        what: "ages of 1000 slots, told by the wind, from -1e12 to 1e12 s, by periods of \
            1e-3 to 1e6 s",
        bound: "4 u of the way that a period is",
        run: late,
    },
    Case {
        name: "live/dead",
        what: "particles at their birth, and past the end of lives that end early: their kappa is \
            0, and that of no others",
        bound: "0",
        run: dead,
    },
    Case {
        name: "live/extreme",
        what: "laws with the least and the greatest numbers that a scene may have: all finite, \
            inside the bounds, nothing negative",
        bound: "16 u of the bounds",
        run: extreme,
    },
];

const N: u32 = 1000;

/// A disc of [`N`] slots that no picture's edge cuts off, with further keys.
fn scene(desk: &Desk, keys: &str) -> Result<Scene> {
    desk.scene(&format!("{PLAIN}[[cloud]]\nfrom = 'disc'\nparticles = {N}\n{keys}\n"))
}

fn at(desk: &mut Desk, mut scene: Scene, time_s: f64) -> Result<(Scene, Played)> {
    scene.time.start_s = time_s;
    let played = desk.play(&scene, 0)?;
    Ok((scene, played))
}

fn late(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    let keys = |period: f64| {
        let still = "radius = 0\nwarmth_k = 0\noutflow = 0\nlifetime_spread = 0";
        format!("{still}\nlifetime_s = {period:e}\nwind = [{:e}, 0, 0]", 1.0 / period)
    };
    for period in [1e-3, 1.0, 37.3, 1e6] {
        for time_s in [-1e12, -1e6, -0.1, 0.0, 0.1, 1e6, 1e12] {
            let (scene, played) = at(desk, scene(desk, &keys(period))?, time_s)?;
            let center = scene.groups()[0].center.x;
            for (i, p) in (0..).zip(&played.particles) {
                let share = age(period, time_s, i).share;
                let found = f64::from(p.position[0]) + center;
                let what = || format!("slot {i} of a period of {period:e} s at {time_s:e} s");
                c.add(found, share, 4.0 * U_F32, what);
            }
        }
    }
    Ok(c.into())
}

fn dead(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    let law = "lifetime_s = 10\nlifetime_spread = 0.9\nbase = 'none'";
    let mut n_dead = 0;
    for time_s in [0.0, 3.3, 1e6] {
        let (scene, played) = at(desk, scene(desk, law)?, time_s)?;
        let cloud = &scene.clouds[0];
        for (i, (p, truth)) in
            (0..).zip(played.particles.iter().zip(crate::reference::live::cloud(cloud, time_s)))
        {
            let share = age(10.0, time_s, i).share;
            n_dead += u32::from(truth.kappa == 0.0);
            // Neither new nor at its very end, where f32 may see it a rounding earlier or later.
            if truth.kappa == 0.0 && share > 0.0 {
                c.add(f64::from(p.kappa), 0.0, 1e-9 * scene.groups()[0].kappa_max, || {
                    format!("slot {i} at {time_s} s")
                });
            } else if share == 0.0 {
                c.add(f64::from(p.kappa), 0.0, 0.0, || format!("slot {i}, born at {time_s} s"));
            } else if truth.kappa > 1e-6 * scene.groups()[0].kappa_max {
                c.holds(p.kappa > 0.0, || format!("that slot {i} is seen at {time_s} s"));
            }
        }
    }
    c.holds(n_dead > 100, || "that some are dead".to_owned());
    Ok(c.remark(format!("{n_dead} of {} not seen", 3 * N)).into())
}

fn extreme(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
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
        "lifetime_spread = 0.9\nsigma_spread = 0.9\nwarmth_spread = 1\nwarmth_core = 1\nfade_in = \
         0.01\nfade_out = 0.01",
    ] {
        let (scene, played) = at(desk, scene(desk, keys)?, 12.3)?;
        let group = scene.groups()[0];
        for (i, p) in played.particles.iter().enumerate() {
            let place = Vec3::from(p.position).as_dvec3();
            let most = group.half_extent + 16.0 * U_F32 * (group.half_extent + group.center.abs());
            c.holds(place.abs().cmple(most).all(), || {
                format!("place {place} of particle {i} of {keys}")
            });
            let [sigma, kappa] = [p.sigma, p.kappa].map(f64::from);
            let room = 1.0 + 16.0 * U_F32;
            c.holds(sigma > 0.0 && sigma <= group.sigma_max * room, || {
                format!("sigma {sigma:e} of {i} of {keys}")
            });
            c.holds(kappa >= 0.0 && kappa <= group.kappa_max * room, || {
                format!("kappa {kappa:e} of {i} of {keys}")
            });
        }
        c.holds(played.n_odd() == 0, || format!("a finite picture of {keys}"));
    }
    Ok(c.into())
}
