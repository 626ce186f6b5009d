//! Pictures in which nothing can be seen, with the reason as far as it can be found.

use glam::DVec3;

use super::features::tau_bound;
use super::renderer::Rendered;
use crate::error::Result;
use crate::model::film::Film;
use crate::model::frame_state::FrameState;
use crate::model::scene::Scene;

/// A difference of display values that no 8-bit picture shows: half a step.
const HALF_STEP: f64 = 0.5 / 255.0;

/// A frame, as far as the reason for an empty picture depends on it.
#[derive(Debug, Clone, Copy)]
pub struct DrawnFrame {
    /// Time of the scene, in seconds.
    pub time_s: f64,
    /// Particles that the drawing pass was given; `None` if this is not known.
    pub n_shown: Option<u32>,
}

impl DrawnFrame {
    /// Returns the frame at `time_s` with the counts of its render step.
    pub fn of(time_s: f64, rendered: &Rendered) -> DrawnFrame {
        DrawnFrame { time_s, n_shown: rendered.n_kept }
    }
}

/// Returns a sentence that says that nothing of `scene` can be seen in a picture of linear,
/// premultiplied pixels, and why; none if a pixel differs from the background.
///
/// # Errors
/// Fails if the scene has no state at the time of the frame.
pub fn unseen(scene: &Scene, frame: DrawnFrame, rgba: &[f32]) -> Result<Option<String>> {
    if shows_something(&scene.film, rgba) {
        return Ok(None);
    }
    let reason = reason(scene, frame, rgba)?;
    Ok(Some(format!("nothing can be seen in the picture: {reason}")))
}

/// Returns whether a pixel is displayed in another colour than the background's.
fn shows_something(film: &Film, rgba: &[f32]) -> bool {
    let empty = film.display(DVec3::ZERO, 0.0);
    rgba.chunks_exact(4).any(|pixel| {
        let [r, g, b, a] = [pixel[0], pixel[1], pixel[2], pixel[3]].map(f64::from);
        if [r, g, b, a] == [0.0; 4] {
            return false;
        }
        // NaN differs from every colour.
        let difference = (film.display(DVec3::new(r, g, b), a) - empty).abs().max_element();
        difference >= HALF_STEP || [r, g, b, a].iter().any(|v| !v.is_finite())
    })
}

fn reason(scene: &Scene, frame: DrawnFrame, rgba: &[f32]) -> Result<String> {
    let has_solids = scene.n_solids() > 0;
    if scene.n_particles() == 0 && !has_solids {
        return Ok(match scene.clouds.len() {
            0 => "the scene has no particles, surfaces or terrain; add a [[cloud]]".to_owned(),
            1 => "the scene's cloud has no particles: its file or box is empty".to_owned(),
            n => format!("none of the scene's {n} clouds has particles: files or boxes are empty"),
        });
    }
    let densest = rgba.chunks_exact(4).map(|pixel| pixel[3]).fold(0.0, f32::max);
    if densest > 0.0 {
        return Ok(if f64::from(densest) < 4.0 * HALF_STEP {
            format!(
                "the clouds are nearly transparent: the densest pixel hides {densest:.1e} of the \
                 background; a greater `optical_depth`, or extinction in a particle list, makes \
                 them denser"
            )
        } else {
            "what is drawn has the colour of the background; [[light]], `film.exposure` and \
             `film.background` set the two"
                .to_owned()
        });
    }
    if let Some(reason) = outside(scene, frame.time_s)? {
        return Ok(reason);
    }
    let small = "all particles are too small or too thin to show in a pixel; `draw.smallest`, \
        `draw.threshold` and `draw.particles` leave particles out";
    Ok(match frame.n_shown {
        Some(0) if !has_solids => small.to_owned(),
        _ => "what is in view is transparent; a greater `optical_depth`, or extinction in a \
              particle list, makes clouds denser"
            .to_owned(),
    })
}

/// Returns how all regions lie outside the view, if they do.
fn outside(scene: &Scene, time_s: f64) -> Result<Option<String>> {
    let groups = scene.groups();
    let pose = FrameState::at(scene, &groups, time_s)?.pose;
    let edge = scene.draw.edge();
    let reach = groups.iter().map(|g| edge.reach(tau_bound(scene, g))).fold(0.0, f64::max);
    let all = scene.region_bounds(&groups, time_s, reach);
    // Greatest value of a linear function over a box.
    let most = |n: DVec3, (low, high): &(DVec3, DVec3)| {
        let (middle, half) = (0.5 * (*low + *high) - pose.position, 0.5 * (*high - *low));
        n.dot(middle) + n.abs().dot(half)
    };
    let [x, y, z] = pose.position.to_array();
    let eye = format!("camera.position [{x}, {y}, {z}]");
    if all.iter().all(|b| most(pose.forward, b) < scene.camera.near) {
        return Ok(Some(format!(
            "the camera looks away: everything lies behind {eye}; `camera.target` sets the \
             direction"
        )));
    }
    let tan_y = (0.5 * scene.camera.fov_y_rad).tan();
    let tan_x = tan_y * f64::from(scene.film.width) / f64::from(scene.film.height);
    let (f, right, up) = (pose.forward, pose.right, pose.up);
    let sides = [tan_x * f - right, tan_x * f + right, tan_y * f - up, tan_y * f + up];
    let is_outside = |b: &(DVec3, DVec3)| {
        most(f, b) < scene.camera.near || sides.iter().any(|side| most(*side, b) < 0.0)
    };
    Ok(all.iter().all(is_outside).then(|| {
        format!(
            "the camera looks past the scene: everything lies outside the field of view from \
             {eye}; `camera.target` sets the direction, `camera.fov_y_deg` the width"
        )
    }))
}
