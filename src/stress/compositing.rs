//! Compositing of layers: very many, opaque, at equal depths, subnormal, in either order.
//!
//! The opacity of a single layer is taken from the device, so that these cases judge compositing
//! alone.

use glam::DVec3;

use super::case::{Case, Comparison};
use super::context::{DeviceFrame, StressContext};
use super::scenes::{
    HEIGHT, MIDDLE, PATHS, SLICES, SPRITES, TILES, UNLIT, WIDTH, blob, blob_cluster, render_blobs,
};
use crate::error::Result;
use crate::model::cloud::Particle;
use crate::reference::rounding::U_F32;

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "compositing/thin-sprites",
        what: "100 000 layers of opacity 1e-5 as sprites: 1 - (1 - a)^n",
        bound: "2^-23 of the value a layer, as it is blended",
        check: |ctx, c| thin(ctx, c, SPRITES),
    },
    Case {
        name: "compositing/thin-tiles",
        what: "100 000 layers of opacity 1e-5 in tiles: 1 - (1 - a)^n",
        bound: "u of the value a layer, and 4 u",
        check: |ctx, c| thin(ctx, c, TILES),
    },
    Case {
        name: "compositing/thin-slices",
        what: "100 000 layers of opacity 1e-5 by slices: 1 - (1 - a)^n",
        bound: "u of the value a layer, and 32 u",
        check: |ctx, c| thin(ctx, c, SLICES),
    },
    Case {
        name: "compositing/thin-chunks",
        what: "100 000 layers of opacity 1e-5 as sprites, near to far in chunks",
        bound: "2^-23 of the value a layer, as it is blended",
        check: |ctx, c| thin(ctx, c, "path = 'sprites'\nchunks = 4"),
    },
    Case {
        name: "compositing/opaque-sprites",
        what: "a layer of opacity exactly 1, as a sprite: its colour, and nothing behind it",
        bound: "0",
        check: |ctx, c| opaque(ctx, c, SPRITES),
    },
    Case {
        name: "compositing/opaque-tiles",
        what: "a layer of opacity exactly 1, in tiles: its colour, and nothing behind it",
        bound: "0",
        check: |ctx, c| opaque(ctx, c, TILES),
    },
    Case {
        name: "compositing/alternating",
        what: "200 layers, opaque and thin in turn: the nearest opaque layer and the layer before \
            it",
        bound: "2^-23 a visible layer",
        check: alternating,
    },
    Case {
        name: "compositing/equal-depths",
        what: "layers at one depth: drawn in the order of their indices, the last one on top",
        bound: "2^-23 a layer",
        check: equal_depths,
    },
    Case {
        name: "compositing/reversed",
        what: "100 blobs of one colour, listed forwards and backwards: the same picture",
        bound: "2^-22 a layer",
        check: reversed,
    },
    Case {
        name: "compositing/subnormal-opacity",
        what: "1000 layers of subnormal opacity: an almost empty picture",
        bound: "the sum of all opacities and 2^-126 a layer",
        check: subnormal_opacity,
    },
    Case {
        name: "compositing/subnormal-colour",
        what: "layers of subnormal colour: finite values, none above the colour",
        bound: "1e-39 and 2^-126 a layer",
        check: subnormal_colour,
    },
    Case {
        name: "compositing/bright",
        what: "radiances of 1e30 in a 32-bit target: the product, not infinity",
        bound: "2^-22 of it",
        check: bright,
    },
    Case {
        name: "compositing/saturated-half",
        what: "radiances of 1e6 in a 16-bit target that holds 65504 at most, alone and in 50 \
            layers: 65504 but for rounding, a number everywhere",
        bound: "0 in alpha; 32/a + 32 in colour, a = 1 - e^-0.5",
        check: saturated_half,
    },
    Case {
        name: "compositing/paths",
        what: "800 blobs as sprites and in tiles: the same picture",
        bound: "2^-22 a layer, and (2e-6 + 64 u) tau of all",
        check: |ctx, c| {
            const N: u32 = 800;
            // At 8 sigma the discontinuity at a sprite's edge vanishes.
            let [a, b] = PATHS.map(|path| {
                render_blobs(ctx, UNLIT, &format!("{path}\ncutoff = 8"), blob_cluster(N))
            });
            let (a, b) = (a?, b?);
            for i in 0..WIDTH * HEIGHT {
                let bound = two_pictures_bound(a.channel(i, 3), N);
                for k in 0..4 {
                    let at = format_args!("pixel {i}, channel {k}");
                    c.add(a.channel(i, k), b.channel(i, k), bound, at);
                }
            }
            Ok(())
        },
    },
    Case {
        name: "compositing/slices",
        what: "800 blobs by slices and one after the other: the same opacity, and a colour between \
            the blobs'",
        bound: "2^-22 a layer, and (2e-6 + 64 u) tau of all",
        check: slices,
    },
];

/// Returns how far two evaluations of one pixel with `n` layers may be apart. The effect of the
/// opacities' errors is bounded by their total depth, which follows from alpha.
pub(super) fn two_pictures_bound(alpha: f64, n: u32) -> f64 {
    let tau = -(1.0 - alpha).max(1e-7).ln();
    f64::from(n) * 2f64.powi(-22) + (2e-6 + 64.0 * U_F32) * tau
}

