//! Scenes of the stress suite: scene texts without files, and clouds and surfaces added to them.

use std::path::Path;

use glam::DVec3;

use super::context::{DeviceFrame, StressContext};
use crate::error::Result;
use crate::io::scene_file::parse;
use crate::model::boxes::{BoxLaw, CloudBox, Form};
use crate::model::cloud::{Cloud, CloudSource, Facing, Particle, SQRT_TAU, Shape};
use crate::model::growth::Growth;
use crate::model::gust::Gust;
use crate::model::scene::Scene;
use crate::model::surface::Surface;
use crate::model::texture::Texture;

/// Picture width of the suite's scenes, px. Odd, so that one column lies in the middle.
pub const WIDTH: usize = 65;
/// Picture height of the suite's scenes, px.
pub const HEIGHT: usize = 49;
/// Index of the pixel in the middle of the picture.
pub const MIDDLE: usize = HEIGHT / 2 * WIDTH + WIDTH / 2;

/// A scene without light or clouds. Its film stores the values without rounding them again.
pub const UNLIT: &str = "\
    [film]\nwidth = 65\nheight = 49\nformat = 'rgba32f'\nbackground = [0, 0, 0]\n\
    [camera]\nposition = [0, 0, 10]\ntarget = [0, 0, 0]\n[lighting]\nmode = 'none'\n";

/// The same scene with a sun, a sky and a white cloud material.
pub const LIT: &str = "\
    [film]\nwidth = 65\nheight = 49\nformat = 'rgba32f'\nbackground = [0, 0, 0]\n\
    [camera]\nposition = [0, 0, 10]\ntarget = [0, 0, 0]\n[lighting]\nmode = 'first'\ngrid = 24\n\
    [[light]]\nkind = 'directional'\ndirection = [-0.5, -0.8, -0.3]\nirradiance = [3, 2.9, 2.7]\n\
    [[light]]\nkind = 'sky'\nirradiance = [0.8, 0.87, 1]\nconstant = 0.25\n\
    [[material]]\nname = 'cloud'\nkd = [0.9, 0.9, 0.9]\n";

/// Keys of `[draw]` that select the sprite path.
pub const SPRITES: &str = "path = 'sprites'";
/// Keys of `[draw]` that select the tile path.
pub const TILES: &str = "path = 'tiles'";
/// Keys of `[draw]` that compose by slices.
pub const SLICES: &str = "path = 'tiles'\noverlap = 'slices'";
/// Both drawing paths.
pub const PATHS: [&str; 2] = [SPRITES, TILES];

/// The seed of the suite's clouds.
pub const SEED: u32 = 9;
/// Optical depth of the clouds of boxes.
pub const OPTICAL_DEPTH: f64 = 1.3;
/// Law of their boxes.
pub const LAW: BoxLaw = BoxLaw { optical_depth: OPTICAL_DEPTH, ..BoxLaw::new(Form::Centred) };

/// A sun in the zenith.
pub const SUN_ABOVE: &str =
    "[[light]]\nkind = 'directional'\ndirection = [0, -1, 0]\nirradiance = [1, 1, 1]\n";
/// Returns a sun that shines in `direction`.
pub fn sun(direction: &str) -> String {
    format!("[[light]]\nkind = 'directional'\ndirection = {direction}\nirradiance = [1, 1, 1]\n")
}

/// Keys of a diffuse grey material.
pub const GREY: &str = "kd = [0.5, 0.5, 0.5]\n";

/// Parses the text of a scene that names no files.
///
/// # Errors
/// Fails if the text is no scene.
pub fn parse_scene(text: &str) -> Result<Scene> {
    Ok(parse(text.to_owned(), Path::new("stress.toml"), &[], None)?.scene)
}

