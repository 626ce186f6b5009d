//! Scenes whose clouds are a medium, and their light on the device and by the f64 twin.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use nimbus::frame::open_sides;
use nimbus::gpu::Compiler;
use nimbus::io::scene_file;
use nimbus::model::frame_state::FrameState;
use nimbus::model::scene::{LightingMode, Scene};
use nimbus::reference::picture::FrameReference;

use crate::harness::Gpu;

/// Colours, sizes, ellipsoids.
const POINTS: &str = "x,y,z,sigma,kappa,r,g,b\n\
    -0.8,0.1,0.2,0.35,4,1,1,1\n0.1,0.4,-0.3,0.3,6,1,0.8,0.6\n0.7,-0.2,0.3,0.25,9,0.7,0.9,1\n\
    0.2,-0.5,0.1,0.4,2,1,1,1\n-0.3,0.7,0.4,0.2,12,0.9,0.9,0.9\n0.9,0.5,-0.2,0.15,3,1,1,1\n";

const LIGHTS: &str = "[[light]]\nkind = 'directional'\ndirection = [-0.5, -0.8, -0.3]\n\
    irradiance = [3, 2.9, 2.7]\n[[light]]\nkind = 'sky'\nirradiance = [0.8, 0.87, 1]\n\
    constant = 0.3\n[[light]]\nkind = 'point'\nposition = [1.5, 1.2, 1]\nintensity = [2, 1, 0.5]\n\
    [[light]]\nkind = 'spot'\nposition = [-2, 1, 2]\ndirection = [2, -1, -2]\n\
    intensity = [1, 2, 3]\ninner_deg = 10\nouter_deg = 25\n";

/// A lamp under the clouds, and a sky.
const FROM_BELOW: &str = "[[light]]\nkind = 'sky'\nirradiance = [0.8, 0.87, 1]\nconstant = 0.3\n\
    [[light]]\nkind = 'point'\nposition = [0.3, -2.6, 0.2]\nintensity = [0.4, 0.2, 0.1]\n";

/// A clear sky of a low sun, which itself is dark, and a lamp under the clouds.
const EVENING: &str = "[[light]]\nkind = 'sky'\nconstant = 0.1\n[[light]]\n\
    kind = 'directional'\ndirection = [-0.7, -0.3, 0.6]\nirradiance = [0, 0, 0]\n[[light]]\n\
    kind = 'point'\nposition = [0.3, -2.6, 0.2]\nintensity = [0.4, 0.2, 0.1]\n\
    [sky]\nmodel = 'hosek-wilkie'\nhaze = 0\n";

