//! Studies that go on after they ended, were stopped or were killed.

use super::*;

#[test]
fn a_resumed_study_measures_nothing_twice() {
    let tiny = Tiny::new();
    let first = [&SHORT[..], &OUT, &["--grid", "--knob", "draw.cutoff=2,3"]].concat();
    tiny.good(&first);
    let (before, times, picture) = (
        tiny.json("out/study.json"),
        tiny.text("out/times.csv"),
        pixels(&tiny, "out/picture-1.png"),
    );
    assert_eq!(names(&before), ["as it stands", "draw.cutoff=2"]);
    // Existing results are replaced only with --force.
    assert_eq!(tiny.refused(&first), "out: exists; --force replaces it");
    assert_eq!(
        (tiny.json("out/study.json"), tiny.text("out/times.csv")),
        (before.clone(), times.clone())
    );
    let go_on = |knob: &str| {
        [&SHORT[..], &OUT, &["--resume", "--grid", "--knob", knob]]
            .concat()
            .iter()
            .map(|s| s.to_string())
            .collect::<Vec<_>>()
    };
    let run = |knob: &str| tiny.good(&go_on(knob).iter().map(String::as_str).collect::<Vec<_>>());
    run("draw.cutoff=2,3,4");
    let after = tiny.json("out/study.json");
    assert_valid(&after, "study.schema.json");
    assert_eq!(names(&after), ["as it stands", "draw.cutoff=2", "draw.cutoff=4"]);
    assert!(tiny.text("out/times.csv").starts_with(&times), "turns are kept as they are");
    for i in [0, 1] {
        assert_eq!(study(&after)[i]["error"], study(&before)[i]["error"]);
    }
    assert_eq!(study(&after)[1]["n_turns"], study(&before)[1]["n_turns"]);
    assert_eq!((&study(&after)[2]["n_turns"], &after["interrupted"]), (&json!(2), &json!(false)));
    assert_eq!(pixels(&tiny, "out/picture-1.png"), picture);
    check_times(&tiny, &after);
    // A study of something else.
    let times = tiny.text("out/times.csv");
    for (more, what) in [
        (&["--set", "draw.threshold=0.01"][..], "the scene"),
        (&["--against=volume"], "the reference"),
        (&["--pixels=20"], "the reference"),
        (&["--frames=2"], "--frames"),
        (&["--frame=3"], "--frame, the reference"),
        (&["--as-played"], "--as-played"),
        (&["--time=gpu"], "the time that decides"),
        (&["--set", "cloud.0.position=[1,0,0]"], "the reference, the scene"),
    ] {
        // The last value of a repeated argument counts.
        let name = more[0].split('=').next().expect("a name");
        let own: Vec<String> = go_on("draw.cutoff=2")
            .into_iter()
            .filter(|a| name == "--set" || a.split('=').next() != Some(name))
            .collect();
        let message =
            tiny.refused(&[&own.iter().map(String::as_str).collect::<Vec<_>>()[..], more].concat());
        assert_eq!(message, format!("out: is of another study; what differs: {what}"), "{more:?}");
    }
    assert_eq!((tiny.json("out/study.json"), tiny.text("out/times.csv")), (after, times));
    // Replaced where that is asked for.
    tiny.good(&[&first[..], &["--force"]].concat());
    assert_eq!(names(&tiny.json("out/study.json")), ["as it stands", "draw.cutoff=2"]);
    assert!(tiny.path("out/picture-1.png").exists() && !tiny.path("out/picture-2.png").exists());
    // Files that are not whole, or none.
    fs::write(tiny.path("out/study.json"), "{").expect("study.json");
    assert!(
        tiny.refused(&[&SHORT[..], &OUT, &["--resume"]].concat())
            .starts_with("out/study.json: not JSON")
    );
    fs::write(tiny.path("out/study.json"), "{\"schema\": 99}").expect("study.json");
    assert_eq!(
        tiny.refused(&[&SHORT[..], &OUT, &["--resume"]].concat()),
        "out/study.json: study.json of schema 99; this nimbus reads 1"
    );
    let output = tiny.run(&[&SHORT[..], &["--resume"]].concat());
    assert!(
        output.status.code() == Some(2)
            && String::from_utf8_lossy(&output.stderr).contains("--out <DIR>")
    );
}

