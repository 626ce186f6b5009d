//! Placement: from group-relative positions to positions relative to the lighting origin O,
//! passes.md "Frames of reference", §12, §13. All in f64; the GPU rounds the offset once and the
//! sum once.

use glam::DVec3;

use super::Blob;
use super::generate::Generated;
use crate::model::cloud::{Cloud, Group};

/// Returns the scale s(t) of model.md §13.
pub fn scale(cloud: &Cloud, time_s: f64) -> f64 {
    1.0 + (cloud.growth.to - 1.0) * (1.0 - (-time_s.max(0.0) / cloud.growth.time_s).exp())
}

/// Returns the centre of every group relative to its cloud's origin, as the cloud has grown: c + s
/// (x − c).
fn grown_centers(groups: &[Group], clouds: &[Cloud], time_s: f64) -> Vec<DVec3> {
    let centers: Vec<DVec3> = clouds.iter().map(Cloud::center).collect();
    let of = |g: &Group| {
        let c = centers[g.i_cloud];
        c + scale(&clouds[g.i_cloud], time_s) * (g.center - c)
    };
    groups.iter().map(of).collect()
}

/// Scales group-relative positions and σ by s, as the clouds have grown.
pub fn grown(
    generated: &[Generated],
    groups: &[Group],
    clouds: &[Cloud],
    time_s: f64,
) -> Vec<Generated> {
    let scales = by_particle(groups, |g| scale(&clouds[g.i_cloud], time_s));
    let of = |(g, s): (&Generated, f64)| Generated {
        position: s * g.position,
        sigma: s * g.sigma,
        ..*g
    };
    generated.iter().zip(scales).map(of).collect()
}

/// Returns the mean σ of each particle's group, as the cloud has grown.
pub fn sigma_means(groups: &[Group], clouds: &[Cloud], time_s: f64) -> Vec<f64> {
    by_particle(groups, |g| g.sigma_mean * scale(&clouds[g.i_cloud], time_s)).collect()
}

fn by_particle<T: Clone>(groups: &[Group], of: impl Fn(&Group) -> T) -> impl Iterator<Item = T> {
    groups.iter().flat_map(move |g| std::iter::repeat_n(of(g), g.n_particles as usize))
}

/// Returns the offset of every group's particles: cloud origin(t) + grown group centre − O.
pub fn offsets(groups: &[Group], clouds: &[Cloud], time_s: f64, origin: DVec3) -> Vec<DVec3> {
    let centers = grown_centers(groups, clouds, time_s);
    groups
        .iter()
        .zip(centers)
        .map(|(g, center)| clouds[g.i_cloud].origin_at(time_s) + center - origin)
        .collect()
}

/// Returns the point that the facets of every cloud face away from, relative to O at `time_s`.
pub fn cloud_centers(clouds: &[Cloud], time_s: f64, origin: DVec3) -> Vec<DVec3> {
    clouds.iter().map(|c| c.origin_at(time_s) + c.facing_from() - origin).collect()
}

/// Returns placed positions: particle k of group g at positions[g.i_first + k] + offsets[g].
/// `positions` have grown.
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

/// Adds the gusts to placed positions: d(x, t) = Σ a sin(k·x + ω t + φ), model.md §12. x is the
/// particle at rest relative to its cloud's origin; `rest` are the grown group-relative positions.
pub fn add_gusts(
    placed: &mut [DVec3],
    rest: &[DVec3],
    groups: &[Group],
    clouds: &[Cloud],
    time_s: f64,
) {
    for (group, center) in groups.iter().zip(grown_centers(groups, clouds, time_s)) {
        let cloud = &clouds[group.i_cloud];
        let modes = cloud.gust.modes(cloud.seed);
        let first = group.i_first as usize;
        for i in first..first + group.n_particles as usize {
            let x = rest[i] + center;
            for m in &modes {
                placed[i] += m.a * (m.k.dot(x) + m.omega * time_s + m.phase).sin();
            }
        }
    }
}

/// Returns a bound, axis by axis, on |f32 − f64| of a placed position: the position's own error,
/// the rounding of the offset (u|offset|), and the rounding of the sum. The sum that is rounded is
/// the computed one, which lies within the first two errors of `placed`.
pub fn placed_bound(position_bound: DVec3, offset: DVec3, placed: DVec3, u: f64) -> DVec3 {
    let inherited = position_bound + u * offset.abs();
    inherited + u * (placed.abs() + inherited)
}

/// Returns the index of the cloud (the region) of each particle.
pub fn regions(groups: &[Group]) -> Vec<u32> {
    by_particle(groups, |g| g.i_cloud as u32).collect()
}

