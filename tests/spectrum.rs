//! Spectra of pictures of weather from above: the lattice of a file's cells has no peak, and the
//! power falls with the wave number between its squares and its power of 3.5 (model.md §15).

use std::f64::consts::{PI, TAU};
use std::path::Path;

use nimbus::frame::{DeviceChoice, Stage};
use nimbus::io::scene_file;
use nimbus::model::philox::philox4x32_10;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Pixels of a side.
const SIDE: usize = 800;

/// Power by wave number along x and y, SIDE × SIDE.
struct Spectrum(Vec<f64>);

impl Spectrum {
    /// Returns the sum of the spectra of pictures, each less its mean and in Hann's window.
    fn of(pictures: &[Vec<f64>]) -> Spectrum {
        let window: Vec<f64> =
            (0..SIDE).map(|k| 0.5 - 0.5 * (TAU * k as f64 / SIDE as f64).cos()).collect();
        let fft = FftPlanner::new().plan_fft_forward(SIDE);
        let mut power = vec![0.0; SIDE * SIDE];
        for picture in pictures {
            let at = |k: usize| window[k % SIDE] * window[k / SIDE];
            let weights: f64 = (0..SIDE * SIDE).map(at).sum();
            let mean = picture.iter().enumerate().map(|(k, v)| v * at(k)).sum::<f64>() / weights;
            let mut values: Vec<Complex<f64>> =
                (0..SIDE * SIDE).map(|k| Complex::new((picture[k] - mean) * at(k), 0.0)).collect();
            for _ in 0..2 {
                fft.process(&mut values);
                values = (0..SIDE * SIDE).map(|k| values[k % SIDE * SIDE + k / SIDE]).collect();
            }
            power.iter_mut().zip(&values).for_each(|(sum, v)| *sum += v.norm_sqr());
        }
        Spectrum(power)
    }

    /// Returns the power at a wave number over that at the eight beside it: 1 is no peak. It is the
    /// mean over rows along x and columns along y.
    fn peak(&self, number: usize) -> f64 {
        let row = |k: usize| (0..SIDE).map(|j| self.0[j * SIDE + k]).sum::<f64>();
        let column = |k: usize| self.0[k * SIDE..(k + 1) * SIDE].iter().sum::<f64>();
        // Hann's window widens a line by one on each side.
        let beside = || (2..=5).flat_map(|d| [number - d, number + d]);
        let over = |of: &dyn Fn(usize) -> f64| of(number) * 8.0 / beside().map(of).sum::<f64>();
        0.5 * (over(&row) + over(&column))
    }

    /// Returns the slope of the radial mean of the power over the decade from 8 to 80 periods.
    fn slope(&self) -> f64 {
        let signed = |k: usize| if k < SIDE / 2 { k as f64 } else { k as f64 - SIDE as f64 };
        let (mut sums, mut counts) = (vec![0.0; SIDE], vec![0.0; SIDE]);
        for (k, power) in self.0.iter().enumerate() {
            let radius = signed(k % SIDE).hypot(signed(k / SIDE)).round() as usize;
            sums[radius] += power;
            counts[radius] += 1.0;
        }
        let points: Vec<[f64; 2]> = (8..=80)
            .map(|k| [(k as f64).ln(), (sums[k] / f64::max(counts[k], 1.0)).ln()])
            .collect();
        let n = points.len() as f64;
        let [x, y] = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
        points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum::<f64>()
            / points.iter().map(|p| (p[0] - x).powi(2)).sum::<f64>()
    }
}

