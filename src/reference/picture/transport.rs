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
use crate::error::Result;
use crate::model::light::Light;
use crate::model::material::Brdf;
use crate::model::medium::Medium;
use crate::model::parallel::parallel_map;
use crate::model::scene::Scene;
use crate::model::sky::Sky;
use crate::model::surface::Surface;
use crate::reference::Blob;
use crate::reference::transport::{
    BlobMedium, Lights, PathLight, Ray, Scatterer, Solids, Stream, TransportScene,
};
use crate::reference::view::View;
use crate::reference::{place, terrain};

/// Pixels of one piece of work.
const PIXELS_A_JOB: usize = 64;

/// The blobs, surfaces, ground, lights and view of a scene, relative to the lighting origin.
#[derive(Debug, Clone)]
pub struct TransportParts {
    /// The camera's view.
    pub view: View,
    /// Blobs.
    pub blobs: Vec<Blob>,
    /// Index of each blob's scattering in `scatterers`.
    pub i_scatterer: Vec<u32>,
    /// The different scatterings.
    pub scatterers: Vec<Scatterer>,
    /// Rectangles: corner and sides, and the index of the material. The front faces u × v.
    pub rectangles: Vec<([DVec3; 3], u32)>,
    /// The ground's triangles, alike.
    pub triangles: Vec<([DVec3; 3], u32)>,
    /// Materials of rectangles and ground.
    pub brdfs: Vec<Brdf>,
    /// Lights.
    pub lights: Vec<Light>,
    /// Clear sky that they belong to.
    pub sky: Option<Sky>,
    /// Angular radius of directional lights, radians.
    pub sun_radius: f64,
}

impl TransportParts {
    /// Takes the scene's blobs, surfaces, ground and lights at `time_s`.
    ///
    /// # Errors
    /// The camera has no direction at that time, or an animation cannot be read.
    pub fn new(scene: &Scene, time_s: f64) -> Result<TransportParts> {
        Ok(TransportParts::of_frame(scene, &FrameReference::unlit(scene, time_s)?))
    }

    fn of_frame(scene: &Scene, frame: &FrameReference) -> TransportParts {
        let local = LocalScene::new(scene, frame.state.light_origin, frame.state.time_s);
        let (i_scatterer, scatterers) = scatterers(scene, frame);
        let mut brdfs = local.solid_brdfs().to_vec();
        let [rectangles, triangles] = flats(scene, &local, &mut brdfs);
        TransportParts {
            view: view(scene, frame),
            blobs: frame.blobs.clone(),
            i_scatterer,
            scatterers,
            rectangles,
            triangles,
            brdfs,
            lights: local.lights,
            sky: scene.sky,
            sun_radius: scene.lighting.sun_radius,
        }
    }
}

/// A scene as light sees it, and the view.
pub(super) struct TransportPicture {
    of: TransportScene<BlobMedium>,
    view: View,
}

impl TransportPicture {
    /// Takes the scene's blobs, surfaces, ground and lights.
    pub fn new(scene: &Scene, frame: &FrameReference) -> TransportPicture {
        let parts = TransportParts::of_frame(scene, frame);
        let of = TransportScene {
            medium: BlobMedium::new(&parts.blobs, &parts.i_scatterer, parts.scatterers),
            solids: Solids::new(&parts.rectangles, &parts.triangles, parts.brdfs),
            lights: Lights::new(&parts.lights, parts.sun_radius).under(parts.sky),
        };
        TransportPicture { of, view: parts.view }
    }

    /// Traces one path through each pixel.
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

    /// Traces the path of one sample through pixel [column, row]; `number` tells pixels apart.
    pub fn path(&self, [i, j]: [u32; 2], number: u32, sample: PixelSample) -> PathLight {
        let view = View { shift: sample.shift, ..self.view };
        let ray = view.ray(i, j);
        let origin = view.pose.position + view.near * ray;
        let ray = Ray { origin, direction: ray.normalize() };
        self.of.trace(ray, &mut Stream::new(number, sample.i))
    }
}

/// Returns the scattering of each blob, by its cloud's material and its own colour, as an index
/// into the list of all.
fn scatterers(scene: &Scene, frame: &FrameReference) -> (Vec<u32>, Vec<Scatterer>) {
    let forward = scene.lighting.forward;
    let (mut scatterers, mut numbers) = (Vec::new(), HashMap::new());
    let mut i_scatterer = Vec::with_capacity(frame.blobs.len());
    for (i_cloud, color) in place::regions(&frame.groups).into_iter().zip(&frame.colors) {
        let key = (i_cloud, color.to_array().map(f64::to_bits));
        let number = *numbers.entry(key).or_insert_with(|| {
            let material = &scene.materials[scene.clouds[i_cloud as usize].i_material];
            let medium = Medium::new(material, frame.state.time_s, forward);
            scatterers.push(Scatterer { albedo: medium.albedo(*color), phase: medium.phase });
            scatterers.len() as u32 - 1
        });
        i_scatterer.push(number);
    }
    (i_scatterer, scatterers)
}

/// A corner and two sides, and the index of a material.
type Flat = ([DVec3; 3], u32);

/// Returns the rectangles, and the ground's triangles. Each triangle of coloured ground gets a
/// material with the mean colour of its corners, which is added to `brdfs`.
fn flats(scene: &Scene, local: &LocalScene, brdfs: &mut Vec<Brdf>) -> [Vec<Flat>; 2] {
    let rectangle = |(s, i): (&Surface, u32)| ([s.center - s.u - s.v, 2.0 * s.u, 2.0 * s.v], i);
    let rectangles = local.surfaces.iter().zip(0u32..).map(rectangle).collect();
    let of_ground = scene.terrains.iter().zip(scene.surfaces.len() as u32..);
    let mut triangles = Vec::new();
    for (terrain, i) in of_ground {
        for (points, color) in terrain::triangles(terrain).zip(terrain::colors(terrain)) {
            let [corner, u, v] = points.map(|p| p - local.origin);
            let mut i_brdf = i;
            if !terrain.colors.is_empty() {
                let plain = brdfs[i as usize];
                i_brdf = brdfs.len() as u32;
                brdfs.push(Brdf { kd: plain.kd * color, ..plain });
            }
            triangles.push(([corner, u - corner, v - corner], i_brdf));
        }
    }
    [rectangles, triangles]
}
