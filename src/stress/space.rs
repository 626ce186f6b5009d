//! Far places, late times, narrow and wide views, small and large targets, cameras that look
//! nowhere.

use glam::DVec3;

use super::case::{Case, Comparison, Found};
use super::desk::Desk;
use super::scenes::{LIT, PLAIN, blob, heap, one_box, with_boxes, with_particles};
use crate::error::{Error, Result};
use crate::model::cloud::Particle;
use crate::model::growth::Growth;
use crate::model::gust::Gust;
use crate::model::scene::Scene;
use crate::reference::picture::FrameReference;
use crate::reference::rounding::{SINE_ERROR, U_F32};

pub const CASES: &[Case] = &[
    Case {
        name: "space/far-exactly",
        what: "all of a lit scene 2^23 away in every direction: the same picture to the byte",
        bound: "0",
        run: far_exactly,
    },
    Case {
        name: "space/far",
        what: "all of a lit scene 1e7 away: the same places but for f64's rounding of 1e7",
        bound: "2^-51 of 1e7, and u of the place",
        run: far,
    },
    Case {
        name: "space/late-wind",
        what: "a cloud that drifts, after 1e6 s: places relative to it as at 0",
        bound: "2^-50 of the way, and u of the place",
        run: late_wind,
    },
    Case {
        name: "space/late-gust",
        what: "gusts after 1e6 s against f64",
        bound: "a wave's sine: 4 u and its argument's rounding; sums",
        run: |desk| gusts(desk, 1e6),
    },
    Case {
        name: "space/early-gust",
        what: "gusts at -1e6 s against f64",
        bound: "a wave's sine: 4 u and its argument's rounding; sums",
        run: |desk| gusts(desk, -1e6),
    },
    Case {
        name: "space/late-growth",
        what: "a cloud that has grown for 1e6 s: its last size, and places so much farther apart",
        bound: "8 u of the place",
        run: late_growth,
    },
    Case {
        name: "space/last-frame",
        what: "frame 2^32 - 1, alone",
        bound: "2^-50 of the way, and u of the place",
        run: last_frame,
    },
    Case {
        name: "space/narrow",
        what: "a view of 1 degree: the pixel in the middle of a blob has the blob's own opacity",
        bound: "1e-6 + 24 u, relative",
        run: |desk| view(desk, 1.0),
    },
    Case {
        name: "space/wide",
        what: "a view of 179 degrees",
        bound: "1e-6 + 24 u, relative",
        run: |desk| view(desk, 179.0),
    },
    Case {
        name: "space/near-plane",
        what: "blobs whose centres lie before and behind the near plane by 1e-5 of it, \
            wide as they are",
        bound: "0: drawn or not; finite",
        run: near_plane,
    },
    Case {
        name: "space/eye-inside",
        what: "an eye in the middle of blobs, of sizes from 1e-3 to 1e3",
        bound: "finite; alpha within 0 and 1",
        run: eye_inside,
    },
    Case {
        name: "space/one-pixel",
        what: "a target of one pixel, by sprites and by tiles",
        bound: "1e-6 + 24 u, relative",
        run: one_pixel,
    },
    Case {
        name: "space/long-targets",
        what: "targets of 8191 x 1 and 1 x 8191 pixels: a blob in the middle, nothing at the ends",
        bound: "0: finite; drawn in the middle alone",
        run: long_targets,
    },
    Case {
        name: "space/large-target",
        what: "a target of 8192 x 8192 pixels of 8 bits: drawn where the blob is, or refused \
            with the limit",
        bound: "0",
        run: large_target,
    },
    Case {
        name: "space/no-camera",
        what: "cameras with NaN, infinite places, no direction, or along what is up: an error \
            and no frame",
        bound: "an error",
        run: no_camera,
    },
];

/// `scene` with all that has a place moved by `by`.
fn moved(scene: &Scene, by: DVec3) -> Scene {
    let mut scene = scene.clone();
    scene.clouds.iter_mut().for_each(|c| c.position += by);
    scene.surfaces.iter_mut().for_each(|s| s.center += by);
    scene
        .camera
        .keys
        .iter_mut()
        .for_each(|k| (k.position, k.target) = (k.position + by, k.target + by));
    scene
}

