//! Light through clouds: thin as nothing and thick as walls, grids without extent, lamps inside of
//! blobs, ways along cells' faces.

use glam::DVec3;

use super::case::{Case, Comparison, Found};
use super::desk::{Desk, Played};
use super::scenes::{NOON, blob, cloud_of, heap, plate, room};
use crate::error::Result;
use crate::model::cloud::{CloudSource, Particle};
use crate::model::scene::Scene;
use crate::reference::rounding::U_F32;

pub const CASES: &[Case] = &[
    Case {
        name: "transmittance/thin",
        what: "a floor under a cloud of optical depth 1e-12: as bright as without",
        bound: "1e-12 and 4 u, relative",
        run: |desk| under(desk, 1e-12),
    },
    Case {
        name: "transmittance/thick",
        what: "a floor under a cloud of optical depth 1e5: dark in the middle, and nothing odd",
        bound: "2^-126",
        run: |desk| under(desk, 1e5),
    },
    Case {
        name: "transmittance/forward",
        what: "a cloud of optical depth 1e5 of which all is scattered forward (g = 1): as \
            bright as without",
        bound: "4 u, relative",
        run: forward,
    },
    Case {
        name: "transmittance/no-extent",
        what: "a cloud of one blob without size: a grid without extent",
        bound: "4 u, relative",
        run: no_extent,
    },
    Case {
        name: "transmittance/flat-grid",
        what: "blobs in a plane, a thousand times as wide as thick: light within 0 and that \
            without them",
        bound: "4 u, relative",
        run: flat_grid,
    },
    Case {
        name: "transmittance/inside",
        what: "a lamp in the middle of a blob: e^-tau of half of its depth, by cells of a \
            sixteenth of sigma",
        bound: "0.58 % of it: cells' means for the blob, cut at 3 sigma",
        run: inside,
    },
    Case {
        name: "transmittance/along-faces",
        what: "ways that lead along an axis, and along the very faces of the grid's cells: \
            within 0 and 1",
        bound: "4 u",
        run: along_faces,
    },
    Case {
        name: "transmittance/proportional",
        what: "ever more extinction from 1e-6 to 1e4: the depth of every way in proportion",
        bound: "3 + 2x ulp of e^-x, and 16 u of x",
        run: proportional,
    },
];

/// A floor of one facet of 1e-3 at `y`, which sees noon through `particles`.
fn floor_under(
    desk: &Desk,
    lighting: &str,
    lights: &str,
    y: f64,
    particles: Vec<Particle>,
) -> Result<Scene> {
    let floor = plate([0.0, y, 0.0], [0.0, 0.0, 5e-4], [5e-4, 0.0, 0.0], 1);
    // All that is scattered is lost, where nothing else is said.
    let lighting = if lighting.is_empty() { "forward = 0.0" } else { lighting };
    let mut scene = room(
        desk,
        &format!("grid = 48\n{lighting}"),
        lights,
        "kd = [0.5, 0.5, 0.5]\n",
        vec![floor],
    )?;
    scene.lighting.mode = crate::model::scene::LightingMode::First;
    if !particles.is_empty() {
        scene.clouds.push(cloud_of(CloudSource::Particles(particles)));
    }
    Ok(scene)
}

/// I_d of the floor, and that all light is finite and not negative.
fn direct(c: &mut Comparison, played: &Played) -> f64 {
    let is_good = |l: &crate::layout::facet::LitRecord| {
        l.direct.iter().chain(&l.first).all(|v| v.is_finite() && *v >= 0.0)
    };
    c.holds(played.lit.iter().all(is_good), || "light that is finite and not negative".to_owned());
    f64::from(played.lit[0].direct[0])
}

fn under(desk: &mut Desk, tau: f64) -> Result<Found> {
    let scene = floor_under(desk, "", NOON, -3.0, vec![blob([0.0; 3], 0.5, tau)])?;
    let played = desk.play(&scene, 0)?;
    let mut c = Comparison::default();
    let found = direct(&mut c, &played);
    let (truth, bound) =
        if tau < 1.0 { (1.0, 4.0 * U_F32 + tau) } else { (0.0, f64::from(f32::MIN_POSITIVE)) };
    c.add(found, truth, bound, || "irradiance of the floor".to_owned());
    c.add(played.n_odd() as f64, 0.0, 0.0, || {
        "numbers of the picture that are not finite".to_owned()
    });
    Ok(c.into())
}

fn forward(desk: &mut Desk) -> Result<Found> {
    let scene = floor_under(desk, "forward = 1.0", NOON, -3.0, vec![blob([0.0; 3], 0.5, 1e5)])?;
    let played = desk.play(&scene, 0)?;
    let mut c = Comparison::default();
    let found = direct(&mut c, &played);
    c.add(found, 1.0, 4.0 * U_F32, || "irradiance of the floor".to_owned());
    Ok(c.into())
}

fn no_extent(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for at in [[0.0; 3], [0.0, 1e-3, 0.0], [1e6, -2.0, 5.0]] {
        let point = Particle {
            aspect: 1.0,
            position: DVec3::from_array(at),
            sigma: 0.0,
            kappa: 1.0,
            color: DVec3::ONE,
        };
        let scene = floor_under(desk, "", NOON, -3.0, vec![point])?;
        let played = desk.play(&scene, 0)?;
        let found = direct(&mut c, &played);
        c.add(found, 1.0, 4.0 * U_F32, || format!("irradiance of the floor, a point at {at:?}"));
        c.add(played.n_odd() as f64, 0.0, 0.0, || {
            "numbers of the picture that are not finite".to_owned()
        });
    }
    Ok(c.into())
}

