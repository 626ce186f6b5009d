//! The light of surfaces in a frame, in closed form.

use std::f64::consts::PI;

use glam::DVec3;

use super::frame::{FrameReference, SecondOf};
use super::local_scene::LocalScene;
use crate::model::light::Light;
use crate::model::parallel::parallel_map;
use crate::model::scene::{LightingMode, Scene};
use crate::model::shade::FacetSlope;
use crate::reference::area::adaptive::Accuracy;
use crate::reference::area::{AreaScene, DiscFacet, Receiver};
use crate::reference::facets::Facet;

impl FrameReference {
    /// Puts the surfaces' facets before all others, lit by the area reference, with `more`
    /// irradiance by diffuse light. `lights` reach them through a share of the depth, 1 less the
    /// number beside them.
    pub(super) fn light_surfaces<T>(
        &mut self,
        scene: &Scene,
        local: &LocalScene,
        (lights, forward): (&[Light], f64),
        more: &[DVec3],
        take: impl FnOnce(&FrameReference, &SecondOf<'_>) -> T,
    ) -> T {
        let disc = |(f, c): (&Facet, &DVec3)| local.disc(f, *c);
        let discs: Vec<DiscFacet> = match scene.lighting.mode {
            LightingMode::TwoReflection => {
                self.facets.iter().zip(&self.facet_colors).map(disc).collect()
            }
            // They reflect onto nothing.
            _ => vec![],
        };
        let area_scene = AreaScene::new(
            &local.surfaces,
            local.surface_brdfs(),
            lights,
            &self.blobs,
            forward,
            &discs,
        )
        .behind_ground(local.relief.as_ref(), local.ground.len());
        let flat: Vec<Facet> = local.surface_facets().collect();
        let eye = self.state.pose.position - self.state.light_origin;
        let on_surfaces = flat.iter().map(|f| area_scene.on_surface(f.region as usize, f.position));
        let receivers: Vec<(Receiver, DVec3)> = on_surfaces
            .chain((0..discs.len()).map(|i| area_scene.on_disc(i)))
            .map(|r| (r, (eye - r.position).normalize_or(r.normal)))
            .collect();
        let of_surfaces = &receivers[..flat.len()];
        let n = of_surfaces.len();
        let of_more = |i: usize| more.get(i).copied().unwrap_or(DVec3::ZERO);
        let first = parallel_map(n, |i| {
            let (at, toward) = &of_surfaces[i];
            area_scene.first(at, *toward) + at.brdf.kd * of_more(i) / PI
        });
        let irradiance = parallel_map(n, |i| area_scene.irradiance(&of_surfaces[i].0) + of_more(i));
        self.radiance.splice(0..0, first);
        if !self.slopes.is_empty() {
            let even = |f: &Facet| FacetSlope { relative: DVec3::ZERO, position: f.position };
            self.slopes.splice(0..0, flat.iter().map(even));
        }
        if let Some(of) = &mut self.cells {
            of.means.splice(0..0, flat.iter().map(|_| 0.0));
        }
        self.irradiance.splice(0..0, irradiance);
        self.facet_colors.splice(0..0, std::iter::repeat_n(DVec3::ONE, flat.len()));
        self.facets.splice(0..0, flat);
        self.grid_error = self.error_of_grid(area_scene.disc_radiance());
        let accuracy = Accuracy::relative(SECOND_ACCURACY);
        take(self, &|i| area_scene.second(&receivers[i].0, receivers[i].1, &accuracy))
    }

    /// Returns [`FrameReference::grid_error`]. `closed` is L1 of the last facets, in closed form.
    fn error_of_grid(&self, closed: &[DVec3]) -> f64 {
        let n_before = self.facets.len() - closed.len();
        let facets = self.facets[n_before..].iter().zip(&self.radiance[n_before..]).zip(closed);
        let (off, all) = facets.fold((DVec3::ZERO, DVec3::ZERO), |(off, all), ((f, grid), l)| {
            (off + f.area * (*l - *grid).abs(), all + f.area * *l)
        });
        let shares = [0, 1, 2].map(|k| if all[k] > 0.0 { off[k] / all[k] } else { 0.0 });
        shares.into_iter().fold(0.0, f64::max)
    }
}

/// Relative accuracy of the second reflection: a hundredth of the 1 % that devices are held to.
const SECOND_ACCURACY: f64 = 1e-4;