/// Returns a cloud at the origin, at rest.
pub fn cloud_of(source: CloudSource) -> Cloud {
    Cloud {
        facing: Facing::Outward,
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

/// Parses a scene text and adds a cloud of boxes.
///
/// # Errors
/// Fails if the text is no scene.
pub fn box_scene(text: &str, boxes: Vec<CloudBox>) -> Result<Scene> {
    let mut scene = parse_scene(text)?;
    scene.clouds.push(cloud_of(CloudSource::Boxes { boxes, law: LAW }));
    Ok(scene)
}

/// Parses a scene text with the keys `draw` of `[draw]` and adds a cloud of particles.
///
/// # Errors
/// Fails if the text is no scene.
pub fn blob_scene(text: &str, draw: &str, particles: Vec<Particle>) -> Result<Scene> {
    let mut scene = parse_scene(&format!("{text}[draw]\n{draw}\n"))?;
    scene.clouds.push(cloud_of(CloudSource::Particles(particles.into())));
    Ok(scene)
}

/// Renders frame 0 of [`blob_scene`].
///
/// # Errors
/// Fails if the text is no scene, or drawing it fails.
pub fn render_blobs(
    ctx: &mut StressContext,
    text: &str,
    draw: &str,
    particles: Vec<Particle>,
) -> Result<DeviceFrame> {
    ctx.render(&blob_scene(text, draw, particles)?, 0)
}

/// Returns a box at the origin.
pub fn centred_box(n_particles: u32, extent: [f64; 3], radius_max: f64) -> CloudBox {
    CloudBox { n_particles, extent: DVec3::from_array(extent), center: DVec3::ZERO, radius_max }
}

/// Returns a white particle whose optical depth through the centre is `tau`.
pub fn blob(position: [f64; 3], sigma: f64, tau: f64) -> Particle {
    Particle {
        shape: Shape::BALL,
        position: DVec3::from_array(position),
        sigma,
        kappa: tau / (SQRT_TAU * sigma),
        color: DVec3::ONE,
    }
}

/// Returns `n` particles of several sizes and colours, spread over a ball of radius 2.
pub fn blob_cluster(n: u32) -> Vec<Particle> {
    let particle = |i: u32| {
        let t = f64::from(i);
        let share = |k: f64| (k * t).fract();
        let z = 2.0 * share(0.618_033_988_7) - 1.0;
        let (sin, cos) = (2.399_963_229_7 * t).sin_cos();
        let r = 2.0 * share(0.754_877_666_2).cbrt();
        let across = r * (1.0 - z * z).sqrt();
        let color = DVec3::new(0.5 + 0.5 * share(0.3), 0.5 + 0.5 * share(0.7), 1.0);
        let at = [across * cos, r * z, across * sin];
        Particle { color, ..blob(at, 0.15 + 0.2 * share(0.569_840_290_9), 0.2 + share(0.41)) }
    };
    (0..n).map(particle).collect()
}

/// Returns a rectangle of half axes `u` and `v` with `n` × `n` facets. Its front faces u × v.
pub fn rectangle(center: [f64; 3], u: [f64; 3], v: [f64; 3], n: u32) -> Surface {
    let [center, u, v] = [center, u, v].map(DVec3::from_array);
    Surface { center, u, v, i_material: 0, subdivide: [n, n] }
}

/// Returns a horizontal square of side 2 with `n` × `n` facets, facing up.
pub fn floor(center: [f64; 3], n: u32) -> Surface {
    rectangle(center, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], n)
}

/// Returns a floor and two walls that meet in a corner, each of side 2 with `n` × `n` facets.
pub fn corner(n: u32) -> [Surface; 3] {
    [
        floor([0.0; 3], n),
        rectangle([0.0, 1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], n),
        rectangle([-1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], n),
    ]
}

/// Returns a two-reflection scene of rectangles of one material; `lighting` holds more keys of
/// `[lighting]`.
///
/// # Errors
/// Fails if the text is no scene.
pub fn surface_scene(
    lighting: &str,
    lights: &str,
    material: &str,
    surfaces: impl Into<Vec<Surface>>,
) -> Result<Scene> {
    let text = format!(
        "[film]\nwidth = 65\nheight = 49\nformat = 'rgba32f'\nbackground = [0, 0, 0]\n\
         [camera]\nposition = [0.3, 4, 10]\ntarget = [0, 0, 0]\n\
         [lighting]\nmode = 'two-reflection'\n{lighting}\n{lights}\
         [[material]]\nname = 'm'\n{material}"
    );
    let mut scene = parse_scene(&text)?;
    scene.surfaces = surfaces.into();
    Ok(scene)
}

/// Applies `change` to the position and the target of every camera key.
pub fn change_camera(scene: &mut Scene, change: impl Fn(DVec3) -> DVec3) {
    for key in &mut scene.camera.keys {
        (key.position, key.target) = (change(key.position), change(key.target));
    }
}