fn draw(ctx: &mut StressContext, keys: &str, particles: Vec<Particle>) -> Result<DeviceFrame> {
    render_blobs(ctx, UNLIT, keys, particles)
}

fn thin(ctx: &mut StressContext, c: &mut Comparison, path: &str) -> Result<()> {
    const N: u32 = 100_000;
    let color = DVec3::new(0.75, 0.5, 0.25);
    let layer = Particle { color, ..blob([0.0; 3], 0.5, 1e-5) };
    let one = draw(ctx, path, vec![layer])?;
    let all = draw(ctx, path, vec![layer; N as usize])?;
    let n = f64::from(N);
    for i in 0..WIDTH * HEIGHT {
        // A single layer shows its opacity exactly.
        let a = one.channel(i, 3);
        if a == 0.0 {
            continue;
        }
        let truth = -(n * (-a).ln_1p()).exp_m1();
        // Blending rounds every layer by 2 u of what is written, of which (1 - a) remains: at most
        // 2 u/a of it, and as much again by second orders. Tiles: A + (1 - A) a, whose sum is
        // rounded by u; 1 - A and the product by 2 u of the summand, in total of A.
        // Slices: the sum of n depths is rounded as often. Shares, opacities and the colour's
        // quotient err by some 20 u in the layer alone and in all of them.
        let bound = match path {
            TILES => (U_F32 * n + 4.0 * U_F32) * truth,
            SLICES => (U_F32 * n + 32.0 * U_F32) * truth,
            _ => (2.0 * U_F32 * n).min(4.0 * U_F32 / a) * truth,
        };
        c.add(all.channel(i, 3), truth, bound, format_args!("alpha, opacity {a:e} each"));
        for k in 0..3 {
            let at = format_args!("channel {k}, opacity {a:e} each");
            c.add(all.channel(i, k), color[k] * truth, bound, at);
        }
    }
    Ok(())
}

fn slices(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const N: u32 = 800;
    let particles = blob_cluster(N);
    let colors = || particles.iter().map(|p| p.color);
    let least = colors().fold(DVec3::INFINITY, DVec3::min);
    let most = colors().fold(DVec3::NEG_INFINITY, DVec3::max);
    let [a, b] =
        [TILES, SLICES].map(|way| draw(ctx, &format!("{way}\ncutoff = 8"), particles.clone()));
    let (a, b) = (a?, b?);
    for i in 0..WIDTH * HEIGHT {
        let alpha = b.channel(i, 3);
        let bound = two_pictures_bound(a.channel(i, 3), N);
        c.add(a.channel(i, 3), alpha, bound, format_args!("pixel {i}, opacity"));
        for k in 0..3 {
            let value = b.channel(i, k);
            let allowed = value.clamp(least[k] * alpha, most[k] * alpha);
            c.add(value, allowed, bound, format_args!("pixel {i}, channel {k}"));
        }
    }
    Ok(())
}

fn opaque(ctx: &mut StressContext, c: &mut Comparison, path: &str) -> Result<()> {
    let behind = Particle { color: DVec3::new(7.0, 5.0, 3.0), ..blob([0.0, 0.0, -2.0], 0.5, 3.0) };
    let before = Particle { color: DVec3::new(0.3, 0.6, 0.1), ..blob([0.0; 3], 0.5, 1e5) };
    let frame = draw(ctx, path, vec![behind, before])?;
    c.exact(frame.channel(MIDDLE, 3), 1.0, "alpha in the middle");
    for k in 0..3 {
        let at = format_args!("channel {k} in the middle");
        c.exact(frame.channel(MIDDLE, k), before.color[k] as f32, at);
    }
    c.finite(&frame.rgba, "picture");
    Ok(())
}

fn alternating(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    // From the farthest to the nearest layer; the nearest is thin.
    let layer = |i: u32| {
        let at = [0.0, 0.0, -4.0 + 0.02 * f64::from(i)];
        if i % 2 == 1 {
            Particle { color: DVec3::Y, ..blob(at, 0.5, 0.01) }
        } else {
            Particle { color: DVec3::new(1.0, 0.0, f64::from(i) / 256.0), ..blob(at, 0.5, 1e4) }
        }
    };
    let all: Vec<Particle> = (0..200).map(layer).collect();
    for path in PATHS {
        let thin = draw(ctx, path, vec![all[199]])?.channel(MIDDLE, 3);
        // 32-bit keys have a sign; 16-bit keys count from the farthest particle.
        let frame = draw(ctx, &format!("{path}\nsort_bits = 32"), all.clone())?;
        let last = all[198].color;
        let truth = [(1.0 - thin) * last.x, thin, (1.0 - thin) * last.z, 1.0];
        let values = (0..4).map(|k| frame.channel(MIDDLE, k));
        c.each(values, truth, |_| 2.0 * 2f64.powi(-23), format_args!("{path}, channels"));
    }
    Ok(())
}

