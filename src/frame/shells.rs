//! When a shell is made, when it is shown again, and where it is cut (docs/model.md §11
//! "impostors"). What comes of it depends on the packets since the last reset alone.

use glam::{DMat3, DVec2, DVec3, Vec3};

use super::packet::{Extent, Packet};
use crate::layout::facet::{REGION_SURFACE, REGION_TERRAIN, RegionRecord};
use crate::layout::frame::CameraRecord;
use crate::model::impostor::{FarField, Shell, View};
use crate::model::scene::Scene;

/// A shell is this share of the picture's side wider at each edge.
const MARGIN: f64 = 0.125;
/// Pixels that the cubic asks for beyond a place.
const FOOTPRINT: f64 = 2.0;
/// Frames ahead that are looked at.
const AHEAD: u32 = 64;
/// A shell that lives no longer is not made.
const LEAST_LIFE: u32 = 3;
/// Parts of what all particles cost, between which a cut may lie.
const N_CUTS: usize = 8;
/// Layers of a pixel that showing a shell costs as much as.
const SHOW_LAYERS: f64 = 4.0;
/// Pixels of σ, of every group's mean, below which the cubic would take too much of them: a blob of
/// 2 pixels keeps 0.99 of its height between four texels.
const LEAST_SIGMA: f64 = 2.0;
/// A cut is at no less than this many radii of the sprites beyond it.
const LEAST_RADII: f64 = 2.0;
/// What f32 may make of a depth, over the lengths that it is made of: as for visibility.
const ROUNDING: f64 = 1.0 / 65536.0;

/// What of the scene the rules ask for.
#[derive(Debug, Clone, Copy)]
pub struct Rules {
    size: [u32; 2],
    /// Of the shell's picture.
    pub shell_size: [u32; 2],
    cutoff: f64,
    /// Pixels.
    error: f64,
}

impl Rules {
    pub fn of(scene: &Scene) -> Rules {
        let size = [scene.film.width, scene.film.height];
        Rules {
            size,
            shell_size: shell_size(size),
            cutoff: scene.draw.cutoff,
            error: scene.draw.impostor_error,
        }
    }
}

/// Pixels of a shell's picture for pictures of `size`.
pub fn shell_size(size: [u32; 2]) -> [u32; 2] {
    size.map(|n| n + 2 * (MARGIN * f64::from(n)).ceil() as u32)
}

/// What is shown of what is far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step {
    /// Nothing: all is drawn.
    Nothing(&'static str),
    /// A shell that is made for this frame.
    Made { kept: Kept, why: &'static str },
    /// The shell that there is, off by so many pixels at most.
    Reused { kept: Kept, pixels: f64 },
}

/// A shell that there is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kept {
    pub shell: Shell,
    /// What its picture is taken with.
    pub camera: CameraRecord,
    /// The last sort key of its particles.
    pub last_key: u32,
    /// Nearer than this are no centres of it that the view shows.
    pub depth: f64,
    /// Slopes of the view that it shows anything at, least and greatest.
    pub bounds: [DVec2; 2],
}

#[derive(Debug)]
pub struct Keeper {
    pub rules: Rules,
    last: Option<View>,
    kept: Option<Kept>,
}

impl Keeper {
    pub fn new(rules: Rules) -> Keeper {
        Keeper { rules, last: None, kept: None }
    }

    /// The next frame is like a first one.
    pub fn reset(&mut self) {
        (self.last, self.kept) = (None, None);
    }

    /// What `packet`'s frame shows. `changed`: what is other than in the last frame, but for the
    /// view.
    pub fn step(&mut self, packet: &Packet, changed: Option<&'static str>) -> Step {
        let now = view_of(&packet.camera);
        let last = self.last.replace(now);
        let kept = self.kept.take();
        if let Some(changed) = changed {
            return Step::Nothing(changed);
        }
        let why = match kept.map(|kept| (kept, self.usable(&kept, &now, packet))) {
            Some((kept, Ok((pixels, depth)))) => {
                let kept = Kept { depth, bounds: self.bounds(&kept, &now, packet), ..kept };
                self.kept = Some(kept);
                return Step::Reused { kept, pixels };
            }
            Some((_, Err(why))) => why,
            None => "there is none",
        };
        let Some(last) = last else {
            return Step::Nothing("how fast the eye moves is not known yet");
        };
        self.kept = self.best(packet, &last, &now);
        match self.kept {
            Some(kept) => Step::Made { kept, why },
            None => Step::Nothing("none would save anything"),
        }
    }

    /// Slopes of a pixel.
    fn pixel(&self, view: &View) -> f64 {
        2.0 * view.tangents.x / f64::from(self.rules.size[0])
    }

