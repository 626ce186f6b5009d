//! The law of the second reflection, C (16): radiance and irradiance at a receiver, integrated over
//! the areas of all surfaces. The facets of clouds and ground count as discs.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec2, DVec3};

use super::adaptive::{self, Accuracy, Cell, Estimate, Integrand, NOTHING, Sample, triangles};
use super::clip::{self, Line, WHOLE};
use super::resolve::{self, ViewOfSurface};
use super::scene::{AreaScene, Exposure, LitRegion, Receiver, divide};
use crate::model::light::Light;
use crate::model::material::Brdf;
use crate::model::surface::Surface;
use crate::reference::brdf::reflectance;
use crate::reference::occlude::{Rectangle, Source};

impl AreaScene<'_> {
    /// Returns L2 toward the unit vector `toward`, and I_i, with error estimates.
    ///
    /// *Source*: C (16); model.md §7, passes.md "area reference".
    pub fn second(&self, at: &Receiver, toward: DVec3, accuracy: &Accuracy) -> Estimate {
        let (mut regions, mut cells) = (Vec::new(), Vec::new());
        for (i_surface, rectangle) in self.rectangles.iter().enumerate() {
            // The receiver sees the surface's back, or lies in its plane.
            if rectangle.side(at.position) <= 0.0 {
                continue;
            }
            let shadows: Vec<_> = self.shadows_on(rectangle, Source::At(at.position)).collect();
            let horizon = Line::of_plane(rectangle, at.normal, at.position);
            for region in &self.regions[i_surface] {
                let above = clip::cut(&region.polygon, &horizon, 1.0);
                for polygon in divide(above, &shadows).1 {
                    cells.extend(triangles(&polygon, regions.len()));
                }
                regions.push((i_surface, region.lit.as_slice()));
            }
        }
        let incident =
            IncidentLight { scene: self, at, toward, regions, relative: accuracy.relative };
        adaptive::integrate(&incident, cells.into_iter(), self.discs_light(at, toward), accuracy)
    }

    /// Light from all discs: Σ L cos θ_i cos θ_j A/(d² + A/π).
    fn discs_light(&self, at: &Receiver, toward: DVec3) -> Sample {
        let mut sum = NOTHING;
        for i in (0..self.discs.len()).filter(|&i| at.i_disc != Some(i)) {
            let (e, direction) = self.disc_light(i, at, self.disc_radiance[i]);
            sum[0] += e * reflectance(&at.brdf, at.normal, direction, toward);
            sum[1] += e;
        }
        sum
    }
}

/// The light that a receiver sees and reflects, over the surfaces' areas.
struct IncidentLight<'s, 'a> {
    scene: &'s AreaScene<'a>,
    at: &'s Receiver,
    toward: DVec3,
    /// Surface of every region, and the lights that reach the region.
    regions: Vec<(usize, &'s [(usize, Exposure)])>,
    relative: f64,
}

impl Integrand for IncidentLight<'_, '_> {
    fn at(&self, i_region: usize, x: DVec2) -> Sample {
        let (i_surface, lit) = self.regions[i_region];
        let rectangle = &self.scene.rectangles[i_surface];
        let point = rectangle.point(x.x, x.y);
        let kernel = kernel(self.at, rectangle, point);
        if kernel <= 0.0 {
            return NOTHING;
        }
        let direction = (point - self.at.position).normalize();
        let v = self.scene.transmittance(self.at.position, Source::At(point));
        let e = self.scene.first_in_region(i_surface, lit, point, -direction)[0] * (kernel * v);
        [e * reflectance(&self.at.brdf, self.at.normal, direction, self.toward), e, DVec3::ZERO]
    }

    fn is_resolved(&self, cell: &Cell) -> bool {
        let (i_surface, lit) = self.regions[cell.i_region];
        let view = ViewOfSurface { scene: self.scene, i_surface, lit, relative: self.relative };
        resolve::is_incident_resolved(&view, self.at, self.toward, cell)
    }

    fn length_squared(&self, i_region: usize, d: DVec2) -> f64 {
        self.scene.rectangles[self.regions[i_region].0].length_squared(d)
    }
}

/// cos θ_i cos θ_j dA/d² per unit of (s, t).
fn kernel(at: &Receiver, rectangle: &Rectangle, point: DVec3) -> f64 {
    let way = point - at.position;
    let d2 = way.length_squared();
    let (j, i) = (at.normal.dot(way), -rectangle.normal.dot(way));
    if j <= 0.0 || i <= 0.0 {
        return 0.0;
    }
    i * j / (d2 * d2) * rectangle.u.length() * rectangle.v.length()
}

/// Returns the form factor from an element at `p` with unit normal `normal` to the front of
/// `surface`, and its error estimate.
pub fn form_factor(surface: &Surface, p: DVec3, normal: DVec3, accuracy: &Accuracy) -> (f64, f64) {
    // A white surface under a sky that lights everything with π has radiance 1 everywhere.
    let sky = [Light::even_sky(DVec3::splat(PI), 1.0)];
    let white = Brdf { kd: DVec3::ONE, ks: DVec3::ZERO, ns: 0.0 };
    let mut scene = AreaScene::new(&[*surface], &[white], &sky, &[], 0.0, &[]);
    scene.regions[0] =
        vec![LitRegion { polygon: WHOLE.to_vec(), lit: vec![(0, Exposure::Shaded)] }];
    let e = scene.second(&Receiver::new(p, normal, white), normal, accuracy);
    (e.irradiance.x * FRAC_1_PI, e.irradiance_error * FRAC_1_PI)
}
