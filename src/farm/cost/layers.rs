//! The number of layers to compose in each pixel of a picture.

use crate::model::edge::Edge;
use crate::model::scene::Scene;
use crate::model::surface::Surface;
use crate::reference::picture::{self, FrameReference, Tile};
use crate::reference::{layers, surfaces};

/// Layers of blobs and of surfaces, by pixel.
pub struct Layers {
    width: u32,
    /// Blobs over each pixel.
    n: Vec<u32>,
    /// Whether each pixel shows a surface.
    is_solid: Vec<bool>,
}

impl Layers {
    /// Counts the layers of a scene as `truth` has placed it. Blobs end at `edge`.
    pub fn new(scene: &Scene, truth: &FrameReference, edge: Edge) -> Layers {
        let view = picture::view(scene, truth);
        let origin = truth.state.light_origin;
        let placed: Vec<Surface> =
            scene.surfaces.iter().map(|s| Surface { center: s.center - origin, ..*s }).collect();
        let sees = |i: u32, j: u32| surfaces::seen(&view, &placed, view.ray(i, j)).is_some();
        let all = (0..view.height).flat_map(|j| (0..view.width).map(move |i| (i, j)));
        let is_solid = all.map(|(i, j)| !placed.is_empty() && sees(i, j)).collect();
        Layers { width: view.width, n: layers::n_layers(&view, &truth.blobs, edge), is_solid }
    }

    /// Returns the layers over all pixels, with a layer a pixel for the background.
    pub fn n_total(&self) -> f64 {
        self.n.iter().map(|n| 1.0 + f64::from(*n)).sum()
    }

    /// Returns the layers over the pixels of `tile`, with a layer a pixel for the background.
    pub fn n_within(&self, tile: Tile) -> f64 {
        self.pixels(&self.n, tile).map(|n| 1.0 + f64::from(*n)).sum()
    }

    /// Returns the number of pixels of `tile` that show a surface.
    pub fn n_solid_within(&self, tile: Tile) -> f64 {
        self.pixels(&self.is_solid, tile).filter(|is_solid| **is_solid).count() as f64
    }

    fn pixels<'a, T>(&self, values: &'a [T], tile: Tile) -> impl Iterator<Item = &'a T> {
        let (width, left, n) = (self.width as usize, tile.left as usize, tile.width as usize);
        let rows = tile.top as usize..(tile.top + tile.height) as usize;
        rows.flat_map(move |j| &values[j * width + left..][..n])
    }
}
