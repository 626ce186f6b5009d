//! Scene keys of light: surfaces, lights, materials, the second reflection.

use crate::scene_text::{CLOUD, assert_table, good, load_with, message, to_toml};
use glam::DVec3;
use nimbus::io::scene_file::LoadedScene;
use nimbus::model::basis::Sampling;
use nimbus::model::light::{Light, MIN_PENUMBRA};
use nimbus::model::material::Brdf;
use nimbus::model::scene::{FacetCount, Gather, LightingMode, Pairs};
use nimbus::model::sums::{Precision, Summation, Sums};
use serde_json::json;

const FLOOR: &str = "[[surface]]\ncenter = [0, -1, 0]\nu = [0, 0, 2]\nv = [3, 0, 0]\n";

/// Checks that the resolved scene, read as a scene file, is the same scene.
fn assert_reads_back(loaded: &LoadedScene) {
    let again = good(&to_toml(&loaded.resolved));
    assert_eq!(
        (&again.scene, &again.resolved, again.hash()),
        (&loaded.scene, &loaded.resolved, loaded.hash())
    );
}

#[test]
fn wrong_surfaces_lights_and_materials_are_refused_by_line() {
    assert_table(include_str!("../data/wrong-lighting.txt"));
}

#[test]
fn a_surface_is_a_rectangle_of_facets() {
    let loaded = good(FLOOR);
    let s = loaded.scene.surfaces[0];
    assert_eq!((s.center, s.u, s.v), (DVec3::NEG_Y, 2.0 * DVec3::Z, 3.0 * DVec3::X));
    assert_eq!((s.normal(), s.area(), s.subdivide, s.i_material), (DVec3::Y, 24.0, [8, 8], 0));
    assert_eq!((loaded.scene.n_facets(), loaded.scene.n_regions()), (64, 1));
    assert_eq!(
        loaded.resolved["surface"],
        json!([{ "center": [0.0, -1.0, 0.0], "u": [0.0, 0.0, 2.0], "v": [3.0, 0.0, 0.0],
        "material": "cloud", "subdivide": [8, 8] }])
    );
    assert_reads_back(&loaded);
    // As steep to each other as typed digits leave them, and as large as nimbus carries.
    let typed = FLOOR.replace("[3, 0, 0]", "[3, 0, 2.9e-6]");
    assert_eq!(good(&typed).scene.surfaces[0].v, DVec3::new(3.0, 0.0, 2.9e-6));
    good(&FLOOR.replace("[3, 0, 0]", "[1e15, 0, 0]"));
    assert_eq!(good(&format!("{FLOOR}subdivide = [1, 4096]")).scene.n_surface_facets(), 4096);
}

#[test]
fn surfaces_come_before_clouds_and_name_their_materials() {
    let materials = "[[material]]\nname = 'red'\n[[material]]\nname = 'cloud'\n";
    let scene =
        good(&format!("{materials}{FLOOR}material = 'red'\nsubdivide = [2, 3]\n{FLOOR}{CLOUD}"))
            .scene;
    assert_eq!(scene.surfaces.iter().map(|s| s.i_material).collect::<Vec<_>>(), [0, 1]);
    assert_eq!((scene.n_surface_facets(), scene.n_facets(), scene.n_regions()), (70, 73, 3));
    assert_eq!(
        (0..3).map(|i| scene.region_material(i).name.as_str()).collect::<Vec<_>>(),
        ["red", "cloud", "cloud"]
    );
    // A rectangle that lights nothing yet is part of what is lit: without particles O is in its
    // middle.
    let bounds = good(FLOOR).scene.lighting_bounds(&[], 0.0, 3.0);
    assert_eq!(bounds, Some((DVec3::new(-3.0, -1.0, -2.0), DVec3::new(3.0, -1.0, 2.0))));
    let of_cloud = |scene: &str| {
        let scene = good(scene).scene;
        scene.lighting_bounds(&scene.groups(), 0.0, 3.0)
    };
    assert_eq!(of_cloud(&format!("{FLOOR}{CLOUD}")), of_cloud(CLOUD));
}

