//! Clouds: where their particles come from, and the groups that keep their positions accurate.

use glam::DVec3;

use super::animated::AnimatedParticles;
use super::boxes::{BoxLaw, CloudBox, max_radius, mean_radius, mean_radius_by_area};
use super::disc::Disc;
pub use super::group::{Group, aspects_of, max_blob_mass, runs};
use super::growth::Growth;
use super::gust::Gust;
use super::named::named;
pub use super::particle::{Particle, SIGMA_PER_RADIUS, SQRT_TAU, mass};
pub use super::particle_list::ParticleList;
pub use super::shape::{MIN_ASPECT, Shape, Shapes, Turn, unit_quaternion};
use super::texture::Texture;

/// A cloud of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Cloud {
    /// Where the particles come from.
    pub source: CloudSource,
    /// Position of the cloud's origin at time 0, in the scene.
    pub position: DVec3,
    /// Velocity, scene units per second: the origin at time t is position + wind·t. A disc stands
    /// still, and the wind carries its particles from where they were born.
    pub wind: DVec3,
    /// Turbulence that displaces the particles.
    pub gust: Gust,
    /// Growth about the cloud's centre.
    pub growth: Growth,
    /// Texture of the particles.
    pub texture: Texture,
    /// Index into the scene's materials.
    pub i_material: usize,
    /// Direction of facets where the density has none.
    pub facing: Facing,
    /// Seed of the cloud's random numbers.
    pub seed: u32,
}

named! {
    /// Direction that a cloud's facets face where the density around them has none
    /// (passes.md "facets").
    pub enum Facing {
        /// Away from the cloud's centre; for a single cloud.
        Outward = "outward",
        /// Upward; for layers of clouds, or many clouds.
        Up = "up",
    }
}

/// Depth below the cloud of the point that upward facets face away from. Their directions differ by
/// the cloud's extent over this depth.
const FAR_BELOW: f64 = 1e9;

/// Source of a cloud's particles.
#[derive(Debug, Clone, PartialEq)]
pub enum CloudSource {
    /// Particles made from boxes, P (1)–(11).
    Boxes {
        /// Lines of the box file.
        boxes: Vec<CloudBox>,
        /// How particles are made from them.
        law: BoxLaw,
    },
    /// A list of blobs as given.
    Particles(ParticleList),
    /// Particles that are born on a disc, live for some time and are replaced.
    Disc(Disc),
    /// Particles that an animation places at every time.
    Animated(AnimatedParticles),
}

impl Cloud {
    /// Returns the cloud's origin at `time_s`.
    pub fn origin_at(&self, time_s: f64) -> DVec3 {
        self.position + self.drift() * time_s
    }

    /// Returns the velocity of the cloud's origin.
    pub fn drift(&self) -> DVec3 {
        if matches!(self.source, CloudSource::Disc(_)) { DVec3::ZERO } else { self.wind }
    }

    /// Returns the cloud's centre relative to its origin: the mean of its groups' centres by
    /// particle count.
    pub fn center(&self) -> DVec3 {
        match &self.source {
            CloudSource::Boxes { boxes, .. } => {
                let n: f64 = boxes.iter().map(|b| f64::from(b.n_particles)).sum();
                let sum: DVec3 = boxes.iter().map(|b| b.center * f64::from(b.n_particles)).sum();
                if n > 0.0 { sum / n } else { DVec3::ZERO }
            }
            CloudSource::Particles(list) => list.summary().center,
            CloudSource::Disc(disc) => disc.center(self.wind),
            CloudSource::Animated(m) => 0.5 * (m.low + m.high),
        }
    }

    /// Returns the point that the cloud's facets face away from, relative to its origin.
    pub fn facing_from(&self) -> DVec3 {
        match self.facing {
            Facing::Outward => self.center(),
            Facing::Up => {
                self.center() - FAR_BELOW.max(self.center().abs().max_element()) * DVec3::Y
            }
        }
    }

    /// Returns the number of particles.
    pub fn n_particles(&self) -> u64 {
        match &self.source {
            CloudSource::Boxes { boxes, .. } => {
                boxes.iter().map(|b| u64::from(b.n_particles)).sum()
            }
            CloudSource::Particles(list) => list.len() as u64,
            CloudSource::Disc(disc) => u64::from(disc.n_particles),
            CloudSource::Animated(m) => u64::from(m.n_particles),
        }
    }

    /// Returns the number of groups.
    pub fn n_groups(&self) -> u64 {
        match &self.source {
            CloudSource::Boxes { boxes, .. } => boxes.len() as u64,
            CloudSource::Particles(_) | CloudSource::Disc(_) | CloudSource::Animated(_) => 1,
        }
    }

