//! From group-relative positions to positions relative to the lighting origin O: model.md §11 "Frames of
//! reference". All in f64; the GPU rounds the offset once and the sum once.

use glam::DVec3;

use super::Blob;
use super::generate::Generated;
use crate::model::cloud::{Cloud, Group};

/// Offset of every group's particles: cloud origin(t) + group centre − O.
pub fn offsets(groups: &[Group], clouds: &[Cloud], time_s: f64, origin: DVec3) -> Vec<DVec3> {
    groups.iter().map(|g| clouds[g.i_cloud].origin_at(time_s) + g.center - origin).collect()
}

/// Centre of every cloud relative to O at `time_s`: what the facets' fallback normal points away from.
pub fn cloud_centers(clouds: &[Cloud], time_s: f64, origin: DVec3) -> Vec<DVec3> {
    clouds.iter().map(|c| c.origin_at(time_s) + c.center() - origin).collect()
}

/// Placed positions: particle k of group g at positions[g.i_first + k] + offsets[g].
pub fn place(positions: &[DVec3], groups: &[Group], offsets: &[DVec3]) -> Vec<DVec3> {
    let mut placed = positions.to_vec();
    for (group, offset) in groups.iter().zip(offsets) {
        let first = group.i_first as usize;
        for p in &mut placed[first..first + group.n_particles as usize] {
            *p += *offset;
        }
    }
    placed
}

/// Number of the cloud (the region) that each particle belongs to.
pub fn regions(groups: &[Group]) -> Vec<u32> {
    groups.iter().flat_map(|g| std::iter::repeat_n(g.i_cloud as u32, g.n_particles as usize)).collect()
}

/// Generated particles at their placed positions.
pub fn blobs(generated: &[Generated], placed: &[DVec3]) -> Vec<Blob> {
    generated.iter().zip(placed).map(|(g, &position)| Blob { position, sigma: g.sigma, kappa: g.kappa }).collect()
}
