//! The error probe: pictures by the reference and by the device have the expected error, and the
//! last request wins.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use glam::DVec3;
use nimbus::frame::Game;
use nimbus::frame::Renderer;
use nimbus::frame::{DeviceChoice, Stage};
use nimbus::io::scene_file;
use nimbus::model::cutoff::Cutoff;
use nimbus::model::edge::Reach;
use nimbus::model::scene::{LightingMode, Scene, Threading};
use nimbus::reference::picture::{BlobModel, Pixels, ReferenceKind, RenderStage, drawn_as_set};
use nimbus::viewer::error_probe::{ErrorProbe, ProbeRequest, ProbeStatus, Progress};

/// Returns a view of hello.toml without texture, from the side.
fn view(set: &[&str]) -> ProbeRequest {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
    let set: Vec<String> =
        ["cloud.0.texture=none"].iter().chain(set).map(|s| (*s).to_owned()).collect();
    let scene = Arc::new(scene_file::load(&path, &set, None).unwrap().scene);
    let kind = ProbeRequest::kind_for(&scene);
    let (position, target) = (DVec3::new(1.0, 0.7, 5.5), DVec3::new(0.1, 0.5, 0.0));
    ProbeRequest { scene, position, target, time_s: 0.0, size: [64, 48], kind }
}

/// Returns the picture that `Renderer::image` would return on an exact device.
fn exact_picture(view: &ProbeRequest) -> Vec<f32> {
    let drawing =
        if view.kind == ReferenceKind::Thin { BlobModel::AsDrawn } else { BlobModel::Volume };
    let rgba = drawn_as_set(
        &ReferenceKind::Thin.without_approximations(&view.exact_scene()),
        view.time_s,
        drawing,
        &|_, _| (),
    )
    .unwrap()
    .rgba;
    rgba.iter().flatten().map(|v| *v as f32).collect()
}

