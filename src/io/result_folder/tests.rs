use super::*;

fn put(text: &str) -> impl Fn(&Path) -> Result<()> {
    move |folder| {
        for name in ["rows.csv", "run.json"] {
            fs::write(folder.join(name), text).map_err(|cause| Error::io(folder, cause))?;
        }
        Ok(())
    }
}

const NAMES: [&str; 2] = ["rows.csv", "run.json"];

fn planned(n_pictures: usize) -> Vec<String> {
    let pictures = (0..n_pictures).map(|i| format!("picture-{i}.png"));
    NAMES.into_iter().map(str::to_owned).chain(pictures).collect()
}

fn picture(folder: &mut ResultFolder, i: usize, text: &str) {
    let write = |path: &Path| fs::write(path, text).map_err(|cause| Error::io(path, cause));
    folder.add(&format!("picture-{i}.png"), write).unwrap();
}

/// Makes finished results with two pictures.
fn finished(place: &Path, text: &str) {
    let mut folder = ResultFolder::open(place, "run", Existing::Refuse, &planned(2)).unwrap();
    folder.replace(&NAMES, put("half")).unwrap();
    (0..2).for_each(|i| picture(&mut folder, i, text));
    folder.finish(&NAMES, put(text)).unwrap();
}

fn files(folder: &Path) -> Vec<(String, String)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let mut found: Vec<_> = entries
        .filter(|entry| entry.path().is_file())
        .filter(|entry| !entry.file_name().to_string_lossy().ends_with(".sha256"))
        .map(|entry| {
            let text = fs::read_to_string(entry.path()).unwrap_or_default();
            (entry.file_name().into_string().unwrap(), text)
        })
        .collect();
    found.sort();
    found
}

fn expected(all: &[(&str, &str)]) -> Vec<(String, String)> {
    all.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect()
}

#[test]
fn earlier_results_stay_until_new_ones_are_finished() {
    [false, true].into_iter().for_each(replaced_by_a_second_run);
}

fn replaced_by_a_second_run(has_folder: bool) {
    let dir = tempfile::tempdir().unwrap();
    let place = dir.path().join("run");
    finished(&place, "old");
    fs::write(place.join("picture-9.png"), "mine").unwrap();
    if has_folder {
        // The files are then moved one by one.
        fs::create_dir(place.join("plots")).unwrap();
    }
    let old = [
        ("picture-0.png", "old"),
        ("picture-1.png", "old"),
        ("picture-9.png", "mine"),
        ("rows.csv", "old"),
        ("run.json", "old"),
    ];
    {
        let mut folder = ResultFolder::open(&place, "run", Existing::Replace, &planned(2)).unwrap();
        assert_eq!(folder.apart(), None);
        folder.replace(&NAMES, put("half")).unwrap();
        picture(&mut folder, 0, "half");
        let apart = folder.apart().unwrap();
        assert_eq!(apart.file_name().unwrap(), "run.partial");
        assert_eq!(files(&place), expected(&old));
    }
    let half = [("picture-0.png", "half"), ("rows.csv", "half"), ("run.json", "half")];
    assert_eq!(files(&dir.path().join("run.partial")), expected(&half));
    // A second run leaves what the first one kept.
    let mut folder = ResultFolder::open(&place, "run", Existing::Replace, &planned(1)).unwrap();
    picture(&mut folder, 0, "new");
    folder.replace(&NAMES, put("new, half")).unwrap();
    folder.finish(&NAMES, put("new")).unwrap();
    drop(folder);
    let new = [
        ("picture-0.png", "new"),
        ("picture-9.png", "mine"),
        ("rows.csv", "new"),
        ("run.json", "new"),
    ];
    assert_eq!(files(&place), expected(&new));
    assert_eq!(files(&dir.path().join("run.partial")), expected(&half));
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2);
}

