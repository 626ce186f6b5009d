//! Results of farms on which nothing goes wrong.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use serde_json::Value;

use super::harness::{Cluster, Farm, alone, content, path_text, succeed, text};

#[test]
fn on_slurm_240_frames_are_the_frames_of_one_machine() {
    let cluster = Cluster::up();
    let farm = Farm::planned(&["--frames", "240", "--shard-frames", "30", "--size", "64x48"]);
    let (_, merge) = farm.submit(&cluster, &[]);
    farm.wait_for_job(&cluster, &merge);
    let merged = content(&farm.merged());
    // The frames and their list.
    assert_eq!(merged.len(), 240 + 1);
    assert!(merged == alone("240", "64x48"), "the merged frames differ from one machine's");
    let attempts = farm.attempts();
    let nodes: BTreeSet<&str> =
        attempts.iter().map(|a| a["node"].as_str().expect("a name")).collect();
    assert_eq!(nodes.len(), 4, "{nodes:?}");
    assert_eq!(farm.status(&cluster)["n_done"], 8);

    // Nothing is left to submit.
    let output = cluster.nimbus(&["farm", "submit", "slurm", "--plan", farm.path()]);
    assert!(text(&output).contains("nothing was submitted"), "{}", text(&output));
}

#[test]
fn on_slurm_a_study_of_60_configurations_is_the_study_of_one_machine() {
    let cluster = Cluster::up();
    let hello = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hello.toml");
    let knobs =
        ["draw.cutoff=2,2.5,3.5,4,5", "lighting.grid=16,24,40,48", "draw.sort_bits=16,32,\"auto\""];
    let mut study =
        vec!["--grid", "--against", "thin", "--pixels", "64", "--rounds", "1", "--frames", "1"];
    knobs.iter().for_each(|knob| study.extend(["--knob", *knob]));
    let farm = Farm::of(hello, &[&["--size", "48x36", "--error", "--"], &study[..]].concat());
    let status = succeed(&["farm", "status", "--plan", farm.path()]);
    assert!(status.starts_with("0 of 8 shards are done"), "{status}");
    let (_, merge) = farm.submit(&cluster, &[]);
    farm.wait_for_job(&cluster, &merge);
    let alone = farm.dir.path().join("alone");
    let error = ["error", hello, "--size", "48x36", "-q", "--out", path_text(&alone)];
    succeed(&[&error[..], &study].concat());

    let read = |folder: &Path| -> Value {
        serde_json::from_slice(&fs::read(folder.join("study.json")).expect("a study"))
            .expect("JSON")
    };
    let exact = |study: &Value| -> Vec<[Value; 4]> {
        // The base configuration, which is the first, has turns in every part.
        let all = study["configurations"].as_array().expect("configurations").iter().skip(1);
        let mut all: Vec<_> =
            all.map(|c| ["name", "hash", "error", "n_turns"].map(|key| c[key].clone())).collect();
        all.sort_by_key(|c| c[0].to_string());
        all
    };
    let (ours, theirs) = (read(&farm.merged()), read(&alone));
    assert!(exact(&ours).len() > 40, "{:?}", exact(&ours));
    assert_eq!(exact(&ours), exact(&theirs));
    let keys =
        |value: &Value| value.as_object().expect("an object").keys().cloned().collect::<Vec<_>>();
    assert_eq!(
        (keys(&ours), keys(&ours["configurations"][7])),
        (keys(&theirs), keys(&theirs["configurations"][7]))
    );
}