/// Waits until no better reference follows.
fn settled(probe: &ErrorProbe) -> ProbeStatus {
    let begin = Instant::now();
    loop {
        let status = probe.status();
        if !status.is_working {
            return status;
        }
        assert!(begin.elapsed() < Duration::from_secs(120), "{status:?}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

const LONG: Duration = Duration::from_secs(1000);

#[test]
fn an_exact_picture_has_no_error_and_a_changed_one_has_its_own() {
    let dir = tempfile::tempdir().unwrap();
    for (set, kind) in
        [(&[][..], ReferenceKind::Volume), (&["cloud.0.texture=\"2\""][..], ReferenceKind::Thin)]
    {
        let view = view(set);
        assert_eq!(view.kind, kind);
        let probe = ErrorProbe::new(Some(dir.path().to_owned()), LONG).unwrap();
        probe.request(view.clone());
        let ProbeStatus { reference: known, failure, progress, .. } = settled(&probe);
        assert_eq!((failure, progress), (None, None));
        let known = known.unwrap();
        assert!(
            known.pixels.at.len() == 64 * 48 && !known.from_cache,
            "there was time for all of them"
        );
        // Rounded to f32 once, of values up to about 1.
        let mut rgba = exact_picture(&view);
        let right = known.error(&rgba).unwrap();
        assert!(right.rmse.value < 3e-8 && right.max < 1e-7, "{kind}: {right:?}");
        // A block of 8 by 8 that is a tenth brighter in red: the square of one channel in four, of
        // 1 pixel in 48.
        for y in 20..28 {
            (24..32).for_each(|x| rgba[4 * (64 * y + x)] += 0.1);
        }
        let wrong = known.error(&rgba).unwrap();
        assert!(
            (wrong.rmse.value - 0.1 * (1.0f64 / (48.0 * 4.0)).sqrt()).abs() < 1e-6,
            "{wrong:?}"
        );
        assert!((wrong.max - 0.1).abs() < 1e-6 && wrong.is_resolved);
        // Another size, and a value that is not a number, have no error.
        assert_eq!(known.error(&rgba[4..]), None);
        rgba[0] = f32::NAN;
        assert_eq!(known.error(&rgba), None);
        // A second probe reads the reference from the cache, also where a setting differs that only
        // changes how the scene is drawn.
        drop(probe);
        let probe = ErrorProbe::new(Some(dir.path().to_owned()), LONG).unwrap();
        let mut turned = view.clone();
        Arc::make_mut(&mut turned.scene).draw.cutoff = Reach::Sigmas(2.0);
        probe.request(turned);
        let again = settled(&probe).reference.unwrap();
        assert!(
            again.from_cache && again.reference == known.reference && again.pixels == known.pixels
        );
    }
}

/// The few pixels are spread over the picture.
#[test]
fn without_a_budget_the_reference_has_a_few_pixels() {
    let probe = ErrorProbe::new(None, Duration::ZERO).unwrap();
    let view = view(&["cloud.0.wind=[1, 0, 0]"]);
    probe.request(view.clone());
    let known = settled(&probe).reference.unwrap();
    // 64 · 48/256 = 12: cells of 4.
    assert_eq!((known.pixels.cell, known.pixels.at.len()), (4, 192));
    let mut rgba = exact_picture(&view);
    assert!(known.error(&rgba).unwrap().rmse.value < 3e-8);
    rgba.iter_mut().for_each(|v| *v += 0.01);
    assert!((known.error(&rgba).unwrap().rmse.value - 0.01).abs() < 1e-6);
}

#[test]
fn a_few_pixels_are_bitwise_those_of_the_whole_picture() {
    for set in [&["lighting.mode=first", "cloud.0.texture=\"2\""][..], &["lighting.mode=none"]] {
        let view = ProbeRequest { size: [61, 47], kind: ReferenceKind::Thin, ..view(set) };
        let scene = ReferenceKind::Thin.without_approximations(&view.exact_scene());
        let whole = drawn_as_set(&scene, 0.0, BlobModel::AsDrawn, &|_, _| ()).unwrap().rgba;
        for n in [1, 30, 200, usize::MAX] {
            let pixels = Pixels::sample(61, 47, n);
            let rows = AtomicUsize::new(0);
            let listener = |work: RenderStage, n: usize| {
                if work == RenderStage::Drawing {
                    assert!(
                        rows.fetch_add(1, Ordering::Relaxed) < n && n == pixels.n_rows() as usize
                    );
                }
            };
            let found = ReferenceKind::Thin.render(&scene, 0.0, &pixels, &listener).unwrap();
            assert_eq!(found.rgba, pixels.pick(&whole), "{n}");
            assert_eq!(rows.into_inner(), pixels.n_rows() as usize);
        }
        assert!(whole.iter().filter(|p| p[3] > 0.1).count() > 300);
    }
}

#[test]
fn the_last_request_wins() {
    let probe = ErrorProbe::new(None, LONG).unwrap();
    let first = view(&[]);
    for k in 0..20u32 {
        probe.request(ProbeRequest { time_s: f64::from(k), ..first.clone() });
        // No status of an earlier request remains.
        assert!(probe.status().reference.is_none_or(|known| known.request.time_s == f64::from(k)));
        std::thread::sleep(Duration::from_millis(u64::from(k % 4)));
    }
    let last = settled(&probe).reference.unwrap();
    assert_eq!(last.request.time_s, 19.0);
    // A setting that only changes how frames are run keeps the reference.
    let mut same = last.request.clone();
    Arc::make_mut(&mut same.scene).threads.mode = Threading::Serial;
    Arc::make_mut(&mut same.scene).draw.threshold = Cutoff::At(0.1);
    probe.request(same);
    assert!(!probe.status().is_working && Arc::ptr_eq(&probe.status().reference.unwrap(), &last));
    // Other light has another reference.
    let mut other = last.request.clone();
    Arc::make_mut(&mut other.scene).lighting.mode = LightingMode::None;
    probe.request(other);
    assert!(
        probe
            .status()
            .reference
            .is_none_or(|known| known.request.scene.lighting.mode == LightingMode::None)
    );
    probe.cancel();
    let status = settled(&probe);
    assert!(status.reference.is_none() && status.failure.is_none());
}

#[test]
fn a_long_computation_reports_progress_and_stops_when_replaced() {
    let probe = ErrorProbe::new(None, LONG).unwrap();
    // The budget pays for all rows.
    probe.request(ProbeRequest { size: [1024, 1024], ..view(&[]) });
    let begin = Instant::now();
    let counts = |probe: &ErrorProbe| {
        probe.status().progress.filter(|p| p.work == RenderStage::Drawing && p.n_done > 1)
    };
    let mut seen = None;
    while seen.is_none() {
        seen = counts(&probe);
        assert!(begin.elapsed() < Duration::from_secs(120));
    }
    let Progress { n_done, n, n_pixels, .. } = seen.unwrap();
    assert!(n_done <= n && n > 1 && n_pixels >= 200, "{seen:?}");
    // A request during the work, and a drop during the next.
    probe.request(ProbeRequest { size: [1024, 1023], ..view(&[]) });
    while counts(&probe).is_none() {
        assert!(begin.elapsed() < Duration::from_secs(120));
    }
    // The whole reference would take far longer than the test's limit.
    drop(probe);
}

#[test]
fn a_scene_without_a_reference_reports_why() {
    let probe = ErrorProbe::new(None, LONG).unwrap();
    probe.request(ProbeRequest { kind: ReferenceKind::Volume, ..view(&["cloud.0.texture=\"1\""]) });
    let ProbeStatus { reference, failure, .. } = settled(&probe);
    assert!(reference.is_none() && failure.unwrap().contains("is textured"));
    // The probe still works.
    probe.request(view(&[]));
    assert!(settled(&probe).reference.is_some());
}

/// The device draws from the camera of the window, and not from that of the scene.
#[test]
fn the_devices_picture_has_the_expected_error() {
    // ROUNDED: a hundred layers of f32, some roundings of 2^-24 each. LIT: the error of light by
    // the directions of a grid and a basis of a few vectors.
    const ROUNDED: f64 = 2e-5;
    const LIT: f64 = 5e-3;
    for (set, most) in [
        (&["film.format=rgba32f", "lighting.mode=none"][..], ROUNDED),
        (&["film.format=rgba32f", "lighting.mode=none", "cloud.0.texture=\"2\""], ROUNDED),
        (&[], LIT),
    ] {
        let mut view = view(set);
        view.kind = ReferenceKind::Thin;
        let probe = ErrorProbe::new(None, LONG).unwrap();
        probe.request(view.clone());
        // The scene of the reference leaves nothing out, so only the device's f32 and f16 differ.
        let exact = ReferenceKind::Thin.without_approximations(&view.exact_scene());
        let pose = exact.camera.pose(0.0).unwrap();
        let size = view.size;
        let scene_of_window = Scene { camera: view.scene.camera.clone(), ..exact };
        let choice = DeviceChoice { validation: true, ..DeviceChoice::default() };
        let mut stage = Stage::new(scene_of_window, &choice, true).expect("a stage");
        let picture = |stage: &mut Stage, flown: bool| {
            let game = Game::new(stage.scene.clone(), None);
            stage.game = if flown { game.with_viewpoint(Box::new(move || pose)) } else { game };
            let mut rgba = vec![];
            let mut on_frame = |_, renderer: &mut Renderer| {
                rgba = renderer.image()?;
                Ok(true)
            };
            stage.run(Threading::Serial, 0..1, &mut on_frame).expect("a frame");
            assert_eq!(rgba.len(), 4 * (size[0] * size[1]) as usize);
            rgba
        };
        let known = settled(&probe).reference.unwrap();
        let (right, elsewhere) = (picture(&mut stage, true), picture(&mut stage, false));
        let [right, elsewhere] = [right, elsewhere].map(|rgba| known.error(&rgba).unwrap());
        println!("{set:?}: {right:?}, from the scene's camera {elsewhere:?}");
        assert!(right.rmse.value < most && elsewhere.rmse.value > 0.02, "{right:?} {elsewhere:?}");
        stage.close().expect("no message of the validation layer");
    }
}
