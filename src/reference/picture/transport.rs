//! Pictures by radiative transfer (transport.md), sample by sample.

use std::collections::HashMap;

use glam::DVec3;

use super::background::view;
use super::error_estimate::ErrorEstimate;
use super::frame::FrameReference;
use super::local_scene::LocalScene;
use super::pixels::Pixels;
use super::progress::{OnProgress, RenderStage};
use super::scene_light::{PixelSample, RenderedPixels};
use crate::model::scene::Scene;
use crate::reference::parallel::parallel_map;
use crate::reference::transport::{
    BlobMedium, Lights, PathLight, Ray, Scatterer, Solids, Stream, TransportScene,
};
use crate::reference::view::View;
use crate::reference::{place, terrain};

/// Pixels of one piece of work.
const PIXELS_A_JOB: usize = 64;

/// A scene as light sees it, and the view.
pub(super) struct TransportPicture {
    of: TransportScene<BlobMedium>,
    view: View,
}

impl TransportPicture {
    /// Takes the scene's blobs, surfaces, ground and lights.
    pub fn new(scene: &Scene, frame: &FrameReference) -> TransportPicture {
        let local = LocalScene::new(scene, frame.state.light_origin, frame.state.time_s);
        let lights = Lights::new(&local.lights, scene.lighting.sun_radius);
        let of =
            TransportScene { medium: medium(scene, frame), solids: solids(scene, &local), lights };
        TransportPicture { of, view: view(scene, frame) }
    }

    /// Follows one path through each pixel.
    pub fn draw(
        &self,
        pixels: &Pixels,
        sample: PixelSample,
        on_progress: OnProgress,
    ) -> RenderedPixels {
        let n = pixels.at.len();
        let n_jobs = n.div_ceil(PIXELS_A_JOB);
        let of_jobs = parallel_map(n_jobs, |job| {
            let range = job * PIXELS_A_JOB..n.min((job + 1) * PIXELS_A_JOB);
            let found: Vec<[f64; 4]> = range.map(|k| self.pixel(pixels, k, sample)).collect();
            on_progress(RenderStage::Drawing, n_jobs);
            found
        });
        let rgba = of_jobs.concat();
        // The spread of several samples tells their error. Of one alone nothing is known.
        let chance = |v: &[f64; 4]| if sample.i == 0 { v[0].max(v[1]).max(v[2]) } else { 0.0 };
        let errors = rgba.iter().map(|v| ErrorEstimate { quadrature: 0.0, chance: chance(v) });
        RenderedPixels { errors: errors.collect(), rgba }
    }

    fn pixel(&self, pixels: &Pixels, k: usize, sample: PixelSample) -> [f64; 4] {
        let light = self.path(pixels.at[k], pixels.number(k) as u32, sample);
        light.radiance().extend(light.alpha).to_array()
    }

    /// Follows the path of one sample through pixel [column, row]; `number` tells pixels apart.
    fn path(&self, [i, j]: [u32; 2], number: u32, sample: PixelSample) -> PathLight {
        let view = View { shift: sample.shift, ..self.view };
        let ray = view.ray(i, j);
        let origin = view.pose.position + view.near * ray;
        let ray = Ray { origin, direction: ray.normalize() };
        self.of.follow(ray, &mut Stream::new(number, sample.i))
    }
}

/// Returns the blobs with what scatters in them: their cloud's material, in their own colour.
fn medium(scene: &Scene, frame: &FrameReference) -> BlobMedium {
    let forward = scene.lighting.forward;
    let (mut scatterers, mut numbers) = (Vec::new(), HashMap::new());
    let mut i_scatterer = Vec::with_capacity(frame.blobs.len());
    for (i_cloud, color) in place::regions(&frame.groups).into_iter().zip(&frame.colors) {
        let i_cloud = i_cloud as usize;
        let key = (i_cloud, color.to_array().map(f64::to_bits));
        let number = *numbers.entry(key).or_insert_with(|| {
            let material = &scene.materials[scene.clouds[i_cloud].i_material];
            let kd = material.at(frame.state.time_s).kd * *color;
            let (albedo, phase) = material.scattering.of(kd, forward);
            // A given albedo is that of white particles.
            let albedo = match material.scattering.albedo {
                Some(_) => (albedo * *color).min(DVec3::ONE),
                None => albedo,
            };
            scatterers.push(Scatterer { albedo, phase });
            scatterers.len() as u32 - 1
        });
        i_scatterer.push(number);
    }
    BlobMedium::new(&frame.blobs, &i_scatterer, scatterers)
}

fn solids(scene: &Scene, local: &LocalScene) -> Solids {
    let rectangles: Vec<_> = local
        .surfaces
        .iter()
        .enumerate()
        .map(|(i, s)| ([s.center - s.u - s.v, 2.0 * s.u, 2.0 * s.v], i as u32))
        .collect();
    let n_surfaces = scene.surfaces.len();
    let origin = local.origin;
    let triangles: Vec<_> = scene
        .terrains
        .iter()
        .enumerate()
        .flat_map(|(i, t)| {
            let of = move |p: [DVec3; 3]| {
                let [corner, u, v] = p.map(|p| p - origin);
                ([corner, u - corner, v - corner], (n_surfaces + i) as u32)
            };
            terrain::triangles(t).map(of)
        })
        .collect();
    Solids::new(&rectangles, &triangles, local.solid_brdfs().to_vec())
}
