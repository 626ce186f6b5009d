//! Layers over layers: very many, opaque ones, equal depths, subnormal numbers, either order. A
//! pixel of one layer shows its opacity as the device has it; laws of many are told by that, so
//! that only composing is judged.

use glam::DVec3;

use super::case::{Case, Comparison, Found};
use super::desk::{Desk, Played};
use super::scenes::{PLAIN, blob, heap, with_particles};
use crate::error::Result;
use crate::model::cloud::Particle;
use crate::model::scene::Scene;
use crate::reference::rounding::U_F32;

pub const CASES: &[Case] = &[
    Case {
        name: "compositing/thin-sprites",
        what: "100 000 layers of opacity 1e-5 by sprites: 1 - (1 - a)^n",
        bound: "2^-23 of the value a layer, as it is blended",
        run: |desk| thin(desk, SPRITES),
    },
    Case {
        name: "compositing/thin-tiles",
        what: "100 000 layers of opacity 1e-5 by tiles: 1 - (1 - a)^n",
        bound: "u of the value a layer, and 4 u",
        run: |desk| thin(desk, TILES),
    },
    Case {
        name: "compositing/thin-chunks",
        what: "100 000 layers of opacity 1e-5 by sprites near to far in chunks",
        bound: "2^-23 of the value a layer, as it is blended",
        run: |desk| thin(desk, "path = 'sprites'\nchunks = 4"),
    },
    Case {
        name: "compositing/opaque-sprites",
        what: "a layer of opacity 1 exactly: its colour, and nothing of what is behind",
        bound: "0",
        run: |desk| opaque(desk, SPRITES),
    },
    Case {
        name: "compositing/opaque-tiles",
        what: "the same by tiles",
        bound: "0",
        run: |desk| opaque(desk, TILES),
    },
    Case {
        name: "compositing/alternating",
        what: "200 layers, opaque and thin by turns: the nearest opaque one and what is before it",
        bound: "2^-23 a layer that shows",
        run: alternating,
    },
    Case {
        name: "compositing/equal-depths",
        what: "layers at one depth are drawn in the order of their numbers, the last on top",
        bound: "2^-23 a layer",
        run: equal_depths,
    },
    Case {
        name: "compositing/reversed",
        what: "a hundred blobs of one colour, listed forwards and backwards: the same picture",
        bound: "2^-22 a layer",
        run: reversed,
    },
    Case {
        name: "compositing/subnormal-opacity",
        what: "a thousand layers whose opacity is subnormal: as good as nothing",
        bound: "the sum of all opacities and 2^-126 a layer",
        run: subnormal_opacity,
    },
    Case {
        name: "compositing/subnormal-colour",
        what: "layers whose colour is subnormal: no number is odd, and none is more \
            than the colour",
        bound: "1e-39 and 2^-126 a layer",
        run: subnormal_colour,
    },
    Case {
        name: "compositing/bright",
        what: "radiances of 1e30 in a target of 32 bits: a product and no infinity",
        bound: "2^-22 of it",
        run: bright,
    },
    Case {
        name: "compositing/saturated-half",
        what: "radiances of 1e6 in a target of 16 bits, which holds 65504: infinite or \
            that, alpha right",
        bound: "0 in alpha; infinity or 65504 in colour",
        run: saturated_half,
    },
    Case {
        name: "compositing/paths",
        what: "a heap of 800 blobs by sprites and by tiles: the same picture",
        bound: "2^-22 a layer, and (2e-6 + 64 u) tau of all",
        run: paths,
    },
];

const WIDTH: usize = 65;
const MIDDLE: usize = 24 * WIDTH + 32;

const SPRITES: &str = "path = 'sprites'";
const TILES: &str = "path = 'tiles'";

/// `drawing`: keys of [draw].
fn draw(desk: &mut Desk, drawing: &str, particles: Vec<Particle>) -> Result<Played> {
    let scene = with_particles(desk, &format!("{PLAIN}[draw]\n{drawing}\n"), particles)?;
    desk.play(&scene, 0)
}

fn channel(played: &Played, i_pixel: usize, k: usize) -> f64 {
    f64::from(played.rgba[4 * i_pixel + k])
}