fn lit_heap(desk: &Desk) -> Result<Scene> {
    // Places that f64 still has exactly 2^23 away.
    let exact = |p: Particle| Particle { position: (p.position * 1024.0).round() / 1024.0, ..p };
    with_particles(desk, LIT, heap(200).into_iter().map(exact).collect())
}

fn far_exactly(desk: &mut Desk) -> Result<Found> {
    let scene = lit_heap(desk)?;
    let here = desk.play(&scene, 0)?;
    let by = 2f64.powi(23);
    let there = desk.play(&moved(&scene, DVec3::new(by, -by, by)), 0)?;
    let mut c = Comparison::default();
    c.same(&here.bytes, &there.bytes, "bytes of the picture");
    c.same(&here.placed, &there.placed, "places");
    c.holds(here.bytes.iter().any(|b| *b != 0), || "that something is drawn".to_owned());
    Ok(c.into())
}

fn far(desk: &mut Desk) -> Result<Found> {
    let scene = lit_heap(desk)?;
    let (here, there) =
        (desk.play(&scene, 0)?, desk.play(&moved(&scene, DVec3::new(1e7, -1e7, 1e7)), 0)?);
    let mut c = Comparison::default();
    for (i, (a, b)) in here.placed.iter().zip(&there.placed).enumerate() {
        for k in 0..3 {
            let (a, b) = (f64::from(a.position[k]), f64::from(b.position[k]));
            c.add(b, a, 2.0 * U_F32 * a.abs() + 2f64.powi(-51) * 1e7, || {
                format!("place of particle {i}, axis {k}")
            });
        }
    }
    c.add(there.n_odd() as f64, 0.0, 0.0, || "numbers that are not finite".to_owned());
    Ok(c.into())
}

fn late_wind(desk: &mut Desk) -> Result<Found> {
    let mut scene = lit_heap(desk)?;
    scene.clouds[0].wind = DVec3::new(3.7, 0.1, -2.3);
    (scene.time.start_s, scene.time.step_s) = (0.0, 1e6);
    let (early, late) = (desk.play(&scene, 0)?, desk.play(&scene, 1)?);
    let way = scene.clouds[0].wind.abs().max_element() * 1e6;
    let mut c = Comparison::default();
    for (i, (a, b)) in early.placed.iter().zip(&late.placed).enumerate() {
        for k in 0..3 {
            let (a, b) = (f64::from(a.position[k]), f64::from(b.position[k]));
            c.add(b, a, 2.0 * U_F32 * a.abs() + 2f64.powi(-50) * way, || {
                format!("place of particle {i}, axis {k}")
            });
        }
    }
    Ok(c.into())
}

/// The device's places of frame `i_frame` against the reference's, within `bound` of each.
fn places(
    desk: &mut Desk,
    scene: &Scene,
    i_frame: u32,
    bound: impl Fn(DVec3) -> f64,
) -> Result<Comparison> {
    let truth = FrameReference::unlit(scene, scene.time.at(i_frame))?;
    let played = desk.play(scene, i_frame)?;
    let mut c = Comparison::default();
    for (i, (place, blob)) in played.placed.iter().zip(&truth.blobs).enumerate() {
        for k in 0..3 {
            let value = f64::from(place.position[k]);
            c.add(value, blob.position[k], bound(blob.position), || {
                format!("place of particle {i}, axis {k}")
            });
        }
        // Rounded, and multiplied by a rounded scale.
        c.add(f64::from(place.sigma), blob.sigma, 4.0 * U_F32 * blob.sigma, || {
            format!("sigma of particle {i}")
        });
    }
    c.add(played.n_odd() as f64, 0.0, 0.0, || "numbers that are not finite".to_owned());
    Ok(c)
}

fn gusts(desk: &mut Desk, time_s: f64) -> Result<Found> {
    let mut scene = with_particles(desk, PLAIN, heap(400))?;
    scene.clouds[0].gust = Gust { amplitude: 0.4, length: 3.0, period_s: 7.0, n_waves: 24 };
    scene.time.start_s = time_s;
    let modes = scene.clouds[0].gust.modes(scene.clouds[0].seed);
    let bound = |p: DVec3| {
        // The phase at this time is reduced in f64 and rounded once; k and a are rounded, and k.x
        // has three products and two sums.
        let wave = |m: &crate::model::gust::Mode| {
            let argument = m.k.abs().dot(p.abs() + DVec3::splat(2.0)) + std::f64::consts::TAU;
            m.a.length() * (SINE_ERROR + 10.0 * U_F32 * argument)
        };
        let sum: f64 = modes.iter().map(|m| m.a.length()).sum();
        modes.iter().map(wave).sum::<f64>()
            + (modes.len() as f64 + 4.0) * U_F32 * (p.length() + sum)
    };
    Ok(places(desk, &scene, 0, bound)?.into())
}