fn flat_grid(desk: &mut Desk) -> Result<Found> {
    let flat = heap(300).into_iter().map(|p| Particle {
        position: p.position * DVec3::new(500.0, 0.0, 500.0),
        sigma: 0.5,
        kappa: 2.0,
        ..p
    });
    let scene = floor_under(desk, "", NOON, -3.0, flat.collect())?;
    let played = desk.play(&scene, 0)?;
    let mut c = Comparison::default();
    direct(&mut c, &played);
    c.holds(
        played.lit.iter().any(|l| l.direct[0] > 0.1)
            && played.lit.iter().any(|l| l.direct[0] < 0.9),
        || "light and shadow".to_owned(),
    );
    for (i, lit) in played.lit.iter().enumerate() {
        c.add((f64::from(lit.direct[0]) - 1.0).max(0.0), 0.0, 4.0 * U_F32, || {
            format!("facet {i} beyond the light without")
        });
    }
    Ok(c.into())
}

fn inside(desk: &mut Desk) -> Result<Found> {
    const TAU: f64 = 1.6;
    let lamp =
        "[[light]]\nkind = 'point'\nposition = [0, 0, 0]\nintensity = [1, 1, 1]\nradius = 0.01\n";
    // The blob's box is 6 sigma wide: 96 cells are 16 a sigma.
    let scene = floor_under(desk, "", lamp, -3.0, vec![blob([0.0; 3], 0.5, TAU)])?;
    let scene = Scene {
        lighting: crate::model::scene::Lighting { grid: 96, step: 0.5, ..scene.lighting },
        ..scene
    };
    let played = desk.play(&scene, 0)?;
    let mut c = Comparison::default();
    let found = direct(&mut c, &played);
    // At 3 beneath the lamp: 1/9, through half of the blob.
    let tau = -(9.0 * found).ln();
    c.add(tau, 0.5 * TAU, 0.0058 * 0.5 * TAU, || "optical depth from the middle".to_owned());
    Ok(c.into())
}

fn along_faces(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    // A grid of 48 cells over a box of 6 units: faces lie at multiples of 1/8.
    let corners = [-1.0, 1.0]
        .map(|s| Particle { kappa: 0.4, ..blob([2.5 * s, 2.5 * s, 2.5 * s], 1.0 / 6.0, 1.0) });
    let particles: Vec<Particle> = corners.into_iter().chain(heap(100)).collect();
    for direction in [
        "[0, -1, 0]",
        "[1, 0, 0]",
        "[0, 0, -1]",
        "[-1, 0, 0]",
        "[0, 1, 0]",
        "[1, 1, 0]",
        "[-1, -1, -1]",
    ] {
        let lights = format!(
            "[[light]]\nkind = 'directional'\ndirection = {direction}\nirradiance = [1, 1, 1]\n"
        );
        for offset in [0.0, 0.125, 0.0625, 3.0] {
            let mut scene = floor_under(desk, "", &lights, -3.0, particles.clone())?;
            scene.surfaces = vec![
                plate([offset, -offset, 0.0], [0.0, 0.0, 0.5], [0.5, 0.0, 0.0], 4),
                plate([offset, -offset, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 0.5], 4),
            ];
            let played = desk.play(&scene, 0)?;
            direct(&mut c, &played);
            let some = played.lit.iter().any(|l| l.direct[0] > 1e-3);
            c.holds(some || offset > 1.0, || format!("that something is lit along {direction}"));
            for (i, lit) in played.lit.iter().enumerate() {
                let beyond = (f64::from(lit.direct[0]) - 1.0).max(0.0);
                c.add(beyond, 0.0, 4.0 * U_F32, || format!("facet {i} in light along {direction}"));
            }
        }
    }
    Ok(c.into())
}

fn proportional(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    let mut before: Option<Vec<f64>> = None;
    for k in 0..=20 {
        let tau = 1e-6 * 10f64.powf(f64::from(k) / 2.0);
        let particles =
            heap(60).into_iter().map(|p| blob(p.position.to_array(), p.sigma, tau)).collect();
        let mut scene = floor_under(desk, "", NOON, -3.0, particles)?;
        scene.surfaces = vec![plate([0.0, -3.0, 0.0], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0], 8)];
        let played = desk.play(&scene, 0)?;
        direct(&mut c, &played);
        // Of the floor: what reaches the blobs' own facets is not compared.
        let depths: Vec<f64> =
            played.lit[..64].iter().map(|l| -f64::from(l.direct[0]).ln()).collect();
        for (i, (now, before)) in depths.iter().zip(before.iter().flatten()).enumerate() {
            let (truth, at) = (10f64.sqrt() * before, || {
                format!("depth over facet {i} at optical depth {tau:e}")
            });
            // V is off by 3 + 2x ulp, 2 u each, and by u of energy and cosine: x by as much; the
            // march by 16 u of itself.
            let off = |x: f64| (8.0 + 20.0 * x) * U_F32 * if x < 1e-3 { 2.0 } else { 1.0 };
            match truth < 60.0 {
                true => c.add(*now, truth, off(*now) + 10f64.sqrt() * off(*before), at),
                false => c.holds(*now > 55.0, at),
            }
        }
        before = Some(depths);
    }
    let last = before.unwrap_or_default();
    c.holds(last.iter().any(|d| *d > 55.0) && last.iter().any(|d| *d < 1.0), || {
        "shadow and light".to_owned()
    });
    Ok(c.into())
}
