//! A view whose error is measured, and the reference picture of it.

use std::sync::Arc;

use glam::DVec3;

use crate::model::camera::{Camera, CameraKey};
use crate::model::film::Film;
use crate::model::scene::Scene;
use crate::reference::picture::{Pixels, Reference, ReferenceKind};
use crate::studies::picture_error::{PictureError, picture_error};
use crate::studies::reference_hash;

/// A view of a scene, and the kind of reference that measures it.
#[derive(Debug, Clone)]
pub struct ProbeRequest {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Position of the camera, in place of the scene's own.
    pub position: DVec3,
    /// Point that the camera looks at.
    pub target: DVec3,
    /// Time of the scene, s.
    pub time_s: f64,
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    /// Kind of the reference.
    pub kind: ReferenceKind,
}

impl ProbeRequest {
    /// Returns the reference that suits `scene`: the integral over its particles, or thin sprites
    /// where a cloud is textured.
    pub fn kind_for(scene: &Scene) -> ReferenceKind {
        if scene.clouds.iter().any(|c| !c.texture.is_none()) {
            ReferenceKind::Thin
        } else {
            ReferenceKind::Volume
        }
    }

    /// Returns the scene with this request's camera and size.
    pub fn exact_scene(&self) -> Scene {
        let [width, height] = self.size;
        let key = CameraKey { time_s: 0.0, position: self.position, target: self.target };
        let camera = Camera { keys: vec![key], ..self.scene.camera };
        Scene { camera, film: Film { width, height, ..self.scene.film }, ..(*self.scene).clone() }
    }

    /// Returns whether both requests have the same reference. Settings that only change how frames
    /// are drawn may differ.
    pub(super) fn has_same_reference(&self, other: &ProbeRequest) -> bool {
        let view = |r: &ProbeRequest| {
            let [p, t] = [r.position, r.target].map(|v| v.to_array().map(f64::to_bits));
            (r.kind, r.time_s.to_bits(), r.size, p, t)
        };
        view(self) == view(other)
            && (Arc::ptr_eq(&self.scene, &other.scene)
                || reference_hash::is_same(self.kind, &self.exact_scene(), &other.exact_scene()))
    }
}

/// The reference picture of a view, at some or all of its pixels.
#[derive(Debug)]
pub struct ReferencePicture {
    /// The view.
    pub request: ProbeRequest,
    /// Pixels of the reference.
    pub pixels: Pixels,
    /// Values at these pixels.
    pub reference: Reference,
    /// Whether the reference was read from the cache.
    pub from_cache: bool,
}

impl ReferencePicture {
    /// Returns the error of a picture at the reference's pixels.
    ///
    /// *Shape*: `rgba` is the whole picture, premultiplied linear RGBA, rows from the top. Returns
    /// `None` where it has another size or contains a value that is not finite.
    pub fn error(&self, rgba: &[f32]) -> Option<PictureError> {
        let [width, height] = self.request.size.map(|n| n as usize);
        if rgba.len() != 4 * width * height {
            return None;
        }
        let pixel = |at: &[u32; 2]| {
            let i = 4 * self.pixels.index(*at);
            [0, 1, 2, 3].map(|k| f64::from(rgba[i + k]))
        };
        let picture: Vec<[f64; 4]> = self.pixels.at.iter().map(pixel).collect();
        picture_error(&self.pixels, &picture, &self.reference.rgba, self.reference.own_error)
    }
}
