use super::*;
use std::sync::Arc;
use std::time::Instant;

const RULES: Rules = Rules { size: [160, 120], shell_size: [200, 150], cutoff: 3.0, error: 0.5 };

/// Some clouds before an eye at (x, 0, z) that looks along −z.
fn packet(x: f64, z: f64) -> Packet {
    let extent = |k: i32| Extent {
        center: DVec3::new(f64::from(k % 5) - 2.0, f64::from(k % 3) - 1.0, -0.5 * f64::from(k)),
        half: DVec3::splat(0.5),
        sigma_max: 0.6,
        sigma_mean: 0.5,
        n_particles: 400,
    };
    Packet {
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
        lived: None,
        placed: None,
        bounds: vec![],
        regions: vec![],
        table: Arc::new(vec![]),
        coefficients: vec![],
        lights: vec![],
        grid: Default::default(),
        heaviest: 1.0,
        radius: 12.0,
        sort_bits: 32,
        extents: (0..20).map(extent).collect(),
    }
}

fn keeper() -> Keeper {
    Keeper::new(RULES)
}

#[test]
fn a_slow_eye_meets_the_same_shell_until_it_is_off_by_too_much() {
    let mut keeper = keeper();
    assert_eq!(
        keeper.step(&packet(0.0, 12.0), Some("there is no frame before")),
        Step::Nothing("there is no frame before")
    );
    let (mut n_made, mut n_reused, mut most) = (0, 0, 0f64);
    for k in 1..60 {
        let at = packet(0.02 * f64::from(k), 12.0);
        match keeper.step(&at, None) {
            Step::Made { kept, .. } => {
                n_made += 1;
                assert_eq!(keeper.off_by(&kept.shell, &view_of(&at.camera)), Ok(0.0));
            }
            Step::Reused { kept, pixels } => {
                n_reused += 1;
                most = most.max(pixels);
                assert_eq!(keeper.off_by(&kept.shell, &view_of(&at.camera)), Ok(pixels));
            }
            Step::Nothing(why) => panic!("{why}"),
        }
    }
    assert!(
        n_made >= 2 && n_reused >= 2 * n_made && most > 0.25 && most <= 0.5,
        "{n_made} {n_reused} {most}"
    );
}

#[test]
fn nothing_is_made_where_it_would_not_live_or_not_pay() {
    let run = |step: f64, change: &dyn Fn(&mut Packet), n: i32| {
        let mut keeper = keeper();
        let mut steps = vec![];
        for k in 0..n {
            let mut at = packet(step * f64::from(k), 12.0);
            change(&mut at);
            steps.push(keeper.step(&at, (k == 0).then_some("there is no frame before")));
        }
        steps.pop().expect("a step")
    };
    // Three units a frame: a pixel is 0.1 at depth 10, and the clouds are 10 deep.
    assert_eq!(run(3.0, &|_| {}, 3), Step::Nothing("none would save anything"));
    // A few small blobs cost less than showing a picture.
    let few = |p: &mut Packet| p.extents.iter_mut().for_each(|e| e.n_particles = 1);
    assert_eq!(run(0.02, &few, 3), Step::Nothing("none would save anything"));
    assert!(matches!(run(0.02, &|_| {}, 3), Step::Reused { .. }));
}

#[test]
fn what_changes_ends_a_shell() {
    let mut keeper = keeper();
    keeper.step(&packet(0.0, 12.0), Some("there is no frame before"));
    assert!(matches!(
        keeper.step(&packet(0.02, 12.0), None),
        Step::Made { why: "there is none", .. }
    ));
    assert!(matches!(keeper.step(&packet(0.04, 12.0), None), Step::Reused { .. }));
    assert_eq!(
        keeper.step(&packet(0.06, 12.0), Some("light changed")),
        Step::Nothing("light changed")
    );
    assert!(matches!(keeper.step(&packet(0.08, 12.0), None), Step::Made { .. }));
    // A jump, and a look elsewhere.
    let far = packet(3.0, 12.0);
    assert_eq!(keeper.step(&far, None), Step::Nothing("none would save anything"));
    assert!(matches!(keeper.step(&far, None), Step::Made { .. }));
    let mut turned = packet(3.0, 12.0);
    (turned.camera.right, turned.camera.forward) = ([0.8, 0.0, 0.6], [0.6, 0.0, -0.8]);
    assert!(!matches!(keeper.step(&turned, None), Step::Reused { .. }));
    keeper.reset();
    assert_eq!(
        keeper.step(&turned, None),
        Step::Nothing("how fast the eye moves is not known yet")
    );
}

#[test]
fn a_surface_among_what_is_far_forbids_it() {
    // At depths 3, 14 and 40 from an eye at z = 12: before, among and behind a cloud at depths from
    // 12 on.
    for (z, forbids) in [(9.0, false), (-2.0, true), (-28.0, false)] {
        let mut keeper = keeper();
        let mut last = Step::Nothing("");
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
            last = keeper.step(&at, (k == 0).then_some("there is no frame before"));
        }
        let is_whole = |kept: &Kept| kept.shell.far.nearest < 11.6;
        match last {
            Step::Reused { kept, .. } => assert!(!forbids || kept.depth > 14.0, "{z}: {kept:?}"),
            _ => assert!(forbids, "{z}"),
        }
        if let (Step::Reused { kept, .. }, false) = (last, forbids) {
            // What is before it hides it, what is behind does not.
            let depth = f64::from(12.0 - z);
            assert_eq!(kept.depth > depth, z > 0.0);
            assert!(is_whole(&kept) || kept.shell.far.nearest > 11.0);
        }
    }
}

#[test]
fn keys_part_where_depths_do() {
    // The sort's law, for depths about a cut.
    let key = |z: f32| {
        let bits = z.to_bits();
        !(if bits & 0x8000_0000 != 0 { !bits } else { bits | 0x8000_0000 })
    };
    for cut in [-3.7, -1e-30, 0.0, 0.5, 11.25] {
        let (last, quantum) = last_key(cut, 12.0, 32).expect("a key");
        assert_eq!(quantum, 0.0);
        for z in [-20.0, cut - 1e-3, cut, cut + 1e-3, 20.0] {
            assert_eq!(key(z as f32) <= last, z as f32 >= cut as f32, "{cut} {z}");
        }
        let (last, quantum) = last_key(cut, 12.0, 16).expect("a key");
        for z in [-11.9, cut - 2.0 * quantum, cut - 1e-9, cut, cut + 2.0 * quantum, 11.9] {
            let key = ((12.0 - z) * (65536.0 / 24.0)).clamp(0.0, 65535.0) as u32;
            // All that is far enough is far, and nothing that is nearer than a quantum before it.
            assert!(key <= last || z < cut, "{cut} {z}");
            assert!(key > last || z >= cut - quantum, "{cut} {z}");
        }
    }
    assert!(last_key(12.5, 12.0, 16).is_none() && last_key(f64::NAN, 12.0, 32).is_none());
}
