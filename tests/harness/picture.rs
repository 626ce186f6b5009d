//! A picture of sprites, its inputs in f32 for the GPU and in f64 for the reference, and the bound between the two.

#![allow(dead_code, reason = "each test binary uses its own part")]

use glam::DVec3;
use half::f16;
use nimbus::gpu::memory::TargetFormat;
use nimbus::gpu::{Buffer, Compiler, Image, Place};
use nimbus::layout::facet::LitRecord;
use nimbus::layout::frame::CameraRecord;
use nimbus::layout::particle::{ParticleRecord, PlacedRecord};
use nimbus::model::camera::{Camera, CameraKey};
use nimbus::model::cloud::SQRT_TAU;
use nimbus::model::film::{Film, FilmFormat, ToneMap};
use nimbus::passes::sprites::Sprites;
use nimbus::reference::Blob;
use nimbus::reference::sort::{depths, key32, order};
use nimbus::reference::sprites::{Rounding, View, alpha, render_with_bound};

use crate::bounded::{Bounded, U, dot, exact3};
use crate::harness::Gpu;

/// What one_minus_exp promises.
const ONE_MINUS_EXP: f64 = 1e-6;

pub const FORMATS: [(TargetFormat, FilmFormat); 2] =
    [(TargetFormat::Rgba16f, FilmFormat::Rgba16f), (TargetFormat::Rgba32f, FilmFormat::Rgba32f)];

#[derive(Debug, Clone)]
pub struct Picture {
    pub camera: Camera,
    pub view: View,
    pub placed: Vec<PlacedRecord>,
    pub particles: Vec<ParticleRecord>,
    /// Radiance of the particles' facets; without it they are drawn in their own colours.
    pub lit: Option<Vec<LitRecord>>,
    /// Facet of each particle, where they do not follow `i_first_facet` in the particles' order.
    pub i_facet: Option<Vec<u32>>,
    pub i_first_facet: u32,
}

fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

impl Picture {
    pub fn new(eye: DVec3, target: DVec3, fov_y_deg: f64, near: f64) -> Picture {
        let keys = vec![CameraKey { time_s: 0.0, position: eye, target }];
        let camera = Camera { keys, up: DVec3::Y, fov_y_rad: fov_y_deg.to_radians(), near };
        let pose = camera.pose(0.0).expect("a pose");
        let view = View { width: 160, height: 120, pose, fov_y_rad: camera.fov_y_rad, near, cutoff: 3.0 };
        Picture { camera, view, placed: vec![], particles: vec![], lit: None, i_facet: None, i_first_facet: 0 }
    }

    /// A blob whose τ through the centre is `tau`.
    pub fn blob(mut self, position: DVec3, sigma: f64, tau: f64) -> Picture {
        let kappa = if sigma > 0.0 { (tau / (SQRT_TAU * sigma)) as f32 } else { 1.0 };
        let shade = 0.5 + 0.4 * (self.placed.len() as f32).sin();
        self.placed.push(PlacedRecord { position: position.as_vec3().to_array(), sigma: sigma as f32 });
        let color = [1.0, shade, 1.5 - shade];
        self.particles.push(ParticleRecord { position: [0.0; 3], sigma: sigma as f32, color, kappa });
        self
    }

    /// The eye's offset `x` right, `y` up, `z` forward in the scene.
    pub fn at(&self, x: f64, y: f64, z: f64) -> DVec3 {
        let p = &self.view.pose;
        p.position + x * p.right + y * p.up + z * p.forward
    }

    fn blobs(&self) -> Vec<Blob> {
        let blob = |(p, q): (&PlacedRecord, &ParticleRecord)| Blob {
            position: double(p.position),
            sigma: f64::from(p.sigma),
            kappa: f64::from(q.kappa),
        };
        self.placed.iter().zip(&self.particles).map(blob).collect()
    }

    fn radiance(&self) -> Vec<DVec3> {
        match &self.lit {
            // Their f32 sum is rounded alike on both sides.
            Some(lit) => {
                let plain = || (self.i_first_facet..).take(self.placed.len()).collect();
                let facets: Vec<u32> = self.i_facet.clone().unwrap_or_else(plain);
                let of = |l: &LitRecord| double([0, 1, 2].map(|i| l.first[i] + l.second[i]));
                facets.iter().map(|i| of(&lit[*i as usize])).collect()
            }
            None => self.particles.iter().map(|p| double(p.color)).collect(),
        }
    }

    fn order(&self) -> Vec<u32> {
        let positions: Vec<DVec3> = self.placed.iter().map(|p| double(p.position)).collect();
        let keys = depths(self.view.pose.forward, &positions).into_iter().map(|z| key32(z as f32));
        order(&keys.collect::<Vec<_>>())
    }

