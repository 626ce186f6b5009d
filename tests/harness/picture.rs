//! A picture of sprites, with or without rectangles: inputs in f32 for the GPU and in f64 for the
//! reference, and the bound between both.

#![allow(dead_code, unused_imports, reason = "each test binary uses its own part")]

#[path = "picture_drawn.rs"]
mod drawn;
#[path = "picture_sprite.rs"]
mod sprite;

use std::sync::Arc;

use glam::{DVec2, DVec3, UVec3};
use nimbus::gpu::TargetFormat;
use nimbus::layout::facet::{LitRecord, SlopeRecord};
use nimbus::layout::frame::GridRecord;
use nimbus::layout::particle::{DrawnRecord, ParticleRecord, PlacedRecord, TexturedRecord};
use nimbus::model::camera::{Camera, CameraKey};
use nimbus::model::cloud::{SQRT_TAU, Shape, Shapes, Turn};
use nimbus::model::edge::Edge;
use nimbus::model::film::FilmFormat;
use nimbus::model::grid::GridSpec;
use nimbus::model::shade::Shade;
use nimbus::reference::Blob;
use nimbus::reference::composite::{OpaquePixel, Rounding};
use nimbus::reference::diffusion::SeenCells;
use nimbus::reference::sort::{depths, distances, key32, order};
use nimbus::reference::sprites::{CellLight, Sprites, render_over};
use nimbus::reference::texture::{Pool, SplatTexture, Textured};
use nimbus::reference::view::View;

use crate::bounded::{Bounded, U, dot, exact3};
use crate::scenery::{Candidates, Scenery};
use crate::sheets::Paper;

pub use drawn::{Tiled, Way};
use sprite::{Ellipsoid, Sprite};

/// Error of a view depth relative to the distance: a difference and an f32 axis per term, three
/// products and two sums.
pub const DEPTH: f64 = 16.0 * U;

/// Error of one_minus_exp.
const ONE_MINUS_EXP: f64 = 3.5e-7;

pub const FORMATS: [(TargetFormat, FilmFormat); 3] = [
    (TargetFormat::Rgba8, FilmFormat::Rgba8),
    (TargetFormat::Rgba16f, FilmFormat::Rgba16f),
    (TargetFormat::Rgba32f, FilmFormat::Rgba32f),
];

#[derive(Debug, Clone)]
pub struct Picture {
    pub camera: Camera,
    pub view: View,
    pub placed: Vec<PlacedRecord>,
    pub particles: Vec<ParticleRecord>,
    /// Order from far to near, if it is not the order of depths.
    pub in_order: Option<Vec<u32>>,
    /// Radiance of the particles' facets; without it particles have their own colours.
    pub lit: Option<Vec<LitRecord>>,
    /// Slopes of the light by facet, if blobs are shaded.
    pub slopes: Option<Vec<SlopeRecord>>,
    /// Radiance by cell, if slices have the light of cells.
    pub cells: Option<(GridRecord, Vec<[f32; 4]>)>,
    /// Facet of each particle, if not in the order of particles.
    pub i_facet: Option<Vec<u32>>,
    /// Group of each particle and the drawn part of each group, if not all particles are drawn.
    pub drawn: Option<(Vec<u32>, Vec<DrawnRecord>)>,
    /// Rectangles under the sprites.
    pub scenery: Option<Scenery>,
    /// Group of each particle, as in `drawn` if that is set; each group's texture; the pool, as it
    /// is rounded.
    pub textured: Option<(Vec<u32>, Vec<TexturedRecord>, Arc<Pool>)>,
}

fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

impl Picture {
    pub fn new(eye: DVec3, target: DVec3, fov_y_deg: f64, near: f64) -> Picture {
        let keys = vec![CameraKey { time_s: 0.0, position: eye, target }];
        let camera = Camera { keys, up: DVec3::Y, fov_y_rad: fov_y_deg.to_radians(), near };
        let pose = camera.pose(0.0).expect("a pose");
        let view = View {
            width: 160,
            height: 120,
            pose,
            fov_y_rad: camera.fov_y_rad,
            near,
            edge: Edge::at(3.0),
            smallest: 0.0,
            slice: 0.0,
            n_parts: 4,
            shift: DVec2::ZERO,
        };
        Picture {
            camera,
            view,
            placed: vec![],
            particles: vec![],
            in_order: None,
            lit: None,
            slopes: None,
            cells: None,
            i_facet: None,
            drawn: None,
            scenery: None,
            textured: None,
        }
    }

