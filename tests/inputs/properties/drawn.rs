//! Small pictures of random particles: finite values, alpha at most 1, and the same bytes with and
//! without skipping.

use std::path::Path;

use glam::DVec3;
use nimbus::frame::DeviceChoice;
use nimbus::frame::serial;
use nimbus::io::scene_file::parse;
use nimbus::model::boxes::{BoxLaw, CloudBox, Form};
use nimbus::model::cloud::{Cloud, CloudSource, Particle, Shape};
use nimbus::model::growth::Growth;
use nimbus::model::gust::Gust;
use nimbus::model::scene::Scene;
use nimbus::model::texture::Texture;
use nimbus::stress::StressContext;
use proptest::collection::vec;
use proptest::prelude::*;

use super::check;

const N_FRAMES: u32 = 3;

/// A scene's text, its particles, an optional box, and whether there is wind.
type Made = (String, Vec<Particle>, Option<CloudBox>, bool);

fn blob() -> impl Strategy<Value = Particle> {
    let place = [-4.0..4.0, -3.0..3.0, -4.0..4.0].prop_map(DVec3::from_array);
    let color = [0.0..1.0, 0.0..1.0, 0.0..1.0].prop_map(DVec3::from_array);
    (place, 0.01..1.5, prop_oneof![Just(0.0), 0.01..50.0], color).prop_map(
        |(position, sigma, kappa, color)| Particle {
            shape: Shape::BALL,
            position,
            sigma,
            kappa,
            color,
        },
    )
}

fn some_box() -> impl Strategy<Value = Option<CloudBox>> {
    let of = |(n_particles, extent, radius_max): (u32, [f64; 3], f64)| CloudBox {
        n_particles,
        extent: DVec3::from_array(extent),
        center: DVec3::ZERO,
        radius_max,
    };
    proptest::option::of((1..16u32, [0.1..3.0, 0.1..3.0, 0.1..3.0], 0.1..1.5).prop_map(of))
}

fn scene() -> impl Strategy<Value = Made> {
    let modes = prop_oneof![2 => Just("none"), 1 => Just("first"), 1 => Just("two-reflection")];
    let paths = prop_oneof![Just("sprites"), Just("tiles")];
    let formats = prop_oneof![Just("rgba8"), Just("rgba16f"), Just("rgba32f")];
    let steps = prop_oneof![Just("0.0"), Just("0.4")];
    let text = (modes, paths, formats, steps, 8..24u32, 2.0..12.0).prop_map(
        |(mode, path, format, step, grid, z)| {
            format!(
                "[film]\nwidth = 24\nheight = 18\nformat = '{format}'\n[camera]\nposition = [0, 1, \
             {z}]\n\
             [time]\nstep_s = {step}\n[lighting]\nmode = '{mode}'\ngrid = {grid}\n[draw]\npath \
             = '{path}'\n"
            )
        },
    );
    (text, vec(blob(), 0..25), some_box(), any::<bool>())
}

fn cloud_of(source: CloudSource, gust: Gust) -> Cloud {
    let (growth, texture) = (Growth::NONE, Texture::NONE);
    Cloud {
        facing: nimbus::model::cloud::Facing::Outward,
        source,
        position: DVec3::ZERO,
        wind: DVec3::ZERO,
        gust,
        growth,
        texture,
        i_material: 0,
        seed: 5,
    }
}

fn with_clouds((text, list, one_box, is_stirred): Made) -> Scene {
    let path = Path::new("property.toml");
    let mut scene = parse(text, path, &[], None).expect("a scene").scene;
    let stirred = Gust { amplitude: 0.2, length: 2.0, period_s: 3.0, n_waves: 4 };
    let gust = if is_stirred { stirred } else { Gust::CALM };
    scene.clouds.push(cloud_of(CloudSource::Particles(list.into()), gust));
    if let Some(one_box) = one_box {
        let law = BoxLaw { optical_depth: 1.3, ..BoxLaw::new(Form::Centred) };
        let source = CloudSource::Boxes { boxes: vec![one_box], law };
        scene.clouds.push(cloud_of(source, gust));
    }
    scene
}

/// Returns colours and bytes of every frame.
fn frames(
    context: &StressContext,
    scene: &Scene,
    skip: bool,
) -> nimbus::error::Result<Vec<(Vec<f32>, Vec<u8>)>> {
    let mut player = context.player(scene, skip)?;
    let mut all = Vec::new();
    serial::run(&mut player.game, &mut player.renderer, 0..N_FRAMES, &mut |_, renderer| {
        all.push((renderer.image()?, renderer.image_bytes()?));
        Ok(true)
    })?;
    Ok(all)
}

#[test]
fn pictures_are_finite_and_independent_of_skipping() {
    let choice = DeviceChoice { validation: true, ..DeviceChoice::default() };
    let context = StressContext::open(&choice).expect("a Vulkan 1.3 device");
    let n_seen = std::cell::Cell::new(0);
    check(24, scene(), |made| {
        let scene = with_clouds(made);
        let drawn =
            |skip| frames(&context, &scene, skip).map_err(|e| TestCaseError::fail(e.to_string()));
        let (some, all) = (drawn(true)?, drawn(false)?);
        prop_assert_eq!(some.len(), N_FRAMES as usize);
        for (i, ((rgba, bytes), (_, bytes_of_all))) in some.iter().zip(&all).enumerate() {
            for pixel in rgba.chunks_exact(4) {
                prop_assert!(
                    pixel.iter().all(|v| v.is_finite() && *v >= 0.0),
                    "frame {i}: {pixel:?}"
                );
                prop_assert!(pixel[3] <= 1.0, "frame {i}: {pixel:?}");
            }
            prop_assert!(bytes == bytes_of_all, "frame {i}: other bytes where nothing is left out");
            n_seen.set(n_seen.get() + usize::from(bytes.iter().any(|b| *b != 0)));
        }
        Ok(())
    });
    // Empty pictures would be equal as well.
    assert!(n_seen.get() > 24, "something is drawn in {} frames", n_seen.get());
    context.close().expect("no validation messages");
}
