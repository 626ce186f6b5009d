//! The light that every particle of a frame is drawn with.

use glam::DVec3;

use super::frame::FrameReference;
use crate::model::grid::DEPOSIT_CUT_SIGMA;
use crate::model::scene::Scene;
use crate::model::shade::{FacetSlope, Shade};
use crate::model::sky::Haze;
use crate::reference::sprites::CellLight;
use crate::reference::{self, Blob};

impl FrameReference {
    /// Returns L1 + L2 of facet `i` toward the eye, and behind the air where the scene has some.
    pub fn facet_radiance(&self, i: usize) -> DVec3 {
        self.behind_air(i).map_or_else(|| self.radiance_of(i), |(radiance, _)| radiance)
    }

    fn radiance_of(&self, i: usize) -> DVec3 {
        self.radiance[i] + self.second.get(i).copied().unwrap_or(DVec3::ZERO)
    }

    /// Returns the radiance of facet `i` as it is seen, and the factor of its change that the air
    /// makes; `None` without air.
    fn behind_air(&self, i: usize) -> Option<(DVec3, f64)> {
        let eye = self.state.pose.position - self.state.light_origin;
        let offset = || self.facets[i].position - eye;
        let sea = self.seas.get(i).copied().flatten();
        self.sky.map(|view| reference::haze::seen(&view, offset(), self.radiance_of(i), sea))
    }

    /// Returns the air before facet `i`, with what a sea mirrors in its light; none without a sky.
    pub fn air_before(&self, i: usize) -> Haze {
        let nothing = Haze { through: DVec3::ONE, added: DVec3::ZERO };
        let Some(view) = self.sky else { return nothing };
        let offset = self.facets[i].position - (self.state.pose.position - self.state.light_origin);
        let sea = self.seas.get(i).copied().flatten();
        // The facet counts as dark.
        let (added, _) = reference::haze::seen(&view, offset, DVec3::ZERO, sea);
        Haze { through: view.before(offset).through, added }
    }

    /// Returns the radiance that every particle is drawn with: that of its facet, or its own
    /// colour if nothing is lit.
    pub fn particle_radiance(&self, scene: &Scene) -> Vec<DVec3> {
        if self.facets.is_empty() {
            return self.colors.clone();
        }
        self.particle_facets(scene).into_iter().map(|i| self.facet_radiance(i as usize)).collect()
    }

    /// Returns the light of cells that slices have where they are; `None` where they have that of
    /// their particles.
    pub fn particle_cells(&self, scene: &Scene) -> Option<CellLight<'_>> {
        let of = self.cells.as_ref().filter(|_| scene.has_light_of_cells())?;
        let means = self.particle_facets(scene).into_iter().map(|i| of.means[i as usize]);
        Some(CellLight { cells: &of.cells, means: means.collect() })
    }

    /// Returns the light inside of every one of `blobs`, as they are drawn; `None` where it is the
    /// same throughout, or that of cells.
    pub fn particle_shades(&self, scene: &Scene, blobs: &[Blob]) -> Option<Vec<Shade>> {
        if scene.has_light_of_cells() {
            return None;
        }
        let shade = |(blob, i): (&Blob, u32)| {
            let FacetSlope { relative, position } = self.slopes[i as usize];
            let relative = self.behind_air(i as usize).map_or(1.0, |(_, share)| share) * relative;
            let is_apart = scene.groups_facets() || scene.draw.lod > 0.0;
            let apart = if is_apart { blob.position - position } else { DVec3::ZERO };
            Shade::new(relative, apart, blob.sigma, &blob.shape)
        };
        let shades = || blobs.iter().zip(self.particle_facets(scene)).map(shade).collect();
        (!self.slopes.is_empty()).then(shades)
    }

    /// Returns the facet that every particle is lit as, whether or not the facets are lit.
    pub fn particle_facets(&self, scene: &Scene) -> Vec<u32> {
        let n_before = scene.n_solid_facets() as u32;
        let n_blobs = self.blobs.len() as u32;
        if !scene.groups_facets() {
            return (n_before..n_before + n_blobs).collect();
        }
        let order = self.morton_order(scene, &reference::place::regions(&self.groups));
        let mut found = vec![0; self.blobs.len()];
        for (k, (first, end)) in (n_before..).zip(scene.facet_runs()) {
            for place in first..end {
                found[order[place as usize] as usize] = k;
            }
        }
        found
    }

    /// Particles in Morton order, cloud by cloud.
    pub(super) fn morton_order(&self, scene: &Scene, i_cloud: &[u32]) -> Vec<u32> {
        let (n_solids, origin) = (scene.n_solids() as u32, self.state.light_origin);
        let bounds = scene.region_bounds(&self.groups, self.state.time_s, DEPOSIT_CUT_SIGMA);
        let bounds: Vec<_> =
            bounds.into_iter().map(|(low, high)| (low - origin, high - origin)).collect();
        let positions: Vec<DVec3> = self.blobs.iter().map(|b| b.position).collect();
        let regions: Vec<u32> = i_cloud.iter().map(|i| n_solids + i).collect();
        reference::morton::order(&positions, &regions, &bounds)
    }
}