    /// Returns the cloud's groups, with particle indices counted from `i_first`. Empty boxes give
    /// empty groups, so that a group's index is its box's index.
    pub fn groups(&self, i_cloud: usize, mut i_first: u32) -> Vec<Group> {
        let at_rest = Group {
            i_cloud,
            i_first,
            n_particles: self.n_particles() as u32,
            center: DVec3::ZERO,
            cloud_center: self.center(),
            facing_from: self.facing_from(),
            scale: 1.0,
            half_extent: DVec3::ZERO,
            sigma_max: 0.0,
            sigma_y_max: 0.0,
            sigma_mean: 0.0,
            sigma_by_area: 0.0,
            aspects: [1.0; 3],
            turned_max: 0.0,
            kappa_max: 0.0,
            mass_max: 0.0,
            gust_reach: self.gust.reach(),
        };
        match &self.source {
            CloudSource::Boxes { boxes, law } => boxes
                .iter()
                .map(|b| {
                    let sigma_max =
                        max_radius(law.form, b.radius_max) * law.radius_scale * SIGMA_PER_RADIUS;
                    let kappa = box_kappa(b, law);
                    let group = Group {
                        i_first,
                        n_particles: b.n_particles,
                        center: b.center,
                        half_extent: 0.5 * b.extent,
                        sigma_max,
                        sigma_y_max: sigma_max,
                        sigma_mean: mean_radius(law.form, b.radius_max)
                            * law.radius_scale
                            * SIGMA_PER_RADIUS,
                        sigma_by_area: mean_radius_by_area(law.form, b.radius_max)
                            * law.radius_scale
                            * SIGMA_PER_RADIUS,
                        kappa_max: kappa,
                        mass_max: mass(kappa, sigma_max),
                        ..at_rest
                    };
                    // A scene with more particles than u32 can count is refused later; until then
                    // only its bounds are used.
                    i_first = i_first.wrapping_add(b.n_particles);
                    group
                })
                .collect(),
            CloudSource::Particles(list) => vec![list_group(list, at_rest)],
            CloudSource::Disc(disc) => vec![disc_group(disc, self.wind, at_rest)],
            CloudSource::Animated(m) => vec![animated_group(m, at_rest)],
        }
    }
}

/// Returns κ of a box's blobs: √(2π) κ σ̄ = optical_depth at the mean radius (model.md §1). 0 if
/// blobs have no size.
pub fn box_kappa(b: &CloudBox, law: &BoxLaw) -> f64 {
    let sigma = mean_radius(law.form, b.radius_max) * law.radius_scale * SIGMA_PER_RADIUS;
    if sigma > 0.0 { law.optical_depth / (SQRT_TAU * sigma) } else { 0.0 }
}

fn list_group(list: &ParticleList, at_rest: Group) -> Group {
    let of = list.summary();
    Group {
        sigma_max: of.sigma_max,
        sigma_y_max: of.sigma_y_max,
        sigma_mean: of.sigma_mean,
        sigma_by_area: of.sigma_by_area,
        aspects: of.aspects,
        turned_max: of.turned_max,
        kappa_max: of.kappa_max,
        mass_max: of.mass_max,
        ..at_rest.between(of.low, of.high)
    }
}

/// Returns a group whose bounds hold over the particles' whole life, so that they stand still.
fn disc_group(disc: &Disc, wind: DVec3, at_rest: Group) -> Group {
    let (low, high) = disc.bounds(wind);
    Group {
        sigma_max: disc.sigma_max(),
        sigma_y_max: disc.sigma_max(),
        sigma_mean: disc.sigma_mean(),
        sigma_by_area: disc.sigma_mean(),
        kappa_max: disc.kappa(),
        mass_max: disc.mass_max(),
        ..at_rest.between(low, high)
    }
}

