//! The buffers of each stage of a frame as rows, from the device or from the reference in f64.

use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::error::{Error, Result};
use crate::frame::Stage;
use crate::frame::plan::Pass;
use crate::model::cloud::{CloudSource, Group};
use crate::model::frame_state::FrameState;
use crate::model::scene::{LightingMode, Scene};
use crate::model::terrain::Terrain;
use crate::passes::generate::FOLDED;
use crate::reference::generate::Generated;
use crate::reference::picture::FrameReference;

/// A facet, in scene coordinates, with direct and indirect irradiance I_d and I_i, and the radiance
/// toward the camera of the first and second reflection, L1 and L2. The back of a surface has no
/// radiance; I_i and L2 are zero if lighting.mode is "first".
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FacetRow {
    /// Number of the facet.
    pub index: usize,
    /// Number of its region.
    pub region: u32,
    /// Centre, x.
    pub x: f64,
    /// Centre, y.
    pub y: f64,
    /// Centre, z.
    pub z: f64,
    /// Normal, x.
    pub nx: f64,
    /// Normal, y.
    pub ny: f64,
    /// Normal, z.
    pub nz: f64,
    /// Area.
    pub area: f64,
    /// Direct irradiance, red.
    pub id_r: f64,
    /// Direct irradiance, green.
    pub id_g: f64,
    /// Direct irradiance, blue.
    pub id_b: f64,
    /// Indirect irradiance, red.
    pub ii_r: f64,
    /// Indirect irradiance, green.
    pub ii_g: f64,
    /// Indirect irradiance, blue.
    pub ii_b: f64,
    /// Radiance of the first reflection, red.
    pub l1_r: f64,
    /// Radiance of the first reflection, green.
    pub l1_g: f64,
    /// Radiance of the first reflection, blue.
    pub l1_b: f64,
    /// Radiance of the second reflection, red.
    pub l2_r: f64,
    /// Radiance of the second reflection, green.
    pub l2_g: f64,
    /// Radiance of the second reflection, blue.
    pub l2_b: f64,
}

impl FacetRow {
    /// Returns I_d, I_i, L1 and L2.
    fn lit(&self) -> [DVec3; 4] {
        [
            DVec3::new(self.id_r, self.id_g, self.id_b),
            DVec3::new(self.ii_r, self.ii_g, self.ii_b),
            DVec3::new(self.l1_r, self.l1_g, self.l1_b),
            DVec3::new(self.l2_r, self.l2_g, self.l2_b),
        ]
    }
}

/// The generation of a box's particles.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoxRow {
    /// Number of the cloud.
    pub cloud: usize,
    /// Number of the box in its cloud.
    pub r#box: usize,
    /// Particles.
    pub particles: u32,
    /// Random points that were tried.
    pub attempts: u64,
    /// Particles divided by attempts; none for an empty box.
    pub acceptance: Option<f64>,
    /// Particles that were folded into the box after the last attempt.
    pub folded: u32,
}

/// The decision about one pass of one frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlanRow {
    /// Frame number.
    pub frame: u32,
    /// Name of the pass.
    pub pass: &'static str,
    /// Whether it runs.
    pub run: bool,
    /// Why.
    pub reason: String,
}

/// Returns the facets of a frame from the device.
///
/// # Errors
/// Fails if the scene is not lit or drawing the frame fails.
pub fn facets(stage: &mut Stage, i_frame: u32) -> Result<Vec<FacetRow>> {
    check_lit(&stage.scene)?;
    let FrameState { light_origin: origin, pose, .. } = draw(stage, i_frame)?;
    let (facets, lit) = stage.renderer.facets(&stage.device)?;
    let rgb = |v: [f32; 3]| Vec3::from(v).as_dvec3();
    let rows = facets.iter().zip(&lit).enumerate().map(|(i, (f, l))| {
        let place = Vec3::from(f.position).as_dvec3() + origin;
        let normal = Vec3::from(f.normal).as_dvec3();
        let lit = [rgb(l.direct), rgb(l.indirect), rgb(l.first), rgb(l.second)];
        let lit = toward_camera(&stage.scene, f.i_region, pose.position - place, normal, lit);
        facet_row(i, f.i_region, [place, normal], f64::from(f.area), lit)
    });
    Ok(rows.collect())
}

/// Returns the facets of a frame from the reference.
///
/// # Errors
/// Fails if the scene is not lit or has no such reference.
pub fn facets_reference(scene: &Scene, i_frame: u32) -> Result<Vec<FacetRow>> {
    check_lit(scene)?;
    let truth = FrameReference::new(scene, scene.time.at(i_frame))?;
    let rows = truth.facets.iter().enumerate().map(|(i, f)| {
        let place = f.position + truth.state.light_origin;
        let or_dark = |of: &[DVec3]| of.get(i).copied().unwrap_or(DVec3::ZERO);
        let lit = [
            truth.irradiance[i],
            or_dark(&truth.indirect),
            truth.radiance[i],
            or_dark(&truth.second),
        ];
        let lit = toward_camera(scene, f.region, truth.state.pose.position - place, f.normal, lit);
        facet_row(i, f.region, [place, f.normal], f.area, lit)
    });
    Ok(rows.collect())
}

