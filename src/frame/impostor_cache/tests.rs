use super::*;
use std::sync::Arc;
use std::time::Instant;

const RULES: CacheRules = CacheRules { size: [160, 120], layer_size: [200, 150], error: 0.5 };

/// Returns a packet of clouds in front of an eye at (x, 0, z) that looks along −z.
fn packet(x: f64, z: f64) -> Packet {
    let extent = |k: i32| Extent {
        center: DVec3::new(f64::from(k % 5) - 2.0, f64::from(k % 3) - 1.0, -0.5 * f64::from(k)),
        half: DVec3::splat(0.5),
        sigma_max: 0.6,
        sigma_mean: 0.5,
        reach: 3.0,
        n_particles: 400,
    };
    Packet {
        media: vec![],
        diffusion: None,
        i_frame: 0,
        time_s: 0.0,
        begin: Instant::now(),
        game_ms: 0.0,
        camera: CameraRecord {
            eye: [x as f32, 0.0, z as f32],
            right: [1.0, 0.0, 0.0],
            up: [0.0, 1.0, 0.0],
            forward: [0.0, 0.0, -1.0],
            tan_x: 0.8,
            tan_y: 0.6,
            near: 0.01,
            unused: 0.0,
        },
        groups: vec![],
        drawn: vec![],
        n_drawn: 8000,
        modes: vec![],
        discs: vec![],
        live: None,
        sky: None,
        placed: None,
        bounds: vec![],
        regions: vec![],
        table: Arc::new(vec![]),
        coefficients: vec![],
        lights: vec![],
        grid: Default::default(),
        heaviest: 1.0,
        sigma_max: 1.0,
        n_levels: 1,
        n_blurs: 0,
        radius: 12.0,
        sort_bits: 32,
        slice: 1.0,
        extents: (0..20).map(extent).collect(),
    }
}

fn cache() -> ImpostorCache {
    ImpostorCache::new(RULES)
}

#[test]
fn a_slow_eye_reuses_a_layer_until_its_error_is_too_large() {
    let mut cache = cache();
    assert_eq!(
        cache.step(&packet(0.0, 12.0), Some("there is no frame before")),
        LayerUse::None("there is no frame before")
    );
    let (mut n_made, mut n_reused, mut most) = (0, 0, 0f64);
    for k in 1..60 {
        let at = packet(0.02 * f64::from(k), 12.0);
        match cache.step(&at, None) {
            LayerUse::Made { layer, .. } => {
                n_made += 1;
                assert_eq!(cache.off_by(&layer.shell, &view_of(&at.camera)), Ok(0.0));
            }
            LayerUse::Reused { layer, pixels } => {
                n_reused += 1;
                most = most.max(pixels);
                assert_eq!(cache.off_by(&layer.shell, &view_of(&at.camera)), Ok(pixels));
            }
            LayerUse::None(why) => panic!("{why}"),
        }
    }
    assert!(
        n_made >= 2 && n_reused >= 2 * n_made && most > 0.25 && most <= 0.5,
        "{n_made} {n_reused} {most}"
    );
}

#[test]
fn no_layer_is_drawn_that_would_be_short_lived_or_slower() {
    let run = |step: f64, change: &dyn Fn(&mut Packet), n: i32| {
        let mut cache = cache();
        let mut steps = vec![];
        for k in 0..n {
            let mut at = packet(step * f64::from(k), 12.0);
            change(&mut at);
            steps.push(cache.step(&at, (k == 0).then_some("there is no frame before")));
        }
        steps.pop().expect("a step")
    };
    // Three units a frame: a pixel is 0.1 at depth 10, and the clouds are 10 deep.
    assert_eq!(run(3.0, &|_| {}, 3), LayerUse::None("no layer would save anything"));
    // A few small blobs cost less than showing a picture.
    let few = |p: &mut Packet| p.extents.iter_mut().for_each(|e| e.n_particles = 1);
    assert_eq!(run(0.02, &few, 3), LayerUse::None("no layer would save anything"));
    assert!(matches!(run(0.02, &|_| {}, 3), LayerUse::Reused { .. }));
}

#[test]
fn a_change_of_the_scene_discards_the_layer() {
    let mut cache = cache();
    cache.step(&packet(0.0, 12.0), Some("there is no frame before"));
    assert!(matches!(
        cache.step(&packet(0.02, 12.0), None),
        LayerUse::Made { why: "there is no layer", .. }
    ));
    assert!(matches!(cache.step(&packet(0.04, 12.0), None), LayerUse::Reused { .. }));
    assert_eq!(
        cache.step(&packet(0.06, 12.0), Some("light changed")),
        LayerUse::None("light changed")
    );
    assert!(matches!(cache.step(&packet(0.08, 12.0), None), LayerUse::Made { .. }));
    // A jump, and a look elsewhere.
    let far = packet(3.0, 12.0);
    assert_eq!(cache.step(&far, None), LayerUse::None("no layer would save anything"));
    assert!(matches!(cache.step(&far, None), LayerUse::Made { .. }));
    let mut turned = packet(3.0, 12.0);
    (turned.camera.right, turned.camera.forward) = ([0.8, 0.0, 0.6], [0.6, 0.0, -0.8]);
    assert!(!matches!(cache.step(&turned, None), LayerUse::Reused { .. }));
    cache.reset();
    assert_eq!(cache.step(&turned, None), LayerUse::None("the motion of the eye is not known yet"));
}

#[test]
fn a_surface_among_distant_blobs_forbids_a_layer() {
    // Depths 3, 14 and 40 from an eye at z = 12: before, among and behind clouds from depth 12 on.
    for (z, forbids) in [(9.0, false), (-2.0, true), (-28.0, false)] {
        let mut cache = cache();
        let mut last = LayerUse::None("");
        for k in 0..3 {
            let mut at = packet(0.02 * f64::from(k), 12.0);
            let (u, v) = ([5.0, 0.0, 0.0], [0.0, 5.0, 0.0]);
            at.regions.push(RegionRecord {
                kind: REGION_SURFACE,
                center: [0.0, 0.0, z],
                u,
                v,
                ..Default::default()
            });
            last = cache.step(&at, (k == 0).then_some("there is no frame before"));
        }
        let is_whole = |layer: &CachedLayer| layer.shell.far.nearest < 11.6;
        match last {
            LayerUse::Reused { layer, .. } => {
                assert!(!forbids || layer.depth > 14.0, "{z}: {layer:?}")
            }
            _ => assert!(forbids, "{z}"),
        }
        if let (LayerUse::Reused { layer, .. }, false) = (last, forbids) {
            // A surface in front hides the layer; a surface behind does not.
            let depth = f64::from(12.0 - z);
            assert_eq!(layer.depth > depth, z > 0.0);
            assert!(is_whole(&layer) || layer.shell.far.nearest > 11.0);
        }
    }
}
