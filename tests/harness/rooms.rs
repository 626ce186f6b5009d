//! Random scenes of rectangles as texts, and the device's results for a scene.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::fmt::Write;
use std::sync::Arc;

use glam::DVec3;
use nimbus::frame::Game;
use nimbus::frame::Renderer;
use nimbus::gpu::Compiler;
use nimbus::layout::facet::{FacetRecord, LitRecord};
use nimbus::layout::frame::LightRecord;
use nimbus::model::grid::DEPOSIT_CUT_SIGMA;
use nimbus::model::scene::Scene;

use crate::bounded::Random;
use crate::harness::Gpu;

/// The beginning of every scene; the picture is not used.
pub const HEAD: &str = "title = 'room'\n[film]\nwidth = 8\nheight = 8\n";

/// A light from all directions.
pub const SKY: &str = "[[light]]\nkind = 'sky'\nirradiance = [0.3, 0.4, 0.6]\nconstant = 0.2\n";

/// Returns the text of a rectangle and its material.
#[derive(Debug, Clone, Copy)]
pub struct Plate {
    pub center: DVec3,
    pub u: DVec3,
    pub v: DVec3,
    pub kd: DVec3,
    pub ks: DVec3,
    pub ns: f64,
    pub subdivide: [u32; 2],
}

fn list(v: DVec3) -> String {
    format!("{:?}", v.to_array())
}

/// The text of materials and surfaces.
pub fn plates_text(plates: &[Plate]) -> String {
    let mut text = String::new();
    for (i, p) in plates.iter().enumerate() {
        let (kd, ks, ns) = (list(p.kd), list(p.ks), p.ns);
        writeln!(text, "[[material]]\nname = 'm{i}'\nkd = {kd}\nks = {ks}\nns = {ns:?}").unwrap();
        let (c, u, v, n) = (list(p.center), list(p.u), list(p.v), p.subdivide);
        writeln!(
            text,
            "[[surface]]\ncenter = {c}\nu = {u}\nv = {v}\nmaterial = 'm{i}'\nsubdivide = {n:?}"
        )
        .unwrap();
    }
    text
}

/// Returns a number from 0 to 1.
fn share(r: &mut Random) -> f64 {
    f64::from(r.within(0.0, 1.0))
}

fn vector(r: &mut Random, low: f64, high: f64) -> DVec3 {
    DVec3::from([0; 3].map(|_| f64::from(r.within(low, high))))
}

/// Returns rectangles of half axes 0.3…0.8 with centres within ±`reach`: K_d 0.2…0.6, K_s up to
/// `ks`, n_s from 1 to 100, uniform in its logarithm.
pub fn random_plates(r: &mut Random, n: usize, reach: f64, ks: f64) -> Vec<Plate> {
    let mut one = || {
        let [a, b] = [0; 2].map(|_| DVec3::from(r.direction().map(f64::from)));
        let (u, v) = (a.normalize(), a.cross(b).normalize());
        Plate {
            center: vector(r, -reach, reach),
            u: u * (0.3 + 0.5 * share(r)),
            v: v * (0.3 + 0.5 * share(r)),
            kd: vector(r, 0.2, 0.6),
            ks: DVec3::splat(ks * share(r)),
            ns: 100f64.powf(share(r)),
            subdivide: [8, 8],
        }
    };
    (0..n).map(|_| one()).collect()
}

/// Returns a sun from a random direction and a lamp at a random position.
pub fn sun_and_lamp(r: &mut Random, reach: f64) -> String {
    let (d, p) = (DVec3::from(r.direction().map(f64::from)), vector(r, -reach, reach));
    let sun = format!(
        "[[light]]\nkind = 'directional'\ndirection = {}\nirradiance = [3.0, 2.9, 2.7]\n",
        list(d)
    );
    format!(
        "{sun}[[light]]\nkind = 'point'\nposition = {}\nintensity = [4.0, 4.0, \
         4.5]\nradius = 0.05\n",
        list(p)
    )
}

/// A frame of a scene.
pub struct Frame {
    pub scene: Arc<Scene>,
    /// The lighting origin O.
    pub origin: DVec3,
    /// Facets relative to O.
    pub eye: DVec3,
    pub facets: Vec<FacetRecord>,
    pub lit: Vec<LitRecord>,
    pub density: Vec<f32>,
    pub lights: Vec<LightRecord>,
}

/// Renders the scene's first frame with the compiler's shaders.
pub fn frame_by(gpu: &Gpu, compiler: &Compiler, scene: Scene) -> Frame {
    let scene = Arc::new(scene);
    let mut renderer = Renderer::new(&gpu.device, compiler, &scene, true).expect("a renderer");
    let packet = Game::new(scene.clone(), None).step(0).expect("a packet");
    let (low, high) =
        scene.lighting_bounds(&scene.groups(), packet.time_s, DEPOSIT_CUT_SIGMA).expect("bounds");
    let (eye, lights) = (DVec3::from(packet.camera.eye.map(f64::from)), packet.lights.clone());
    renderer.step(packet).expect("a frame");
    let (facets, lit) = renderer.facets(&gpu.device).expect("facets");
    Frame { origin: 0.5 * (low + high), eye, facets, lit, density: vec![], lights, scene }
}

pub fn frame(gpu: &Gpu, scene: Scene) -> Frame {
    frame_by(gpu, &gpu.compiler, scene)
}
