//! Blobs of all sizes that are deposited on a grid.

use glam::{DQuat, DVec3};

use nimbus::model::boxes::{BoxLaw, Form};
use nimbus::model::cloud::{Shape, Turn};
use nimbus::reference::Blob;
use nimbus::reference::generate::{generate_box, uniforms};

const LAW: BoxLaw = BoxLaw { radius_scale: 0.6, ..BoxLaw::new(Form::Centred) };

/// Blobs from a hundredth of a cell to a fifth of the scene, of masses over nine orders of
/// magnitude.
pub fn scattered(n: u32) -> Vec<Blob> {
    let blob = |i: u32| {
        let ([a, b, c, d], [e, ..]) = (uniforms(0x64123, 0, i, 0), uniforms(0x64123, 1, i, 0));
        let position = DVec3::new(20.0 * a - 8.0, 12.0 * b, 9.0 * c - 40.0);
        Blob {
            shape: Shape::BALL,
            position,
            sigma: 0.004 * 500f64.powf(d),
            kappa: 10f64.powf(3.0 * e - 2.0),
        }
    };
    (0..n).map(blob).collect()
}

/// The same, from a fiftieth to five times as high as wide.
pub fn ellipsoids(n: u32) -> Vec<Blob> {
    let shaped = |(b, i): (Blob, u32)| Blob {
        shape: Shape::upright(0.02 * 250f64.powf(uniforms(0x64124, 0, i, 0)[0])),
        ..b
    };
    scattered(n).into_iter().zip(0..).map(shaped).collect()
}

/// Blobs of one to seven cells of 64.
pub fn wide(n: u32) -> Vec<Blob> {
    let of = |(b, i): (Blob, u32)| Blob { sigma: 8f64.powf(uniforms(0x64125, 0, i, 0)[0]), ..b };
    scattered(n).into_iter().zip(0..).map(of).collect()
}

/// Blobs of half a cell to three of 24, which are `aspect` times as high as wide.
pub fn medium(n: u32, aspect: f64) -> Vec<Blob> {
    let blob = |i: u32| {
        let ([a, b, c, d], [e, ..]) = (uniforms(0x64128, 0, i, 0), uniforms(0x64128, 1, i, 0));
        let position = DVec3::new(3.0 * a, 7.0 + 0.2 * aspect * b, 1.6 * c - 3.0);
        let kappa = 10f64.powf(3.0 * e - 2.0);
        Blob { shape: Shape::upright(aspect), position, sigma: 0.5 + 2.55 * d, kappa }
    };
    (0..n).map(blob).collect()
}

/// [`wide`] ones, from half to twice as high as wide.
pub fn wide_ellipsoids(n: u32) -> Vec<Blob> {
    let shaped = |(b, i): (Blob, u32)| Blob {
        shape: Shape::upright(0.5 * 4f64.powf(uniforms(0x64126, 0, i, 0)[0])),
        ..b
    };
    wide(n).into_iter().zip(0..).map(shaped).collect()
}

/// Ellipsoids of any axes, a twentieth to once as long as the longest. Every fifth blob is a ball.
pub fn turned(n: u32) -> Vec<Blob> {
    scattered(n)
        .into_iter()
        .zip(0..)
        .map(|(b, i)| Blob { shape: turned_shape(i, 0.05), ..b })
        .collect()
}

/// The same of one to seven cells of 64, half to once as long as the longest.
pub fn wide_turned(n: u32) -> Vec<Blob> {
    wide(n).into_iter().zip(0..).map(|(b, i)| Blob { shape: turned_shape(i, 0.5), ..b }).collect()
}

fn turned_shape(i: u32, least: f64) -> Shape {
    if i % 5 == 4 {
        return Shape::BALL;
    }
    let ([a, b, c, d], [e, f, ..]) = (uniforms(0x64127, 0, i, 0), uniforms(0x64127, 1, i, 0));
    let turn = DQuat::from_xyzw(a - 0.5, b - 0.5, c - 0.5, d - 0.5).normalize();
    let [aspect, aspect_z] = [e, f].map(|v| least.powf(v));
    Shape { aspect, aspect_z, turn: Turn::new(turn) }
}

pub fn paper() -> Vec<Blob> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cubes-554.dat");
    let boxes = nimbus::io::box_file::read(&path).unwrap();
    let of_box = |(b, i): (&nimbus::model::boxes::CloudBox, u32)| {
        let center = b.center;
        generate_box(b, i, 1, &LAW)
            .into_iter()
            .map(move |g| Blob {
                shape: g.shape,
                position: center + g.position,
                sigma: g.sigma,
                kappa: g.kappa,
            })
            .collect::<Vec<_>>()
    };
    boxes.iter().zip(0..).flat_map(of_box).collect()
}

/// Small blobs whose cut ends within rounding of a cell's face, on either side of it. Where
/// rounding makes the share of the cell beyond negative, it must not become 2³² quanta.
pub fn at_the_cut() -> Vec<Blob> {
    let blob = |i: u32| {
        let [a, b, ..] = uniforms(0xc07, 0, i, 0);
        let sigma = 0.02 + 0.1 * a;
        // Cells of 1 from 0 on: the face at 5 lies 3σ(1 ± 1e-6) away.
        let x = 5.0 - 3.0 * sigma * (1.0 + 2e-6 * (b - 0.5));
        Blob {
            shape: Shape::BALL,
            position: DVec3::new(x, 4.5, 3.5),
            sigma,
            kappa: 1.0 / sigma.powi(3),
        }
    };
    (0..4000).map(blob).collect()
}