fn late_growth(desk: &mut Desk) -> Result<Found> {
    let mut scene = with_particles(desk, PLAIN, heap(300))?;
    scene.clouds[0].growth = Growth { to: 2.5, time_s: 30.0 };
    scene.time.start_s = 1e6;
    let most = 2.5 * 4.0;
    Ok(places(desk, &scene, 0, |p| 8.0 * U_F32 * (p.length() + most))?.into())
}

fn last_frame(desk: &mut Desk) -> Result<Found> {
    let mut scene = with_particles(desk, PLAIN, heap(200))?;
    scene.clouds[0].wind = DVec3::new(1e-3, 0.0, 0.0);
    scene.time.step_s = 1.0 / 60.0;
    let way = scene.clouds[0].wind.x * scene.time.at(u32::MAX);
    Ok(places(desk, &scene, u32::MAX, |p| {
        4.0 * U_F32 * p.abs().max_element() + 2f64.powi(-50) * way
    })?
    .into())
}

/// What the pixel in the middle may be off of a blob's opacity through its centre: what 1 - e^-t
/// promises, two products and two roundings of the depth, an exponential of nearly nothing.
const MIDDLE_OFF: f64 = 1e-6 + 24.0 * U_F32;

/// A blob at the origin, seen through the middle of a pixel: its opacity.
fn middle(
    c: &mut Comparison,
    desk: &mut Desk,
    text: &str,
    i_pixel: usize,
    what: &str,
) -> Result<()> {
    const TAU: f64 = 0.8;
    let scene = with_particles(desk, text, vec![blob([0.0; 3], 0.5, TAU)])?;
    let played = desk.play(&scene, 0)?;
    let truth = -(-TAU).exp_m1();
    c.add(f64::from(played.rgba[4 * i_pixel + 3]), truth, MIDDLE_OFF * truth, || {
        format!("alpha, {what}")
    });
    c.add(played.n_odd() as f64, 0.0, 0.0, || format!("numbers that are not finite, {what}"));
    Ok(())
}

fn view(desk: &mut Desk, fov_y_deg: f64) -> Result<Found> {
    let mut c = Comparison::default();
    for path in ["sprites", "tiles"] {
        let text = PLAIN.replace("target", &format!("fov_y_deg = {fov_y_deg:?}\ntarget"));
        middle(&mut c, desk, &format!("{text}[draw]\npath = '{path}'\n"), 24 * 65 + 32, path)?;
    }
    Ok(c.into())
}

fn near_plane(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for path in ["sprites", "tiles"] {
        for near in [0.01, 1.0, 7.0] {
            for (beyond, drawn) in [(1e-5, true), (-1e-5, false)] {
                let text = PLAIN.replace("target", &format!("near = {near:?}\ntarget"));
                let z = 10.0 - near * (1.0 + beyond);
                let scene = with_particles(
                    desk,
                    &format!("{text}[draw]\npath = '{path}'\n"),
                    vec![blob([0.0, 0.0, z], 2.0, 1.0)],
                )?;
                let played = desk.play(&scene, 0)?;
                let found = played.rgba.iter().any(|v| *v != 0.0);
                c.holds(found == drawn, || {
                    format!("{path}, near {near}: drawn {found} at {beyond:e} beyond")
                });
                c.add(played.n_odd() as f64, 0.0, 0.0, || {
                    format!("numbers that are not finite, {path}, near {near}")
                });
            }
        }
    }
    Ok(c.into())
}

fn eye_inside(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for path in ["sprites", "tiles"] {
        for sigma in [1e-3, 0.1, 1.0, 30.0, 1e3] {
            let around: Vec<Particle> = heap(60)
                .into_iter()
                .map(|p| Particle {
                    sigma,
                    kappa: 0.3 / sigma,
                    position: p.position + DVec3::Z * 10.0,
                    ..p
                })
                .collect();
            let scene = with_particles(desk, &format!("{PLAIN}[draw]\npath = '{path}'\n"), around)?;
            let played = desk.play(&scene, 0)?;
            c.add(played.n_odd() as f64, 0.0, 0.0, || {
                format!("numbers that are not finite, {path}, sigma {sigma}")
            });
            let within = played.rgba.chunks_exact(4).all(|p| (0.0..=1.0).contains(&p[3]));
            c.holds(within, || format!("alpha within 0 and 1, {path}, sigma {sigma}"));
        }
    }
    Ok(c.into())
}

