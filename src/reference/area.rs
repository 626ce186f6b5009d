//! The light of reflections integrated over the areas of surfaces, model.md §11 "area reference":
//! the truth that a sum over pairs of facets is measured against. In: surfaces with a material
//! each, lights, blobs, facets of clouds. Out: radiance toward the eye and irradiance, RGB, with an
//! error.

pub mod adaptive;
pub mod clip;
pub mod mean;
pub mod paths;
mod resolve;
#[cfg(test)]
mod tests;
pub mod visibility;

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec2, DVec3};

pub use adaptive::{Accuracy, Estimate};
use adaptive::{Cell, Integrand, NOTHING, Sample, triangles};
use clip::{Line, Polygon, WHOLE};
use visibility::{Rect, Source};

use super::Blob;
use crate::model::light::Light;
use crate::model::material::Brdf;
use crate::model::surface::Surface;

/// A cloud's facet, diffuse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscFacet {
    pub position: DVec3,
    pub normal: DVec3,
    pub area: f64,
    /// K_d times the particle's colour.
    pub kd: DVec3,
}

/// Part of a surface that the same lights reach.
#[derive(Debug, Clone, PartialEq)]
struct Piece {
    polygon: Polygon,
    /// Numbers of the lights, the sky among them where only its constant share gets here.
    lit: Vec<(usize, Reach)>,
}

/// How a light gets to a piece.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Reach {
    Open,
    /// A sky behind a surface: its constant share only.
    Shaded,
}

/// All that light meets.
pub struct AreaScene<'a> {
    pub lights: &'a [Light],
    pub blobs: &'a [Blob],
    /// g of model.md §8.
    pub forward: f64,
    pub discs: &'a [DiscFacet],
    rects: Vec<Rect>,
    brdfs: Vec<Brdf>,
    pieces: Vec<Vec<Piece>>,
    /// L1 of the discs, alike in every direction.
    disc_radiance: Vec<DVec3>,
}

/// A point that reflects: on a surface, or a cloud's facet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    pub position: DVec3,
    pub normal: DVec3,
    pub brdf: Brdf,
    i_disc: Option<usize>,
}

impl Receiver {
    /// A point of no surface and no disc.
    pub fn new(position: DVec3, normal: DVec3, brdf: Brdf) -> Receiver {
        Receiver { position, normal, brdf, i_disc: None }
    }
}

impl<'a> AreaScene<'a> {
    /// `brdfs` by surface.
    pub fn new(
        surfaces: &[Surface],
        brdfs: &[Brdf],
        lights: &'a [Light],
        blobs: &'a [Blob],
        forward: f64,
        discs: &'a [DiscFacet],
    ) -> Self {
        let rects: Vec<Rect> = surfaces.iter().map(Rect::of).collect();
        let brdfs = brdfs.to_vec();
        let mut scenery = AreaScene {
            lights,
            blobs,
            forward,
            discs,
            rects,
            brdfs,
            pieces: Vec::new(),
            disc_radiance: Vec::new(),
        };
        scenery.pieces = (0..scenery.rects.len()).map(|i| scenery.lit_pieces(i)).collect();
        scenery.disc_radiance =
            (0..discs.len()).map(|i| scenery.first(&scenery.on_disc(i), discs[i].normal)).collect();
        scenery
    }

    /// Surface `i`, parted by the shadows on it.
    fn lit_pieces(&self, i: usize) -> Vec<Piece> {
        let rect = &self.rects[i];
        let mut pieces = vec![Piece { polygon: WHOLE.to_vec(), lit: Vec::new() }];
        for (i_light, light) in self.lights.iter().enumerate() {
            let source = visibility::source_of(light);
            let behind = match source {
                Source::At(q) => rect.side_of(q) <= 0.0,
                Source::Toward(d) => rect.normal.dot(d) <= 0.0,
            };
            if behind && !light.is_sky() {
                continue;
            }
            let shadows: Vec<_> = self.shadows_on(rect, source).collect();
            let mut parted = Vec::with_capacity(pieces.len());
            for piece in pieces {
                let (shaded, open) = part(piece.polygon, &shadows);
                let with = |polygon, reach| {
                    let mut lit = piece.lit.clone();
                    if reach == Reach::Open || light.is_sky() {
                        lit.push((i_light, reach));
                    }
                    Piece { polygon, lit }
                };
                parted.extend(shaded.into_iter().map(|p| with(p, Reach::Shaded)));
                parted.extend(open.into_iter().map(|p| with(p, Reach::Open)));
            }
            pieces = parted;
        }
        pieces.retain(|piece| !piece.lit.is_empty());
        pieces
    }

