//! Surfaces divided by their shadows, lights, blobs and facets of clouds, with the first reflection
//! at any point.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use super::adaptive::{NOTHING, Sample};
use super::clip::{self, Line, Polygon, WHOLE};
use super::visibility;
use crate::model::light::Light;
use crate::model::material::Brdf;
use crate::model::parallel::parallel_map;
use crate::model::surface::Surface;
use crate::reference::Blob;
use crate::reference::brdf::reflectance;
use crate::reference::occlude::{Rectangle, Source, source_of};
use crate::reference::relief::Ground;

/// A diffuse facet of a cloud or of the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscFacet {
    /// Centre.
    pub position: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// Area.
    pub area: f64,
    /// K_d times the particle's colour.
    pub kd: DVec3,
}

/// Part of a surface that one set of lights reaches.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LitRegion {
    pub polygon: Polygon,
    /// Indices of the lights that reach the region, and how.
    pub lit: Vec<(usize, Exposure)>,
}

/// How a light reaches a region of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Exposure {
    Open,
    /// Behind another surface: only the constant share of a sky arrives.
    Shaded,
}

/// Everything that light meets: surfaces, blobs, facets of clouds and ground, and the lights.
pub struct AreaScene<'a> {
    pub(super) lights: &'a [Light],
    pub(super) blobs: &'a [Blob],
    /// g of model.md §8.
    pub(super) forward: f64,
    pub(super) discs: &'a [DiscFacet],
    pub(super) rectangles: Vec<Rectangle>,
    pub(super) brdfs: Vec<Brdf>,
    /// Lit regions of every surface.
    pub(super) regions: Vec<Vec<LitRegion>>,
    /// L1 of the discs, the same in every direction.
    pub(super) disc_radiance: Vec<DVec3>,
    /// Ground that hides lights from the first discs, its points, and their number.
    ground: Option<(&'a Ground, usize)>,
}

/// A point that reflects: on a surface, or a cloud's facet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    /// Position.
    pub position: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// Material.
    pub brdf: Brdf,
    pub(super) i_disc: Option<usize>,
}

impl Receiver {
    /// Returns a receiver that belongs to no surface and no disc.
    pub fn new(position: DVec3, normal: DVec3, brdf: Brdf) -> Receiver {
        Receiver { position, normal, brdf, i_disc: None }
    }
}

impl<'a> AreaScene<'a> {
    /// Divides the surfaces by their shadows and lights the discs. `brdfs` by surface; `forward`
    /// is g of model.md §8.
    pub fn new(
        surfaces: &[Surface],
        brdfs: &[Brdf],
        lights: &'a [Light],
        blobs: &'a [Blob],
        forward: f64,
        discs: &'a [DiscFacet],
    ) -> Self {
        let mut scene = AreaScene {
            lights,
            blobs,
            forward,
            discs,
            rectangles: surfaces.iter().map(|s| Rectangle::new(s, DVec3::ZERO)).collect(),
            brdfs: brdfs.to_vec(),
            regions: Vec::new(),
            disc_radiance: Vec::new(),
            ground: None,
        };
        scene.regions = scene.rectangles.iter().map(|r| scene.lit_regions(r)).collect();
        scene.disc_radiance = scene.lit_discs(discs.len());
        scene
    }

    /// Returns the scene with ground that hides lights from its points, the first `n_points` discs.
    pub fn behind_ground(mut self, ground: Option<&'a Ground>, n_points: usize) -> Self {
        let n = n_points.min(self.discs.len());
        if let Some(ground) = ground.filter(|_| n > 0) {
            self.ground = Some((ground, n));
            let lit = self.lit_discs(n);
            self.disc_radiance[..n].copy_from_slice(&lit);
        }
        self
    }

    fn lit_discs(&self, n: usize) -> Vec<DVec3> {
        parallel_map(n, |i| self.first(&self.on_disc(i), self.discs[i].normal))
    }

    /// Returns L1 of every disc.
    pub fn disc_radiance(&self) -> &[DVec3] {
        &self.disc_radiance
    }

    fn lit_regions(&self, rectangle: &Rectangle) -> Vec<LitRegion> {
        let mut regions = vec![LitRegion { polygon: WHOLE.to_vec(), lit: Vec::new() }];
        for (i_light, light) in self.lights.iter().enumerate() {
            let source = source_of(light);
            let is_behind = match source {
                Source::At(q) => rectangle.side(q) <= 0.0,
                Source::Toward(d) => rectangle.normal.dot(d) <= 0.0,
            };
            if is_behind && !light.is_sky() {
                continue;
            }
            let shadows: Vec<_> = self.shadows_on(rectangle, source).collect();
            let mut divided = Vec::with_capacity(regions.len());
            for region in regions {
                let (shaded, open) = divide(region.polygon, &shadows);
                let with = |polygon, exposure| {
                    let mut lit = region.lit.clone();
                    if exposure == Exposure::Open || light.is_sky() {
                        lit.push((i_light, exposure));
                    }
                    LitRegion { polygon, lit }
                };
                divided.extend(shaded.into_iter().map(|p| with(p, Exposure::Shaded)));
                divided.extend(open.into_iter().map(|p| with(p, Exposure::Open)));
            }
            regions = divided;
        }
        regions.retain(|region| !region.lit.is_empty());
        regions
    }

    pub(super) fn shadows_on(
        &self,
        rectangle: &Rectangle,
        source: Source,
    ) -> impl Iterator<Item = [Line; 5]> {
        self.rectangles.iter().filter_map(move |blocker| clip::shadow(rectangle, blocker, source))
    }

