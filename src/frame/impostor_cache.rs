//! The cache of an impostor layer: when the layer is drawn, when it is shown again, and at which
//! depth it begins (passes.md "impostors"). Its decisions follow from the packets
//! since the last reset alone.

use glam::{DMat3, DVec2, DVec3, Vec3};

use super::packet::Packet;
use crate::layout::facet::{REGION_SURFACE, REGION_TERRAIN, RegionRecord};
use crate::layout::frame::CameraRecord;
use crate::model::impostor::{FarField, Shell, View};
use crate::model::scene::Scene;
use crate::passes::blobs::Extent;

/// Margin of a layer at each edge, as a share of the picture's side.
const MARGIN: f64 = 0.125;
/// Pixels around a position that the cubic reads.
const FOOTPRINT: f64 = 2.0;
/// Frames ahead for which a layer's use is predicted.
const AHEAD: u32 = 64;
/// Frames that a layer must be usable in to be drawn.
const MIN_LIFE: u32 = 3;
/// Parts of equal drawing cost, between which a layer may begin.
const N_CUTS: usize = 8;
/// Cost of showing a layer, in blobs drawn over a pixel.
const SHOW_LAYERS: f64 = 4.0;
/// Mean σ of a group, in pixels, below which the cubic would blur its blobs: a blob of 2 pixels
/// keeps 0.99 of its height between four texels.
const MIN_SIGMA: f64 = 2.0;
/// Depth at which a layer may begin, in radii of the sprites beyond.
const MIN_RADII: f64 = 2.0;
/// Bound of the f32 rounding of a depth, relative to the lengths it is computed from, as for
/// visibility.
const ROUNDING: f64 = 1.0 / 65536.0;

/// The parameters of the cache.
#[derive(Debug, Clone, Copy)]
pub struct CacheRules {
    /// Pixels of the picture.
    size: [u32; 2],
    /// Pixels of the layer's picture.
    pub layer_size: [u32; 2],
    /// Bound of the error, in pixels.
    error: f64,
}

impl CacheRules {
    pub fn new(scene: &Scene) -> CacheRules {
        let size = [scene.film.width, scene.film.height];
        CacheRules { size, layer_size: layer_size(size), error: scene.draw.impostor_error }
    }
}

/// Returns the pixels of a layer for pictures of `size`.
pub fn layer_size(size: [u32; 2]) -> [u32; 2] {
    size.map(|n| n + 2 * (MARGIN * f64::from(n)).ceil() as u32)
}

/// The layer that a frame shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LayerUse {
    /// No layer, for this reason: all blobs are drawn.
    None(&'static str),
    /// A layer that is drawn for this frame.
    Made { layer: CachedLayer, why: &'static str },
    /// The cached layer, whose error is at most `pixels`.
    Reused { layer: CachedLayer, pixels: f64 },
}

/// A cached layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CachedLayer {
    pub shell: Shell,
    /// The camera of its picture.
    pub camera: CameraRecord,
    /// Least depth of its particles when it was drawn, relative to the lighting origin.
    pub cut: f32,
    /// Least depth of its particles in the current view.
    pub depth: f64,
    /// Least and greatest slopes of the view at which it shows anything.
    pub bounds: [DVec2; 2],
}

/// The cache of one layer.
#[derive(Debug)]
pub struct ImpostorCache {
    pub rules: CacheRules,
    last: Option<View>,
    layer: Option<CachedLayer>,
}

impl ImpostorCache {
    pub fn new(rules: CacheRules) -> ImpostorCache {
        ImpostorCache { rules, last: None, layer: None }
    }

    /// Forgets the layer, as before a first frame.
    pub fn reset(&mut self) {
        (self.last, self.layer) = (None, None);
    }