    /// Pixels that a shell is off by in `now`'s view and the least depth of its centres, or why it
    /// is not to be shown.
    fn usable(&self, kept: &Kept, now: &View, packet: &Packet) -> Result<(f64, f64), &'static str> {
        let pixels = self.off_by(&kept.shell, now)?;
        let far = &kept.shell.far;
        let ratio = kept.shell.predict(now).map_or(0.0, |p| p.depth_ratio);
        let nearest = ratio * far.nearest;
        let mut surfaces = packet
            .regions
            .iter()
            .filter(|r| matches!(r.kind, REGION_SURFACE | REGION_TERRAIN))
            .peekable();
        if surfaces.peek().is_some() {
            let farthest = packet.extents.iter().map(|e| depths(e, now)[1]).fold(0.0, f64::max);
            if surfaces.any(|r| is_among(r, now, [nearest, farthest])) {
                return Err("a surface is among what is far");
            }
        }
        Ok((pixels, nearest))
    }

    /// Pixels that a shell is off by in `now`'s view, or why it is not to be shown.
    fn off_by(&self, shell: &Shell, now: &View) -> Result<f64, &'static str> {
        let pixel = self.pixel(now);
        let Some(predicted) = shell.predict(now) else { return Err("the eye came too near") };
        let pixels = predicted.slopes() / pixel;
        // Written so that NaN is none.
        if !matches!(pixels, p if p <= self.rules.error) {
            return Err("it would be off by more than draw.impostor_error");
        }
        if shell.covers(now, FOOTPRINT * pixel) {
            Ok(pixels)
        } else {
            Err("the view leaves its picture")
        }
    }

    /// The shell that saves the most if the eye goes on as it came from `last` to `now`.
    fn best(&self, packet: &Packet, last: &View, now: &View) -> Option<Kept> {
        let pixel = self.pixel(now);
        let costs: Vec<f64> = packet.extents.iter().map(|e| self.cost(e, now, pixel)).collect();
        let sum = |costs: &[f64], cut: f64| -> f64 {
            packet.extents.iter().zip(costs).map(|(e, c)| c * share_beyond(e, now, cut)).sum()
        };
        let mut best: Option<(f64, Kept)> = None;
        for cut in cuts(&packet.extents, &costs, now) {
            let Some(kept) = self.shell(packet, now, cut) else { continue };
            let wide = View { tangents: kept.shell.view.tangents, ..*now };
            let in_shell: Vec<f64> =
                packet.extents.iter().map(|e| self.cost(e, &wide, pixel)).collect();
            let shown = (kept.bounds[1] - kept.bounds[0]) / pixel;
            let n = self.life(&kept, packet, last, now);
            let anew = sum(&in_shell, cut) / f64::from(n);
            let saved = sum(&costs, cut) - anew - SHOW_LAYERS * shown.x * shown.y;
            if n >= LEAST_LIFE && saved > best.as_ref().map_or(0.0, |(s, _)| *s) {
                best = Some((saved, kept));
            }
        }
        best.map(|(_, kept)| kept)
    }

    /// Frames that a shell would be shown in.
    fn life(&self, kept: &Kept, packet: &Packet, last: &View, now: &View) -> u32 {
        let axes = |v: &View| DMat3::from_cols(v.right, v.up, v.forward);
        let (moved, turn) = (now.eye - last.eye, axes(now) * axes(last).transpose());
        let mut view = *now;
        for n in 1..AHEAD {
            let turned = turn * axes(&view);
            let (right, up, forward) = (turned.x_axis, turned.y_axis, turned.z_axis);
            view = View { eye: view.eye + moved, right, up, forward, ..view };
            if self.usable(kept, &view, packet).is_err() {
                return n;
            }
        }
        AHEAD
    }

    /// The shell of all that is farther than `cut`; none where that is too near, or a surface is
    /// among it.
    fn shell(&self, packet: &Packet, now: &View, cut: f64) -> Option<Kept> {
        let Rules { size, shell_size, cutoff, .. } = self.rules;
        let beyond: Vec<(&Extent, [f64; 2])> = packet
            .extents
            .iter()
            .map(|e| (e, depths(e, now)))
            .filter(|(_, d)| d[1] >= cut)
            .collect();
        let sigma = beyond.iter().map(|(e, _)| e.sigma_max).fold(0.0, f64::max);
        let lengths = now.eye.abs().element_sum() + packet.radius;
        let (last_key, quantum) =
            last_key(cut + now.eye.dot(now.forward), packet.radius, packet.sort_bits)?;
        let nearest = cut - quantum - ROUNDING * lengths;
        let farthest =
            beyond.iter().map(|(_, d)| d[1]).fold(nearest, f64::max) + ROUNDING * lengths;
        let least = beyond.iter().map(|(e, d)| e.sigma_mean / d[1]).fold(f64::INFINITY, f64::min);
        if least < LEAST_SIGMA * self.pixel(now) {
            return None;
        }
        let far = FarField { nearest, farthest, sigma, radius: cutoff * sigma };
        // The far set's sprites must be drawn whole, and stay so.
        if nearest.is_nan()
            || nearest <= (LEAST_RADII * far.radius).max(2.0 * f64::from(packet.camera.near))
        {
            return None;
        }
        let wider = |k: usize| f64::from(shell_size[k]) / f64::from(size[k]);
        let tangents = now.tangents * DVec2::new(wider(0), wider(1));
        let camera =
            CameraRecord { tan_x: tangents.x as f32, tan_y: tangents.y as f32, ..packet.camera };
        let kept = Kept {
            shell: Shell { view: view_of(&camera), far },
            camera,
            last_key,
            depth: nearest,
            bounds: [-now.tangents, now.tangents],
        };
        let kept = Kept { bounds: self.bounds(&kept, now, packet), ..kept };
        self.usable(&kept, now, packet).is_ok().then_some(kept)
    }

    /// Slopes of `now`'s view that a shell shows anything at, least and greatest.
    fn bounds(&self, kept: &Kept, now: &View, packet: &Packet) -> [DVec2; 2] {
        let then = &kept.shell.view;
        let far = packet.extents.iter().filter(|e| depths(e, then)[1] >= kept.shell.far.nearest);
        let (mut low, mut high) = (now.tangents, -now.tangents);
        for extent in far {
            let c = extent.center - now.eye;
            let reach = self.rules.cutoff * extent.sigma_max;
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
        // Off by the error, the cubic's footprint, and a pixel for the rounding of both.
        let slack = (self.rules.error + FOOTPRINT + 1.0) * self.pixel(now);
        let (low, high) = ((low - slack).max(-now.tangents), (high + slack).min(now.tangents));
        [low.min(high), high]
    }

    /// Pixels, `pixel` slopes wide, of the layers that a group's particles make in a view.
    fn cost(&self, extent: &Extent, now: &View, pixel: f64) -> f64 {
        let c = extent.center - now.eye;
        let z = c.dot(now.forward).max(1e-3 * self.rules.cutoff * extent.sigma_mean);
        let reach = extent.half.length() + self.rules.cutoff * extent.sigma_max;
        let beside = |axis: DVec3, tan: f64| c.dot(axis).abs() - reach > tan * z.max(reach);
        if c.dot(now.forward) < -reach
            || beside(now.right, now.tangents.x)
            || beside(now.up, now.tangents.y)
        {
            return 0.0;
        }
        let radius = self.rules.cutoff * extent.sigma_mean / z;
        let all = 4.0 * now.tangents.x * now.tangents.y;
        f64::from(extent.n_particles) * (std::f64::consts::PI * radius * radius).min(all)
            / (pixel * pixel)
    }
}

