//! The reference of a picture drawn in tiles or chunks, and its bound.

#![allow(dead_code, reason = "each test binary uses its own part")]

use glam::DVec2;
use nimbus::model::film::FilmFormat;
use nimbus::reference::composite::{OpaquePixel, Rounding};
use nimbus::reference::sprites::Sprites;
use nimbus::reference::tiles::{self, Composition};
use nimbus::reference::{Blob, chunks};

use crate::picture::Picture;

impl Picture {
    /// Returns the largest number of visible blobs in one pixel.
    pub fn most_layers(&self) -> usize {
        let (view, blobs) = (&self.view, self.blobs());
        let pixels = (0..view.height).flat_map(|j| (0..view.width).map(move |i| (i, j)));
        let layers = |(i, j): (u32, u32)| {
            let d = view.ray(i, j);
            let covers = |b: &&Blob| {
                let c = b.position - view.pose.position;
                c.dot(view.pose.forward) >= view.near && b.along(c, d).off <= view.edge.radius
            };
            blobs.iter().filter(covers).count()
        };
        pixels.map(layers).max().unwrap_or(0)
    }

    pub fn tiled_truth(&self, format: FilmFormat, saturated: f64) -> (Vec<f64>, Vec<f64>) {
        self.near_first(format, saturated, true)
    }

    /// Returns the same for chunks.
    pub fn chunked_truth(&self, format: FilmFormat, saturated: f64) -> (Vec<f64>, Vec<f64>) {
        self.near_first(format, saturated, false)
    }

    fn near_first(
        &self,
        format: FilmFormat,
        saturated: f64,
        by_tiles: bool,
    ) -> (Vec<f64>, Vec<f64>) {
        let [mut off_alpha, edge, tau] = self.worst(by_tiles);
        if by_tiles {
            off_alpha += tiles::off_alpha(format);
        }
        let depth = crate::picture::DEPTH;
        let rounding = Rounding { depth, tau, ..Rounding::of(format, off_alpha, edge) };
        let (blobs, radiance, order) = (self.blobs(), self.radiance(), self.order());
        let behind: Vec<OpaquePixel> = match &self.scenery {
            None => vec![OpaquePixel::EMPTY; self.view.width as usize * self.view.height as usize],
            Some(_) => self.behind(format).iter().map(|c| self.widened(c)).collect(),
        };
        let sheets = self.sheets();
        let factor = |j: usize, delta: DVec2| self.factor(&sheets, j, delta);
        let (blobs, radiance, order) = (&blobs, &radiance, &order);
        let (shades, seen) = (self.shades(), self.seen());
        let cells = self.cell_light(seen.as_ref());
        let (shades, factor) = (shades.as_deref(), Some(&factor as _));
        let cells = cells.as_ref();
        let sprites = Sprites { blobs, radiance, order, factor, shades, cells };
        let of = Composition { view: &self.view, sprites, rounding, saturated };
        let render = if by_tiles { tiles::render_over } else { chunks::render_over };
        let (value, bound) = render(&of, &behind);
        (value.concat(), bound.concat())
    }
}
