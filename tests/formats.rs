//! Accumulated rounding and banding of 10 000 thin layers in every target format. The reference is
//! 1 − (1 − a)^n for every pixel. A format of few bits stalls when a layer changes the value by
//! less than the format resolves.

#[path = "harness/bounded.rs"]
mod bounded;
mod harness;
#[path = "harness/picture.rs"]
mod picture;
#[path = "harness/scenery.rs"]
mod scenery;
#[path = "harness/sheets.rs"]
mod sheets;

use std::collections::BTreeSet;

use glam::DVec3;
use half::f16;
use harness::Gpu;
use nimbus::gpu::TargetFormat;
use nimbus::model::film::FilmFormat;
use picture::{FORMATS, Picture};

const N_LAYERS: i32 = 10_000;
/// Optical depth through a layer's centre.
const THIN: [f64; 2] = [1e-3, 1e-4];
/// Radiance of the red channel; alpha is 1.
const RED: f64 = 0.75;

/// Returns `n` coincident blobs whose largest α is about `tau`.
fn layers(n: i32, tau: f64) -> Picture {
    let mut picture = Picture::new(DVec3::Z * 5.0, DVec3::ZERO, 45.0, 0.1);
    (picture.view.width, picture.view.height) = (80, 60);
    let at = picture.at(0.0, 0.0, 5.0);
    for _ in 0..n {
        picture = picture.blob(at, 0.4, tau);
    }
    picture.particles.iter_mut().for_each(|p| p.color = [RED as f32, 0.5, 0.25]);
    picture
}

/// Returns α of one layer in every pixel.
fn one_layer(tau: f64) -> Vec<f64> {
    layers(1, tau).truth(FilmFormat::Rgba32f).0.into_iter().skip(3).step_by(4).collect()
}

/// Returns 1 − (1 − a)^n.
fn law(a: f64) -> f64 {
    -libm::expm1(f64::from(N_LAYERS) * libm::log1p(-a))
}

fn channel(values: &[f64], k: usize) -> Vec<f64> {
    values.iter().skip(k).step_by(4).copied().collect()
}

/// Returns the distance from `c` to the next larger half-precision number.
fn ulp(c: f16) -> f64 {
    f16::from_bits(c.to_bits() + 1).to_f64() - c.to_f64()
}

/// Returns the smallest half-precision number that another layer raises by less than `share` of the
/// distance to the next number: α (L − C) < share ulp(C).
fn stall(alpha: f64, light: f64, share: f64) -> f64 {
    let numbers = (0..=f16::from_f64(light).to_bits()).map(f16::from_bits);
    let stalled = numbers.into_iter().find(|c| alpha * (light - c.to_f64()) < share * ulp(*c));
    stalled.map_or(light, f16::to_f64)
}

#[test]
fn reference_equals_the_closed_form() {
    for tau in THIN {
        let (values, _) = layers(N_LAYERS, tau).truth(FilmFormat::Rgba32f);
        let (alphas, reds) = (channel(&values, 3), channel(&values, 0));
        for ((a, red), one) in alphas.iter().zip(&reds).zip(one_layer(tau)) {
            // 10 000 roundings of 2⁻⁵³.
            assert!((a - law(one)).abs() < 2e-12 && (red - RED * law(one)).abs() < 2e-12);
        }
    }
}

#[test]
fn rgba32f_accumulates_every_layer() {
    let mut gpu = Gpu::new();
    for tau in THIN {
        let picture = layers(N_LAYERS, tau);
        let values = channel(&picture.draw(&mut gpu, None, TargetFormat::Rgba32f), 3);
        // A layer errs by 2⁻²³ of the written value and by the error of its α; earlier errors are
        // multiplied by 1 − α. Thus n layers err by at most n 2⁻²³, and by the relative error of α
        // times n α (1 − C).
        let off = layers(1, tau).rounding(FilmFormat::Rgba32f).alpha;
        for (value, a) in values.iter().zip(one_layer(tau)) {
            let (n, truth) = (f64::from(N_LAYERS), law(a));
            let bound =
                (n * 2f64.powi(-23)).min(2f64.powi(-22) / a) * truth + off * n * a * (1.0 - truth);
            assert!((value - truth).abs() <= bound, "{value} {truth} {bound:e}");
        }
        assert!(values.iter().any(|v| (v - law(tau)).abs() < 0.01), "it is drawn");
    }
}