    fn shadows_on(&self, rect: &Rect, source: Source) -> impl Iterator<Item = [Line; 5]> {
        self.rects.iter().filter_map(move |blocker| clip::shadow(rect, blocker, source))
    }

    pub fn on_surface(&self, i_surface: usize, position: DVec3) -> Receiver {
        Receiver::new(position, self.rects[i_surface].normal, self.brdfs[i_surface])
    }

    pub fn on_disc(&self, i: usize) -> Receiver {
        let DiscFacet { position, normal, kd, .. } = self.discs[i];
        Receiver { position, normal, brdf: Brdf { kd, ks: DVec3::ZERO, ns: 0.0 }, i_disc: Some(i) }
    }

    /// V of `light` at `p`.
    pub fn in_light(&self, p: DVec3, light: &Light) -> f64 {
        visibility::in_light(&self.rects, self.blobs, self.forward, p, light)
    }

    fn transmittance(&self, p: DVec3, source: Source) -> f64 {
        visibility::transmittance(self.blobs, self.forward, p, source)
    }

    /// L1 toward the unit vector `toward`; from behind its diffuse part.
    pub fn first(&self, at: &Receiver, toward: DVec3) -> DVec3 {
        let reflected = |light: &Light| {
            reflected(
                &at.brdf,
                at.normal,
                at.position,
                light,
                self.in_light(at.position, light),
                toward,
            )
            .0
        };
        self.lights.iter().map(reflected).sum()
    }

    /// I_d.
    pub fn irradiance(&self, at: &Receiver) -> DVec3 {
        let of = |light: &Light| {
            let v = self.in_light(at.position, light);
            light.energy() * light.share(at.normal, &light.arrival(at.position), v)
        };
        self.lights.iter().map(of).sum()
    }

    /// L1 toward `toward` and I_d at `x` on surface `i_surface`, in a piece that the lights `lit`
    /// reach.
    fn first_on_piece(
        &self,
        i_surface: usize,
        lit: &[(usize, Reach)],
        x: DVec3,
        toward: DVec3,
    ) -> Sample {
        let (brdf, normal) = (&self.brdfs[i_surface], self.rects[i_surface].normal);
        let mut sum = NOTHING;
        for &(i_light, reach) in lit {
            let light = &self.lights[i_light];
            let v = match reach {
                Reach::Open => self.transmittance(x, visibility::source_of(light)),
                Reach::Shaded => 0.0,
            };
            let (radiance, irradiance) = reflected(brdf, normal, x, light, v, toward);
            sum[0] += radiance;
            sum[1] += irradiance;
        }
        sum
    }

    /// L2 toward the unit vector `toward`, and I_i.
    pub fn second(&self, at: &Receiver, toward: DVec3, accuracy: &Accuracy) -> Estimate {
        let (mut pieces, mut cells) = (Vec::new(), Vec::new());
        for (i_surface, rect) in self.rects.iter().enumerate() {
            // Its back, or its own plane.
            if rect.side_of(at.position) <= 0.0 {
                continue;
            }
            let shadows: Vec<_> = self.shadows_on(rect, Source::At(at.position)).collect();
            let horizon = Line::of_plane(rect, at.normal, at.position);
            for piece in &self.pieces[i_surface] {
                let above = clip::cut(&piece.polygon, &horizon, 1.0);
                for polygon in part(above, &shadows).1 {
                    cells.extend(triangles(&polygon, pieces.len()));
                }
                pieces.push((i_surface, piece.lit.as_slice()));
            }
        }
        let seen = Seen { scenery: self, at, toward, pieces, relative: accuracy.relative };
        adaptive::integrate(&seen, cells.into_iter(), self.of_discs(at, toward), accuracy)
    }

    /// What the discs send, by the law of pairs: L cos θ_i cos θ_j A/(d² + A/π).
    fn of_discs(&self, at: &Receiver, toward: DVec3) -> Sample {
        let mut sum = NOTHING;
        for i in (0..self.discs.len()).filter(|&i| at.i_disc != Some(i)) {
            let (e, direction) = self.of_disc(i, at, self.disc_radiance[i]);
            sum[0] += e * reflectance(&at.brdf, at.normal, direction, toward);
            sum[1] += e;
        }
        sum
    }

    /// Irradiance that disc `i` brings if its radiance is `radiance`, and from where.
    fn of_disc(&self, i: usize, at: &Receiver, radiance: DVec3) -> (DVec3, DVec3) {
        let disc = &self.discs[i];
        let direction = (disc.position - at.position).normalize_or_zero();
        let (pair, source) = (self.pair(i, at), Source::At(disc.position));
        if pair == 0.0 || !visibility::is_open(&self.rects, at.position, source) {
            return (DVec3::ZERO, direction);
        }
        (radiance * (pair * self.transmittance(at.position, source)), direction)
    }

