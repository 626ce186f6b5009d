//! Scenes of the suite: a text without files, and clouds put into it.

use glam::DVec3;

use super::desk::Desk;
use crate::error::Result;
use crate::model::boxes::{CloudBox, Form};
use crate::model::cloud::{Cloud, CloudSource, Particle, SQRT_TAU};
use crate::model::growth::Growth;
use crate::model::gust::Gust;
use crate::model::scene::Scene;
use crate::model::surface::Surface;
use crate::model::texture::Texture;

/// An odd number of pixels, so that there is one in the middle; numbers are kept as they are.
pub const PLAIN: &str = "[film]\nwidth = 65\nheight = 49\nformat = 'rgba32f'\nbackground = [0, 0, \
    0]\n\
    [camera]\nposition = [0, 0, 10]\ntarget = [0, 0, 0]\n[lighting]\nmode = 'none'\n";

/// The same lit by a sun and the sky.
pub const LIT: &str = "[film]\nwidth = 65\nheight = 49\nformat = 'rgba32f'\nbackground = [0, 0, \
    0]\n\
    [camera]\nposition = [0, 0, 10]\ntarget = [0, 0, 0]\n[lighting]\nmode = 'first'\ngrid = 24\n\
    [[light]]\nkind = 'directional'\ndirection = [-0.5, -0.8, -0.3]\nirradiance = [3, 2.9, 2.7]\n\
    [[light]]\nkind = 'sky'\nirradiance = [0.8, 0.87, 1]\nconstant = 0.25\n\
    [[material]]\nname = 'cloud'\nkd = [0.9, 0.9, 0.9]\n";

/// The seed of the suite's clouds.
pub const SEED: u32 = 9;

/// Of a thickness that shows.
pub const OPTICAL_DEPTH: f64 = 1.3;

pub fn cloud_of(source: CloudSource) -> Cloud {
    Cloud {
        facing: crate::model::cloud::Facing::Outward,
        source,
        position: DVec3::ZERO,
        wind: DVec3::ZERO,
        gust: Gust::CALM,
        growth: Growth::NONE,
        texture: Texture::NONE,
        i_material: 0,
        seed: SEED,
    }
}

/// `text` with a cloud of boxes.
pub fn with_boxes(desk: &Desk, text: &str, boxes: Vec<CloudBox>) -> Result<Scene> {
    let source = CloudSource::Boxes {
        boxes,
        form: Form::Centred,
        optical_depth: OPTICAL_DEPTH,
        radius_scale: 1.0,
    };
    let mut scene = desk.scene(text)?;
    scene.clouds.push(cloud_of(source));
    Ok(scene)
}

/// `text` with a cloud of these particles.
pub fn with_particles(desk: &Desk, text: &str, particles: Vec<Particle>) -> Result<Scene> {
    let mut scene = desk.scene(text)?;
    scene.clouds.push(cloud_of(CloudSource::Particles(particles)));
    Ok(scene)
}

pub fn one_box(n_particles: u32, extent: [f64; 3], radius_max: f64) -> CloudBox {
    CloudBox { n_particles, extent: DVec3::from_array(extent), center: DVec3::ZERO, radius_max }
}

/// A white blob whose optical depth through the centre is `tau`.
pub fn blob(position: [f64; 3], sigma: f64, tau: f64) -> Particle {
    Particle {
        aspect: 1.0,
        position: DVec3::from_array(position),
        sigma,
        kappa: tau / (SQRT_TAU * sigma),
        color: DVec3::ONE,
    }
}

/// Some hundred blobs in a ball of radius 2, of several sizes and colours.
pub fn heap(n: u32) -> Vec<Particle> {
    let of = |i: u32| {
        let t = f64::from(i);
        let share = |k: f64| (k * t).fract();
        let (z, turn, r) = (
            2.0 * share(0.618_033_988_7) - 1.0,
            2.399_963_229_7 * t,
            2.0 * share(0.754_877_666_2).cbrt(),
        );
        let across = (1.0 - z * z).sqrt();
        let at = [r * across * turn.cos(), r * z, r * across * turn.sin()];
        let color = DVec3::new(0.5 + 0.5 * share(0.3), 0.5 + 0.5 * share(0.7), 1.0);
        Particle { color, ..blob(at, 0.15 + 0.2 * share(0.569_840_290_9), 0.2 + share(0.41)) }
    };
    (0..n).map(of).collect()
}

/// A rectangle of half axes `u` and `v`, whose front is toward u × v, of `n` × `n` facets.
pub fn plate(center: [f64; 3], u: [f64; 3], v: [f64; 3], n: u32) -> Surface {
    let [center, u, v] = [center, u, v].map(DVec3::from_array);
    Surface { center, u, v, i_material: 0, subdivide: [n, n] }
}

/// A sun from above, straight down.
pub const NOON: &str =
    "[[light]]\nkind = 'directional'\ndirection = [0, -1, 0]\nirradiance = [1, 1, 1]\n";
pub const DULL: &str = "kd = [0.5, 0.5, 0.5]\n";

/// Rectangles of one material under `lights`, by two reflections; `lighting`: further keys of it.
pub fn room(
    desk: &Desk,
    lighting: &str,
    lights: &str,
    material: &str,
    surfaces: Vec<Surface>,
) -> Result<Scene> {
    let text = format!(
        "[film]\nwidth = 65\nheight = 49\nformat = 'rgba32f'\nbackground = [0, 0, 0]\n\
         [camera]\nposition = [0.3, 4, 10]\ntarget = [0, 0, 0]\n[lighting]\nmode = \
         'two-reflection'\n{lighting}\n{lights}\
         [[material]]\nname = 'm'\n{material}"
    );
    let mut scene = desk.scene(&text)?;
    scene.surfaces = surfaces;
    Ok(scene)
}
