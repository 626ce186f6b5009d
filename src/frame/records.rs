//! Records that never change during a run, and their upload.

use glam::DVec3;

use super::buffers::SceneBuffers;
use super::features::{colored_runs, has_relief, has_sea, is_lit};
use super::staging::{per_upload, upload, upload_parts};
use crate::error::Result;
use crate::gpu::{Commands, Device};
use crate::layout::facet::{FacetRecord, LitRecord};
use crate::layout::harmonics::{n_texels, push_texels};
use crate::layout::particle::{BoxRecord, ParticleRecord, TexturedRecord};
use crate::layout::relief::ReliefNodeRecord;
use crate::model::cloud::{CloudSource, Group};
use crate::model::particle_list::ParticleList;
use crate::model::scene::Scene;
use crate::model::terrain::Terrain;

/// Fills the buffers whose content never changes: boxes, each particle's group, listed particles,
/// regions of facets, terrain, textures, and the light of unlit scenes.
pub(super) fn fill(
    device: &Device,
    commands: &mut Commands,
    scene: &Scene,
    groups: &[Group],
    b: &SceneBuffers,
) -> Result<()> {
    let i_group = repeated(groups.iter().map(|g| u64::from(g.n_particles)));
    let i_region = repeated(scene.surfaces.iter().map(|s| s.n_facets()));
    upload(device, commands, &i_region, &b.i_region)?;
    upload(device, commands, &ground_records(scene), &b.ground)?;
    if has_sea(scene) {
        upload(device, commands, &sea_records(scene), &b.seas)?;
    }
    if has_relief(scene) {
        upload(device, commands, &ReliefNodeRecord::of(&scene.terrains), &b.relief)?;
    }
    upload(device, commands, &i_group, &b.i_group)?;
    upload_groups(device, commands, scene, groups, b)?;
    commands.run(|rec| {
        rec.fill(&b.status, 0);
        // L2 of scenes with a first reflection alone.
        rec.fill(&b.lit, 0);
        Ok(())
    })?;
    if !is_lit(scene) {
        upload(device, commands, &unlit_records(scene), &b.lit)?;
    }
    for group in groups {
        if let CloudSource::Particles(list) = &scene.clouds[group.i_cloud].source {
            let i_first = group.i_first.into();
            upload_parts(device, commands, listed_records(list, group), &b.particles, i_first)?;
        }
    }
    let mut i_texel = 0;
    for run in colored_runs(scene) {
        let group = groups.iter().find(|g| g.i_first == run.i_first && g.n_particles > 0);
        let cloud = group.map(|g| &scene.clouds[g.i_cloud].source);
        let Some(CloudSource::Particles(list)) = cloud else { continue };
        upload_parts(device, commands, harmonic_texels(list), &b.harmonics, i_texel)?;
        i_texel += u64::from(run.n_particles) * u64::from(n_texels(run.degree));
    }
    Ok(())
}

/// Uploads the boxes and textures of `groups`.
pub(super) fn upload_groups(
    device: &Device,
    commands: &mut Commands,
    scene: &Scene,
    groups: &[Group],
    b: &SceneBuffers,
) -> Result<()> {
    upload(device, commands, &box_records(scene, groups), &b.boxes)?;
    if scene.is_textured() {
        upload(device, commands, &textured_records(scene, groups), &b.textured)?;
    }
    Ok(())
}

/// Returns each index of `counts` as often as its count says.
fn repeated(counts: impl Iterator<Item = u64>) -> Vec<u32> {
    (0..).zip(counts).flat_map(|(i, n)| std::iter::repeat_n(i, n as usize)).collect()
}

