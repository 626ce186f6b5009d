//! The part of each group that a frame draws: nothing if the group cannot be in the picture, else
//! as many particles as its distance and size ask for. Lighting does not depend on it.

use glam::DVec3;

use super::features::tau_bound;
use crate::layout::particle::DrawnRecord;
use crate::model::cloud::Group;
use crate::model::count::DrawnCount;
use crate::model::frame_state::FrameState;
use crate::model::scene::Scene;
use crate::model::visibility::Frustum;

/// Returns the drawn part of each of `groups`, as they have grown, and the number of drawn
/// particles. With `culls`, groups that cannot be in the picture are left out.
pub(super) fn drawn_groups(
    scene: &Scene,
    groups: &[Group],
    setting: &FrameState,
    culls: bool,
) -> (Vec<DrawnRecord>, u32) {
    let frustum = Frustum::of(&scene.camera, &setting.pose, &scene.film, scene.widening());
    let eye = setting.pose.position;
    // Coordinates, also the eye's, are relative to the lighting origin.
    let lengths = (eye - setting.light_origin).abs().element_sum() + setting.radius;
    let mut n_drawn = 0;
    let of = |group: &Group| {
        let origin = scene.clouds[group.i_cloud].origin_at(setting.time_s) - eye;
        // The reach of an ellipsoid beyond that of its shortest axis is added to the box.
        let reach = scene.draw.edge().reach(tau_bound(scene, group)) * group.sigma_bounds();
        let radius = reach.min_element();
        let half =
            group.half_extent + DVec3::splat(group.gust_reach) + (reach - DVec3::splat(radius));
        let in_view = !culls || frustum.may_show(origin + group.center, half, radius, lengths);
        let drawn = match scene.draw.count {
            _ if !in_view => DrawnCount::NOTHING,
            None => DrawnCount::all(group.n_particles),
            Some(count) => {
                let distance = (origin + group.cloud_center).length();
                count.drawn(group.n_particles, count.share(group.scale, distance))
            }
        };
        let record = DrawnRecord::new(group, &drawn, n_drawn);
        n_drawn += drawn.n;
        record
    };
    let records = groups.iter().map(of).collect();
    (records, n_drawn)
}