fn one_pixel(desk: &mut Desk) -> Result<Found> {
    let text = PLAIN.replace("width = 65", "width = 1").replace("height = 49", "height = 1");
    let mut c = Comparison::default();
    for path in ["sprites", "tiles"] {
        middle(&mut c, desk, &format!("{text}[draw]\npath = '{path}'\n"), 0, path)?;
    }
    Ok(c.into())
}

fn long_targets(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for path in ["sprites", "tiles"] {
        for (width, height) in [(8191u32, 1u32), (1, 8191)] {
            let text = PLAIN
                .replace("width = 65", &format!("width = {width}"))
                .replace("height = 49", &format!("height = {height}"));
            let scene = with_particles(
                desk,
                &format!("{text}[draw]\npath = '{path}'\n"),
                vec![blob([0.0; 3], 0.5, 2.0)],
            )?;
            let played = desk.play(&scene, 0)?;
            let alpha = |i: usize| played.rgba[4 * i + 3];
            c.add(played.n_odd() as f64, 0.0, 0.0, || {
                format!("numbers that are not finite, {path}, {width} x {height}")
            });
            c.holds(alpha(4095) > 0.5, || {
                format!("a blob in the middle, {path}, {width} x {height}")
            });
            c.holds(alpha(0) == 0.0 && alpha(8190) == 0.0, || {
                format!("nothing at the ends, {path}, {width} x {height}")
            });
        }
    }
    Ok(c.into())
}

fn large_target(desk: &mut Desk) -> Result<Found> {
    const SIDE: usize = 8192;
    let text = PLAIN
        .replace("width = 65", "width = 8192")
        .replace("height = 49", "height = 8192")
        .replace("rgba32f", "rgba8");
    let scene = with_particles(
        desk,
        &format!("{text}[draw]\npath = 'sprites'\n"),
        vec![blob([0.0; 3], 0.01, 50.0)],
    )?;
    let mut c = Comparison::default();
    let mut player = match desk.player(&scene, false) {
        Ok(player) => player,
        Err(Error::Limit { what }) => {
            c.holds(true, || "a limit".to_owned());
            return Ok(c.remark(format!("refused: {what}")).into());
        }
        Err(error) => return Err(error),
    };
    let packet = player.game.step(0)?;
    player.renderer.step(packet)?;
    let bytes = player.renderer.image_bytes()?;
    let alpha = |i: usize, j: usize| f64::from(bytes[4 * (j * SIDE + i) + 3]);
    c.add(alpha(SIDE / 2, SIDE / 2), 255.0, 0.0, || "alpha in the middle".to_owned());
    for (i, j) in [(0, 0), (SIDE - 1, 0), (0, SIDE - 1), (SIDE - 1, SIDE - 1)] {
        c.add(alpha(i, j), 0.0, 0.0, || format!("alpha in the corner {i}, {j}"));
    }
    Ok(c.into())
}

fn no_camera(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    let scene = with_boxes(desk, PLAIN, vec![one_box(10, [1.0; 3], 1.0)])?;
    let places = [
        (DVec3::new(f64::NAN, 0.0, 0.0), DVec3::ZERO, "NaN"),
        (DVec3::new(f64::INFINITY, 0.0, 0.0), DVec3::ZERO, "an infinite place"),
        (DVec3::Z, DVec3::splat(f64::NAN), "a target of NaN"),
        (DVec3::Z, DVec3::Z, "no direction"),
        (DVec3::ZERO, DVec3::Y, "along what is up"),
    ];
    for (position, target, what) in places {
        let mut scene = scene.clone();
        scene.camera.keys.iter_mut().for_each(|k| (k.position, k.target) = (position, target));
        let frame =
            desk.player(&scene, false).and_then(|mut player| player.game.step(0).map(|_| ()));
        // Bad input, and no fault of the device.
        c.holds(frame.is_err_and(|e| e.exit_code() == 2), || {
            format!("an error of a camera of {what}")
        });
    }
    Ok(c.into())
}
