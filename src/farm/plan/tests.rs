use super::*;
use crate::farm::work::Frames;
use crate::io::image::ImageKind;

/// Frames 3 and following of hello.toml, in shards of these sizes.
fn request(sizes: &[u32], format: ImageKind) -> PlanRequest {
    let n = sizes.iter().sum();
    let cut = Cut::single(AnyWork::Frames(Frames { first: 3, n, format }));
    let parts = sizes.iter().map(|n| Part { n: *n, ..cut.parts[0] }).collect();
    PlanRequest {
        scene: Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml"),
        set: vec![],
        seed: None,
        shaders: None,
        device: None,
        cut: Cut { parts, ..cut },
    }
}

fn png(sizes: &[u32]) -> PlanRequest {
    request(sizes, ImageKind::Png)
}

#[test]
fn keys_change_with_everything_that_results_depend_on() {
    let plan = Plan::new(png(&[4, 4])).unwrap();
    assert_eq!(plan.shards, Plan::new(png(&[4, 4])).unwrap().shards);
    assert_eq!(plan.shards[1].items(), 7..11);
    assert_eq!(plan.work.outputs(3..4), ["frame-00000003.png"]);
    let key = |request: PlanRequest| Plan::new(request).unwrap().shards[0].key.clone();
    let (mut built, mut shaded) = (plan.clone(), plan.clone());
    built.code = "0123".into();
    shaded.scene.shaders_hash = "4567".into();
    let mut keys = vec![
        plan.shards[0].key.clone(),
        plan.shards[1].key.clone(),
        key(png(&[3, 5])),
        key(PlanRequest { seed: Some(9), ..png(&[4, 4]) }),
        key(PlanRequest { set: vec!["film.width=64".into()], ..png(&[4, 4]) }),
        key(request(&[4, 4], ImageKind::Exr)),
        built.key(3, 4),
        shaded.key(3, 4),
    ];
    assert!(keys.iter().all(|key| key.len() == KEY_DIGITS));
    keys.sort();
    keys.dedup();
    assert_eq!(keys.len(), 8);
}

#[test]
fn a_plan_is_read_as_written_and_a_changed_one_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("farm");
    let plan = Plan::new(png(&[4, 4, 2])).unwrap();
    plan.write(&folder).unwrap();
    assert_eq!(Plan::read(&folder).unwrap(), plan);
    assert!(plan.write(&folder).unwrap_err().to_string().contains("is not replaced"));
    let path = folder.join(Plan::FILE);
    let text = std::fs::read_to_string(&path).unwrap();
    for (from, to, expected) in [
        ("\"schema\": 1", "\"schema\": 2", "schema 2"),
        ("\"n\": 2", "\"n\": 3", "key"),
        ("\"first\": 7", "\"first\": 8", "begin"),
        ("\"n\": 10", "\"n\": 11", "end at 13"),
        ("\"work\"", "\"wrok\"", "wrok"),
        ("\"format\"", "\"fromat\"", "fromat"),
        ("{", "", "not JSON"),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let error = Plan::read(&folder).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn plans_of_another_build_or_a_changed_scene_are_stale() {
    let dir = tempfile::tempdir().unwrap();
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for name in ["hello.toml", "hello.csv"] {
        std::fs::copy(scenes.join(name), dir.path().join(name)).unwrap();
    }
    let scene = dir.path().join("hello.toml");
    let mut plan = Plan::new(PlanRequest { scene, ..png(&[1]) }).unwrap();
    plan.scene_as_planned().unwrap();
    let list = dir.path().join("hello.csv");
    let text = std::fs::read_to_string(&list).unwrap();
    let last = text.trim_end().rfind('\n').unwrap();
    std::fs::write(&list, &text[..=last]).unwrap();
    assert!(plan.scene_as_planned().unwrap_err().to_string().contains("has changed since"));
    plan.code = "0".into();
    assert!(plan.scene_as_planned().unwrap_err().to_string().contains("another build"));
}

#[test]
fn frames_that_depend_on_others_are_refused() {
    let set = vec!["draw.impostors=\"on\"".to_owned()];
    let error = Plan::new(PlanRequest { set, ..png(&[1]) }).unwrap_err().to_string();
    assert!(error.contains("draw.impostors"), "{error}");
}