    /// Returns the layer that `packet`'s frame shows. `changed` names a change since the last frame
    /// other than the view.
    pub fn step(&mut self, packet: &Packet, changed: Option<&'static str>) -> LayerUse {
        let now = view_of(&packet.camera);
        let last = self.last.replace(now);
        let layer = self.layer.take();
        if let Some(changed) = changed {
            return LayerUse::None(changed);
        }
        let why = match layer.map(|layer| (layer, self.usable(&layer, &now, packet))) {
            Some((layer, Ok((pixels, depth)))) => {
                let layer =
                    CachedLayer { depth, bounds: self.bounds(&layer, &now, packet), ..layer };
                self.layer = Some(layer);
                return LayerUse::Reused { layer, pixels };
            }
            Some((_, Err(why))) => why,
            None => "there is no layer",
        };
        let Some(last) = last else {
            return LayerUse::None("the motion of the eye is not known yet");
        };
        self.layer = self.best(packet, &last, &now);
        match self.layer {
            Some(layer) => LayerUse::Made { layer, why },
            None => LayerUse::None("no layer would save anything"),
        }
    }

    /// Returns the width of a pixel, as a slope.
    fn pixel(&self, view: &View) -> f64 {
        2.0 * view.tangents.x / f64::from(self.rules.size[0])
    }