fn thin(desk: &mut Desk, path: &str) -> Result<Found> {
    const N: u32 = 100_000;
    let layer = Particle { color: DVec3::new(0.75, 0.5, 0.25), ..blob([0.0; 3], 0.5, 1e-5) };
    let one = draw(desk, path, vec![layer])?;
    let all = draw(desk, path, vec![layer; N as usize])?;
    let is_tiled = path == TILES;
    let mut c = Comparison::default();
    for i in 0..WIDTH * 49 {
        // Alone a layer is its own opacity, to the bit.
        let a = channel(&one, i, 3);
        if a == 0.0 {
            continue;
        }
        let n = f64::from(N);
        let passed = n * (-a).ln_1p();
        let truth = -passed.exp_m1();
        // Blending: of every layer what is written is rounded, by 2 u of it, and (1 - a) of that
        // goes on: no more than 2 u/a of it, and as much again by second orders. Tiles: A + (1 - A)
        // a, whose sum is rounded as what it is; 1 - A and the product by 2 u of what is added, all
        // of them once.
        let bound = match is_tiled {
            false => (2.0 * U_F32 * n).min(4.0 * U_F32 / a) * truth,
            true => (U_F32 * n + 4.0 * U_F32) * truth,
        };
        c.add(channel(&all, i, 3), truth, bound, || format!("alpha, opacity {a:e} each"));
        for (k, light) in [0.75, 0.5, 0.25].into_iter().enumerate() {
            c.add(channel(&all, i, k), light * truth, bound, || {
                format!("channel {k}, opacity {a:e} each")
            });
        }
    }
    Ok(c.into())
}

fn opaque(desk: &mut Desk, path: &str) -> Result<Found> {
    let behind = Particle { color: DVec3::new(7.0, 5.0, 3.0), ..blob([0.0, 0.0, -2.0], 0.5, 3.0) };
    let before = Particle { color: DVec3::new(0.3, 0.6, 0.1), ..blob([0.0; 3], 0.5, 1e5) };
    let played = draw(desk, path, vec![behind, before])?;
    let mut c = Comparison::default();
    c.add(channel(&played, MIDDLE, 3), 1.0, 0.0, || "alpha in the middle".to_owned());
    for k in 0..3 {
        c.add(channel(&played, MIDDLE, k), f64::from(before.color[k] as f32), 0.0, || {
            format!("channel {k} in the middle")
        });
    }
    c.add(played.n_odd() as f64, 0.0, 0.0, || "numbers that are not finite".to_owned());
    Ok(c.into())
}

fn alternating(desk: &mut Desk) -> Result<Found> {
    // From the farthest to the nearest: opaque, thin, opaque, thin; the nearest is thin.
    let of = |i: u32| {
        let z = -4.0 + 0.02 * f64::from(i);
        let is_thin = i % 2 == 1;
        let color = if is_thin {
            DVec3::new(0.0, 1.0, 0.0)
        } else {
            DVec3::new(1.0, 0.0, f64::from(i) / 256.0)
        };
        Particle { color, ..blob([0.0, 0.0, z], 0.5, if is_thin { 0.01 } else { 1e4 }) }
    };
    let all: Vec<Particle> = (0..200).map(of).collect();
    let mut c = Comparison::default();
    for path in [SPRITES, TILES] {
        let thin = channel(&draw(desk, path, vec![all[199]])?, MIDDLE, 3);
        // Of 32 bits, which have a sign; those of 16 count from the farthest.
        let played = draw(desk, &format!("{path}\nsort_bits = 32"), all.clone())?;
        let last = all[198].color;
        let truth = [(1.0 - thin) * last.x, thin, (1.0 - thin) * last.z, 1.0];
        for (k, truth) in truth.into_iter().enumerate() {
            c.add(channel(&played, MIDDLE, k), truth, 2.0 * 2f64.powi(-23), || {
                format!("{path}, channel {k}")
            });
        }
    }
    Ok(c.into())
}

fn equal_depths(desk: &mut Desk) -> Result<Found> {
    let colors = [DVec3::X, DVec3::Y, DVec3::Z];
    let all: Vec<Particle> =
        (0..30).map(|i| Particle { color: colors[i % 3], ..blob([0.0; 3], 0.5, 0.4) }).collect();
    let mut c = Comparison::default();
    for path in [SPRITES, TILES] {
        let a = channel(&draw(desk, path, vec![all[0]])?, MIDDLE, 3);
        let played = draw(desk, path, all.clone())?;
        let mut truth = DVec3::ZERO;
        all.iter().for_each(|p| truth = a * p.color + (1.0 - a) * truth);
        for k in 0..3 {
            let bound = 30.0 * 2f64.powi(-23) * truth[k].max(a);
            c.add(channel(&played, MIDDLE, k), truth[k], bound, || format!("{path}, channel {k}"));
        }
    }
    Ok(c.into())
}

fn one_colour(n: u32) -> Vec<Particle> {
    heap(n).into_iter().map(|p| Particle { color: DVec3::new(0.8, 0.6, 0.4), ..p }).collect()
}