/// Returns a row for each surface and ground, with its centre, normal and area, and the means of
/// its facets weighted by their areas.
pub fn per_surface(scene: &Scene, rows: &[FacetRow]) -> Vec<FacetRow> {
    let of_ground = |t: &Terrain| {
        let (low, high) = t.bounds();
        [
            0.5 * (low + high),
            t.facets().map(|f| f.area * f.normal).sum::<DVec3>().normalize_or(DVec3::Y),
        ]
    };
    let surfaces = scene.surfaces.iter().map(|s| [s.center, s.normal()]);
    let mean = |(i, place): (usize, [DVec3; 2])| {
        let own: Vec<&FacetRow> = rows.iter().filter(|r| r.region as usize == i).collect();
        let area: f64 = own.iter().map(|r| r.area).sum();
        let mean = |k: usize| own.iter().map(|r| r.area * r.lit()[k]).sum::<DVec3>() / area;
        facet_row(i, i as u32, place, area, [0, 1, 2, 3].map(mean))
    };
    surfaces.chain(scene.terrains.iter().map(of_ground)).enumerate().map(mean).collect()
}

/// Returns the attempts and folded particles of every box from the device.
///
/// # Errors
/// Fails if generating the particles fails.
pub fn boxes(stage: &mut Stage) -> Result<Vec<BoxRow>> {
    let status = stage.renderer.generate_now(&stage.device)?.1;
    let tries = status.iter().map(|s| (u64::from(s & !FOLDED), s & FOLDED != 0));
    Ok(box_rows(&stage.scene, &tries.collect::<Vec<_>>()))
}

/// Returns the attempts and folded particles of every box from the reference.
pub fn boxes_reference(scene: &Scene) -> Vec<BoxRow> {
    let tried = |g: Generated| (u64::from(g.n_attempts), g.folded);
    let tries: Vec<_> = scene
        .clouds
        .iter()
        .flat_map(|c| crate::reference::live::cloud(c, 0.0))
        .map(tried)
        .collect();
    box_rows(scene, &tries)
}

fn box_rows(scene: &Scene, tries: &[(u64, bool)]) -> Vec<BoxRow> {
    let mut rows: Vec<BoxRow> = Vec::new();
    let mut n_before = 0;
    for group in scene.groups() {
        if !matches!(scene.clouds[group.i_cloud].source, CloudSource::Boxes { .. }) {
            continue;
        }
        let first = group.i_first as usize;
        let mine = &tries[first..first + group.n_particles as usize];
        let attempts: u64 = mine.iter().map(|t| t.0).sum();
        let folded = mine.iter().filter(|t| t.1).count() as u32;
        let accepted = f64::from(group.n_particles - folded);
        if rows.last().is_some_and(|r| r.cloud != group.i_cloud) {
            n_before = rows.len();
        }
        let i_box = rows.len() - n_before;
        let acceptance = (attempts > 0).then(|| accepted / attempts as f64);
        rows.push(BoxRow {
            cloud: group.i_cloud,
            r#box: i_box,
            particles: group.n_particles,
            attempts,
            acceptance,
            folded,
        });
    }
    rows
}

/// Returns the passes that frames `0..n_frames` run and skip, with the reasons.
///
/// # Errors
/// Fails if drawing a frame fails.
pub fn plans(stage: &mut Stage, n_frames: u32) -> Result<Vec<PlanRow>> {
    let mut rows = Vec::new();
    let on_frame = &mut |times: crate::frame::FrameTimes, _: &mut _| {
        rows.extend(Pass::ALL.iter().map(|pass| {
            let decision = times.plan.decision(*pass);
            PlanRow {
                frame: times.i_frame,
                pass: pass.name(),
                run: decision.run,
                reason: decision.reason.to_string(),
            }
        }));
        Ok(true)
    };
    let mode = stage.scene.threads.mode;
    stage.run(mode, 0..n_frames, on_frame)?;
    Ok(rows)
}

/// Draws a frame and returns its state.
pub(super) fn draw(stage: &mut Stage, i_frame: u32) -> Result<FrameState> {
    let packet = stage.game.step(i_frame)?;
    let time_s = packet.time_s;
    stage.renderer.step(packet)?;
    FrameState::at(&stage.scene, &stage.scene.groups(), time_s)
}

fn check_lit(scene: &Scene) -> Result<()> {
    match scene.lighting.mode {
        LightingMode::None => {
            Err(Error::usage("the scene has no facets: lighting.mode is \"none\""))
        }
        _ => Ok(()),
    }
}

/// Returns the cloud of particle `i`: that of the last group that begins at or before it. Groups
/// are in the order of their particles, and an empty one precedes the group that begins at its
/// place.
pub(super) fn cloud_of(groups: &[Group], i: usize) -> usize {
    let after = groups.partition_point(|g| g.i_first as usize <= i);
    groups[after.saturating_sub(1)].i_cloud
}

/// Sets L1 and L2, the last two of `lit`, to zero if the camera sees the back of a surface or
/// ground.
fn toward_camera(
    scene: &Scene,
    region: u32,
    to_eye: DVec3,
    normal: DVec3,
    lit: [DVec3; 4],
) -> [DVec3; 4] {
    let is_back = (region as usize) < scene.n_solids() && normal.dot(to_eye) <= 0.0;
    if is_back { [lit[0], lit[1], DVec3::ZERO, DVec3::ZERO] } else { lit }
}

fn facet_row(
    index: usize,
    region: u32,
    [p, n]: [DVec3; 2],
    area: f64,
    [id, ii, l1, l2]: [DVec3; 4],
) -> FacetRow {
    FacetRow {
        index,
        region,
        x: p.x,
        y: p.y,
        z: p.z,
        nx: n.x,
        ny: n.y,
        nz: n.z,
        area,
        id_r: id.x,
        id_g: id.y,
        id_b: id.z,
        ii_r: ii.x,
        ii_g: ii.y,
        ii_b: ii.z,
        l1_r: l1.x,
        l1_g: l1.y,
        l1_b: l1.z,
        l2_r: l2.x,
        l2_g: l2.y,
        l2_b: l2.z,
    }
}