    /// Adds a blob whose optical depth through the centre is `tau`.
    pub fn blob(mut self, position: DVec3, sigma: f64, tau: f64) -> Picture {
        let kappa = if sigma > 0.0 { (tau / (SQRT_TAU * sigma)) as f32 } else { 1.0 };
        let shade = 0.5 + 0.4 * (self.placed.len() as f32).sin();
        self.placed
            .push(PlacedRecord { position: position.as_vec3().to_array(), sigma: sigma as f32 });
        let color = [1.0, shade, 1.5 - shade];
        self.particles.push(ParticleRecord {
            aspect: 1.0,
            aspect_z: 1.0,
            turn: [0; 2],
            position: [0.0; 3],
            sigma: sigma as f32,
            color,
            kappa,
        });
        self
    }

    /// Composes overlapping blobs by slices of this thickness.
    pub fn sliced(mut self, slice: f64) -> Picture {
        self.view.slice = slice;
        self
    }

    /// Deals each blob among `n` slices.
    pub fn in_parts(mut self, n: u32) -> Picture {
        self.view.n_parts = n;
        self
    }

    /// Sets the aspect of the last blob: its σ along y relative to that along x and z.
    pub fn shaped(mut self, aspect: f64) -> Picture {
        if let Some(last) = self.particles.last_mut() {
            last.aspect = aspect as f32;
        }
        self
    }

    /// Gives the last blob any shape.
    pub fn of_shape(mut self, shape: Shape) -> Picture {
        if let Some(last) = self.particles.last_mut() {
            (last.aspect, last.aspect_z) = (shape.aspect as f32, shape.aspect_z as f32);
            last.turn = shape.turn.words();
        }
        self
    }

    /// Returns the shapes of the blobs.
    pub fn shapes(&self) -> Shapes {
        self.particles.iter().map(|p| p.shape().kind()).max().unwrap_or_default()
    }

    /// Returns the position at an offset of `x` right, `y` up and `z` forward of the eye.
    pub fn at(&self, x: f64, y: f64, z: f64) -> DVec3 {
        let p = &self.view.pose;
        p.position + x * p.right + y * p.up + z * p.forward
    }

    pub fn blobs(&self) -> Vec<Blob> {
        let blob = |(p, q): (&PlacedRecord, &ParticleRecord)| Blob {
            position: double(p.position),
            sigma: f64::from(p.sigma),
            shape: q.shape(),
            kappa: f64::from(q.kappa),
        };
        let blobs = self.placed.iter().zip(&self.particles).map(blob);
        blobs.enumerate().map(|(i, b)| Blob { kappa: b.kappa * self.weight(i), ..b }).collect()
    }

    /// Returns the factor on particle `i`'s κ; 0 if it is not drawn.
    fn weight(&self, i: usize) -> f64 {
        let Some((i_group, drawn)) = &self.drawn else { return 1.0 };
        let group = drawn[i_group[i] as usize];
        match (i as u32 + 1).cmp(&group.end) {
            std::cmp::Ordering::Less => f64::from(group.kappa_scale),
            std::cmp::Ordering::Equal => {
                f64::from(group.kappa_scale) * f64::from(group.last_weight)
            }
            std::cmp::Ordering::Greater => 0.0,
        }
    }

    /// Returns the facet of each particle.
    fn facets(&self) -> Vec<u32> {
        self.i_facet.clone().unwrap_or_else(|| (0..self.placed.len() as u32).collect())
    }

    /// Returns the light inside of each blob.
    pub fn shades(&self) -> Option<Vec<Shade>> {
        let slopes = self.slopes.as_ref()?;
        let of = |(blob, i): (Blob, u32)| {
            let SlopeRecord { relative, position, .. } = slopes[i as usize];
            let apart = match self.i_facet {
                Some(_) => blob.position - double(position),
                None => DVec3::ZERO,
            };
            Shade::new(double(relative), apart, blob.sigma, &blob.shape)
        };
        Some(self.blobs().into_iter().zip(self.facets()).map(of).collect())
    }