/// The camera in f64, exactly as shaders have it.
pub fn view_of(camera: &CameraRecord) -> View {
    let f64s = |v: [f32; 3]| Vec3::from(v).as_dvec3();
    View {
        eye: f64s(camera.eye),
        right: f64s(camera.right),
        up: f64s(camera.up),
        forward: f64s(camera.forward),
        tangents: DVec2::new(camera.tan_x.into(), camera.tan_y.into()),
    }
}

/// Least and greatest view depth of a group's centres.
fn depths(extent: &Extent, view: &View) -> [f64; 2] {
    let (z, half) =
        ((extent.center - view.eye).dot(view.forward), view.forward.abs().dot(extent.half));
    [z - half, z + half]
}

/// The share of a group that is farther than `cut`, as if it were spread evenly over its depths.
fn share_beyond(extent: &Extent, view: &View, cut: f64) -> f64 {
    let [low, high] = depths(extent, view);
    if high > low {
        ((high - cut) / (high - low)).clamp(0.0, 1.0)
    } else {
        f64::from(u8::from(low >= cut))
    }
}

/// Depths that part the groups into equal parts of their costs, and one before all of them.
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

/// The last sort key of depths of at least `z` relative to the lighting origin, and how much less a
/// depth of that key may be; none where no depth has one.
fn last_key(z: f64, radius: f64, sort_bits: u32) -> Option<(u32, f64)> {
    if sort_bits == 32 {
        let z = z as f32;
        let bits = z.to_bits();
        let map = if bits & 0x8000_0000 != 0 { !bits } else { bits | 0x8000_0000 };
        return (!z.is_nan()).then_some((!map, 0.0));
    }
    let quantum = 2.0 * radius / 65536.0;
    let key = ((radius - z) / quantum).floor();
    // Written so that NaN is none.
    if matches!(key, k if k >= 0.0) { Some((key.min(65535.0) as u32, quantum)) } else { None }
}

/// Whether a surface or ground is neither nearer nor farther than all of some depths.
fn is_among(region: &RegionRecord, view: &View, [nearest, farthest]: [f64; 2]) -> bool {
    let f64s = |v: [f32; 3]| Vec3::from(v).as_dvec3();
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
