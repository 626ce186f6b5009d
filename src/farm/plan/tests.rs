use super::*;

fn wish(sizes: &[u32]) -> Wish {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
    let work = Work::Frames { first: 3, n: sizes.iter().sum(), format: PictureFormat::Png };
    Wish {
        scene,
        set: vec![],
        seed: None,
        shaders: None,
        device: None,
        work,
        sizes: sizes.to_vec(),
        counted: vec![],
        predicted_s: None,
        predicted_for: None,
    }
}

#[test]
fn keys_follow_from_all_that_a_result_follows_from() {
    let plan = Plan::new(wish(&[4, 4])).unwrap();
    let again = Plan::new(wish(&[4, 4])).unwrap();
    assert_eq!(plan.shards, again.shards);
    assert_eq!(plan.shards[1].items(), 7..11);
    assert_eq!(plan.outputs(&plan.shards[0])[0], "frame-00000003.png");
    let key = |plan: &Plan| plan.shards[0].key.clone();
    let mut others = vec![key(&plan), plan.shards[1].key.clone()];
    others.push(key(&Plan::new(wish(&[3, 5])).unwrap()));
    others.push(key(&Plan::new(Wish { seed: Some(9), ..wish(&[4, 4]) }).unwrap()));
    others.push(key(
        &Plan::new(Wish { set: vec!["film.width=64".into()], ..wish(&[4, 4]) }).unwrap()
    ));
    let exr = Work::Frames { first: 3, n: 8, format: PictureFormat::Exr };
    others.push(key(&Plan::new(Wish { work: exr, ..wish(&[4, 4]) }).unwrap()));
    let (mut built, mut shaded) = (plan.clone(), plan.clone());
    built.code = "0123".into();
    shaded.scene.shaders_hash = "4567".into();
    others.extend([built.key(3, 4), shaded.key(3, 4)]);
    let n = others.len();
    others.sort();
    others.dedup();
    assert_eq!(others.len(), n);
    assert!(others.iter().all(|key| key.len() == KEY_DIGITS));
}

#[test]
fn what_is_read_is_what_was_planned_and_what_was_changed_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("farm");
    let plan = Plan::new(wish(&[4, 4, 2])).unwrap();
    plan.write(&folder).unwrap();
    assert_eq!(Plan::read(&folder).unwrap(), plan);
    assert!(plan.write(&folder).unwrap_err().to_string().contains("is not replaced"));
    let path = folder.join(PLAN_FILE);
    let text = std::fs::read_to_string(&path).unwrap();
    for (from, to, expected) in [
        ("\"schema\": 1", "\"schema\": 2", "schema 2"),
        ("\"n\": 2", "\"n\": 3", "key"),
        ("\"first\": 7", "\"first\": 8", "begin"),
        ("\"n\": 10", "\"n\": 11", "end at 13"),
        ("\"work\"", "\"wrok\"", "wrok"),
        ("{", "", "not a plan"),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let said = Plan::read(&folder).unwrap_err().to_string();
        assert!(said.contains(expected), "{said}");
    }
}

#[test]
fn another_build_and_a_changed_scene_are_stale() {
    let dir = tempfile::tempdir().unwrap();
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for name in ["hello.toml", "hello.csv"] {
        std::fs::copy(scenes.join(name), dir.path().join(name)).unwrap();
    }
    let mut plan = Plan::new(Wish { scene: dir.path().join("hello.toml"), ..wish(&[1]) }).unwrap();
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
fn frames_that_need_others_are_refused() {
    let set = vec!["draw.impostors=\"on\"".to_owned()];
    let said = Plan::new(Wish { set, ..wish(&[1]) }).unwrap_err().to_string();
    assert!(said.contains("draw.impostors"), "{said}");
}