    /// Four numbers a pixel from the GPU.
    pub fn draw(&self, gpu: &mut Gpu, compiler: Option<&Compiler>, format: TargetFormat) -> Vec<f64> {
        let lit = self.lit.is_some();
        let pass = Sprites::new(&gpu.device, compiler.unwrap_or(&gpu.compiler), format, lit, self.i_facet.is_some())
            .expect("sprites");
        let entries: Vec<[u32; 2]> = self.order().into_iter().map(|i| [0, i]).collect();
        let buffers = [
            gpu.upload(&entries),
            gpu.upload(&self.placed),
            gpu.upload(&self.particles),
            gpu.upload(self.lit.as_deref().unwrap_or(&[])),
            gpu.upload(self.i_facet.as_deref().unwrap_or(&[])),
        ];
        let (width, height) = (self.view.width, self.view.height);
        let mut target = Image::color_target(&gpu.device, "test.target", width, height, format).expect("a target");
        let film = Film {
            width,
            height,
            format: FilmFormat::Rgba16f,
            background: DVec3::ZERO,
            exposure: 1.0,
            tone_map: ToneMap::Clip,
        };
        let camera = CameraRecord::new(&self.camera, &self.view.pose, &film, DVec3::ZERO);
        let n_numbers = 4 * target.n_pixels() as usize;
        let bytes = target.n_pixels() * format.bytes_per_pixel();
        let readback = Buffer::new::<u8>(&gpu.device, "test.pixels", bytes, Place::Readback).expect("readback");
        gpu.run(|rec| {
            let n = entries.len() as u32;
            pass.record(rec, buffers.each_ref(), &mut target, &camera, self.view.cutoff, n, self.i_first_facet)?;
            rec.copy_image(&mut target, &readback);
            Ok(())
        });
        match format {
            TargetFormat::Rgba16f => {
                readback.read::<f16>(n_numbers).expect("read").iter().map(|v| v.to_f64()).collect()
            }
            TargetFormat::Rgba32f => {
                readback.read::<f32>(n_numbers).expect("read").into_iter().map(f64::from).collect()
            }
        }
    }

    /// The reference's picture and its bound for `format`.
    pub fn truth(&self, format: FilmFormat) -> (Vec<f64>, Vec<f64>) {
        let rounding = self.rounding(format);
        let (value, bound) = render_with_bound(&self.view, &self.blobs(), &self.radiance(), &self.order(), &rounding);
        (value.concat(), bound.concat())
    }

    /// How the shaders' α and edges may be off: the worst of all pixels in all blobs, each by a running bound.
    pub fn rounding(&self, format: FilmFormat) -> Rounding {
        let (mut off_alpha, mut edge) = (ONE_MINUS_EXP, 8.0 * U);
        for (blob, placed) in self.blobs().iter().zip(&self.placed) {
            let c = blob.position - self.view.pose.position;
            if !(c.dot(self.view.pose.forward) >= self.view.near && blob.sigma > 0.0 && blob.kappa > 0.0) {
                continue;
            }
            let sprite = self.sprite(placed, blob);
            let cut = self.view.cutoff * blob.sigma;
            for j in 0..self.view.height {
                for i in 0..self.view.width {
                    let d = self.view.ray(i, j);
                    let b = c.cross(d).length() / d.length();
                    if b > 1.1 * cut {
                        continue;
                    }
                    let e = sprite.exponent(self.ray(i, j));
                    // The cut: e <= cutoff²/2, three roundings; b ∝ √e.
                    if b > 0.9 * cut {
                        edge = edge.max(0.51 * e.error / e.value + 4.0 * U);
                    }
                    let true_alpha = alpha(blob, b);
                    let t = sprite.tau.times(e.scaled(-1.0).exp());
                    // d(1 − e^{−t})/dt = e^{−t}.
                    let off = (-(t.value - t.error)).exp() * t.error + ONE_MINUS_EXP * true_alpha;
                    off_alpha = off_alpha.max(off / true_alpha);
                }
            }
        }
        let mut rounding = Rounding::of(format, off_alpha, edge);
        // Beside the store into the target there are three f32 roundings: α·L, (1 − α)·C and their sum.
        rounding.unit += 1.5 * U;
        rounding
    }

    fn half_slopes(&self) -> [Bounded; 2] {
        let tan = (0.5 * self.view.fov_y_rad).tan();
        let aspect = f64::from(self.view.width) / f64::from(self.view.height);
        [Bounded::once(tan * aspect), Bounded::once(tan)]
    }

    fn ray(&self, i: u32, j: u32) -> [Bounded; 2] {
        let [x, y] = self.half_slopes();
        let along = |at: u32, tan: Bounded, n: u32| {
            let pixel = tan.scaled(2.0).over(Bounded::exact(f64::from(n)));
            Bounded::exact(f64::from(at) + 0.5).times(pixel)
        };
        [along(i, x, self.view.width).minus(x), y.minus(along(j, y, self.view.height))]
    }

    fn sprite(&self, placed: &PlacedRecord, blob: &Blob) -> Sprite {
        let pose = &self.view.pose;
        let once = |v: DVec3| v.to_array().map(Bounded::once);
        let (eye, p) = (once(pose.position), exact3(placed.position));
        let c = [0, 1, 2].map(|i| p[i].minus(eye[i]));
        let z = dot(once(pose.forward), c);
        let slope = |axis: DVec3| dot(once(axis), c).over(z);
        let z_sigmas = z.over(Bounded::exact(blob.sigma));
        Sprite {
            s: [slope(pose.right), slope(pose.up)],
            z: z_sigmas.squared().scaled(0.5),
            tau: Bounded::once(SQRT_TAU).times(Bounded::exact(blob.kappa)).times(Bounded::exact(blob.sigma)),
        }
    }
}

/// What the vertex shader hands on.
struct Sprite {
    s: [Bounded; 2],
    z: Bounded,
    tau: Bounded,
}

impl Sprite {
    /// b²/2σ² as the fragment shader evaluates it.
    fn exponent(&self, ray: [Bounded; 2]) -> Bounded {
        let d = [ray[0].minus(self.s[0]), ray[1].minus(self.s[1])];
        let twist = self.s[0].times(d[1]).minus(self.s[1].times(d[0]));
        let above = d[0].squared().plus(d[1].squared()).plus(twist.squared());
        let below = Bounded::exact(1.0).plus(ray[0].squared().plus(ray[1].squared()));
        self.z.times(above).over(below)
    }
}