fn reversed(desk: &mut Desk) -> Result<Found> {
    const N: u32 = 100;
    // All at one depth: the order of the list is that of the layers.
    let forwards: Vec<Particle> = one_colour(N)
        .into_iter()
        .map(|p| Particle { position: p.position * DVec3::new(1.0, 1.0, 0.0), ..p })
        .collect();
    let backwards: Vec<Particle> = forwards.iter().rev().copied().collect();
    let mut c = Comparison::default();
    for path in [SPRITES, TILES] {
        let (a, b) = (draw(desk, path, forwards.clone())?, draw(desk, path, backwards.clone())?);
        for (i, (a, b)) in a.rgba.iter().zip(&b.rgba).enumerate() {
            let bound = f64::from(N) * 2f64.powi(-22) * f64::from(*b);
            c.add(f64::from(*a), f64::from(*b), bound, || format!("{path}, number {i}"));
        }
    }
    Ok(c.into())
}

fn subnormal_opacity(desk: &mut Desk) -> Result<Found> {
    const TAU: f64 = 1e-41;
    let mut c = Comparison::default();
    for path in [SPRITES, TILES] {
        let played = draw(desk, path, vec![blob([0.0; 3], 0.5, TAU); 1000])?;
        for (i, v) in played.rgba.iter().enumerate() {
            let bound = 1000.0 * (TAU + f64::from(f32::MIN_POSITIVE));
            c.add(f64::from(*v), 0.0, bound, || format!("{path}, number {i}"));
        }
    }
    Ok(c.into())
}

fn subnormal_colour(desk: &mut Desk) -> Result<Found> {
    const LIGHT: f64 = 1e-39;
    let mut c = Comparison::default();
    for path in [SPRITES, TILES] {
        let all: Vec<Particle> =
            heap(300).into_iter().map(|p| Particle { color: DVec3::splat(LIGHT), ..p }).collect();
        let played = draw(desk, path, all)?;
        for i in 0..WIDTH * 49 {
            for k in 0..3 {
                let bound = LIGHT + 300.0 * f64::from(f32::MIN_POSITIVE);
                c.add(channel(&played, i, k), 0.0, bound, || {
                    format!("{path}, pixel {i}, channel {k}")
                });
            }
            c.holds((0.0..=1.0).contains(&channel(&played, i, 3)), || {
                format!("{path}, alpha of pixel {i}")
            });
        }
    }
    Ok(c.into())
}

fn bright(desk: &mut Desk) -> Result<Found> {
    const LIGHT: f64 = 1e30;
    let mut c = Comparison::default();
    for path in [SPRITES, TILES] {
        let layer = Particle { color: DVec3::splat(LIGHT), ..blob([0.0; 3], 0.5, 0.7) };
        let played = draw(desk, path, vec![layer])?;
        for i in 0..WIDTH * 49 {
            let truth = f64::from(LIGHT as f32) * channel(&played, i, 3);
            c.add(channel(&played, i, 0), truth, 2f64.powi(-22) * truth, || {
                format!("{path}, pixel {i}")
            });
        }
    }
    Ok(c.into())
}

fn saturated_half(desk: &mut Desk) -> Result<Found> {
    let layer = Particle { color: DVec3::splat(1e6), ..blob([0.0; 3], 0.5, 1e5) };
    let text = PLAIN.replace("rgba32f", "rgba16f");
    let mut c = Comparison::default();
    let mut n_infinite = 0;
    for path in [SPRITES, TILES] {
        let scene: Scene = with_particles(desk, &format!("{text}[draw]\n{path}\n"), vec![layer])?;
        let played = desk.play(&scene, 0)?;
        c.add(channel(&played, MIDDLE, 3), 1.0, 0.0, || format!("{path}, alpha"));
        let red = channel(&played, MIDDLE, 0);
        // Vulkan lets a conversion overflow either way.
        c.holds(red == f64::INFINITY || red == 65504.0, || format!("{path}, red {red}"));
        c.holds(!played.rgba.iter().any(|v| v.is_nan()), || format!("{path}, that none is NaN"));
        n_infinite += played.n_odd();
    }
    Ok(c.remark(format!("{n_infinite} numbers are infinite")).into())
}

fn paths(desk: &mut Desk) -> Result<Found> {
    const N: u32 = 800;
    // At 8 sigma the step at a sprite's rim is nothing, and it does not matter who has it.
    let [a, b] = ["path = 'sprites'\ncutoff = 8", "path = 'tiles'\ncutoff = 8"]
        .map(|drawing| draw(desk, drawing, heap(N)));
    let (a, b) = (a?, b?);
    let mut c = Comparison::default();
    for i in 0..WIDTH * 49 {
        // What the opacities' errors can do is bounded by the depth of all of them, which alpha
        // tells where it is not full.
        let tau = -(1.0 - channel(&a, i, 3)).max(1e-7).ln();
        let bound = f64::from(N) * 2f64.powi(-22) + (2e-6 + 64.0 * U_F32) * tau;
        for k in 0..4 {
            c.add(channel(&a, i, k), channel(&b, i, k), bound, || {
                format!("pixel {i}, channel {k}")
            });
        }
    }
    Ok(c.into())
}