fn equal_depths(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let all: Vec<Particle> = (0..30)
        .map(|i| Particle { color: DVec3::AXES[i % 3], ..blob([0.0; 3], 0.5, 0.4) })
        .collect();
    for path in PATHS {
        let a = draw(ctx, path, vec![all[0]])?.channel(MIDDLE, 3);
        let frame = draw(ctx, path, all.clone())?;
        let truth = all.iter().fold(DVec3::ZERO, |below, p| a * p.color + (1.0 - a) * below);
        let values = (0..3).map(|k| frame.channel(MIDDLE, k));
        let bound = |truth: f64| 30.0 * 2f64.powi(-23) * truth.max(a);
        c.each(values, truth.to_array(), bound, format_args!("{path}, channels"));
    }
    Ok(())
}

fn reversed(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const N: u32 = 100;
    // At one depth the order of the list is the order of the layers.
    let forwards: Vec<Particle> = blob_cluster(N)
        .into_iter()
        .map(|p| Particle {
            color: DVec3::new(0.8, 0.6, 0.4),
            position: p.position.with_z(0.0),
            ..p
        })
        .collect();
    let backwards: Vec<Particle> = forwards.iter().rev().copied().collect();
    for path in PATHS {
        let a = draw(ctx, path, forwards.clone())?.rgba;
        let b = draw(ctx, path, backwards.clone())?.rgba;
        c.each(a, b, |b| f64::from(N) * 2f64.powi(-22) * b, format_args!("{path}, picture"));
    }
    Ok(())
}

fn subnormal_opacity(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const TAU: f64 = 1e-41;
    let bound = 1000.0 * (TAU + f64::from(f32::MIN_POSITIVE));
    for path in PATHS {
        let frame = draw(ctx, path, vec![blob([0.0; 3], 0.5, TAU); 1000])?;
        for v in frame.rgba {
            c.add(v, 0.0, bound, format_args!("{path}, value of the picture"));
        }
    }
    Ok(())
}

fn subnormal_colour(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const LIGHT: f64 = 1e-39;
    let bound = LIGHT + 300.0 * f64::from(f32::MIN_POSITIVE);
    let all: Vec<Particle> = blob_cluster(300)
        .into_iter()
        .map(|p| Particle { color: DVec3::splat(LIGHT), ..p })
        .collect();
    for path in PATHS {
        let frame = draw(ctx, path, all.clone())?;
        for i in 0..WIDTH * HEIGHT {
            for k in 0..3 {
                let at = format_args!("{path}, pixel {i}, channel {k}");
                c.add(frame.channel(i, k), 0.0, bound, at);
            }
            let is_alpha = (0.0..=1.0).contains(&frame.channel(i, 3));
            c.holds(is_alpha, format_args!("{path}, alpha of pixel {i} within 0 and 1"));
        }
    }
    Ok(())
}

fn bright(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let light = 1e30f32;
    let layer = Particle { color: DVec3::splat(1e30), ..blob([0.0; 3], 0.5, 0.7) };
    for path in PATHS {
        let frame = draw(ctx, path, vec![layer])?;
        for i in 0..WIDTH * HEIGHT {
            let truth = f64::from(light) * frame.channel(i, 3);
            let at = format_args!("{path}, pixel {i}");
            c.add(frame.channel(i, 0), truth, 2f64.powi(-22) * truth, at);
        }
    }
    Ok(())
}

fn saturated_half(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const MOST: f64 = 65504.0;
    const TAU: f64 = 0.5;
    // The step of 16-bit floats below 65504. A layer of opacity a shrinks the sum's distance d from
    // 65504 by the share a, and rounds by a step at most. So d stays below step/a. The conversion
    // may round toward zero once more.
    const STEP: f64 = 32.0;
    let opaque = |radiance| Particle { color: DVec3::splat(radiance), ..blob([0.0; 3], 0.5, 1e5) };
    // The sum of many thin layers rounds in each.
    let thin = Particle { color: DVec3::splat(1e6), ..blob([0.0; 3], 0.5, TAU) };
    let text = UNLIT.replace("rgba32f", "rgba16f");
    for path in PATHS {
        for (layers, alpha) in [
            (vec![opaque(1e6)], Some(1.0)),
            (vec![opaque(f64::from(f32::MAX))], Some(1.0)),
            ([vec![thin; 50], vec![opaque(1e6)]].concat(), Some(1.0)),
            (vec![thin; 50], None),
        ] {
            let n = layers.len();
            let frame = render_blobs(ctx, &text, path, layers)?;
            if let Some(alpha) = alpha {
                c.exact(frame.channel(MIDDLE, 3), alpha, format_args!("{path}, {n} layers, alpha"));
            }
            let red = frame.channel(MIDDLE, 0);
            let bound = STEP / -(-TAU).exp_m1() + STEP;
            c.add(red, MOST, bound, format_args!("{path}, {n} layers, red"));
            let is_finite = frame.rgba.iter().all(|v| v.is_finite() && f64::from(*v) <= MOST);
            c.holds(is_finite, format_args!("{path}, {n} layers, every value is a number"));
        }
    }
    Ok(())
}