    /// Returns the layer's error in the view `now`, in pixels, and the least depth of its
    /// particles; or why it cannot be shown.
    fn usable(
        &self,
        layer: &CachedLayer,
        now: &View,
        packet: &Packet,
    ) -> Result<(f64, f64), &'static str> {
        let pixels = self.off_by(&layer.shell, now)?;
        let far = &layer.shell.far;
        let ratio = layer.shell.predict(now).map_or(0.0, |p| p.depth_ratio);
        let nearest = ratio * far.nearest;
        let mut surfaces = packet
            .regions
            .iter()
            .filter(|r| matches!(r.kind, REGION_SURFACE | REGION_TERRAIN))
            .peekable();
        if surfaces.peek().is_some() {
            let farthest = packet.extents.iter().map(|e| depths(e, now)[1]).fold(0.0, f64::max);
            if surfaces.any(|r| is_among(r, now, [nearest, farthest])) {
                return Err("a surface is among the distant blobs");
            }
        }
        Ok((pixels, nearest))
    }

    /// Returns the layer's error in the view `now`, in pixels, or why it cannot be shown.
    fn off_by(&self, shell: &Shell, now: &View) -> Result<f64, &'static str> {
        let pixel = self.pixel(now);
        let Some(predicted) = shell.predict(now) else { return Err("the eye came too near") };
        let pixels = predicted.slopes() / pixel;
        // The comparison is false for NaN.
        if !matches!(pixels, p if p <= self.rules.error) {
            return Err("it would be off by more than draw.impostor_error");
        }
        if shell.covers(now, FOOTPRINT * pixel) {
            Ok(pixels)
        } else {
            Err("the view leaves its picture")
        }
    }

    /// Returns the layer that saves the most if the eye keeps moving as from `last` to `now`.
    fn best(&self, packet: &Packet, last: &View, now: &View) -> Option<CachedLayer> {
        let pixel = self.pixel(now);
        let costs: Vec<f64> = packet.extents.iter().map(|e| self.cost(e, now, pixel)).collect();
        let sum = |costs: &[f64], cut: f64| -> f64 {
            packet.extents.iter().zip(costs).map(|(e, c)| c * share_beyond(e, now, cut)).sum()
        };
        let mut best: Option<(f64, CachedLayer)> = None;
        for cut in cuts(&packet.extents, &costs, now) {
            let Some(layer) = self.layer_beyond(packet, now, cut) else { continue };
            let wide = View { tangents: layer.shell.view.tangents, ..*now };
            let in_layer: Vec<f64> =
                packet.extents.iter().map(|e| self.cost(e, &wide, pixel)).collect();
            let shown = (layer.bounds[1] - layer.bounds[0]) / pixel;
            let n = self.life(&layer, packet, last, now);
            let anew = sum(&in_layer, cut) / f64::from(n);
            let saved = sum(&costs, cut) - anew - SHOW_LAYERS * shown.x * shown.y;
            if n >= MIN_LIFE && saved > best.as_ref().map_or(0.0, |(s, _)| *s) {
                best = Some((saved, layer));
            }
        }
        best.map(|(_, layer)| layer)
    }

    /// Returns the number of frames in which a layer would be usable.
    fn life(&self, layer: &CachedLayer, packet: &Packet, last: &View, now: &View) -> u32 {
        let axes = |v: &View| DMat3::from_cols(v.right, v.up, v.forward);
        let (moved, turn) = (now.eye - last.eye, axes(now) * axes(last).transpose());
        let mut view = *now;
        for n in 1..AHEAD {
            let turned = turn * axes(&view);
            let (right, up, forward) = (turned.x_axis, turned.y_axis, turned.z_axis);
            view = View { eye: view.eye + moved, right, up, forward, ..view };
            if self.usable(layer, &view, packet).is_err() {
                return n;
            }
        }
        AHEAD
    }

    /// Returns the layer of all blobs beyond `cut`; `None` if they are too near or surround a
    /// surface.
    fn layer_beyond(&self, packet: &Packet, now: &View, cut: f64) -> Option<CachedLayer> {
        let CacheRules { size, layer_size, .. } = self.rules;
        let beyond: Vec<(&Extent, [f64; 2])> = packet
            .extents
            .iter()
            .map(|e| (e, depths(e, now)))
            .filter(|(_, d)| d[1] >= cut)
            .collect();
        let greatest =
            |of: fn(&Extent) -> f64| beyond.iter().map(|(e, _)| of(e)).fold(0.0, f64::max);
        let (sigma, radius) = (greatest(|e| e.sigma_max), greatest(Extent::radius));
        let lengths = now.eye.abs().element_sum() + packet.radius;
        let nearest = cut - ROUNDING * lengths;
        let farthest =
            beyond.iter().map(|(_, d)| d[1]).fold(nearest, f64::max) + ROUNDING * lengths;
        let least = beyond.iter().map(|(e, d)| e.sigma_mean / d[1]).fold(f64::INFINITY, f64::min);
        if least < MIN_SIGMA * self.pixel(now) {
            return None;
        }
        let far = FarField { nearest, farthest, sigma, radius };
        // The sprites of the layer must lie wholly in front of the eye, and stay so.
        if nearest.is_nan()
            || nearest <= (MIN_RADII * far.radius).max(2.0 * f64::from(packet.camera.near))
        {
            return None;
        }
        let wider = |k: usize| f64::from(layer_size[k]) / f64::from(size[k]);
        let tangents = now.tangents * DVec2::new(wider(0), wider(1));
        let camera =
            CameraRecord { tan_x: tangents.x as f32, tan_y: tangents.y as f32, ..packet.camera };
        let layer = CachedLayer {
            shell: Shell { view: view_of(&camera), far },
            camera,
            cut: (cut + now.eye.dot(now.forward)) as f32,
            depth: nearest,
            bounds: [-now.tangents, now.tangents],
        };
        let layer = CachedLayer { bounds: self.bounds(&layer, now, packet), ..layer };
        self.usable(&layer, now, packet).is_ok().then_some(layer)
    }

    /// Returns the least and greatest slopes of the view `now` at which a layer shows anything.
    fn bounds(&self, layer: &CachedLayer, now: &View, packet: &Packet) -> [DVec2; 2] {
        let then = &layer.shell.view;
        let far = packet.extents.iter().filter(|e| depths(e, then)[1] >= layer.shell.far.nearest);
        let (mut low, mut high) = (now.tangents, -now.tangents);
        for extent in far {
            let c = extent.center - now.eye;
            let reach = extent.radius();
            let along = |axis: DVec3| (c.dot(axis), axis.abs().dot(extent.half) + reach);
            let (z, deep) = along(now.forward);
            if z - deep <= 0.0 {
                return [-now.tangents, now.tangents];
            }
            for (k, axis) in [now.right, now.up].into_iter().enumerate() {
                let (x, wide) = along(axis);
                let slope = |x: f64, z: f64| x / z;
                low[k] = low[k].min(slope(x - wide, z - deep)).min(slope(x - wide, z + deep));
                high[k] = high[k].max(slope(x + wide, z - deep)).max(slope(x + wide, z + deep));
            }
        }
        // The error, the cubic's footprint, and a pixel for the rounding of both.
        let slack = (self.rules.error + FOOTPRINT + 1.0) * self.pixel(now);
        let (low, high) = ((low - slack).max(-now.tangents), (high + slack).min(now.tangents));
        [low.min(high), high]
    }

    /// Returns the pixels that a group's particles cover in a view, with `pixel` as a pixel's
    /// slope.
    fn cost(&self, extent: &Extent, now: &View, pixel: f64) -> f64 {
        let c = extent.center - now.eye;
        let z = c.dot(now.forward).max(1e-3 * extent.reach * extent.sigma_mean);
        let reach = extent.half.length() + extent.radius();
        let beside = |axis: DVec3, tan: f64| c.dot(axis).abs() - reach > tan * z.max(reach);
        if c.dot(now.forward) < -reach
            || beside(now.right, now.tangents.x)
            || beside(now.up, now.tangents.y)
        {
            return 0.0;
        }
        let radius = extent.reach * extent.sigma_mean / z;
        let all = 4.0 * now.tangents.x * now.tangents.y;
        f64::from(extent.n_particles) * (std::f64::consts::PI * radius * radius).min(all)
            / (pixel * pixel)
    }
}