    /// cos θ_i cos θ_j A/(d² + A/π) of disc `i`; 0 where one is behind the other.
    fn pair(&self, i: usize, at: &Receiver) -> f64 {
        let disc = &self.discs[i];
        let offset = disc.position - at.position;
        let direction = offset.normalize_or_zero();
        let (cos_j, cos_i) = (at.normal.dot(direction), -disc.normal.dot(direction));
        let cosines = if cos_j <= 0.0 || cos_i <= 0.0 { 0.0 } else { cos_i * cos_j };
        cosines * disc.area / (offset.length_squared() + disc.area * FRAC_1_PI)
    }
}

/// The parts of `polygon` inside any of the shadows, and those inside none.
fn part(polygon: Polygon, shadows: &[[Line; 5]]) -> (Vec<Polygon>, Vec<Polygon>) {
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

/// C (11): f for light from the unit vector `from` reflected along `toward`, both before the front
/// side.
pub fn reflectance(brdf: &Brdf, normal: DVec3, from: DVec3, toward: DVec3) -> DVec3 {
    let diffuse = brdf.kd * FRAC_1_PI;
    if brdf.ks == DVec3::ZERO || normal.dot(from) <= 0.0 || normal.dot(toward) <= 0.0 {
        return diffuse;
    }
    // 1 − cos γ = |n − h|²/2 keeps its digits where γ is small.
    let w = 0.5 * (normal - (from + toward).normalize_or_zero()).length_squared();
    diffuse + brdf.ks * Brdf::lobe(brdf.ns, w)
}

/// L1 and I_d that one light makes at `p`; the sky has no direction that a lobe could reflect.
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

/// The light that a receiver sees and reflects, over the surfaces' areas.
struct Seen<'s, 'a> {
    scenery: &'s AreaScene<'a>,
    at: &'s Receiver,
    toward: DVec3,
    /// Surface, and the lights that reach the piece.
    pieces: Vec<(usize, &'s [(usize, Reach)])>,
    relative: f64,
}

impl Integrand for Seen<'_, '_> {
    fn at(&self, i_piece: usize, x: DVec2) -> Sample {
        let (i_surface, lit) = self.pieces[i_piece];
        let rect = &self.scenery.rects[i_surface];
        let point = rect.point(x.x, x.y);
        let kernel = kernel(self.at, rect, point);
        if kernel <= 0.0 {
            return NOTHING;
        }
        let direction = (point - self.at.position).normalize();
        let v = self.scenery.transmittance(self.at.position, Source::At(point));
        let e = self.scenery.first_on_piece(i_surface, lit, point, -direction)[0] * (kernel * v);
        [e * reflectance(&self.at.brdf, self.at.normal, direction, self.toward), e, DVec3::ZERO]
    }

    fn is_resolved(&self, cell: &Cell) -> bool {
        resolve::seen_is_resolved(self, cell)
    }

    fn length_squared(&self, i_piece: usize, d: DVec2) -> f64 {
        self.scenery.rects[self.pieces[i_piece].0].length_squared(d)
    }
}

/// cos θ_i cos θ_j dA/d² per unit of (s, t).
fn kernel(at: &Receiver, rect: &Rect, point: DVec3) -> f64 {
    let way = point - at.position;
    let d2 = way.length_squared();
    let (j, i) = (at.normal.dot(way), -rect.normal.dot(way));
    if j <= 0.0 || i <= 0.0 { 0.0 } else { i * j / (d2 * d2) * rect.u.length() * rect.v.length() }
}

/// The form factor from an element at `p` with unit normal `normal` to the front of `surface`, and
/// its error.
pub fn form_factor(surface: &Surface, p: DVec3, normal: DVec3, accuracy: &Accuracy) -> (f64, f64) {
    // A lamp of uniform radiance 1: white under a sky that lights everything with π.
    let sky = [Light::Sky { irradiance: DVec3::splat(PI), constant: 1.0 }];
    let white = Brdf { kd: DVec3::ONE, ks: DVec3::ZERO, ns: 0.0 };
    let mut scenery = AreaScene::new(&[*surface], &[white], &sky, &[], 0.0, &[]);
    scenery.pieces[0] = vec![Piece { polygon: WHOLE.to_vec(), lit: vec![(0, Reach::Shaded)] }];
    let e = scenery.second(&Receiver::new(p, normal, white), normal, accuracy);
    (e.irradiance.x * FRAC_1_PI, e.irradiance_error * FRAC_1_PI)
}
