//! Clouds as a medium: every facet's light on the device is that of the f64 twin, in all modes;
//! wrong shaders are found; what stands still is not computed again.

mod harness;

use std::sync::Arc;

use glam::DVec3;
use harness::Gpu;
use nimbus::frame::plan::{Pass, Plan};
use nimbus::frame::{Game, Renderer};
use nimbus::gpu::Compiler;
use nimbus::io::scene_file;
use nimbus::model::frame_state::FrameState;
use nimbus::model::scene::{LightingMode, Scene};
use nimbus::reference::picture::FrameReference;

const MODES: [&str; 4] = ["single", "similarity", "octaves", "diffusion"];

/// Colours, sizes, ellipsoids.
const POINTS: &str = "x,y,z,sigma,kappa,r,g,b\n\
    -0.8,0.1,0.2,0.35,4,1,1,1\n0.1,0.4,-0.3,0.3,6,1,0.8,0.6\n0.7,-0.2,0.3,0.25,9,0.7,0.9,1\n\
    0.2,-0.5,0.1,0.4,2,1,1,1\n-0.3,0.7,0.4,0.2,12,0.9,0.9,0.9\n0.9,0.5,-0.2,0.15,3,1,1,1\n";

const LIGHTS: &str = "[[light]]\nkind = 'directional'\ndirection = [-0.5, -0.8, -0.3]\n\
    irradiance = [3, 2.9, 2.7]\n[[light]]\nkind = 'sky'\nirradiance = [0.8, 0.87, 1]\n\
    constant = 0.3\n[[light]]\nkind = 'point'\nposition = [1.5, 1.2, 1]\nintensity = [2, 1, 0.5]\n\
    [[light]]\nkind = 'spot'\nposition = [-2, 1, 2]\ndirection = [2, -1, -2]\n\
    intensity = [1, 2, 3]\ninner_deg = 10\nouter_deg = 25\n";

/// Scenes by name: coloured balls among lamps and surfaces, droplets in facets of several, flat
/// blobs over one another, boxes.
fn scene(name: &str, mode: &str, more: &[&str]) -> Scene {
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
             subdivide = [3, 3]\n[[surface]]\ncenter = [1.2, 1.0, 0.5]\nu = [0.3, 0, 0]\n\
             v = [0, 0, 0.3]\nmaterial = 'm'\n",
        ),
        "droplets" => (
            "albedo = [0.999, 0.99, 0.95]\nphase = 'mie'\ndroplet_um = 8\n",
            "[[cloud]]\nfrom = 'boxes'\nfile = 'boxes.dat'\nmaterial = 'm'\noptical_depth = 2\n",
        ),
        "flat" => (
            "kd = [0.95, 0.95, 0.95]\n",
            "[[cloud]]\nfrom = 'particles'\nfile = 'flat.csv'\nmaterial = 'm'\n",
        ),
        _ => (
            "kd = [0.9, 0.9, 0.9]\n",
            "[[cloud]]\nfrom = 'boxes'\nfile = 'boxes.dat'\nmaterial = 'm'\noptical_depth = 1\n",
        ),
    };
    let grouped = if name == "droplets" { "facets_per_cloud = 30\n" } else { "" };
    let text = format!(
        "[film]\nwidth = 64\nheight = 48\n[camera]\nposition = [0.5, 1, 6]\ntarget = [0, 0, 0]\n\
         [lighting]\nmode = '{mode}'\ngrid = 20\n{grouped}{LIGHTS}[[material]]\nname = 'm'\n\
         {material}{cloud}"
    );
    write("scene.toml", &text);
    let more: Vec<String> = more.iter().map(|s| (*s).to_owned()).collect();
    let loaded = scene_file::load(&dir.path().join("scene.toml"), &more, None);
    loaded.unwrap_or_else(|e| panic!("{name}: {e}")).scene
}

struct Lit {
    direct: Vec<DVec3>,
    radiance: Vec<DVec3>,
}