/// Returns generated particles at their placed positions.
pub fn blobs(generated: &[Generated], placed: &[DVec3]) -> Vec<Blob> {
    generated
        .iter()
        .zip(placed)
        .map(|(g, &position)| Blob { position, sigma: g.sigma, shape: g.shape, kappa: g.kappa })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::cloud::{CloudSource, Particle, Shape};
    use crate::model::growth::Growth;
    use crate::model::gust::Gust;
    use crate::model::texture::Texture;
    use crate::reference::live;

    #[test]
    fn groups_are_placed_by_wind_centre_and_origin() {
        let particle = |x| Particle {
            shape: Shape::BALL,
            position: DVec3::X * x,
            sigma: 1.0,
            kappa: 1.0,
            color: DVec3::ONE,
        };
        let cloud = |list: Vec<Particle>, y, wind| Cloud {
            facing: crate::model::cloud::Facing::Outward,
            source: CloudSource::Particles(list.into()),
            position: DVec3::Y * y,
            wind,
            gust: Gust::CALM,
            growth: Growth::NONE,
            texture: Texture::NONE,
            i_material: 0,
            seed: 0,
        };
        let clouds = [
            cloud(vec![particle(2.0), particle(6.0)], 1.0, DVec3::Z),
            cloud(vec![particle(1e9)], 0.0, DVec3::ZERO),
        ];
        let groups: Vec<Group> = clouds
            .iter()
            .zip([0, 2])
            .enumerate()
            .flat_map(|(i, (c, first))| c.groups(i, first))
            .collect();
        let origin = DVec3::new(1.0, 1.0, 1.0);
        let offsets = offsets(&groups, &clouds, 10.0, origin);
        // Bounds of the first list: x from 2 to 6, centre 4; 10 s of wind along z.
        assert_eq!(offsets, [DVec3::new(3.0, 0.0, 9.0), DVec3::new(1e9 - 1.0, -1.0, -1.0)]);
        let generated: Vec<Generated> = clouds.iter().flat_map(|c| live::cloud(c, 0.0)).collect();
        let relative: Vec<DVec3> = generated.iter().map(|g| g.position).collect();
        assert_eq!(relative, [DVec3::X * -2.0, DVec3::X * 2.0, DVec3::ZERO]);
        let placed = place(&relative, &groups, &offsets);
        assert_eq!((placed[0], placed[1]), (DVec3::new(1.0, 0.0, 9.0), DVec3::new(5.0, 0.0, 9.0)));
        assert_eq!(regions(&groups), [0, 0, 1]);
        // By hand with u = 1/8: 1 + 4/8 inherited, the sum at most 10 + 1.5 in magnitude.
        let bound = placed_bound(DVec3::ONE, DVec3::splat(-4.0), DVec3::splat(10.0), 0.125);
        assert_eq!(bound, DVec3::splat(1.5 + 11.5 / 8.0));
        assert_eq!(cloud_centers(&clouds, 10.0, origin)[0], offsets[0]);
        assert_eq!(
            blobs(&generated, &placed)[1],
            Blob { shape: Shape::BALL, position: placed[1], sigma: 1.0, kappa: 1.0 }
        );
    }

    #[test]
    fn a_cloud_grows_about_its_own_centre() {
        let particle = |x| Particle {
            shape: Shape::BALL,
            position: DVec3::X * x,
            sigma: 0.5,
            kappa: 1.0,
            color: DVec3::ONE,
        };
        let cloud = Cloud {
            facing: crate::model::cloud::Facing::Outward,
            source: CloudSource::Particles(
                vec![particle(0.0), particle(0.0), particle(6.0)].into(),
            ),
            position: DVec3::Y,
            wind: DVec3::Z,
            gust: Gust::CALM,
            growth: Growth { to: 3.0, time_s: 1.0 / std::f64::consts::LN_2 },
            texture: Texture::NONE,
            i_material: 0,
            seed: 0,
        };
        let (groups, clouds) = (cloud.groups(0, 0), [cloud.clone()]);
        // After 1 s half of the growth from 1 to 3 is done; about x = 2 the list lies from −2 to 10
        // then.
        assert!((scale(&cloud, 1.0) - 2.0).abs() < 1e-15 && scale(&cloud, -1.0) == 1.0);
        let given = live::cloud(&cloud, 0.0);
        let grown = grown(&given, &groups, &clouds, 1.0);
        let positions: Vec<DVec3> = grown.iter().map(|g| g.position).collect();
        let placed = place(&positions, &groups, &offsets(&groups, &clouds, 1.0, DVec3::ZERO));
        for (p, x) in placed.iter().zip([-2.0, -2.0, 10.0]) {
            assert!((*p - DVec3::new(x, 1.0, 1.0)).length() < 1e-14, "{p}");
        }
        assert!((grown[0].sigma - 1.0).abs() < 1e-15 && grown[0].kappa == 1.0);
        assert!((sigma_means(&groups, &clouds, 1.0)[2] - 1.0).abs() < 1e-15);
        // The cloud's centre stays where it is.
        assert_eq!(cloud_centers(&clouds, 1.0, DVec3::ZERO)[0], DVec3::new(2.0, 1.0, 1.0));
    }
}