fn f64s(v: [f32; 3]) -> DVec3 {
    Vec3::from(v).as_dvec3()
}

/// Returns the camera in f64, exactly as shaders have it.
pub fn view_of(camera: &CameraRecord) -> View {
    View {
        eye: f64s(camera.eye),
        right: f64s(camera.right),
        up: f64s(camera.up),
        forward: f64s(camera.forward),
        tangents: DVec2::new(camera.tan_x.into(), camera.tan_y.into()),
    }
}

/// Returns the least and greatest view depth of a group's particles.
fn depths(extent: &Extent, view: &View) -> [f64; 2] {
    let (z, half) =
        ((extent.center - view.eye).dot(view.forward), view.forward.abs().dot(extent.half));
    [z - half, z + half]
}

/// Returns the share of a group beyond `cut`, as if it were spread evenly over its depths.
fn share_beyond(extent: &Extent, view: &View, cut: f64) -> f64 {
    let [low, high] = depths(extent, view);
    if high > low {
        ((high - cut) / (high - low)).clamp(0.0, 1.0)
    } else {
        f64::from(u8::from(low >= cut))
    }
}

/// Returns depths that divide the groups into parts of equal cost, and one before all of them.
fn cuts(extents: &[Extent], costs: &[f64], view: &View) -> Vec<f64> {
    let of = |(e, cost): (&Extent, &f64)| ((e.center - view.eye).dot(view.forward), *cost);
    let mut sorted: Vec<(f64, f64)> =
        extents.iter().zip(costs).map(of).filter(|(_, cost)| *cost > 0.0).collect();
    sorted.sort_by(|a, b| b.0.total_cmp(&a.0));
    let total: f64 = sorted.iter().map(|(_, cost)| cost).sum();
    let (mut cuts, mut sum) = (vec![], 0.0);
    for (depth, cost) in &sorted {
        sum += cost;
        if sum >= total * (cuts.len() + 1) as f64 / N_CUTS as f64 && cuts.len() + 1 < N_CUTS {
            cuts.push(*depth);
        }
    }
    let all = extents.iter().map(|e| depths(e, view)[0]).fold(f64::INFINITY, f64::min);
    cuts.push(all);
    cuts
}

/// Returns whether a surface or terrain is neither nearer nor farther than all of a range of
/// depths.
fn is_among(region: &RegionRecord, view: &View, [nearest, farthest]: [f64; 2]) -> bool {
    let z = (f64s(region.center) - view.eye).dot(view.forward);
    let half = match region.kind {
        REGION_TERRAIN => (f64s(region.u) * view.forward).abs().element_sum(),
        _ => f64s(region.u).dot(view.forward).abs() + f64s(region.v).dot(view.forward).abs(),
    };
    let slack = ROUNDING * (z.abs() + half + view.eye.abs().element_sum());
    z + half + slack >= nearest && z - half - slack <= farthest
}

#[cfg(test)]
mod tests;