#[test]
fn a_study_without_a_folder_prints_its_rounds_at_ctrl_c() {
    let tiny = Tiny::new();
    // A step takes longer than the time that Ctrl-C leaves it.
    let long = ["error", "scene.toml", "--against=thin", "--frames=500", "--rounds=1000"];
    let mut command = tiny.command(&[&long[..], &["--grid", "--knob=draw.cutoff=2"]].concat());
    let log = fs::File::create(tiny.path("log")).expect("a file");
    let child = command.env("NIMBUS_PROGRESS_S", "1e-9").stderr(log).spawn().expect("it begins");
    // Of two configurations: their pictures and two rounds.
    let is_due = || tiny.text("log").contains("progress: configurations: 6 of ");
    let begin = Instant::now();
    while !is_due() {
        assert!(begin.elapsed() < Duration::from_secs(120), "it never has a round");
        std::thread::sleep(Duration::from_millis(5));
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(killed.expect("kill").success());
    let output = child.wait_with_output().expect("it ends");
    let stdout = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(130), "{}", tiny.text("log"));
    assert!(stdout.contains("INTERRUPTED") && stdout.contains("draw.cutoff=2"), "{stdout}");
}

#[test]
fn a_study_ended_by_ctrl_c_can_be_resumed() {
    let tiny = Tiny::new();
    let knob = [
        "error",
        "scene.toml",
        "-q",
        "--pixels=all",
        "--frames=1",
        "--grid",
        "--knob",
        "draw.cutoff=2,4",
        "--out",
        "out",
    ];
    // More than it is given time for; it ends alone where the test does.
    let child = tiny.start(&[&knob[..], &["--rounds=2000"]].concat());
    let begin = Instant::now();
    let n_rounds = || {
        let text = fs::read_to_string(tiny.path("out/study.json")).ok()?;
        serde_json::from_str::<Value>(&text).ok()?["rounds"].as_u64()
    };
    while n_rounds().is_none_or(|n| n < 2) {
        assert!(begin.elapsed() < Duration::from_secs(120), "it never has a round");
        std::thread::sleep(Duration::from_millis(5));
    }
    let killed =
        Command::new("kill").args(["-INT", &child.id().to_string()]).stderr(Stdio::null()).status();
    assert!(killed.expect("kill").success());
    let output = child.wait_with_output().expect("it ends");
    let (stdout, stderr) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    assert!(
        stdout.contains("INTERRUPTED: what was finished") && stderr.contains("keeps what is done"),
        "{stdout}{stderr}"
    );
    let (before, times) = (tiny.json("out/study.json"), tiny.text("out/times.csv"));
    assert_valid(&before, "study.schema.json");
    let n = before["rounds"].as_u64().expect("rounds");
    assert!(before["interrupted"] == true && n >= 2 && names(&before).len() == 3, "{before}");
    // Two rounds more, of all.
    let (rounds, n_turns) =
        (format!("--rounds={}", n + 2), |c: &Value| c["n_turns"].as_u64().expect("turns"));
    tiny.good(&[&knob[..], &["--resume", &rounds]].concat());
    let after = tiny.json("out/study.json");
    assert_valid(&after, "study.schema.json");
    assert!(after["interrupted"] == false && names(&after) == names(&before));
    assert!(tiny.text("out/times.csv").starts_with(&times));
    assert!(study(&after)[1..].iter().all(|c| n_turns(c) == n + 2), "{after}");
    assert!(study(&after).iter().zip(study(&before)).all(|(a, b)| a["error"] == b["error"]));
}

/// However early: the folder holds a study before its first configuration is drawn.
#[test]
fn a_killed_study_can_be_resumed() {
    let tiny = Tiny::new();
    let knob = [&SHORT[..], &OUT, &["--grid", "--knob", "draw.cutoff=2"]].concat();
    let mut child = tiny.start(&knob);
    let begin = Instant::now();
    while !tiny.path("out/study.json").exists() {
        assert!(begin.elapsed() < Duration::from_secs(120), "it never begins");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().expect("it is there, or was");
    child.wait().expect("it ends");
    assert_valid(&tiny.json("out/study.json"), "study.schema.json");
    tiny.good(&[&knob[..], &["--resume"]].concat());
    let json = tiny.json("out/study.json");
    assert!(
        json["interrupted"] == false && names(&json) == ["as it stands", "draw.cutoff=2"],
        "{json}"
    );
    assert!(
        study(&json).iter().all(|c| c["error"].is_object() && c["by_base"].is_object()),
        "{json}"
    );
}
