//! A scene as Mitsuba 3 reads it: the blobs on a grid, surfaces, ground, lights and camera
//! (transport.md, "Another program").

mod grid;
mod spot;
mod vector;

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use glam::DVec3;

use crate::error::{Error, Result};
use crate::model::light::Light;
use crate::model::phase::Phase;
use crate::model::scene::Scene;
use crate::reference::picture::TransportParts;
use crate::reference::transport::Lights;

pub use grid::Grid;
use grid::{extinction, reach, usual_step};
pub use spot::file_name as spot_picture;
use vector::list;

/// Columns and rows of the picture of the sky.
const SKY: [u32; 2] = [512, 256];

/// The names of the files.
pub const SCENE: &str = "scene.xml";
/// Extinction on a grid.
pub const EXTINCTION: &str = "extinction.vol";
/// Albedo on the same grid, where blobs differ.
pub const ALBEDO: &str = "albedo.vol";
/// The sky's radiance.
pub const SKY_PICTURE: &str = "sky.exr";
/// The ground.
pub const GROUND: &str = "ground.ply";

/// A scene for Mitsuba.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// The scene file.
    pub scene: String,
    /// Extinction; none without clouds.
    pub extinction: Option<Grid>,
    /// Albedo, where blobs differ.
    pub albedo: Option<Grid>,
    /// The sky's picture: columns, rows, linear RGBA.
    pub sky: Option<([u32; 2], Vec<f32>)>,
    /// The pictures that spots throw, alike.
    pub spots: Vec<([u32; 2], Vec<f32>)>,
    /// The ground as PLY.
    pub ground: Option<String>,
    /// Width of a cell.
    pub step: f64,
}

/// Returns `scene` at `time_s` for Mitsuba, on a grid of the given step.
///
/// # Errors
/// The scene has what Mitsuba has not, the grid would be too large, or the camera has no direction.
pub fn export(scene: &Scene, time_s: f64, step: Option<f64>, n_samples: u32) -> Result<Exported> {
    let parts = TransportParts::new(scene, time_s)?;
    check(&parts)?;
    let shown: Vec<usize> =
        (0..parts.blobs.len()).filter(|&i| reach(&parts.blobs[i]) > 0.0).collect();
    let step = step.unwrap_or_else(|| usual_step(&parts.blobs, &shown));
    let grid = (!shown.is_empty()).then(|| extinction(&parts, &shown, step)).transpose()?;
    let is_even = parts.scatterers.iter().all(|s| s.albedo == parts.scatterers[0].albedo);
    let (extinction, albedo) = match grid {
        Some((extinction, albedo)) => (Some(extinction), albedo.filter(|_| !is_even)),
        None => (None, None),
    };
    let sky = sky(&parts);
    let spots = parts.lights.iter().filter_map(spot::picture).collect();
    let ground = (!parts.triangles.is_empty()).then(|| ply(&parts));
    let mut text = String::new();
    let files = (extinction.as_ref(), albedo.is_some(), sky.is_some());
    // Writing to a string cannot fail.
    let _ = scene_file(&mut text, scene, &parts, files, n_samples);
    Ok(Exported { scene: text, extinction, albedo, sky, spots, ground, step })
}

/// Checks that Mitsuba has everything that the scene has.
fn check(parts: &TransportParts) -> Result<()> {
    let refused = |what: &str, expected: &str| {
        Err(Error::usage(format!("Mitsuba has no {what} as nimbus has; expected {expected}")))
    };
    if parts.blobs.iter().any(|blob| !blob.shape.is_upright()) {
        return Err(Error::usage(
            "ellipsoids whose axes are turned are not exported; expected balls and upright \
             ellipsoids",
        ));
    }
    if parts.lights.iter().any(spot::is_too_wide) {
        return refused("spot lights so wide", "outer_deg of at most 80");
    }
    if parts.brdfs.iter().any(|brdf| brdf.ks != DVec3::ZERO) {
        return refused("lobes", "surfaces and ground of ks = [0, 0, 0]");
    }
    let phases = || parts.scatterers.iter().map(|s| s.phase);
    let is_known = |phase: Phase| matches!(phase, Phase::HenyeyGreenstein { .. });
    if !phases().all(is_known) || phases().any(|p| p != parts.scatterers[0].phase) {
        return refused("such phase functions", "one mean cosine for all clouds (material.phase)");
    }
    Ok(())
}

