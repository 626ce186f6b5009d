//! diffusion against its f64 twin: every facet's light on the device is that of the twin, wrong
//! shaders are found, and what stands still is not computed again.

use std::sync::Arc;

use crate::harness::Gpu;
use crate::media;
use crate::media::scene;
use glam::DVec3;
use nimbus::frame::plan::{Pass, Plan};
use nimbus::frame::{Game, Renderer};
use nimbus::io::scene_file;
use nimbus::model::scene::Scene;

#[test]
fn every_facet_has_the_light_of_the_twin() {
    let gpu = Gpu::new();
    for name in ["coloured", "droplets", "flat", "boxes", "opaque", "floors", "evening"] {
        media::check(&gpu, name, "diffusion");
        media::check(&gpu, name, "bounces");
        media::check(&gpu, name, "merged");
    }
}

#[test]
fn bounces_of_the_first_order_have_the_light_of_the_twin() {
    let gpu = Gpu::new();
    for name in ["coloured", "opaque", "floors"] {
        media::check(&gpu, name, "cosine");
    }
}

#[test]
fn bounces_have_the_same_light_without_slopes() {
    let gpu = Gpu::new();
    for name in ["boxes", "floors"] {
        let scene = scene(name, "bounces", &["lighting.slopes=false"]);
        let (found, truth) =
            (media::on_device(&gpu, &gpu.compiler, &scene), media::by_twin(&scene));
        assert!(found.slopes.is_empty());
        let off = media::apart(&found.radiance, &truth.radiance);
        assert!(off < media::bound(&scene), "{name}: {off:e}");
    }
}

#[test]
fn merged_cells_without_a_coarser_grid_have_the_light_of_the_twin() {
    let gpu = Gpu::new();
    for name in ["boxes", "flat"] {
        media::check(&gpu, name, "few");
    }
}

/// Cells that are higher than wide, and flat ones, of balls.
#[test]
fn layers_that_are_given_have_the_light_of_the_twin() {
    let gpu = Gpu::new();
    for (name, layers) in [("boxes", 8), ("floors", 8), ("coloured", 20)] {
        for mode in ["diffusion", "bounces", "merged"] {
            let scene = scene(name, mode, &[&format!("lighting.layers={layers}")]);
            let groups = scene.groups();
            let (low, high) = scene.bounds(&groups, 0.0, 3.0).expect("clouds");
            let grid = scene.density_grid(&groups, 0.5 * (high - low));
            assert!(grid.n_cells.y == layers && grid.aspect != 1.0, "{grid:?}");
            let (found, truth) =
                (media::on_device(&gpu, &gpu.compiler, &scene), media::by_twin(&scene));
            let off = media::apart(&found.radiance, &truth.radiance);
            println!("{name}, {mode}, {layers} layers: {off:e}");
            assert!(off < media::bound(&scene), "{name}, {mode}: {off:e}");
        }
    }
}

