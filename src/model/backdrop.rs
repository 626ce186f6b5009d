//! What a display shows of a picture's pixels: over the background or the sky, tone-mapped.

use glam::DVec3;

use super::camera::Pose;
use super::film::Film;
use super::scene::Scene;
use super::sky::SkyView;

/// A film, and what is behind the scene in each pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Backdrop {
    /// Size and display settings.
    pub film: Film,
    sky: Option<SkyRays>,
}

/// A sky, and the rays of the pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SkyRays {
    view: SkyView,
    pose: Pose,
    fov_y_rad: f64,
}

impl From<Film> for Backdrop {
    /// Returns the film's own background.
    fn from(film: Film) -> Backdrop {
        Backdrop { film, sky: None }
    }
}

impl Backdrop {
    /// Returns what is behind `scene` at `time_s`, seen by its own camera.
    pub fn of(scene: &Scene, time_s: f64) -> Backdrop {
        scene
            .camera
            .pose(time_s)
            .map_or_else(|| scene.film.into(), |pose| Backdrop::seen(scene, &pose, time_s))
    }

    /// Returns what is behind `scene`, seen by a camera at `pose`.
    pub fn seen(scene: &Scene, pose: &Pose, time_s: f64) -> Backdrop {
        match scene.sky_view(pose.position, time_s) {
            Some(view) => Backdrop::under(scene.film, view, pose, scene.camera.fov_y_rad),
            None => scene.film.into(),
        }
    }

    /// Returns a sky as a camera at `pose` sees it; `fov_y_rad`: its vertical field of view.
    pub fn under(film: Film, view: SkyView, pose: &Pose, fov_y_rad: f64) -> Backdrop {
        Backdrop { film, sky: Some(SkyRays { view, pose: *pose, fov_y_rad }) }
    }

    /// Returns the linear radiance behind the pixel in column `x` and row `y`.
    pub fn at(&self, x: usize, y: usize) -> DVec3 {
        let Some(SkyRays { view, pose, fov_y_rad }) = &self.sky else {
            return self.film.background;
        };
        let [width, height] = [self.film.width, self.film.height].map(f64::from);
        let tan_y = (0.5 * fov_y_rad).tan();
        let right = (2.0 * (x as f64 + 0.5) / width - 1.0) * tan_y * width / height;
        let up = (1.0 - 2.0 * (y as f64 + 0.5) / height) * tan_y;
        view.behind((pose.forward + right * pose.right + up * pose.up).normalize())
    }

    /// Returns the display value in [0, 1]³ of a premultiplied linear pixel (alpha = 1 −
    /// transmittance).
    pub fn display(&self, x: usize, y: usize, rgb: DVec3, alpha: f64) -> DVec3 {
        self.film.display_over(rgb, alpha, self.at(x, y))
    }
}