/// Returns the sky's picture, rows from the zenith down; none without a sky. Column 0 looks along
/// -z, and the next ones turn toward x.
fn sky(parts: &TransportParts) -> Option<([u32; 2], Vec<f32>)> {
    let lights = Lights::new(&parts.lights, parts.sun_radius).under(parts.sky);
    let pixel = |i: u32, j: u32| {
        let [around, down] = [(i, TAU / f64::from(SKY[0])), (j, PI / f64::from(SKY[1]))]
            .map(|(k, step)| (f64::from(k) + 0.5) * step);
        let direction =
            DVec3::new(around.sin() * down.sin(), down.cos(), -around.cos() * down.sin());
        let l = lights.sky_radiance(direction).as_vec3();
        [l.x, l.y, l.z, 1.0]
    };
    let shines = |light: &Light| light.is_sky() && light.energy() != DVec3::ZERO;
    let pixels = || (0..SKY[1]).flat_map(|j| (0..SKY[0]).flat_map(move |i| pixel(i, j)));
    parts.lights.iter().any(shines).then(|| (SKY, pixels().collect()))
}

/// Returns the ground's triangles as PLY.
fn ply(parts: &TransportParts) -> String {
    let n = parts.triangles.len();
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nelement face {n}\nproperty list uchar int vertex_indices\nend_header\n",
        3 * n
    );
    for ([corner, u, v], _) in &parts.triangles {
        for p in [*corner, *corner + *u, *corner + *v] {
            let _ = writeln!(text, "{} {} {}", p.x, p.y, p.z);
        }
    }
    for i in 0..n {
        let _ = writeln!(text, "3 {} {} {}", 3 * i, 3 * i + 1, 3 * i + 2);
    }
    text
}