/// Returns the light of the clouds' facets on the device.
fn on_device(gpu: &Gpu, compiler: &Compiler, scene: &Scene) -> Lit {
    let mut renderer =
        Renderer::new(&gpu.device, compiler, &Arc::new(scene.clone()), true).expect("a renderer");
    let mut game = Game::new(Arc::new(scene.clone()), None);
    renderer.step(game.step(0).expect("a packet")).expect("a frame");
    let (_, lit) = renderer.facets(&gpu.device).expect("facets");
    let of_clouds = &lit[scene.n_solid_facets() as usize..];
    let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    Lit {
        direct: of_clouds.iter().map(|l| vector(l.direct)).collect(),
        radiance: of_clouds.iter().map(|l| vector(l.first)).collect(),
    }
}

fn by_twin(scene: &Scene) -> Lit {
    let frame = FrameReference::new(scene, 0.0).expect("a reference");
    let n = scene.n_solid_facets() as usize;
    Lit { direct: frame.irradiance[n..].to_vec(), radiance: frame.radiance[n..].to_vec() }
}

/// Greatest difference as a share of the greatest value; infinite where one is no number.
fn apart(a: &[DVec3], b: &[DVec3]) -> f64 {
    assert_eq!(a.len(), b.len());
    let most = b.iter().map(|v| v.max_element()).fold(0.0, f64::max);
    assert!(most > 0.0, "there is light");
    let differences = a.iter().zip(b).map(|(a, b)| (*a - *b).abs().max_element());
    differences.fold(0.0, |m: f64, d| if d.is_nan() { f64::INFINITY } else { m.max(d) }) / most
}

/// The densities of the grid are within 2.5e-6 a weight and axis (passes.md, "grid"): 7.5e-6. What
/// arrives, e^-x, errs by x e^-x of that, at most 0.37; exponents and phase functions add some
/// 40 roundings of 6e-8. Diffuse light is a sum of such numbers, and its equations depend on the
/// density as smoothly. Their rounding adds to it by (cells across)²/8 roundings: that is how much
/// an error in every cell's equation makes φ rise in the middle.
fn bound(scene: &Scene) -> f64 {
    let groups = scene.groups();
    let state = FrameState::at(scene, &groups, 0.0).expect("a state");
    let across = f64::from(state.grid.n_cells.max_element());
    let diffuse = scene.lighting.mode == LightingMode::Diffusion;
    1.2e-5 + if diffuse { across * across / 8.0 * 6e-8 } else { 0.0 }
}

#[test]
fn every_facet_has_the_light_of_the_twin() {
    let gpu = Gpu::new();
    for name in ["coloured", "droplets", "flat", "boxes"] {
        for mode in MODES {
            let scene = scene(name, mode, &[]);
            let (found, truth) = (on_device(&gpu, &gpu.compiler, &scene), by_twin(&scene));
            let off =
                [apart(&found.direct, &truth.direct), apart(&found.radiance, &truth.radiance)];
            println!("{name}, {mode}: {off:?}");
            assert!(off.iter().all(|off| *off < bound(&scene)), "{name}, {mode}: {off:?}");
        }
    }
}