    /// Returns the cells that slices have the light of.
    pub fn seen(&self) -> Option<SeenCells> {
        let (grid, cells) = self.cells.as_ref()?;
        let spec = GridSpec {
            low: double(grid.low),
            cell: f64::from(grid.cell),
            aspect: f64::from(grid.aspect),
            n_cells: UVec3::from(grid.n_cells),
        };
        let of = |v: &[f32; 4]| (double([v[0], v[1], v[2]]), f64::from(v[3]));
        Some(SeenCells::of_cells(spec, cells.iter().map(of).collect()))
    }

    /// Returns their light. A facet's colour has the radiance that belongs to a mean of 1.
    pub fn cell_light<'a>(&self, seen: Option<&'a SeenCells>) -> Option<CellLight<'a>> {
        seen.map(|cells| CellLight { cells, means: vec![1.0; self.placed.len()] })
    }

    pub fn radiance(&self) -> Vec<DVec3> {
        match &self.lit {
            // The f32 sum is rounded equally on both sides.
            Some(lit) => {
                let of = |l: &LitRecord| double([0, 1, 2].map(|i| l.first[i] + l.second[i]));
                self.facets().iter().map(|i| of(&lit[*i as usize])).collect()
            }
            None => self.particles.iter().map(|p| double(p.color)).collect(),
        }
    }

    pub fn order(&self) -> Vec<u32> {
        if let Some(order) = &self.in_order {
            return order.clone();
        }
        let positions: Vec<DVec3> = self.placed.iter().map(|p| double(p.position)).collect();
        let pose = &self.view.pose;
        let depths = match self.view.slice > 0.0 {
            true => distances(pose.position, &positions),
            false => depths(pose.forward, &positions),
        };
        let keys = depths.into_iter().map(|z| key32(z as f32));
        let order = order(&keys.collect::<Vec<_>>());
        order.into_iter().filter(|i| self.weight(*i as usize) > 0.0).collect()
    }

    /// Returns the reference's picture and its bound for `format`.
    pub fn truth(&self, format: FilmFormat) -> (Vec<f64>, Vec<f64>) {
        let rounding = self.rounding(format);
        let (blobs, radiance, order) = (self.blobs(), self.radiance(), self.order());
        let behind: Vec<OpaquePixel> = match &self.scenery {
            None => vec![OpaquePixel::EMPTY; (self.view.width * self.view.height) as usize],
            Some(_) => self.behind(format).iter().map(|c| self.widened(c)).collect(),
        };
        let sheets = self.sheets();
        let (shades, seen) = (self.shades(), self.seen());
        let cells = self.cell_light(seen.as_ref());
        let factor = |j: usize, delta: DVec2| self.factor(&sheets, j, delta);
        let (value, bound) = {
            let (blobs, radiance, order) = (&blobs, &radiance, &order);
            let (shades, factor) = (shades.as_deref(), Some(&factor as _));
            let cells = cells.as_ref();
            let sprites = Sprites { blobs, radiance, order, factor, shades, cells };
            render_over(&self.view, &behind, &sprites, &rounding)
        };
        (value.concat(), bound.concat())
    }

    /// Returns the texture's factor on particle `j`'s τ.
    pub fn factor(&self, sheets: &[Option<SplatTexture>], j: usize, delta: DVec2) -> f64 {
        match (&sheets[j], &self.textured) {
            (Some(sheet), Some((_, _, pool))) => sheet.factor(pool, delta),
            _ => 1.0,
        }
    }

    /// Returns the candidates of each pixel among the rectangles.
    pub fn behind(&self, format: FilmFormat) -> Vec<Candidates> {
        let scenery = self.scenery.as_ref().expect("rectangles");
        let rounding = Rounding::of(format, 0.0, 0.0);
        let found = scenery.candidates(&self.view, |i, j| self.ray(i, j), &rounding);
        found
            .into_iter()
            .map(|all| all.into_iter().map(|one| rounding.stored(one)).collect())
            .collect()
    }

    /// Returns the reference of a pixel, with the sprites' error in the bound of its depth. Without
    /// a bound if there are several candidates.
    pub fn widened(&self, candidates: &Candidates) -> OpaquePixel {
        let truth = candidates[0];
        if candidates.len() > 1 {
            return OpaquePixel { bound: [f64::INFINITY; 4], ..truth };
        }
        let near = Bounded::once(self.view.near);
        let of_sprites = self.placed.iter().filter(|p| p.sigma > 0.0).map(|p| {
            let depth = near.over(self.view_depth(p));
            depth.error / depth.value.abs()
        });
        // The rasteriser interpolates between four equal depths: a product, a sum, a shift and a
        // scaling of at most 1.
        let of_sprites = of_sprites.fold(0.0, f64::max) + 4.0 * U;
        // |near/z − near/z'| ≤ near (r/z + r'/z') for z' within a few r of z.
        OpaquePixel { depth_bound: 1.01 * (truth.depth_bound + of_sprites * truth.depth), ..truth }
    }

    /// Returns each particle's texture factors.
    pub fn sheets(&self) -> Vec<Option<SplatTexture>> {
        let pose = &self.view.pose;
        let sheet = |(i, p): (usize, &PlacedRecord)| {
            let (i_group, textures, _) = self.textured.as_ref()?;
            let of = &textures[i_group[i] as usize];
            let z = (double(p.position) - pose.position).dot(pose.forward);
            let strength = f64::from(of.strength);
            let textured =
                Textured { i_field: of.i_field, strength, seed: of.seed, i_box: of.i_box };
            Some(SplatTexture::new(
                &textured,
                i as u32 - of.i_first,
                z / f64::from(p.sigma),
                self.view.pixel(),
            ))
        };
        self.placed.iter().enumerate().map(sheet).collect()
    }

    /// Returns the largest error of the shaders' α and edges over all pixels of all blobs, by
    /// running bounds.
    pub fn rounding(&self, format: FilmFormat) -> Rounding {
        let [off_alpha, edge, _] = self.worst(false);
        let mut rounding = Rounding::of(format, off_alpha, edge);
        // Besides the store into the target there are four f32 roundings: L1 + L2, α·L, (1 − α)·C
        // and their sum.
        rounding.unit += 2.0 * U;
        rounding.depth = DEPTH;
        rounding
    }

    /// Returns the relative error of an opacity, of a sprite's edge and of an optical depth, in
    /// tiles or as sprites.
    pub fn worst(&self, tiled: bool) -> [f64; 3] {
        let (mut off_alpha, mut edge, mut off_tau) = (ONE_MINUS_EXP, 8.0 * U, 8.0 * U);
        let columns: Vec<Bounded> = (0..self.view.width).map(|i| self.ray(i, 0)[0]).collect();
        let rows: Vec<Bounded> = (0..self.view.height).map(|j| self.ray(0, j)[1]).collect();
        for ((blob, placed), sheet) in self.blobs().iter().zip(&self.placed).zip(self.sheets()) {
            let c = blob.position - self.view.pose.position;
            if !(c.dot(self.view.pose.forward) >= self.view.near
                && blob.sigma > 0.0
                && blob.kappa > 0.0)
            {
                continue;
            }
            let sprite = self.sprite(placed, blob);
            let paper = sheet.zip(self.textured.as_ref()).map(|(s, (_, _, pool))| {
                Paper::new(
                    s,
                    pool,
                    self.view_depth(placed).over(Bounded::exact(f64::from(placed.sigma))),
                    self.view.pixel(),
                )
            });
            // The pixels within the cut, and a little beyond it.
            let slack = |cut: f64| 0.2 * cut.max(1.0);
            let most = self.view.edge.cut(blob.deepest());
            let reach = (2.0 * (most + slack(most)).max(0.0)).sqrt();
            let [(left, right), (top, bottom)] = self.view.rectangle(blob, c, reach);
            for j in top..bottom {
                for i in left..right {
                    let line = blob.along(c, self.view.ray(i, j));
                    let ray = [columns[i as usize], rows[j as usize]];
                    let cut = self.view.edge.cut(line.depth);
                    let at_cut = 0.5 * line.off.powi(2) - cut;
                    if at_cut > slack(cut) {
                        continue;
                    }
                    let e = match tiled {
                        true => sprite.tiled_exponent(ray),
                        false => sprite.exponent(ray),
                    };
                    let tau = sprite.deep(ray);
                    let cut_error = self.cut_error(tau);
                    // The cutoff: e ≤ cutoff²/2, three roundings; or the threshold's.
                    if at_cut > -slack(cut) {
                        let error = if tiled { std::f64::consts::LN_2 * e.error } else { e.error };
                        edge = edge.max(0.51 * (error + cut_error) / cut.max(1.0) + 4.0 * U);
                    }
                    let sheet = paper.as_ref().map(|p| p.exponent(sprite.difference(ray)));
                    let log2_e = Bounded::once(std::f64::consts::LOG2_E);
                    let factor = match (sheet, tiled) {
                        (None, false) => e.scaled(-1.0).exp(),
                        (Some(sheet), false) => e.scaled(-1.0).plus(sheet).exp(),
                        (None, true) => e.scaled(-1.0).exp2(),
                        (Some(sheet), true) => e.scaled(-1.0).plus(log2_e.times(sheet)).exp2(),
                    };
                    let t = tau.times(factor);
                    let true_alpha = -libm::expm1(-t.value);
                    // d(1 − e^{−t})/dt = e^{−t}.
                    let off = (-(t.value - t.error)).exp() * t.error + ONE_MINUS_EXP * true_alpha;
                    off_alpha = off_alpha.max(off / true_alpha);
                    off_tau = off_tau.max(t.error / t.value);
                }
            }
        }
        [off_alpha, edge, off_tau]
    }

    /// Returns the error of the shaders' ln(τ₀/threshold), or of their log2.
    fn cut_error(&self, tau: Bounded) -> f64 {
        let inverse = Bounded::once(1.0 / self.view.edge.tau);
        if self.view.edge.has_threshold() { tau.times(inverse).log().error } else { 0.0 }
    }

    fn half_slopes(&self) -> [Bounded; 2] {
        let tan = (0.5 * self.view.fov_y_rad).tan();
        let aspect = f64::from(self.view.width) / f64::from(self.view.height);
        [Bounded::once(tan * aspect), Bounded::once(tan)]
    }

    pub fn ray(&self, i: u32, j: u32) -> [Bounded; 2] {
        let [x, y] = self.half_slopes();
        let along = |at: u32, tan: Bounded, n: u32| {
            let pixel = tan.scaled(2.0).over(Bounded::exact(f64::from(n)));
            Bounded::exact(f64::from(at) + 0.5).times(pixel)
        };
        [along(i, x, self.view.width).minus(x), y.minus(along(j, y, self.view.height))]
    }

    fn offset(&self, placed: &PlacedRecord) -> [Bounded; 3] {
        let (eye, p) = (self.view.pose.position.to_array(), exact3(placed.position));
        [0, 1, 2].map(|i| p[i].minus(Bounded::once(eye[i])))
    }

    fn view_depth(&self, placed: &PlacedRecord) -> Bounded {
        dot(self.view.pose.forward.to_array().map(Bounded::once), self.offset(placed))
    }

    pub fn sprite(&self, placed: &PlacedRecord, blob: &Blob) -> Sprite {
        let pose = &self.view.pose;
        let once = |v: DVec3| v.to_array().map(Bounded::once);
        let (c, z) = (self.offset(placed), self.view_depth(placed));
        let slope = |axis: DVec3| dot(once(axis), c).over(z);
        let z_sigmas = z.over(Bounded::exact(blob.sigma));
        // The factor is a product, and multiplied.
        let tau = Bounded::once(SQRT_TAU)
            .times(Bounded::exact(blob.kappa))
            .times(Bounded::exact(blob.sigma));
        let one = Bounded::exact(1.0);
        let tau = if self.drawn.is_some() { tau.times(one).times(one) } else { tau };
        let ellipsoid = match self.shapes() {
            Shapes::Balls => None,
            Shapes::Upright => {
                Some(Ellipsoid::new(blob.shape.aspect, [pose.right.y, pose.up.y, pose.forward.y]))
            }
            Shapes::Turned => Some(Ellipsoid::turned(&blob.shape, pose)),
        };
        Sprite {
            s: [slope(pose.right), slope(pose.up)],
            z: z_sigmas.squared().scaled(0.5),
            tau,
            ellipsoid,
        }
    }
}
