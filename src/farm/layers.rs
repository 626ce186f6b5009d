//! How much there is to compose in the parts of a picture: what of it takes time before any of it
//! is drawn.

use crate::model::scene::Scene;
use crate::model::surface::Surface;
use crate::reference::picture::{self, FrameReference, Tile};
use crate::reference::{layers, surfaces};

/// By pixel.
pub struct Layers {
    width: u32,
    /// Blobs that lie over it.
    n: Vec<u32>,
    /// Whether a surface is seen in it.
    solid: Vec<bool>,
}

impl Layers {
    /// Of a scene as it is in `truth`, lit or not; its blobs end at `reach` σ.
    pub fn of(scene: &Scene, truth: &FrameReference, reach: f64) -> Layers {
        let view = picture::view(scene, truth);
        let origin = truth.state.light_origin;
        let placed: Vec<Surface> =
            scene.surfaces.iter().map(|s| Surface { center: s.center - origin, ..*s }).collect();
        let sees = |i: u32, j: u32| surfaces::seen(&view, &placed, view.ray(i, j)).is_some();
        let all = (0..view.height).flat_map(|j| (0..view.width).map(move |i| (i, j)));
        let solid = all.map(|(i, j)| !placed.is_empty() && sees(i, j)).collect();
        Layers { width: view.width, n: layers::n_layers(&view, &truth.blobs, reach), solid }
    }

    fn rows<'a, T>(&self, values: &'a [T], tile: Tile) -> impl Iterator<Item = &'a [T]> {
        let width = self.width as usize;
        let (left, n) = (tile.left as usize, tile.width as usize);
        (tile.top..tile.top + tile.height).map(move |j| &values[j as usize * width + left..][..n])
    }

    /// Layers over all pixels, and one a pixel for what is behind them.
    pub fn n_whole(&self) -> f64 {
        self.n.iter().map(|n| 1.0 + f64::from(*n)).sum()
    }

    /// Layers over the pixels of `tile`, and one a pixel for what is behind them.
    pub fn n_within(&self, tile: Tile) -> f64 {
        self.rows(&self.n, tile).flatten().map(|n| 1.0 + f64::from(*n)).sum()
    }

    /// Pixels of `tile` that see a surface.
    pub fn n_solid_within(&self, tile: Tile) -> f64 {
        self.rows(&self.solid, tile).flatten().filter(|solid| **solid).count() as f64
    }
}