    /// Returns the receiver at a point of surface `i_surface`.
    pub fn on_surface(&self, i_surface: usize, position: DVec3) -> Receiver {
        Receiver::new(position, self.rectangles[i_surface].normal, self.brdfs[i_surface])
    }

    /// Returns disc `i` as a receiver.
    pub fn on_disc(&self, i: usize) -> Receiver {
        let DiscFacet { position, normal, kd, .. } = self.discs[i];
        Receiver { position, normal, brdf: Brdf { kd, ks: DVec3::ZERO, ns: 0.0 }, i_disc: Some(i) }
    }

    /// Returns V of `light` at `p`: 0 behind a surface, else the blobs' transmittance.
    pub fn visibility(&self, p: DVec3, light: &Light) -> f64 {
        let source = source_of(light);
        if visibility::is_open(&self.rectangles, p, source) {
            self.transmittance(p, source)
        } else {
            0.0
        }
    }

    /// Returns V of `light` at a receiver.
    fn arriving(&self, at: &Receiver, light: &Light) -> f64 {
        let is_hidden = |(ground, n_points): (&Ground, usize)| {
            at.i_disc.is_some_and(|i| i < n_points) && ground.hides(at.position, light, 0.0)
        };
        if self.ground.is_some_and(is_hidden) { 0.0 } else { self.visibility(at.position, light) }
    }

    pub(super) fn transmittance(&self, p: DVec3, source: Source) -> f64 {
        visibility::transmittance(self.blobs, self.forward, p, source)
    }

    /// Returns L1 toward the unit vector `toward`, W m⁻² sr⁻¹; from behind only its diffuse part.
    pub fn first(&self, at: &Receiver, toward: DVec3) -> DVec3 {
        let radiance = |light: &Light| {
            let v = self.arriving(at, light);
            reflected(&at.brdf, at.normal, at.position, light, v, toward).0
        };
        self.lights.iter().map(radiance).sum()
    }

    /// Returns I_d, W m⁻².
    pub fn irradiance(&self, at: &Receiver) -> DVec3 {
        let of = |light: &Light| {
            let v = self.arriving(at, light);
            light.energy() * light.share(at.normal, &light.arrival(at.position), v)
        };
        self.lights.iter().map(of).sum()
    }

    /// L1 toward `toward` and I_d at `x` on surface `i_surface`, in a region that `lit` reaches.
    pub(super) fn first_in_region(
        &self,
        i_surface: usize,
        lit: &[(usize, Exposure)],
        x: DVec3,
        toward: DVec3,
    ) -> Sample {
        let (brdf, normal) = (&self.brdfs[i_surface], self.rectangles[i_surface].normal);
        let mut sum = NOTHING;
        for &(i_light, exposure) in lit {
            let light = &self.lights[i_light];
            let v = match exposure {
                Exposure::Open => self.transmittance(x, source_of(light)),
                Exposure::Shaded => 0.0,
            };
            let (radiance, irradiance) = reflected(brdf, normal, x, light, v, toward);
            sum[0] += radiance;
            sum[1] += irradiance;
        }
        sum
    }

    /// Irradiance from disc `i` if its radiance is `radiance`, and the direction it comes from.
    pub(super) fn disc_light(&self, i: usize, at: &Receiver, radiance: DVec3) -> (DVec3, DVec3) {
        let disc = &self.discs[i];
        let direction = (disc.position - at.position).normalize_or_zero();
        let (form, source) = (self.disc_form_factor(i, at), Source::At(disc.position));
        if form == 0.0 || !visibility::is_open(&self.rectangles, at.position, source) {
            return (DVec3::ZERO, direction);
        }
        (radiance * (form * self.transmittance(at.position, source)), direction)
    }

    /// cos θ_i cos θ_j A/(d² + A/π) of disc `i`; 0 where one faces away from the other.
    pub(super) fn disc_form_factor(&self, i: usize, at: &Receiver) -> f64 {
        let disc = &self.discs[i];
        let offset = disc.position - at.position;
        let direction = offset.normalize_or_zero();
        let (cos_j, cos_i) = (at.normal.dot(direction), -disc.normal.dot(direction));
        let cosines = if cos_j <= 0.0 || cos_i <= 0.0 { 0.0 } else { cos_i * cos_j };
        cosines * disc.area / (offset.length_squared() + disc.area * FRAC_1_PI)
    }
}

/// Returns the parts of `polygon` inside any of the shadows, and the parts inside none.
pub(super) fn divide(polygon: Polygon, shadows: &[[Line; 5]]) -> (Vec<Polygon>, Vec<Polygon>) {
    if polygon.is_empty() {
        return (Vec::new(), Vec::new());
    }
    let (mut shaded, mut open) = (Vec::new(), vec![polygon]);
    for lines in shadows {
        let mut left = Vec::with_capacity(open.len());
        for polygon in open {
            let (inside, mut outside) = clip::split(polygon, lines);
            if !inside.is_empty() {
                shaded.push(inside);
            }
            left.append(&mut outside);
        }
        open = left;
    }
    (shaded, open)
}

/// L1 and I_d that one light causes at `p`. The sky has no direction that a lobe could reflect.
fn reflected(
    brdf: &Brdf,
    normal: DVec3,
    p: DVec3,
    light: &Light,
    v: f64,
    toward: DVec3,
) -> (DVec3, DVec3) {
    let arrival = light.arrival(p);
    let e = light.energy() * light.share(normal, &arrival, v);
    let f = if light.is_sky() {
        brdf.kd * FRAC_1_PI
    } else {
        reflectance(brdf, normal, arrival.toward, toward)
    };
    (e * f, e)
}