#[test]
fn files_that_nimbus_did_not_write_are_never_replaced() {
    let dir = tempfile::tempdir().unwrap();
    let place = dir.path().join("run");
    let open = |existing| ResultFolder::open(&place, "run", existing, &planned(3));
    finished(&place, "old");
    fs::write(place.join("picture-2.png"), "mine").unwrap();
    for existing in [Existing::Replace, Existing::Extend] {
        let error = open(existing).unwrap_err().to_string();
        assert!(error.contains("picture-2.png: was not written by nimbus"), "{error}");
    }
    fs::remove_file(place.join("picture-2.png")).unwrap();
    // One that has changed since is the user's.
    fs::write(place.join("picture-1.png"), "drawn on").unwrap();
    assert!(open(Existing::Replace).unwrap_err().to_string().contains("picture-1.png"));
    assert!(open(Existing::Extend).is_ok());
    fs::write(place.join("picture-1.png"), "old").unwrap();
    // One that comes while the run works.
    let mut folder = open(Existing::Replace).unwrap();
    fs::write(place.join("picture-2.png"), "mine").unwrap();
    picture(&mut folder, 2, "new");
    let error = folder.finish(&NAMES, put("new")).unwrap_err().to_string();
    assert!(error.contains("the new results are in"), "{error}");
    assert_eq!(fs::read_to_string(place.join("picture-2.png")).unwrap(), "mine");
    assert_eq!(fs::read_to_string(place.join("run.json")).unwrap(), "old");
    let apart = dir.path().join("run.partial");
    assert_eq!(fs::read_to_string(apart.join("picture-2.png")).unwrap(), "new");
    assert_eq!(fs::read_to_string(apart.join("run.json")).unwrap(), "new");
}

#[test]
fn a_list_cannot_name_files_outside_of_its_folder() {
    let dir = tempfile::tempdir().unwrap();
    let place = dir.path().join("run");
    finished(&place, "old");
    fs::write(dir.path().join("other.txt"), "mine").unwrap();
    let sum = sum_of(&dir.path().join("other.txt")).unwrap();
    for name in ["../other.txt", "/etc/passwd", "..", "a/b", ""] {
        fs::write(place.join("run.sha256"), format!("{sum}  {name}\n")).unwrap();
        assert!(read_list(&place.join("run.sha256")).is_err(), "{name}");
        assert!(ResultFolder::open(&place, "run", Existing::Replace, &[]).is_err());
    }
}

#[test]
fn one_run_at_a_time_and_nothing_is_left_of_one_that_failed() {
    let dir = tempfile::tempdir().unwrap();
    let place = dir.path().join("run");
    let open = |existing| ResultFolder::open(&place, "run", existing, &planned(0));
    let first = open(Existing::Refuse).unwrap();
    for existing in [Existing::Replace, Existing::Extend] {
        assert_eq!(open(existing).unwrap_err().exit_code(), 75);
    }
    drop(first);
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
    finished(&place, "old");
    drop(open(Existing::Replace).unwrap());
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    assert_eq!(open(Existing::Refuse).unwrap_err().exit_code(), 2);
}

#[test]
fn the_list_is_one_that_sha256sum_checks() {
    let dir = tempfile::tempdir().unwrap();
    let place = dir.path().join("run");
    finished(&place, "old");
    let mut check = std::process::Command::new("sha256sum");
    let output = check.args(["-c", "run.sha256"]).current_dir(&place).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(String::from_utf8_lossy(&output.stdout).lines().count(), 4);
}

#[test]
fn results_that_a_run_is_replacing_belong_to_that_run() {
    let dir = tempfile::tempdir().unwrap();
    let place = dir.path().join("run");
    finished(&place, "old");
    let refused = || ResultFolder::open(&place, "run", Existing::Refuse, &planned(0)).unwrap_err();
    let running = ResultFolder::open(&place, "run", Existing::Replace, &planned(0)).unwrap();
    assert_eq!(refused().exit_code(), 75);
    // The folder above has results of several scenes.
    assert_eq!(refuse_existing(dir.path(), false).unwrap_err().exit_code(), 75);
    drop(running);
    assert!(refused().to_string().contains("--force replaces it"));
}