#[test]
fn point_lights_and_spots() {
    let loaded = good(
        "[[light]]\nkind = 'point'\nposition = [1, 2, 3]\nintensity = [4, 5, 6]\n\
         [[light]]\nkind = 'spot'\nposition = [1, 2, 3]\ndirection = [0, -2, 0]\nintensity = [4, \
         5, 6]\n\
         [[light]]\nkind = 'spot'\nposition = [1, 2, 3]\ndirection = [0, 0, 9]\nintensity = [4, 5, \
         6]\n\
         inner_deg = 60\nouter_deg = 60\nradius = 0.5\n",
    );
    let (position, intensity) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0));
    let [point, spot, edge] = loaded.scene.lights[..] else { panic!("{:?}", loaded.scene.lights) };
    assert_eq!(point, Light::Point { position, intensity, radius: 1e-3 });
    let Light::Spot { direction, radius, cos_inner, cos_outer, .. } = spot else {
        panic!("{spot:?}")
    };
    assert_eq!((direction, radius, cos_inner), (DVec3::NEG_Y, 1e-3, 1.0));
    assert!((cos_outer - 0.5f64.sqrt()).abs() < 1e-15);
    // A cone without penumbra: full just inside 60 degrees, nothing just outside.
    let falloff =
        |cos: f64| edge.arrival(position + DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)).falloff;
    assert!((falloff(0.5 + 1.01 * MIN_PENUMBRA) - 1.0).abs() < 1e-12 && falloff(0.5 - 1e-9) == 0.0);
    assert_eq!(
        loaded.resolved["light"][1],
        json!({
            "kind": "spot", "position": [1.0, 2.0, 3.0], "direction": [0.0, -2.0, 0.0],
            "intensity": [4.0, 5.0, 6.0],
            "inner_deg": 0.0, "outer_deg": 45.0, "radius": 1e-3,
        })
    );
    assert_reads_back(&loaded);
}

#[test]
fn a_material_can_change_over_time() {
    let loaded = good(
        "[[material]]\nname = 'm'\npath = [\n{ time_s = 1, ks = [0.1, 0, 0], ns = 20 },\n\
         { time_s = 3, kd = [0.5, 0.5, 0.5] },\n{ time_s = 4 },\n]\n",
    );
    let m = &loaded.scene.materials[0];
    let first = Brdf { kd: DVec3::splat(0.9), ks: 0.1 * DVec3::X, ns: 20.0 };
    // An entry has the settings of the one before it where it sets none; the first entry those of a
    // material without a path.
    assert_eq!(
        (m.at(0.0), m.at(1.0), m.at(3.0)),
        (first, first, Brdf { kd: DVec3::splat(0.5), ..first })
    );
    assert_eq!((m.at(9.0), m.keys.len(), m.is_edited(), m.is_glossy()), (m.at(3.0), 3, true, true));
    assert!((m.at(2.0).kd.x - 0.7).abs() < 1e-15);
    // K_d + 4 K_s is looked at at every time.
    assert!(
        loaded.warnings.len() == 1 && loaded.warnings[0].contains("K_d + 4 K_s = 1.300"),
        "{:?}",
        loaded.warnings
    );
    assert_eq!(
        loaded.resolved["material"][0]["path"][2],
        json!({ "time_s": 4.0, "kd": [0.5, 0.5, 0.5], "ks": [0.1, 0.0, 0.0], "ns": 20.0 })
    );
    assert_reads_back(&loaded);
}

#[test]
fn the_second_reflection_has_its_keys() {
    let lighting = |text: &str| good(text).scene.lighting;
    let l = lighting(CLOUD);
    assert_eq!(
        (l.mode, l.bases, l.sampling, l.gather),
        (LightingMode::TwoReflection, 8, Sampling::Log, Gather::Auto)
    );
    assert_eq!((l.theta, l.facets_per_cloud), (0.4, FacetCount::Auto));
    assert_eq!(l.pairs, Pairs { size: 0.5, levels: 6, steps: 16 });
    for (name, mode) in LightingMode::NAMES {
        assert_eq!(lighting(&format!("[lighting]\nmode = '{name}'")).mode, mode);
    }
    for (name, gather) in Gather::NAMES {
        assert_eq!(lighting(&format!("[lighting]\ngather = '{name}'")).gather, gather);
    }
    assert_eq!(l.sums, Sums { summation: Summation::Plain, precision: Precision::F32 });
    for (name, summation) in Summation::NAMES {
        assert_eq!(
            lighting(&format!("[lighting]\nsummation = '{name}'")).sums.summation,
            summation
        );
    }
    for (name, precision) in Precision::NAMES {
        assert_eq!(
            lighting(&format!("[lighting]\nprecision = '{name}'")).sums.precision,
            precision
        );
    }
    let loaded = good(&format!("[lighting]\nfacets_per_cloud = 2\nsampling = 'uniform'\n{CLOUD}"));
    assert_eq!(
        (loaded.scene.lighting.facets_per_cloud, loaded.scene.n_facets()),
        (FacetCount::AtMost(2), 2)
    );
    assert_eq!(
        (loaded.scene.n_particles(), loaded.scene.lighting.sampling),
        (3, Sampling::Uniform)
    );
    assert_reads_back(&loaded);
    let of_many =
        |lines: &str| good(&format!("[draw]\nparticles = 5000\n[lighting]\n{lines}\n{CLOUD}"));
    let many = of_many("");
    assert_eq!((many.scene.n_facets(), many.warnings.len()), (4096, 1));
    assert!(
        many.warnings[0].starts_with("cloud 0: 5000 particles share the light and colour of 4096")
    );
    for (lines, n) in
        [("facets_per_cloud = 0", 5000), ("facets_per_cloud = 8", 8), ("mode = 'first'", 5000)]
    {
        let found = of_many(lines);
        assert_eq!((found.scene.n_facets(), found.warnings.len()), (n, 0), "{lines}");
    }
    // No more than there are particles.
    assert_eq!(good(&format!("[lighting]\nfacets_per_cloud = 4\n{CLOUD}")).scene.n_facets(), 3);
}

