//! The key `draw.particles`: a number of particles for all clouds made from boxes together.

use super::device_range::{out_of_range, out_of_range_when_grown};
use crate::model::boxes::CloudBox;
use crate::model::cloud::{Cloud, CloudSource};

/// Gives the clouds that are made from boxes `n` particles together, in proportion to the counts of
/// their boxes (largest remainder; of equal ones the first). κ changes inversely to the count, so
/// that the expected optical depth stays.
///
/// # Errors
/// When no box has particles, or when so few would be too dense; the message is about `n`.
pub fn set_particle_count(clouds: &mut [Cloud], n: u32) -> Result<(), String> {
    let counts: Vec<u32> = clouds.iter_mut().flat_map(boxes_of).map(|b| b.n_particles).collect();
    let total: u128 = counts.iter().map(|n| u128::from(*n)).sum();
    if total == 0 {
        return Err("the scene has no cloud made from boxes that has particles".to_owned());
    }
    let quota = |count: u32| {
        let product = u128::from(n) * u128::from(count);
        (product / total, product % total)
    };
    let mut shares: Vec<u32> = counts.iter().map(|count| quota(*count).0 as u32).collect();
    let mut by_remainder: Vec<usize> = (0..counts.len()).collect();
    // The sort is stable: of equal remainders the first comes first.
    by_remainder.sort_by_key(|i| std::cmp::Reverse(quota(counts[*i]).1));
    let left = n - shares.iter().sum::<u32>();
    for i in by_remainder.into_iter().take(left as usize) {
        shares[i] += 1;
    }
    for (b, share) in clouds.iter_mut().flat_map(boxes_of).zip(shares) {
        b.n_particles = share;
    }
    for (i, cloud) in clouds.iter_mut().enumerate() {
        if let CloudSource::Boxes { law, .. } = &mut cloud.source {
            law.optical_depth *= total as f64 / f64::from(n);
            if let Some(what) = out_of_range(cloud, &[]).or_else(|| out_of_range_when_grown(cloud))
            {
                return Err(format!("makes cloud {i}'s particles too dense: {what}"));
            }
        }
    }
    Ok(())
}

fn boxes_of(cloud: &mut Cloud) -> &mut [CloudBox] {
    match &mut cloud.source {
        CloudSource::Boxes { boxes, .. } => boxes,
        CloudSource::Particles(_) | CloudSource::Disc(_) | CloudSource::Animated(_) => &mut [],
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::model::boxes::{BoxLaw, Form};
    use crate::model::cloud::{Facing, ParticleList};
    use crate::model::growth::Growth;
    use crate::model::gust::Gust;
    use crate::model::texture::Texture;

    fn cloud(counts: &[u32]) -> Cloud {
        let b = |n: &u32| CloudBox {
            n_particles: *n,
            extent: DVec3::ONE,
            center: DVec3::ZERO,
            radius_max: 1.0,
        };
        let boxes = counts.iter().map(b).collect();
        let law = BoxLaw { form: Form::Centred, optical_depth: 1.0, radius_scale: 1.0 };
        let source = CloudSource::Boxes { boxes, law };
        let (gust, growth) = (Gust::CALM, Growth::NONE);
        Cloud {
            facing: Facing::Outward,
            source,
            position: DVec3::ZERO,
            wind: DVec3::ZERO,
            gust,
            growth,
            texture: Texture::NONE,
            i_material: 0,
            seed: 1,
        }
    }

    fn counts(clouds: &mut [Cloud]) -> Vec<u32> {
        clouds.iter_mut().flat_map(boxes_of).map(|b| b.n_particles).collect()
    }

    #[test]
    fn particles_are_dealt_by_the_largest_remainder() {
        let mut clouds = [
            cloud(&[3, 0, 4]),
            Cloud { source: CloudSource::Particles(ParticleList::default()), ..cloud(&[]) },
            cloud(&[3]),
        ];
        // 5 · (3, 0, 4, 3)/10 is 1.5, 0, 2, 1.5: one is left, and the first of the two has it.
        set_particle_count(&mut clouds, 5).unwrap();
        assert_eq!(counts(&mut clouds), [2, 0, 2, 1]);
        for i in [0, 2] {
            assert!(matches!(
                clouds[i].source,
                CloudSource::Boxes { law: BoxLaw { optical_depth: 2.0, .. }, .. }
            ));
        }
        set_particle_count(&mut clouds, 50_000).unwrap();
        assert_eq!(counts(&mut clouds), [20_000, 0, 20_000, 10_000]);
        assert!(matches!(
            clouds[0].source,
            CloudSource::Boxes { law: BoxLaw { optical_depth: 2e-4, .. }, .. }
        ));
        assert!(
            set_particle_count(&mut [cloud(&[0])], 7)
                .unwrap_err()
                .contains("no cloud made from boxes")
        );
        let mut dense = cloud(&[u32::MAX]);
        let CloudSource::Boxes { law, .. } = &mut dense.source else { panic!() };
        law.optical_depth = 1e14;
        assert!(set_particle_count(&mut [dense], 1).unwrap_err().contains("too dense"));
    }
}
