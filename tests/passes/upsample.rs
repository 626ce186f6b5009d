//! upsample: whole pictures against the f64 reference, in every format, of every remainder of
//! widths and heights, over surfaces with edges of depth and without.

use crate::bounded::{Random, U, greatest_ratio};
use crate::harness::{Gpu, assert_within_and_say};
use nimbus::gpu::{Buffer, Compiler};
use nimbus::gpu::{TargetFormat, has_depth24};
use nimbus::model::resolution::{ALIKE, LowResLayout};
use nimbus::passes::upsample::{Extents, SolidBuffers, Upsample};
use nimbus::reference::upsample::{OpaqueLayer, Summed, render_alike};

const FORMATS: [TargetFormat; 3] =
    [TargetFormat::Rgba8, TargetFormat::Rgba16f, TargetFormat::Rgba32f];

/// Four numbers as a format holds them, four of each of its words in a row.
fn stored(format: TargetFormat, v: [f64; 4]) -> Vec<u32> {
    let half = |x: f64| u32::from(half::f16::from_f64(x).to_bits());
    match format {
        TargetFormat::Rgba8 | TargetFormat::Bgra8 => {
            vec![v.iter().rev().fold(0, |w, x| w << 8 | (255.0 * x).round() as u32)]
        }
        TargetFormat::Rgba16f => vec![half(v[0]) | half(v[1]) << 16, half(v[2]) | half(v[3]) << 16],
        TargetFormat::Rgba32f => v.map(|x| (x as f32).to_bits()).to_vec(),
    }
}

fn numbers(format: TargetFormat, words: &[u32]) -> Vec<f64> {
    let half = |w: u32| half::f16::from_bits(w as u16).to_f64();
    let of = |w: &u32| match format {
        TargetFormat::Rgba8 | TargetFormat::Bgra8 => {
            w.to_le_bytes().map(|b| f64::from(b) / 255.0).to_vec()
        }
        TargetFormat::Rgba16f => vec![half(w & 0xffff), half(w >> 16)],
        TargetFormat::Rgba32f => vec![f64::from(f32::from_bits(*w))],
    };
    words.iter().flat_map(of).collect()
}

/// The rounding that the format adds: faithful, relative above its least normal number,
/// or absolute.
fn roundoff(format: TargetFormat, value: f64) -> f64 {
    match format {
        // Twice half a step.
        TargetFormat::Rgba8 | TargetFormat::Bgra8 => 1.0 / 255.0,
        TargetFormat::Rgba16f => 2f64.powi(-10) * value.abs().max(2f64.powi(-14)),
        TargetFormat::Rgba32f => 2f64.powi(-126),
    }
}

/// A small picture of blobs, and surfaces of one of a few depths in rectangles, their edges
/// anywhere.
struct Case {
    small: LowResLayout,
    format: TargetFormat,
    blobs: Vec<[f64; 4]>,
    surfaces: Option<Surfaces>,
}

struct Surfaces {
    picture: Vec<[f64; 4]>,
    depths: Vec<f64>,
    small_depths: Vec<f64>,
}

