use glam::DVec3;

use super::*;
use crate::model::boxes::{BoxLaw, CloudBox, Form};
use crate::model::cloud::{Facing, Particle, Shape};
use crate::model::growth::Growth;
use crate::model::gust::Gust;
use crate::model::texture::Texture;

fn cloud(source: CloudSource) -> Cloud {
    Cloud {
        source,
        position: DVec3::ZERO,
        wind: DVec3::ZERO,
        gust: Gust::CALM,
        growth: Growth::NONE,
        texture: Texture::NONE,
        i_material: 0,
        facing: Facing::Outward,
        seed: 1,
    }
}

fn of_boxes(counts: &[u32]) -> Cloud {
    let b = |n: &u32| CloudBox {
        n_particles: *n,
        extent: DVec3::ONE,
        center: DVec3::ZERO,
        radius_max: 1.0,
    };
    let boxes = counts.iter().map(b).collect();
    cloud(CloudSource::Boxes {
        boxes,
        law: BoxLaw { radius_scale: 0.6, ..BoxLaw::new(Form::Centred) },
    })
}

fn of_list(n: usize) -> Cloud {
    let p = Particle {
        position: DVec3::ZERO,
        sigma: 1.0,
        shape: Shape::BALL,
        kappa: 1.0,
        color: DVec3::ONE,
    };
    cloud(CloudSource::Particles(vec![p; n].into()))
}

fn groups(clouds: &[Cloud]) -> Vec<Group> {
    let mut groups: Vec<Group> = vec![];
    for (i, cloud) in clouds.iter().enumerate() {
        groups.extend(cloud.groups(i, groups.last().map_or(0, |g| g.i_first + g.n_particles)));
    }
    groups
}

fn shared_of(old: &[Cloud], new: &[Cloud], touched: &[usize]) -> Vec<[u32; 3]> {
    let shared = shared_ranges((old, &groups(old)), (new, &groups(new)), touched);
    shared.iter().map(|s| [s.i_old, s.i_new, s.n]).collect()
}

#[test]
fn contiguous_groups_are_one_range_and_empty_boxes_none() {
    let groups = groups(&[of_boxes(&[3, 0, 4, 5, 2])]);
    assert_eq!(particle_ranges(&groups, &[0, 1, 2, 4]), [[0, 7], [12, 2]]);
    assert_eq!(particle_ranges(&groups, &[1, 3]), [[7, 5]]);
    assert!(particle_ranges(&groups, &[1]).is_empty() && particle_ranges(&groups, &[]).is_empty());
}

#[test]
fn shared_particles_are_found_by_cloud_and_box() {
    let old = [of_boxes(&[3, 4, 5]), of_list(7), of_boxes(&[2, 2])];
    // One more box in the first cloud moves all that follows.
    let new = [of_boxes(&[3, 6, 5, 1]), of_list(7), of_boxes(&[2, 2])];
    assert_eq!(shared_of(&old, &new, &[1, 3]), [[0, 0, 3], [7, 9, 5], [19, 22, 4]]);
    // Fewer boxes; the first box of the last cloud is touched.
    let new = [of_boxes(&[3, 4]), of_list(7), of_boxes(&[2, 2])];
    assert_eq!(shared_of(&old, &new, &[3]), [[0, 0, 7], [21, 16, 2]]);
    assert!(shared_of(&old, &new, &[0, 1, 2, 3, 4]).is_empty());
}