/// Draws the luminance of a scene from far above, `width` metres of it around `middle`.
fn from_above(name: &str, middle: [f64; 2], width: f64, overrides: &[String]) -> Vec<f64> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let ([x, z], height) = (middle, 5e6);
    let fov = 2.0 * (0.5 * width / height).atan() * 180.0 / PI;
    let mut all = vec![
        format!("film.width={SIDE}"),
        format!("film.height={SIDE}"),
        "film.format='rgba32f'".to_owned(),
        format!("camera.position=[{x:?},{height:?},{z:?}]"),
        format!("camera.target=[{x:?},0.0,{:?}]", z - 1.0),
        format!("camera.fov_y_deg={fov}"),
    ];
    all.extend_from_slice(overrides);
    let scene = scene_file::load(&path, &all, None).unwrap_or_else(|e| panic!("{e}")).scene;
    let choice = DeviceChoice { validation: true, ..DeviceChoice::default() };
    let mut stage = Stage::new(scene, &choice, true).expect("a stage");
    stage.renderer.step(stage.game.step(0).expect("a packet")).expect("a frame");
    let bytes = stage.renderer.image_bytes().expect("bytes");
    let pixels: &[[f32; 4]] = bytemuck::cast_slice(&bytes);
    let luminance = |p: &[f32; 4]| {
        0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2])
    };
    let found = pixels.iter().map(luminance).collect();
    stage.close().expect("no message");
    found
}

/// The scenes as they are, of four seeds. Measured: peaks of 1.47 and 1.05, slopes of -2.68 and
/// -3.41. With blobs of one width, evenly many in all cells, they were 1.6 and 1.1, -2.8 and -3.9.
#[test]
fn the_lattice_of_a_file_does_not_show() {
    // Widths of a whole number of cells, which Mercator's projection makes 9.115 km in the mean.
    for (name, middle, width, n_cells) in [
        ("katrina.toml", [128e3, -128e3], 16.0 * 9115.0, 16),
        ("supercell.toml", [0.0, 0.0], 40e3, 40),
    ] {
        let measure = |more: &[&str]| {
            let of = |seed: u32| {
                let mut overrides = vec![format!("cloud.0.seed={seed}")];
                overrides.extend(more.iter().map(|text| (*text).to_owned()));
                from_above(name, middle, width, &overrides)
            };
            let spectrum = Spectrum::of(&[1, 2, 3, 4].map(of));
            (spectrum.peak(n_cells), spectrum.slope())
        };
        let (peak, slope) = measure(&[]);
        let (plain_peak, plain_slope) = measure(&["cloud.0.detail=0"]);
        println!(
            "{name}: peak {peak:.2}, slope {slope:.2}; without detail {plain_peak:.2}, \
             {plain_slope:.2}"
        );
        assert!(peak < 1.5, "{name}: {peak}");
        assert!((-3.5..-2.0).contains(&slope), "{name}: {slope}");
    }
}

#[test]
fn spectra_by_hand() {
    let at = |k: usize| [(k % SIDE) as f64 / SIDE as f64, (k / SIDE) as f64 / SIDE as f64];
    // Dots have the same power at all small wave numbers. A wave of 20 periods along x and y, of
    // three hundredths of their height, is a peak.
    let dots = |k: usize| {
        let word = philox4x32_10([1, 2], [k as u32, 0, 0, 0])[0];
        if word.is_multiple_of(1000) { 1.0 } else { 0.0 }
    };
    let wave = |k: usize| at(k).map(|t| (20.0 * TAU * t).sin()).iter().sum::<f64>();
    let of = |share: f64| {
        let picture = (0..SIDE * SIDE).map(|k| dots(k) + share * wave(k)).collect();
        Spectrum::of(&[picture])
    };
    let (plain, waving) = (of(0.0), of(0.03));
    assert!((0.5..1.5).contains(&plain.peak(20)), "{}", plain.peak(20));
    assert!(waving.peak(20) > 2.0 && (0.5..1.5).contains(&waving.peak(30)));
    assert!(plain.slope().abs() < 0.3, "{}", plain.slope());
    // An edge across the picture has a power of k^-2 in each row, and the radial mean has k^-3.
    let disc = |k: usize| {
        let [x, y] = at(k);
        if (x - 0.5).hypot(y - 0.5) < 0.25 { 1.0 } else { 0.0 }
    };
    let slope = Spectrum::of(&[(0..SIDE * SIDE).map(disc).collect()]).slope();
    assert!((-3.3..-2.7).contains(&slope), "{slope}");
}
