//! Settings of the wrong form, and unknown keys: the message has the right form.

use std::path::Path;

use nimbus::io::scene_file;
use nimbus::io::scene_keys::{Key, tables};
use proptest::prelude::*;
use serde_json::Value;

use crate::generated;

fn load(set: &str) -> Result<(), String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
    scene_file::load(&path, &[set.to_owned()], None).map(drop).map_err(|e| e.to_string())
}

/// Path and description of every key of the tables that a scene always has.
fn keys() -> Vec<(String, &'static Key)> {
    let always = ["[film]", "[camera]", "[time]", "[threads]", "[draw]", "[lighting]"];
    tables()
        .into_iter()
        .filter(|table| always.contains(&table.name.as_str()))
        .flat_map(|table| {
            let name = table.name.trim_matches(['[', ']']).to_owned();
            table.keys.into_iter().map(move |key| (format!("{name}.{}", key.name), key))
        })
        .collect()
}

/// Returns a default in a form that a user may type, and that TOML or the key does not take.
fn wrong_forms(default: &Value) -> Vec<String> {
    match default {
        Value::Bool(flag) => vec![if *flag { "yes" } else { "off" }.to_owned()],
        Value::Number(n) if n.is_u64() => {
            vec![format!("{n}.0"), format!("{n} px"), format!("\"{n}\"")]
        }
        Value::Number(n) => vec![format!("{n}s"), format!("\"{n}\""), format!("[{n}]")],
        Value::Array(items) => {
            let items: Vec<String> = items.iter().map(Value::to_string).collect();
            [", ", ",", " ", ";"].map(|between| items.join(between)).to_vec()
        }
        Value::String(text) => vec![text.to_uppercase(), text.replace('-', "_") + " "],
        Value::Null | Value::Object(_) => vec![],
    }
}

#[test]
fn a_value_of_the_wrong_form_is_suggested_in_the_right_one() {
    let mut n_suggested = 0;
    for (path, key) in keys() {
        let Some(default) = (key.about)().default else { continue };
        for wrong in wrong_forms(&default) {
            let Err(message) = load(&format!("{path}={wrong}")) else { continue };
            // A camera stands still or has a path.
            if message.contains("not both") || message.contains("did you mean") {
                continue;
            }
            let right = message.split("; write `").nth(1).and_then(|rest| rest.split('`').next());
            let right = right.unwrap_or_else(|| panic!("no right form: {message}"));
            let again = load(right);
            let is_of_form = again.as_ref().err().is_none_or(|e| !e.contains("; write `"));
            assert!(is_of_form, "{path}={wrong}: {right}: {again:?}");
            n_suggested += 1;
        }
    }
    assert!(n_suggested > 60, "{n_suggested}");
}

#[test]
fn keys_known_by_other_names_are_found() {
    for (set, says) in [
        ("camera.position=1,2,3", "write `camera.position=[1,2,3]`"),
        ("camera.fov=40", "did you mean `fov_y_deg`"),
        ("camera.look_at=[0,0,0]", "`camera.target`"),
        ("camera.direction=[0,0,1]", "`camera.target`"),
        ("camera.yaw=3", "`camera.target`"),
        ("light.0.target=[0,0,0]", "`direction` of a light"),
        ("cloud.0.count=5", "`draw.particles`"),
        ("lighting.mode=twoo", "did you mean `two-reflection`"),
        ("film.size=800x600", "`film.width` and `film.height`"),
        ("seed=3", "`seed` is a key of [[cloud]]"),
        ("clouds.0.seed=3", "did you mean `cloud`"),
        ("cloud.seed=3", "write `cloud.0.seed`"),
        ("camera.position.y=3", "write `camera.position.1`"),
        ("draw.cull=yes", "write `draw.cull=\"on\"`"),
        ("film.background=red", "for example `film.background=["),
    ] {
        let message = load(set).expect_err(set);
        assert!(message.contains(says), "{set}: {message}");
    }
}

/// One edit of a key's name, or one of its words, leads to it or to another key's name.
#[test]
fn a_mistyped_key_is_suggested() {
    let index = any::<prop::sample::Index>;
    generated::check(256, (index(), index(), "[a-z]"), |(i, at, c)| {
        let keys = keys();
        let (path, key) = &keys[i.index(keys.len())];
        let mut name: Vec<char> = key.name.chars().collect();
        name.insert(at.index(name.len()), c.chars().next().expect("a letter"));
        let name: String = name.into_iter().collect();
        let (table, _) = path.split_once('.').expect("a table");
        if keys.iter().any(|(path, _)| *path == format!("{table}.{name}")) {
            return Ok(());
        }
        let message = load(&format!("{table}.{name}=1")).expect_err("unknown");
        prop_assert!(message.contains("; did you mean `"), "{}", message);
        Ok(())
    });
}

/// No value makes loading panic, and every refusal is one line without control characters.
#[test]
fn any_value_is_read_or_refused_in_one_line() {
    generated::check(256, (any::<prop::sample::Index>(), ".{0,30}"), |(i, value)| {
        let keys = keys();
        let (path, _) = &keys[i.index(keys.len())];
        if let Err(message) = load(&format!("{path}={value}")) {
            prop_assert!(!message.contains(char::is_control), "{:?}", message);
        }
        Ok(())
    });
}