/// Writes the scene file.
fn scene_file(
    text: &mut String,
    scene: &Scene,
    parts: &TransportParts,
    (extinction, has_albedo, has_sky): (Option<&Grid>, bool, bool),
    n_samples: u32,
) -> std::fmt::Result {
    let view = &parts.view;
    let (eye, fov) = (view.pose.position, view.fov_y_rad.to_degrees());
    let inside =
        extinction.is_some_and(|g| eye.cmpge(g.bounds[0]).all() && eye.cmple(g.bounds[1]).all());
    let medium = if inside { "\n    <ref id=\"cloud\"/>" } else { "" };
    writeln!(
        text,
        r#"<scene version="3.0.0">
  <integrator type="volpath">
    <integer name="max_depth" value="-1"/>
    <integer name="rr_depth" value="1000000"/>
    <boolean name="hide_emitters" value="true"/>
  </integrator>"#
    )?;
    if let Some(grid) = extinction {
        let scatterer = parts.scatterers[0];
        let albedo = match has_albedo {
            true => format!(
                r#"<volume name="albedo" type="gridvolume">
      <string name="filename" value="{ALBEDO}"/>
      <boolean name="use_grid_bbox" value="true"/>
      <boolean name="raw" value="true"/>
    </volume>"#
            ),
            false => format!(r#"<rgb name="albedo" value="{}"/>"#, list(scatterer.albedo)),
        };
        let [low, high] = grid.bounds;
        writeln!(
            text,
            r#"  <medium type="heterogeneous" id="cloud">
    <volume name="sigma_t" type="gridvolume">
      <string name="filename" value="{EXTINCTION}"/>
      <boolean name="use_grid_bbox" value="true"/>
    </volume>
    {albedo}
    <phase type="hg">
      <float name="g" value="{}"/>
    </phase>
  </medium>
  <shape type="cube">
    <transform name="to_world">
      <scale value="{}"/>
      <translate value="{}"/>
    </transform>
    <bsdf type="null"/>
    <ref name="interior" id="cloud"/>
  </shape>"#,
            scatterer.phase.mean_cosine(),
            list(0.5 * (high - low)),
            list(0.5 * (low + high))
        )?;
    }
    writeln!(
        text,
        r#"  <sensor type="perspective">
    <string name="fov_axis" value="y"/>
    <float name="fov" value="{fov}"/>
    <float name="near_clip" value="{}"/>
    <transform name="to_world">
      <lookat origin="{}" target="{}" up="{}"/>
    </transform>
    <sampler type="independent">
      <integer name="sample_count" value="{n_samples}"/>
    </sampler>
    <film type="hdrfilm">
      <integer name="width" value="{}"/>
      <integer name="height" value="{}"/>
      <string name="pixel_format" value="rgba"/>
      <rfilter type="box"/>
    </film>{medium}
  </sensor>"#,
        view.near,
        list(eye),
        list(eye + view.pose.forward),
        list(view.pose.up),
        scene.film.width,
        scene.film.height
    )?;
    lights(text, parts, has_sky)?;
    flats(text, parts)?;
    writeln!(text, "</scene>")
}

fn lights(text: &mut String, parts: &TransportParts, has_sky: bool) -> std::fmt::Result {
    let mut n_spots = 0;
    for light in &parts.lights {
        let (kind, place, strength) = match light {
            Light::Directional { direction, irradiance } => {
                ("directional", ("vector", "direction", *direction), ("irradiance", *irradiance))
            }
            Light::Point { position, intensity, .. } => {
                ("point", ("point", "position", *position), ("intensity", *intensity))
            }
            Light::Spot { .. } => {
                spot::emitter(text, light, n_spots)?;
                n_spots += 1;
                continue;
            }
            // All skies together are the picture below.
            Light::Sky { .. } => continue,
        };
        let (tag, name, value) = place;
        writeln!(
            text,
            r#"  <emitter type="{kind}">
    <{tag} name="{name}" value="{}"/>
    <rgb name="{}" value="{}"/>
  </emitter>"#,
            list(value),
            strength.0,
            list(strength.1)
        )?;
    }
    if has_sky {
        writeln!(
            text,
            r#"  <emitter type="envmap">
    <string name="filename" value="{SKY_PICTURE}"/>
  </emitter>"#
        )?;
    }
    Ok(())
}

fn flats(text: &mut String, parts: &TransportParts) -> std::fmt::Result {
    for ([corner, u, v], i_brdf) in &parts.rectangles {
        // Mitsuba's rectangle is [-1, 1]^2 and faces +z.
        let (u, v) = (0.5 * *u, 0.5 * *v);
        let (center, normal) = (*corner + u + v, u.cross(v).normalize());
        let row = |k: usize| format!("{} {} {} {}", u[k], v[k], normal[k], center[k]);
        writeln!(
            text,
            r#"  <shape type="rectangle">
    <transform name="to_world">
      <matrix value="{} {} {} 0 0 0 1"/>
    </transform>
    <bsdf type="diffuse">
      <rgb name="reflectance" value="{}"/>
    </bsdf>
  </shape>"#,
            row(0),
            row(1),
            row(2),
            list(parts.brdfs[*i_brdf as usize].kd)
        )?;
    }
    if let Some((_, i_brdf)) = parts.triangles.first() {
        writeln!(
            text,
            r#"  <shape type="ply">
    <string name="filename" value="{GROUND}"/>
    <boolean name="face_normals" value="true"/>
    <bsdf type="diffuse">
      <rgb name="reflectance" value="{}"/>
    </bsdf>
  </shape>"#,
            list(parts.brdfs[*i_brdf as usize].kd)
        )?;
    }
    Ok(())
}