impl Case {
    fn new(size: [u32; 2], n: u32, format: TargetFormat, behind: bool, seed: u64) -> Case {
        let small = LowResLayout::of(size, n);
        let mut random = Random(seed);
        let held = |v: [f64; 4]| {
            let v = numbers(format, &stored(format, v));
            [v[0], v[1], v[2], v[3]]
        };
        // Steep enough for the weights below 0 to show, and brighter than 1 where the format allows
        // it.
        let most = if format == TargetFormat::Rgba8 { 1.0 } else { 3.0 };
        let mut color = |most: f64| {
            let a = f64::from(random.within(0.0, 1.0)).powi(3);
            held([most * a, 0.5 * a, f64::from(random.within(0.0, 1.0)), a])
        };
        let blobs = (0..small.n_pixels()).map(|_| color(most)).collect();
        let n_full = u64::from(size[0]) * u64::from(size[1]);
        let picture = (0..n_full).map(|_| color(1.0)).collect();
        let mut random = Random(seed + 1);
        // Slabs in full pixels: [left, right, top, bottom], depth; later ones in front.
        let mut within = |high: f64| f64::from(random.within(-2.0, high + 2.0));
        let slabs: Vec<[f64; 5]> = (0..6)
            .map(|k| {
                let (a, b) = (within(f64::from(size[0])), within(f64::from(size[0])));
                let (c, d) = (within(f64::from(size[1])), within(f64::from(size[1])));
                // Two and two alike, a sixteenth apart.
                let depth = [0.11, 0.115, 0.3, 0.31, 0.75, 0.9][k];
                [a.min(b), a.max(b), c.min(d), c.max(d), depth]
            })
            .collect();
        let depth_at = |x: f64, y: f64| {
            let of = |s: &&[f64; 5]| (s[0]..s[1]).contains(&x) && (s[2]..s[3]).contains(&y);
            slabs.iter().rev().find(of).map_or(0.0, |s| {
                // A slope, so that depths are many.
                f64::from((s[4] * (1.0 + 1e-3 * x / f64::from(size[0]))) as f32)
            })
        };
        let [w, h] = size.map(f64::from);
        let n = f64::from(n);
        let to_full = |k: u32, small: u32, full: f64| {
            (f64::from(k) + 0.5 - 0.5 * f64::from(small)) * n + 0.5 * full
        };
        let [sw, sh] = small.size;
        let small_depths =
            (0..sw * sh).map(|i| depth_at(to_full(i % sw, sw, w), to_full(i / sw, sh, h)));
        let depths = (0..size[0] * size[1])
            .map(|p| depth_at(f64::from(p % size[0]) + 0.5, f64::from(p / size[0]) + 0.5));
        let surfaces =
            Surfaces { picture, depths: depths.collect(), small_depths: small_depths.collect() };
        Case { small, format, blobs, surfaces: behind.then_some(surfaces) }
    }

    fn draw(&self, gpu: &mut Gpu, compiler: Option<&Compiler>) -> Vec<f64> {
        let Case { small, format, .. } = self;
        let extents =
            Extents { full: small.full, small: small.size, offsets: small.offsets(), n: small.n };
        let behind = self.surfaces.is_some();
        let pass = Upsample::new(
            &gpu.device,
            compiler.unwrap_or(&gpu.compiler),
            &extents,
            *format,
            behind,
        );
        let pass = pass.expect("upsample");
        // Texels are whole.
        let upload = |gpu: &mut Gpu, mut words: Vec<u32>| {
            words.resize(words.len().next_multiple_of(4), 0);
            gpu.upload(&words)
        };
        let picture_words =
            |of: &[[f64; 4]]| of.iter().flat_map(|v| stored(*format, *v)).collect::<Vec<u32>>();
        let blobs = upload(gpu, picture_words(&self.blobs));
        let n_words =
            (small.full[0] * small.full[1]) as usize * format.bytes_per_pixel() as usize / 4;
        let picture = upload(gpu, vec![0xffff_ffff; n_words]);
        let is_24 = has_depth24(&gpu.device);
        let depth =
            |d: &f64| if is_24 { (d * 16_777_215.0).round() as u32 } else { (*d as f32).to_bits() };
        let surfaces: Option<[Buffer; 3]> = self.surfaces.as_ref().map(|s| {
            let words =
                [&s.small_depths, &s.depths].map(|d| d.iter().map(depth).collect::<Vec<u32>>());
            let [small_depths, depths] = words.map(|w| upload(gpu, w));
            [upload(gpu, picture_words(&s.picture)), small_depths, depths]
        });
        let surfaces = surfaces.as_ref().map(|s| SolidBuffers {
            under: &s[0],
            small_depths: &s[1],
            depths: &s[2],
        });
        gpu.run(|rec| pass.record(rec, [&blobs, &picture], surfaces));
        numbers(*format, &gpu.download(&picture, n_words))
    }