/// Returns the light of an unlit scene: surfaces and terrain show the K_d of their materials, as
/// particles show their colors.
fn unlit_records(scene: &Scene) -> Vec<LitRecord> {
    let kd = |i_material: usize| scene.materials[i_material].at(scene.time.start_s).kd;
    let record = |radiance: DVec3| LitRecord {
        first: radiance.as_vec3().to_array(),
        ..LitRecord::default()
    };
    let of_surfaces = scene
        .surfaces
        .iter()
        .flat_map(|s| std::iter::repeat_n(kd(s.i_material), s.n_facets() as usize));
    let of_terrain = |t: &'_ Terrain| -> Vec<DVec3> {
        (0..t.points.len()).map(|i| kd(t.i_material) * t.color(i)).collect()
    };
    of_surfaces.chain(scene.terrains.iter().flat_map(of_terrain)).map(record).collect()
}

/// Returns the mean square of the slopes of every region's sea: 0 of surfaces and dry ground.
fn sea_records(scene: &Scene) -> Vec<f32> {
    let of_ground = scene.seas().map(|sea| sea.map_or(0.0, |sea| sea.slopes as f32));
    scene.surfaces.iter().map(|_| 0.0).chain(of_ground).collect()
}

/// Returns the facets of all terrains.
fn ground_records(scene: &Scene) -> Vec<FacetRecord> {
    let terrains = scene.terrains.iter().zip(scene.surfaces.len() as u32..);
    terrains
        .flat_map(|(t, i_region)| t.facets().map(move |f| FacetRecord::terrain(&f, i_region)))
        .collect()
}

/// Returns the box of each group.
fn box_records(scene: &Scene, groups: &[Group]) -> Vec<BoxRecord> {
    let mut records = Vec::with_capacity(groups.len());
    for cloud in &scene.clouds {
        match &cloud.source {
            CloudSource::Boxes { boxes, law } => {
                for (b, i_box) in boxes.iter().zip(0u32..) {
                    let i_first = groups[records.len()].i_first;
                    records.push(BoxRecord::new(b, law, cloud.seed, i_box, i_first));
                }
            }
            CloudSource::Particles(_) | CloudSource::Disc(_) | CloudSource::Animated(_) => {
                records.push(BoxRecord::given())
            }
        }
    }
    records
}

/// Returns the texture of each group.
fn textured_records(scene: &Scene, groups: &[Group]) -> Vec<TexturedRecord> {
    let record = |(g, i_box): (&Group, u32)| {
        let cloud = &scene.clouds[g.i_cloud];
        TexturedRecord::new(&cloud.texture, cloud.seed, i_box, g.i_first)
    };
    let clouds = groups.chunk_by(|a, b| a.i_cloud == b.i_cloud);
    clouds.flat_map(|boxes| boxes.iter().zip(0u32..).map(record)).collect()
}

/// Returns the records of the particles of a list, in parts of an upload.
fn listed_records<'a>(
    list: &'a ParticleList,
    group: &'a Group,
) -> impl Iterator<Item = Vec<ParticleRecord>> + 'a {
    let n = per_upload::<ParticleRecord>();
    let mut rest = list.iter();
    std::iter::from_fn(move || {
        let part: Vec<_> = rest.by_ref().take(n).map(|p| ParticleRecord::new(p, group)).collect();
        (!part.is_empty()).then_some(part)
    })
}

/// Returns the texels of a list's harmonics, in parts of an upload.
fn harmonic_texels(list: &ParticleList) -> impl Iterator<Item = Vec<[f32; 4]>> + '_ {
    let degree = list.harmonics().map_or(0, |of| of.degree);
    let n = per_upload::<[f32; 4]>() / n_texels(degree) as usize;
    let by_particle = list.harmonics().map_or(&[][..], |of| &of.by_particle);
    list.chunks(n).zip(by_particle.chunks(n)).map(move |(particles, coefficients)| {
        let mut texels = Vec::with_capacity(n_texels(degree) as usize * particles.len());
        for (p, of) in particles.iter().zip(coefficients) {
            push_texels(&mut texels, of, p.kappa, degree);
        }
        texels
    })
}
