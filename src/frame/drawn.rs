//! What of each group is drawn this frame: none where it cannot be in the picture, else as many as
//! its distance and size ask for. Light knows nothing of it.

use glam::DVec3;

use crate::layout::particle::DrawnRecord;
use crate::model::cloud::Group;
use crate::model::count::DrawnCount;
use crate::model::frame_state::FrameState;
use crate::model::scene::Scene;
use crate::model::visibility::Frustum;

/// A record for each of `groups`, as they have grown, and how many particles they name together.
/// `culls`: leave out groups that cannot be in the picture.
pub fn drawn(
    scene: &Scene,
    groups: &[Group],
    setting: &FrameState,
    culls: bool,
) -> (Vec<DrawnRecord>, u32) {
    let frustum = Frustum::of(&scene.camera, &setting.pose, &scene.film, scene.widening());
    let eye = setting.pose.position;
    // Coordinates are relative to the lighting origin, the eye's too.
    let lengths = (eye - setting.light_origin).abs().element_sum() + setting.radius;
    let mut n_drawn = 0;
    let of = |group: &Group| {
        let origin = scene.clouds[group.i_cloud].origin_at(setting.time_s) - eye;
        // Of an ellipsoid what it reaches farther along some axis than along its shortest is added
        // to the box.
        let reach = scene.draw.cutoff * group.sigma_bounds();
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