/// Scenes by name: coloured balls among lamps and surfaces, droplets in facets of several, flat
/// blobs over one another, boxes, boxes with "opaque" cells; "floors" whose lamps no cloud hides,
/// in the box of the grid, near it, and far from it, and the same in the "evening".
pub fn scene(name: &str, mode: &str, more: &[&str]) -> Scene {
    let dir = tempfile::tempdir().expect("a folder");
    let write = |file: &str, text: &str| std::fs::write(dir.path().join(file), text).expect("room");
    write("points.csv", POINTS);
    write(
        "flat.csv",
        "x,y,z,sigma,sigma_y,kappa,r,g,b\n0,0,0,0.5,0.1,5,1,1,1\n\
        0.2,0.15,0.1,0.6,0.12,4,1,1,1\n-0.5,-0.2,0.3,0.4,0.08,9,1,1,1\n",
    );
    write("boxes.dat", "120\n2\n60, 2, 1, 1, -0.5, 0, 0, 0.6\n60, 1, 1, 2, 0.8, 0.3, 0, 0.5\n");
    let (material, cloud) = match name {
        "coloured" => (
            "kd = [0.9, 0.8, 0.7]\n",
            "[[cloud]]\nfrom = 'particles'\nfile = 'points.csv'\nmaterial = 'm'\n[[surface]]\n\
             center = [0, -1.5, 0]\nu = [0, 0, 2]\nv = [2, 0, 0]\nmaterial = 'm'\n\
             subdivide = [3, 3]\n[[surface]]\ncenter = [1.2, 1.0, 0.5]\nu = [0.6, 0, 0]\n\
             v = [0, 0, 0.6]\nmaterial = 'm'\n",
        ),
        "floors" | "evening" => (
            "kd = [0.9, 0.8, 0.7]\n",
            "[[cloud]]\nfrom = 'particles'\nfile = 'points.csv'\nmaterial = 'm'\n[[surface]]\n\
             center = [0, -3.5, 0]\nu = [0, 0, 5]\nv = [5, 0, 0]\nmaterial = 'm'\n\
             subdivide = [9, 9]\n[[surface]]\ncenter = [-3.5, -1.0, 0]\nu = [0.5, 1, 0]\n\
             v = [0, 0, 0.5]\nmaterial = 'm'\nsubdivide = [2, 2]\n[[surface]]\n\
             center = [0.0, -0.9, 1.1]\nu = [0, 0, 0.4]\nv = [0.4, 0, 0]\nmaterial = 'm'\n",
        ),
        "droplets" => (
            "albedo = [0.999, 0.99, 0.95]\nphase = 'mie'\ndroplet_um = 8\n",
            "[[cloud]]\nfrom = 'boxes'\nfile = 'boxes.dat'\nmaterial = 'm'\noptical_depth = 2\n",
        ),
        "flat" => (
            "kd = [0.95, 0.95, 0.95]\n",
            "[[cloud]]\nfrom = 'particles'\nfile = 'flat.csv'\nmaterial = 'm'\n",
        ),
        "opaque" => (
            "albedo = [1, 1, 0.98]\n",
            "[[cloud]]\nfrom = 'boxes'\nfile = 'boxes.dat'\nmaterial = 'm'\noptical_depth = 1e3\n",
        ),
        _ => (
            "kd = [0.9, 0.9, 0.9]\n",
            "[[cloud]]\nfrom = 'boxes'\nfile = 'boxes.dat'\nmaterial = 'm'\noptical_depth = 1\n",
        ),
    };
    let grouped = if name == "droplets" { "facets_per_cloud = 30\n" } else { "" };
    // Not a mode, but diffusion with more.
    let (mode, bounces) = match mode {
        "bounces" => ("diffusion", "bounces = 2\nbounce_cells = 1\n"),
        "merged" => ("diffusion", "bounces = 2\nbounce_cells = 3\n"),
        // The first order of the phase function alone.
        "cosine" => ("diffusion", "bounces = 2\nbounce_cells = 2\nbounce_order = 1\n"),
        // Merged cells that no coarser grid has.
        "few" => ("diffusion", "bounces = 2\nbounce_cells = 8\n"),
        _ => (mode, ""),
    };
    let lights = match name {
        "floors" => FROM_BELOW,
        "evening" => EVENING,
        _ => LIGHTS,
    };
    let text = format!(
        "[film]\nwidth = 64\nheight = 48\n[camera]\nposition = [0.5, 1, 6]\ntarget = [0, 0, 0]\n\
         [lighting]\nmode = '{mode}'\ngrid = 20\n{grouped}{bounces}{lights}[[material]]\nname = 'm'\n\
         {material}{cloud}"
    );
    write("scene.toml", &text);
    let more: Vec<String> = more.iter().map(|s| (*s).to_owned()).collect();
    let loaded = scene_file::load(&dir.path().join("scene.toml"), &more, None);
    loaded.unwrap_or_else(|e| panic!("{name}: {e}")).scene
}

/// Light of facets.
pub struct Lit {
    /// Irradiance of the surfaces' facets.
    pub of_solids: Vec<DVec3>,
    /// Fluence of suns and lamps by facet of the clouds.
    pub direct: Vec<DVec3>,
    /// Their radiance toward the eye.
    pub radiance: Vec<DVec3>,
    /// Slopes of that, where light changes inside of blobs.
    pub slopes: Vec<DVec3>,
}

/// Returns the light of the facets on the device.
pub fn on_device(gpu: &Gpu, compiler: &Compiler, scene: &Scene) -> Lit {
    let (mut renderer, mut game) =
        open_sides(&gpu.device, compiler, &Arc::new(scene.clone()), true).expect("both sides");
    renderer.step(game.step(0).expect("a packet")).expect("a frame");
    let (facets, lit) = renderer.facets(&gpu.device).expect("facets");
    let slopes = renderer.slopes(&gpu.device).expect("slopes");
    let n_solids = scene.n_solid_facets() as usize;
    let slopes = slopes.iter().zip(&facets).skip(n_solids).map(|(slope, facet)| {
        assert_eq!(slope.position, facet.position);
        DVec3::from(slope.relative.map(f64::from))
    });
    let (of_solids, of_clouds) = lit.split_at(scene.n_solid_facets() as usize);
    let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    Lit {
        of_solids: of_solids.iter().map(|l| vector(l.direct)).collect(),
        direct: of_clouds.iter().map(|l| vector(l.direct)).collect(),
        radiance: of_clouds.iter().map(|l| vector(l.first)).collect(),
        slopes: slopes.collect(),
    }
}

/// Returns the light of the facets by the twin. That of surfaces is by areas, without the grid.
pub fn by_twin(scene: &Scene) -> Lit {
    let frame = FrameReference::new(scene, 0.0).expect("a reference");
    let n = scene.n_solid_facets() as usize;
    let of_solids = frame.irradiance[..n].to_vec();
    Lit {
        of_solids,
        direct: frame.irradiance[n..].to_vec(),
        radiance: frame.radiance[n..].to_vec(),
        slopes: frame.slopes.iter().skip(n).map(|s| s.relative).collect(),
    }
}