/// With correct rounding C stalls at α (L − C) < ½ ulp, with rounding toward zero below a whole
/// ulp; devices lie between. Before the stall every layer raises C by at least an ulp.
#[test]
fn rgba16f_stalls_when_a_layer_is_below_half_an_ulp() {
    let mut gpu = Gpu::new();
    // The relative error of α and of blending in f32 is smaller than this.
    const BRINK: f64 = 1e-4;
    for tau in THIN {
        let values = layers(N_LAYERS, tau).draw(&mut gpu, None, TargetFormat::Rgba16f);
        let (mut n_stalled, mut n_at_half, mut most) = (0, 0, 0f64);
        for (light, k) in [(1.0, 3), (RED, 0)] {
            for (value, a) in
                channel(&values, k).into_iter().zip(one_layer(tau)).filter(|(_, a)| *a > 0.0)
            {
                let [low, high] = [1.0 + BRINK, 0.5 - BRINK].map(|share| stall(a, light, share));
                let truth = light * law(a);
                // With half an ulp gained per layer, C may reach the stall before the exact value
                // does.
                assert!(value <= high, "{value} above {high} (a = {a:e}, L = {light})");
                if truth > high {
                    assert!(value >= low, "{value} below {low} (a = {a:e}, L = {light})");
                    n_stalled += 1;
                    n_at_half += usize::from(value >= stall(a, light, 0.5 + BRINK));
                    most = most.max(truth - value);
                }
            }
        }
        println!(
            "τ = {tau:e}: {n_stalled} values stalled, {n_at_half} at half an ulp, off by up \
             to {most:.3}"
        );
        assert!(n_stalled > 1000 && most > 0.2, "the scene shows it");
    }
    // By hand: at α = 10⁻³ and L = 1, numbers from ½ on are 2⁻¹¹ apart, and 1 − C < 2⁻¹²/10⁻³ holds
    // from 0.75586 on, whose next number is 0.756347…; at 10⁻⁴ a layer is below half of 2⁻¹² from ¼
    // on.
    assert_eq!((stall(1e-3, 1.0, 0.5), stall(1e-4, 1.0, 0.5)), (1549.0 / 2048.0, 0.25));
}

#[test]
fn rgba8_drops_layers_below_half_a_step() {
    let mut gpu = Gpu::new();
    for tau in THIN {
        // α L < 1/510 is rounded to 0, the initial value.
        let values = layers(N_LAYERS, tau).draw(&mut gpu, None, TargetFormat::Rgba8);
        assert!(values.iter().all(|v| *v == 0.0));
    }
    // A slightly thicker layer is drawn.
    assert!(layers(4, 3e-3).draw(&mut gpu, None, TargetFormat::Rgba8).iter().any(|v| *v > 0.0));
}

/// Prints the table of docs/explanation/performance.md: `cargo test --release --test formats table
/// -- --nocapture`.
#[test]
fn table_of_formats() {
    let mut gpu = Gpu::new();
    println!("| α | format | RMS | greatest | levels |");
    for tau in [1e-1, 4e-3, 1e-3, 1e-4] {
        let truth: Vec<f64> = one_layer(tau).into_iter().map(law).collect();
        let covered: Vec<usize> = (0..truth.len()).filter(|i| truth[*i] > 0.0).collect();
        // Mirrored pixels differ in their last bits. Levels are distinguished at 10⁻¹², far below
        // the spacing of the formats.
        let level = |v: f64| (v * 1e12).round() as u64;
        let levels = |values: &[f64]| {
            covered.iter().map(|i| level(values[*i])).collect::<BTreeSet<u64>>().len()
        };
        println!("| {tau:e} | truth, {} pixels | | | {} |", covered.len(), levels(&truth));
        let (mut worst, mut bands) = (Vec::new(), Vec::new());
        for (target, format) in FORMATS {
            let values = channel(&layers(N_LAYERS, tau).draw(&mut gpu, None, target), 3);
            let off = |i: &usize| (values[*i] - truth[*i]).abs();
            let rms = (covered.iter().map(|i| off(i) * off(i)).sum::<f64>() / covered.len() as f64)
                .sqrt();
            let greatest = covered.iter().map(off).fold(0.0, f64::max);
            println!("| | {format:?} | {rms:.2e} | {greatest:.2e} | {} |", levels(&values));
            worst.push(greatest);
            bands.push(levels(&values));
        }
        // For thin layers eight bits are worse than 32 by orders of magnitude.
        assert!(worst[2] < 1e-2 * worst[1] && worst[1] <= worst[0], "{worst:?}");
        // If layers are below an ulp of the picture's values, bands appear.
        assert!(bands[0] < bands[1] && (tau > 1e-3 || 3 * bands[1] < bands[2]), "{bands:?}");
    }
}