#[test]
fn wrong_shaders_are_found() {
    let gpu = Gpu::new();
    for (name, mode, file, from, to) in [
        ("boxes", "single", "scatter.comp", "a.toward + outgoing", "a.toward - outgoing"),
        ("boxes", "single", "scatter.comp", "return law.albedo * sum", "return sum"),
        ("boxes", "octaves", "scatter.comp", "phase *= push.term_phase", "phase *= 0.49"),
        ("boxes", "octaves", "scatter.comp", "depth * tau * law.depth", "tau * law.depth"),
        ("boxes", "single", "scatter.comp", "- 0.5) * up", "- 0.5) * -up"),
        ("boxes", "similarity", "include/medium.glsl", "1.0 - albedo * m.straight", "vec3(1.0)"),
        ("coloured", "single", "include/medium.glsl", "1.17 * r", "1.16 * r"),
        ("droplets", "single", "include/medium.glsl", "c * m.draine_lobe", "c * m.lobe"),
        ("droplets", "single", "include/medium.glsl", "2.0 * g * g) * (1.0", "g * g) * (1.0"),
        ("coloured", "diffusion", "diffusion_sources.comp", "z -= e", "z += e"),
        (
            "coloured",
            "diffusion",
            "diffusion_sources.comp",
            "is_clear(p, light",
            "true || is_clear(p, light",
        ),
        ("coloured", "diffusion", "diffusion_system.comp", "next[2][set]", "next[1][set]"),
        ("flat", "diffusion", "diffusion_system.comp", "axis == 1 ? 0.0", "axis == 0 ? 0.0"),
        (
            "boxes",
            "diffusion",
            "diffusion_system.comp",
            "sink += through;\n                right += 4.0",
            "right += 4.0",
        ),
        ("boxes", "diffusion", "diffusion_system.comp", "push.absorbed", "push.absorbed * 0.0"),
        (
            "flat",
            "diffusion",
            "diffusion_coarsen.comp",
            "equal(ivec3(x, y, z) - first, halved)",
            "bvec3(true)",
        ),
        ("boxes", "diffusion", "diffusion_restrict.comp", "- all * PHI(from)", ""),
        ("boxes", "diffusion", "diffusion_coarsest.comp", "% 2u == 0u", "% 2u == 2u"),
        ("boxes", "diffusion", "include/equations.glsl", "if (at[axis] > 0)", "if (at[axis] > 1)"),
        ("boxes", "diffusion", "diffusion_sweep.comp", "(at) >> halved()", "(at)"),
        ("boxes", "diffusion", "diffusion_flux.comp", "-= reach * slope", "+= reach * slope"),
        ("boxes", "diffusion", "scatter.comp", "w.y * field[c + 2]", "w.y * field[c + 3]"),
    ] {
        let scene = scene(name, mode, &[]);
        let wrong = Gpu::wrong_compiler(file, from, to);
        let (found, truth) = (on_device(&gpu, &wrong, &scene), by_twin(&scene));
        let off = apart(&found.radiance, &truth.radiance).max(apart(&found.direct, &truth.direct));
        println!("{name}, {mode}, {file}, {from} -> {to}: {off:e}");
        assert!(
            off.is_nan() || off > bound(&scene),
            "{name}, {mode}, {file}, {from} -> {to}: {off:e}"
        );
    }
}

fn plan_of(renderer: &mut Renderer, game: &mut Game, i_frame: u32) -> Plan {
    renderer.step(game.step(i_frame).expect("a packet")).expect("a frame").plan
}

#[test]
fn what_stands_still_is_not_computed_again() {
    let gpu = Gpu::new();
    let runs = |scene: &Scene| {
        let scene = Arc::new(scene.clone());
        let mut renderer =
            Renderer::new(&gpu.device, &gpu.compiler, &scene, true).expect("a renderer");
        let mut game = Game::new(scene, None);
        let plans = [0, 1].map(|i| plan_of(&mut renderer, &mut game, i));
        let passes = [Pass::Grid, Pass::Facets, Pass::Transmit, Pass::Diffusion, Pass::Scatter];
        plans.map(|plan| passes.map(|pass| plan.runs(pass)))
    };
    assert_eq!(runs(&scene("boxes", "diffusion", &[])), [[true; 5], [false; 5]]);
    // The phase function depends on the eye, and the diffuse light does not.
    let mut flown = scene("boxes", "diffusion", &[]);
    flown.camera = scene_with_path().camera;
    assert_eq!(runs(&flown), [[true; 5], [false, false, false, false, true]]);
    // An edit of the material marches nothing.
    let mut edited = scene("boxes", "diffusion", &[]);
    let mut key = edited.materials[0].keys[0];
    key.time_s = 1.0;
    key.brdf.kd = DVec3::splat(0.5);
    edited.materials[0].keys.push(key);
    assert_eq!(runs(&edited), [[true; 5], [false, false, false, true, true]]);
    let reflecting = runs(&scene("boxes", "first", &[]));
    assert_eq!(reflecting, [[true, true, true, false, false], [false; 5]]);
}

/// A scene whose camera moves.
fn scene_with_path() -> Scene {
    let dir = tempfile::tempdir().expect("a folder");
    let text = "[camera]\npath = [{ time_s = 0, position = [0, 0, 5], target = [0, 0, 0] }, \
        { time_s = 1, position = [1, 0, 5], target = [0, 0, 0] }]\n[[light]]\nkind = 'sky'\n\
        irradiance = [1, 1, 1]\n";
    let file = dir.path().join("scene.toml");
    std::fs::write(&file, text).expect("room");
    scene_file::load(&file, &[], None).unwrap_or_else(|e| panic!("{e}")).scene
}