#[test]
fn the_default_range_of_exponents_covers_the_materials() {
    let with = |given: &str, materials: &str| {
        let scene = format!("[lighting]\n{given}\n{materials}");
        load_with(&scene, &[], None).map(|loaded| loaded.scene.lighting.exponents)
    };
    let glossy = |ns: &str| {
        format!("[[material]]\nname = 'a'\nkd = [0, 0, 0]\nks = [0.1, 0.1, 0.1]\nns = {ns}\n")
    };
    // Not given: [1, 256], and as wide as lobes need it; n_s of a material without a lobe does not
    // count.
    assert_eq!(with("", "").unwrap(), [1.0, 256.0]);
    assert_eq!(with("", &glossy("64")).unwrap(), [1.0, 256.0]);
    assert_eq!(with("", &glossy("0.5")).unwrap(), [0.5, 256.0]);
    assert_eq!(with("", &glossy("1e4")).unwrap(), [1.0, 1e4]);
    assert_eq!(with("", "[[material]]\nname = 'a'\nns = 1e4\n").unwrap(), [1.0, 256.0]);
    // Given: just so, and every lobe must lie within.
    assert_eq!(with("exponents = [8, 64]", &glossy("64")).unwrap(), [8.0, 64.0]);
    assert_eq!(
        with("exponents = [8, 64]", "[[material]]\nname = 'a'\nns = 1e4\n").unwrap(),
        [8.0, 64.0]
    );
    assert!(with("exponents = [8, 64]", &glossy("65")).is_err());
    let edited = "[[material]]\nname = 'a'\npath = [{ time_s = 0, ks = [1, 0, 0], ns = 4 }, { \
        time_s = 1, ns = 500 }]\n";
    assert_eq!(with("", edited).unwrap(), [1.0, 500.0]);
    assert_reads_back(&good(&glossy("1e4")));
}

#[test]
fn scenes_lit_differently_have_different_hashes() {
    let texts = [
        FLOOR.to_owned(),
        FLOOR.replace("[0, -1, 0]", "[0, -1.5, 0]"),
        FLOOR.replace("[3, 0, 0]", "[-3, 0, 0]"),
        format!("{FLOOR}subdivide = [8, 9]"),
        format!("{FLOOR}[lighting]\ntheta = 0.6"),
        format!("{FLOOR}[lighting]\npair_steps = 8"),
        format!("{FLOOR}[lighting]\nsummation = 'kahan'"),
        format!("{FLOOR}[lighting]\nprecision = 'f64'"),
        format!(
            "{FLOOR}[[material]]\nname = 'cloud'\npath = [{{ time_s = 0 }}, {{ time_s = \
             1, ns = 9 }}]"
        ),
        format!("{FLOOR}[[light]]\nkind = 'point'\nposition = [0, 0, 0]\nintensity = [1, 1, 1]"),
        format!(
            "{FLOOR}[[light]]\nkind = 'point'\nposition = [0, 0, 0]\nintensity = [1, 1, \
             1]\nradius = 1"
        ),
    ];
    let hashes: Vec<String> = texts.iter().map(|t| good(t).hash().to_owned()).collect();
    for (i, hash) in hashes.iter().enumerate() {
        assert!(!hashes[..i].contains(hash), "{}", texts[i]);
    }
    assert_eq!(good(&format!("{FLOOR}subdivide = [8, 8]")).hash(), hashes[0]);
}

#[test]
fn surfaces_can_be_set_from_the_command_line() {
    let set = ["surface.0.subdivide=[4,2]", "light.1.constant=0", "material.0.ns=3"];
    let scene = load_with(FLOOR, &set, None).unwrap().scene;
    assert_eq!((scene.n_facets(), scene.materials[0].at(0.0).ns), (8, 3.0));
    assert_eq!(
        message(FLOOR, &["surface.0.v=[0,0,1]"]),
        "--set surface.0.v=[0,0,1]: `surface.0.v`: expected a half axis perpendicular to `u`, \
         found the cosine 1.000e0 \
         between them"
    );
}