    /// The picture and its bounds. A depth that is alike to a rounding may be taken either way.
    fn truth(&self) -> (Vec<f64>, Vec<f64>) {
        let under = self.surfaces.as_ref().map(|s| OpaqueLayer {
            picture: &s.picture,
            depths: &s.depths,
            small_depths: &s.small_depths,
        });
        let by = |alike: f64| render_alike(&self.small, &self.blobs, under.as_ref(), alike);
        // A difference of numbers within a factor of two is exact, and so is its comparison with a
        // sixteenth.
        let summed: Vec<Summed> = by(ALIKE);
        // A weight is a product of five differences (exact: t has three bits) and five quotients,
        // each within 5 u; six terms are summed twice; their total divides at most once (5 u), and
        // surfaces come with four roundings.
        const ROUNDINGS: f64 = 2.0 * (5.0 * 6.0 + 1.0 + 6.0) + 5.0 + 4.0;
        let bound = |(v, of_terms): &([f64; 4], [f64; 4])| {
            [0, 1, 2, 3].map(|k| {
                let error = ROUNDINGS * U * (of_terms[k] + U);
                error + roundoff(self.format, v[k].abs() + error)
            })
        };
        let bounds = summed.iter().flat_map(bound).collect();
        // Values outside the format's range are clamped.
        let cut = |v: f64| if self.format == TargetFormat::Rgba8 { v.clamp(0.0, 1.0) } else { v };
        (summed.iter().flat_map(|(v, _)| v.map(cut)).collect(), bounds)
    }

    fn compare(&self, gpu: &mut Gpu) {
        let what = format!(
            "{:?} by {}, {:?}, surfaces {}",
            self.small.full,
            self.small.n,
            self.format,
            self.surfaces.is_some()
        );
        let (truths, bounds) = self.truth();
        assert_within_and_say(&what, &self.draw(gpu, None), &truths, &bounds);
    }
}

#[test]
fn pictures_of_every_remainder() {
    let mut gpu = Gpu::new();
    let sizes = [[1, 1], [2, 3], [37, 26], [40, 17], [51, 8]];
    for (i, (size, n)) in sizes.into_iter().flat_map(|s| [(s, 2), (s, 4)]).enumerate() {
        // Each size in one of the formats over surfaces, in another without.
        for behind in [false, true] {
            Case::new(size, n, FORMATS[(i + usize::from(behind)) % 3], behind, i as u64)
                .compare(&mut gpu);
        }
    }
}

#[test]
fn more_runs_than_a_workgroup_has_and_many_edges() {
    let mut gpu = Gpu::new();
    for n in [2, 4] {
        Case::new([203, 114], n, TargetFormat::Rgba32f, true, 5).compare(&mut gpu);
        Case::new([200, 114], n, TargetFormat::Rgba16f, true, 6).compare(&mut gpu);
    }
}

#[test]
fn wrong_shaders_are_noticed() {
    let mut gpu = Gpu::new();
    let case = Case::new([90, 61], 4, TargetFormat::Rgba32f, true, 3);
    let (truths, bounds) = case.truth();
    assert!(greatest_ratio(&case.draw(&mut gpu, None), &truths, &bounds) <= 1.0);
    let (upsample, include) = ("upsample.comp", "include/upsample.glsl");
    for (file, from, to) in [
        (include, "2.0 + t - float(m)", "2.01 + t - float(m)"),
        (include, "max(sum.xyz, 0.0)", "sum.xyz"),
        (include, "clamp(sum.w, 0.0, 1.0)", "sum.w"),
        (include, "ALIKE = 0.0625", "ALIKE = 0.5"),
        (include, "six && by == 0.0", "six"),
        (include, "four && (by == 0.0 || !inner)", "four"),
        (include, "alike ? wx", "true ? wx"),
        (include, "by == least && far < closest", "false"),
        (include, "total > 0.0 ? sum / total : nearest", "sum / total"),
        (include, "* (-1.0 / 6.0)", "* (1.0 / 6.0)"),
        (upsample, "OFFSET_X + 2 * (i + m)", "OFFSET_X + 2 * (i + m) + 1"),
        (upsample, "most - least <= ALIKE * most", "true"),
    ] {
        let compiler = Gpu::wrong_compiler(file, from, to);
        let values = case.draw(&mut gpu, Some(&compiler));
        assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "{from} as {to}");
    }
}