#[test]
fn wrong_shaders_are_found() {
    let wrong = [
        ("coloured", "diffusion", "diffusion_sources.comp", "z -= e", "z += e"),
        ("boxes", "diffusion", "diffusion_sources.comp", "SLOPES + BOUNCES != 0 || sigma", "sigma"),
        ("coloured", "diffusion", "diffusion_sources.comp", "1.0 / 3.0", "0.0, 1.0, 0.0"),
        ("boxes", "diffusion", "scatter.comp", "0.5 * edges[axis]", "0.55 * edges[axis]"),
        ("coloured", "diffusion", "scatter.comp", "? 2.0 * first", "? first"),
        ("flat", "diffusion", "scatter.comp", "(all * edges)", "(all * edges.x)"),
        (
            "coloured",
            "diffusion",
            "diffusion_sources.comp",
            "is_clear(p, light",
            "true || is_clear(p, light",
        ),
        ("coloured", "diffusion", "diffusion_system.comp", "next[2][set]", "next[1][set]"),
        ("flat", "diffusion", "include/sky.glsl", "0.5 + 0.5 * n.y", "0.5"),
        ("floors", "diffusion", "diffusion_solids.comp", "share_of(light", "0.99 * share_of(light"),
        ("coloured", "diffusion", "diffusion_solids.comp", "push.backward * tau", "tau"),
        ("floors", "diffusion", "diffusion_faces.comp", "sent - sky_", "sent - 0.9 * sky_"),
        ("floors", "diffusion", "diffusion_faces.comp", "offset.y > 0.0", "offset.y < 0.0"),
        ("floors", "diffusion", "diffusion_faces.comp", "place.xyz - at", "place.xyz - to.center"),
        ("floors", "diffusion", "diffusion_faces.comp", "n = WORKGROUP / 2u", "n = WORKGROUP / 4u"),
        ("floors", "diffusion", "include/faces.glsl", "(axis + 2u) % 3u", "(axis + 1u) % 3u"),
        (
            "floors",
            "diffusion",
            "diffusion_system.comp",
            "max(j, vec3(0.0)) - half",
            "j - 0.0 * half",
        ),
        ("floors", "diffusion", "diffusion_sources.comp", "fallen[1] -= e", "fallen[1] -= 0.0 * e"),
        (
            "evening",
            "diffusion",
            "diffusion_sources.comp",
            "fallen[0] -= MEAN_UP",
            "fallen[0] -= 0.5",
        ),
        ("evening", "diffusion", "include/sky.glsl", "of.tilt_x * mean.x", "of.tilt_x * mean.z"),
        ("evening", "diffusion", "include/sky.glsl", "sky.tilt_x * mean.x", "sky.tilt_x * mean.z"),
        ("evening", "diffusion", "include/sky.glsl", "vec3(0.0, across, 0.0)", "vec3(0.0)"),
        ("evening", "diffusion", "include/sky.glsl", "1.0 - MEAN_UP * light", "1.0 - 0.6 * light"),
        ("evening", "bounces", "include/sky.glsl", "of.tilt_z * w.z", "-of.tilt_z * w.z"),
        ("evening", "bounces", "include/ways.glsl", "skies, -w,", "skies, w,"),
        ("floors", "diffusion", "diffusion_patches.comp", "c.share *", "0.125 *"),
        ("coloured", "diffusion", "diffusion_sources.comp", "0.5 * whole", "0.6 * whole"),
        ("coloured", "diffusion", "diffusion_sources.comp", "(1.0 - absorbed) /", "0.9 /"),
        ("coloured", "diffusion", "diffusion_sources.comp", "of.share * e", "e"),
        ("opaque", "diffusion", "diffusion_sources.comp", "min(place * own,", "(place * own +"),
        ("opaque", "diffusion", "diffusion_sources.comp", "min(whole, push", "(whole + push"),
        (
            "opaque",
            "bounces",
            "include/diffusivity.glsl",
            "min(FLOAT(density, c), push.densest)",
            "FLOAT(density, c)",
        ),
        ("coloured", "bounces", "diffusion_sources.comp", "share * z", "share * x"),
        ("coloured", "bounces", "diffusion_flux.comp", "push.even * fluence", "fluence"),
        ("coloured", "bounces", "diffusion_flux.comp", "push.forward * flux", "flux"),
        ("flat", "bounces", "diffusion_sources.comp", "SLOPES + BOUNCES != 0 || sigma", "sigma"),
        ("coloured", "bounces", "include/directions.glsl", "0.908248290463863", "0.9"),
        ("coloured", "bounces", "diffusion_bounce.comp", "y += l * w.y", "y -= l * w.y"),
        ("flat", "bounces", "diffusion_bounce.comp", "reach * push.forward;", "push.forward;"),
        (
            "coloured",
            "bounces",
            "diffusion_flux.comp",
            "fluence += field",
            "fluence += 0.9 * field",
        ),
        ("coloured", "bounces", "diffusion_flux.comp", "flux += field", "flux += 0.9 * field"),
        ("flat", "bounces", "diffusion_flux.comp", "- 2.0 * own * other", "- 2.0 * own * own"),
        ("flat", "merged", "diffusion_flux.comp", "flow(prior, c, axis,", "flow(c, prior, axis,"),
        ("flat", "bounces", "diffusion_flux.comp", "carried_at(next, axis)", "carried_at(c, axis)"),
        ("coloured", "bounces", "include/of_suns.glsl", "0.5 * dot(bend", "dot(bend"),
        ("coloured", "bounces", "diffusion_toward.comp", "mix(1.0, peak", "mix(0.9, peak"),
        ("coloured", "bounces", "diffusion_seen.comp", "(1.0 - push.weakened) *", "0.9 *"),
        ("flat", "bounces", "include/ways.glsl", "face = 0.5 * across", "face = across"),
        ("coloured", "bounces", "diffusion_bounce.comp", "w.y < 0.0 ? 1.0", "w.y > 0.0 ? 1.0"),
        ("coloured", "bounces", "diffusion_seen.comp", "0.5 - way.y", "0.5 + way.y"),
        ("floors", "bounces", "include/ways.glsl", "turn[axis] > 0 ? 1u", "turn[axis] < 0 ? 1u"),
        ("flat", "bounces", "scatter.comp", "passed *= on", "passed *= 1.0"),
        ("coloured", "bounces", "scatter.comp", "APART = 1.2", "APART = 1.3"),
        ("boxes", "bounces", "scatter.comp", "(k & 2) == 0", "(k & 1) == 0"),
        ("coloured", "bounces", "scatter.comp", "law.depth * push", "push"),
        (
            "boxes",
            "bounces",
            "scatter.comp",
            "relative -= dot(relative, toward)",
            "relative -= 0.0",
        ),
        ("coloured", "merged", "diffusion_merge.comp", "loss_of(sigma) * field", "field"),
        ("flat", "merged", "diffusion_merge.comp", "sigma * arrived_at", "arrived_at"),
        ("opaque", "merged", "diffusion_merge.comp", "share / sigma", "1.0 / max(all, 1e-30)"),
        ("boxes", "merged", "diffusion_merge.comp", "min(low + int(push.edge)", "min(low + 2"),
        ("boxes", "merged", "diffusion_merge.comp", "- ivec3(push.before)", ""),
        ("boxes", "merged", "diffusion_spread.comp", "+ ivec3(push.before)", ""),
        ("boxes", "merged", "diffusion_spread.comp", "(push.before)) + 0.5", "(push.before))"),
        (
            "coloured",
            "merged",
            "diffusion_spread.comp",
            "field[4 * c + k].rgb +=",
            "field[4 * c].rgb +=",
        ),
        ("coloured", "bounces", "include/second_order.glsl", "1.5 * s.z", "1.4 * s.z"),
        ("coloured", "bounces", "include/second_order.glsl", "0.8660254037844386", "0.9"),
        ("boxes", "bounces", "include/directions.glsl", "1.359295272310", "1.0"),
        (
            "droplets",
            "merged",
            "diffusion_sources.comp",
            "(1.0 - push.straight) / max",
            "1.0 / max",
        ),
        ("boxes", "bounces", "diffusion_flux.comp", "of.factor * lobe", "lobe"),
        ("boxes", "cosine", "diffusion_flux.comp", "dot(of.slope, w)", "0.0"),
        ("coloured", "merged", "diffusion_flux.comp", "mix(1.0, once", "mix(0.9, once"),
        ("coloured", "bounces", "include/of_suns.glsl", "length(part), 1.0)", "0.5, 1.0)"),
        (
            "floors",
            "bounces",
            "diffusion_faces.comp",
            "positive_of(toward, axis",
            "positive_of(-toward, axis",
        ),
        ("floors", "bounces", "diffusion_faces.comp", "axis ? 0.125", "axis ? 0.1"),
        ("floors", "bounces", "include/sectors.glsl", "0.5 + 2.0 * d", "0.5 + 1.5 * d"),
        ("floors", "bounces", "diffusion_bounce.comp", "k ^ 7u", "k"),
        ("floors", "merged", "include/faces.glsl", "axis, side, 1u + k", "axis, side, k"),
        ("boxes", "merged", "diffusion_bounce.comp", "at_w[m] * l", "0.9 * at_w[m] * l"),
        ("coloured", "merged", "diffusion_flux.comp", "y[m] * second", "y[m] * -second"),
        ("boxes", "cosine", "diffusion_flux.comp", "+ w.y * forward[1]", "- w.y * forward[1]"),
        ("coloured", "merged", "diffusion_merge.comp", "arrived_at(c + k)", "arrived_at(c)"),
        ("boxes", "merged", "diffusion_toward.comp", "to.share * y[m]", "0.125 * y[m]"),
        (
            "flat",
            "merged",
            "diffusion_toward.comp",
            "+= second_at(at, w)",
            "+= 0.9 * second_at(at, w)",
        ),
        ("boxes", "merged", "diffusion_toward.comp", "ivec3(push.before)", "ivec3(0)"),
        ("boxes", "bounces", "include/eye.glsl", "vec3(1.0, grid.aspect, 1.0)", "vec3(1.01)"),
        ("droplets", "bounces", "facets_groups.comp", "color, sigma)", "color, scale)"),
        ("floors", "diffusion", "include/patches.glsl", "part[u] =", "part[v] ="),
        ("floors", "diffusion", "scatter.comp", "0.25 * field_at(c)", "0.5 * field_at(c)"),
        ("floors", "diffusion", "scatter.comp", "min(distance(p, nearest) / edge, 1.0)", "1.0"),
        ("floors", "diffusion", "scatter.comp", "- 3.0 * along", "- along"),
        (
            "floors",
            "diffusion",
            "scatter.comp",
            "define WITHOUT_SKY SOLIDS",
            "define WITHOUT_SKY 0",
        ),
        (
            "boxes",
            "diffusion",
            "diffusion_system.comp",
            "sink += through;\n                vec3 outward = vec3(0.0);\n                outward[axis] = -1.0;",
            "vec3 outward = vec3(0.0);\n                outward[axis] = -1.0;",
        ),
        ("boxes", "diffusion", "diffusion_system.comp", "push.absorbed", "push.absorbed * 0.0"),
        (
            "flat",
            "bounces",
            "include/diffusivity.glsl",
            "(other_reach * q + reach * other_q)",
            "(other_reach * q - reach * other_q)",
        ),
        (
            "flat",
            "diffusion",
            "include/diffusivity.glsl",
            "0.5 * (q + other_q)",
            "0.6 * (q + other_q)",
        ),
        (
            "flat",
            "merged",
            "diffusion_system.comp",
            "right -= inverse * at_face(carried, own,",
            "right -= inverse * at_face(carried, other,",
        ),
        (
            "flat",
            "diffusion",
            "include/equations.glsl",
            "equal(ivec3(x, y, z) - of.first, halved)",
            "bvec3(true)",
        ),
        (
            "boxes",
            "diffusion",
            "include/equations.glsl",
            "SOURCE(index_of(fine, from)) + flows",
            "flows",
        ),
        ("boxes", "diffusion", "diffusion_cycle.comp", "% 2u == 0u", "% 2u == 2u"),
        ("boxes", "diffusion", "include/equations.glsl", "if (at[axis] > 0)", "if (at[axis] > 1)"),
        ("boxes", "diffusion", "diffusion_sweep.comp", "(at) >> added_axes()", "(at)"),
        ("boxes", "diffusion", "diffusion_restrict.comp", "LONG_STEP * left", "left"),
        ("boxes", "diffusion", "diffusion_coarsen.comp", "merged;", "1.1 * merged;"),
        ("coloured", "diffusion", "diffusion_cycle.comp", "at >> halved)", "at)"),
        ("coloured", "diffusion", "diffusion_cycle.comp", "push.is_new != 0u", "false"),
        ("boxes", "merged", "diffusion_cycle.comp", "push.is_first == 0u", "false"),
        ("boxes", "few", "diffusion_cycle.comp", "push.is_first != 0u", "true"),
        ("coloured", "diffusion", "diffusion_cycle.comp", "words_of(left)", "words_of(0.5 * left)"),
        ("coloured", "diffusion", "diffusion_cycle.comp", "if (is_corrected)", "if (false)"),
        (
            "flat",
            "diffusion",
            "diffusion_cycle.comp",
            "level.n_cells + by >> by",
            "level.n_cells >> by",
        ),
        ("boxes", "diffusion", "include/diffusion.glsl", "SHORT_STEP = 0.6", "SHORT_STEP = 0.5"),
        (
            "boxes",
            "diffusion",
            "diffusion_flux.comp",
            ".rgb - reach_of(c) * slope",
            ".rgb + reach_of(c) * slope",
        ),
        ("boxes", "diffusion", "scatter.comp", "w.y * field_at(c + 2)", "w.y * field_at(c + 3)"),
    ];
    media::check_found(&Gpu::new(), &wrong);
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