fn animated_group(m: &AnimatedParticles, at_rest: Group) -> Group {
    Group {
        sigma_max: m.sigma_max,
        sigma_y_max: m.sigma_y_max,
        sigma_mean: m.sigma_mean,
        sigma_by_area: m.sigma_mean,
        aspects: [MIN_ASPECT, m.aspect_mean, 1.0 / MIN_ASPECT],
        turned_max: 0.0,
        kappa_max: m.kappa_max,
        mass_max: m.mass_max,
        ..at_rest.between(m.low, m.high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::boxes::Form;

    #[test]
    fn kappa_gives_the_optical_depth_at_the_mean_radius() {
        let b =
            CloudBox { n_particles: 5, extent: DVec3::ONE, center: DVec3::ZERO, radius_max: 2.2 };
        let law = BoxLaw { form: Form::Centred, optical_depth: 1.5, radius_scale: 0.6 };
        let kappa = box_kappa(&b, &law);
        let sigma = mean_radius(Form::Centred, 2.2) * 0.6 / 3.0;
        assert!((SQRT_TAU * kappa * sigma - 1.5).abs() < 1e-14);
        assert_eq!(box_kappa(&CloudBox { radius_max: 0.0, ..b }, &law), 0.0);
    }

    #[test]
    fn runs_divide_all_places() {
        assert_eq!(runs(10, 3).collect::<Vec<_>>(), [(0, 3), (3, 6), (6, 10)]);
        assert_eq!((runs(2, 2).collect::<Vec<_>>(), runs(0, 0).count()), (vec![(0, 1), (1, 2)], 0));
        let last = runs(u64::from(u32::MAX), 1 << 20).last();
        assert_eq!(last, Some((4_294_963_199, 4_294_967_295)));
    }

    #[test]
    fn groups_number_particles_through_and_keep_empty_boxes() {
        let b =
            |n| CloudBox { n_particles: n, extent: DVec3::ONE, center: DVec3::X, radius_max: 1.0 };
        let source =
            CloudSource::Boxes { boxes: vec![b(3), b(0), b(4)], law: BoxLaw::new(Form::Centred) };
        let (gust, growth) = (Gust::CALM, Growth::NONE);
        let cloud = Cloud {
            facing: crate::model::cloud::Facing::Outward,
            source,
            position: DVec3::ZERO,
            wind: DVec3::X,
            gust,
            growth,
            texture: Texture::NONE,
            i_material: 0,
            seed: 1,
        };
        let firsts: Vec<u32> = cloud.groups(0, 10).iter().map(|g| g.i_first).collect();
        assert_eq!(firsts, [10, 13, 13]);
        assert_eq!(cloud.center(), DVec3::X);
        assert_eq!(cloud.origin_at(2.0), DVec3::new(2.0, 0.0, 0.0));
    }

    #[test]
    fn a_grown_group_is_similar_about_the_clouds_centre() {
        let blob = |x: f64, sigma| Particle {
            shape: Shape::BALL,
            position: DVec3::X * x,
            sigma,
            kappa: 2.0,
            color: DVec3::ONE,
        };
        // Mean position 2, bounds from 0 to 5.
        let source =
            CloudSource::Particles(vec![blob(0.0, 1.0), blob(1.0, 0.5), blob(5.0, 0.75)].into());
        let (gust, growth) = (Gust::CALM, Growth { to: 3.0, time_s: 1.0 });
        let cloud = Cloud {
            facing: crate::model::cloud::Facing::Outward,
            source,
            position: DVec3::Y,
            wind: DVec3::ZERO,
            gust,
            growth,
            texture: Texture::NONE,
            i_material: 0,
            seed: 1,
        };
        let group = cloud.groups(0, 0)[0];
        let grown = group.grown(3.0);
        assert_eq!((group.center.x, group.cloud_center.x), (2.5, 2.0));
        // The least and greatest x: 2 + 3 (0 − 2) and 2 + 3 (5 − 2).
        assert_eq!((grown.center - grown.half_extent).x, -4.0);
        assert_eq!((grown.center + grown.half_extent).x, 11.0);
        assert_eq!(
            (grown.sigma_max, grown.sigma_mean, grown.kappa_max, grown.scale),
            (3.0, 2.25, 2.0, 3.0)
        );
        assert!((grown.mass_max / mass(2.0, 3.0) - 1.0).abs() < 1e-15);
        assert_eq!(group.grown(1.0), group);
    }

    #[test]
    fn the_greatest_mass_is_of_one_blob_and_not_of_two_maxima() {
        let blob = |sigma, kappa| Particle {
            shape: Shape::BALL,
            position: DVec3::ZERO,
            sigma,
            kappa,
            color: DVec3::ONE,
        };
        let source = CloudSource::Particles(vec![blob(1.0, 2.0), blob(1e-3, 1e9)].into());
        let (gust, growth) = (Gust::CALM, Growth::NONE);
        let cloud = Cloud {
            facing: crate::model::cloud::Facing::Outward,
            source,
            position: DVec3::ZERO,
            wind: DVec3::ZERO,
            gust,
            growth,
            texture: Texture::NONE,
            i_material: 0,
            seed: 1,
        };
        assert_eq!(max_blob_mass(&cloud.groups(0, 0)), mass(2.0, 1.0));
    }
}