/// Greatest difference as a share of the greatest value; infinite where one is no number.
pub fn apart(a: &[DVec3], b: &[DVec3]) -> f64 {
    assert_eq!(a.len(), b.len());
    let most = b.iter().map(|v| v.max_element()).fold(0.0, f64::max);
    assert!(most > 0.0, "there is light");
    let differences = a.iter().zip(b).map(|(a, b)| (*a - *b).abs().max_element());
    differences.fold(0.0, |m: f64, d| if d.is_nan() { f64::INFINITY } else { m.max(d) }) / most
}

/// Greatest difference of slopes, as the error of the light that makes it: a share of the brightest
/// facet. A slope is four such numbers by the facet's own light and the shortest edge of a cell.
fn slopes_apart(scene: &Scene, found: &Lit, truth: &Lit) -> f64 {
    assert_eq!(found.slopes.len(), truth.slopes.len());
    let state = FrameState::at(scene, &scene.groups(), 0.0).expect("a state");
    let edge = state.grid.edges().min_element();
    let own: Vec<f64> = truth.radiance.iter().map(|v| v.element_sum() / 3.0).collect();
    let most = own.iter().copied().fold(0.0, f64::max);
    let all = found.slopes.iter().zip(&truth.slopes).zip(own);
    all.map(|((a, b), own)| (*a - *b).length() * edge * own / (4.0 * most)).fold(0.0, f64::max)
}

/// Bound of the difference from the twin, as a share of the brightest facet.
///
/// The densities of the grid are within 2.5e-6 a weight and axis (passes.md, "grid"): 7.5e-6. The
/// transmitted share e^-x errs by x e^-x of that, which is at most 0.37. Exponents and phase
/// functions add some 40 roundings of 6e-8.
///
/// Diffuse light depends on the density twice: its sources are such numbers, and D is inverse to
/// the density. An error in every cell's equation makes φ rise in the middle by (cells across)²/8
/// times it, so that as many roundings are added.
pub fn bound(scene: &Scene) -> f64 {
    let groups = scene.groups();
    let state = FrameState::at(scene, &groups, 0.0).expect("a state");
    let across = f64::from(state.grid.n_cells.max_element());
    match scene.lighting.mode {
        LightingMode::Diffusion => 2.0 * 1.2e-5 + across * across / 8.0 * 6e-8,
        _ => 1.2e-5,
    }
}

/// Checks that the device has the light of the twin.
pub fn check(gpu: &Gpu, name: &str, mode: &str) {
    let scene = scene(name, mode, &[]);
    let (found, truth) = (on_device(gpu, &gpu.compiler, &scene), by_twin(&scene));
    // The twin lights surfaces without the grid, which is the same where no cloud is between.
    let of_solids = match name {
        "floors" | "evening" => apart(&found.of_solids, &truth.of_solids),
        _ => 0.0,
    };
    let off = [
        of_solids,
        // Light that gets through opaque clouds errs by more than that share of itself.
        if name == "opaque" { 0.0 } else { apart(&found.direct, &truth.direct) },
        apart(&found.radiance, &truth.radiance),
        slopes_apart(&scene, &found, &truth),
    ];
    assert_eq!(truth.slopes.is_empty(), scene.lighting.mode != LightingMode::Diffusion);
    println!("{name}, {mode}: {off:?}");
    assert!(off.iter().all(|off| *off < bound(&scene)), "{name}, {mode}: {off:?}");
}

/// A scene and its mode; a shader's file, and what is replaced in it.
pub type Wrong = (&'static str, &'static str, &'static str, &'static str, &'static str);

/// Checks that wrong shaders are beyond the bound.
pub fn check_found(gpu: &Gpu, wrong: &[Wrong]) {
    let mut truths = BTreeMap::new();
    for (name, mode, file, from, to) in wrong {
        let scene = scene(name, mode, &[]);
        let truth = truths.entry((name, mode)).or_insert_with(|| by_twin(&scene));
        let found = on_device(gpu, &Gpu::wrong_compiler(file, from, to), &scene);
        let off = apart(&found.radiance, &truth.radiance);
        let off = off.max(slopes_apart(&scene, &found, truth));
        let off = match *name {
            "opaque" => off,
            _ => off.max(apart(&found.direct, &truth.direct)),
        };
        let off = match *name {
            "floors" | "evening" => off.max(apart(&found.of_solids, &truth.of_solids)),
            _ => off,
        };
        println!("{name}, {mode}, {file}, {from} -> {to}: {off:e}");
        assert!(off > bound(&scene), "{name}, {mode}, {file}, {from} -> {to}: {off:e}");
    }
}
