//! Unsaved changes, questions, and answers.

use super::super::action::{Edit, Select};
use super::super::axis::Axis;
use super::super::fixtures::{document, unit_box};
use super::*;

fn opened() -> Session {
    Session::from_file(Path::new("a.dat"), document(2).boxes)
}

fn turn(session: &Session, event: SessionEvent) -> (Session, Option<Request>) {
    session.after(&event).unwrap()
}

fn changed(session: &Session) -> Session {
    let session = turn(session, SessionEvent::Act(Action::Select(Select::All))).0;
    turn(&session, SessionEvent::Act(Action::Edit(Edit::Count(99)))).0
}

fn answer(session: &Session, answer: Answer) -> (Session, Option<Request>) {
    turn(session, SessionEvent::Answer(answer))
}

#[test]
fn a_session_is_dirty_where_its_boxes_differ_from_the_file() {
    let session = opened();
    assert!(!session.is_dirty());
    let dirty = changed(&session);
    assert!(dirty.is_dirty());
    let undone = turn(&dirty, SessionEvent::Act(Action::Undo)).0;
    assert!(!undone.is_dirty());
    // After a save, an undo makes the session dirty.
    let document = dirty.editor().shared_document();
    let saved = turn(&dirty, SessionEvent::Saved { path: "a.dat".into(), document }).0;
    assert!(!saved.is_dirty() && turn(&saved, SessionEvent::Act(Action::Undo)).0.is_dirty());
    // The file distinguishes −0 from 0, and has no seed.
    let zero = Edit::Center(Axis::Y, -0.0);
    let session = turn(&session, SessionEvent::Act(Action::Select(Select::All))).0;
    assert!(turn(&session, SessionEvent::Act(Action::Edit(zero))).0.is_dirty());
    assert!(!turn(&session, SessionEvent::Act(Action::Edit(Edit::Seed(7)))).0.is_dirty());
}

#[test]
fn a_clean_session_asks_no_question() {
    let (session, request) = turn(&opened(), SessionEvent::Intend(Intent::New));
    assert_eq!((session.editor().boxes().len(), session.path(), request), (0, None, None));
    assert_eq!(turn(&opened(), SessionEvent::Intend(Intent::Quit)).1, Some(Request::Quit));
    let intent = Intent::Open(Some("b.dat".into()));
    assert_eq!(
        turn(&opened(), SessionEvent::Intend(intent)).1,
        Some(Request::Open("b.dat".into()))
    );
    assert_eq!(
        turn(&opened(), SessionEvent::Intend(Intent::Open(None))).1,
        Some(Request::ChooseToOpen)
    );
}

#[test]
fn every_intent_that_would_lose_changes_asks_first() {
    let dirty = changed(&opened());
    for (intent, discarded) in [
        (Intent::New, None),
        (Intent::Open(None), Some(Request::ChooseToOpen)),
        (Intent::Open(Some("b.dat".into())), Some(Request::Open("b.dat".into()))),
        (Intent::Quit, Some(Request::Quit)),
    ] {
        let (asking, request) = turn(&dirty, SessionEvent::Intend(intent.clone()));
        assert_eq!(
            (request, asking.question()),
            (Some(Request::Ask(intent.clone())), Some(&intent))
        );
        assert!(asking.editor().document().is_same(dirty.editor().document()));
        let (kept, request) = answer(&asking, Answer::Cancel);
        assert_eq!((kept.is_dirty(), kept.question(), request), (true, None, None));
        assert_eq!(answer(&asking, Answer::Discard).1, discarded.clone());
        // The intent follows the save.
        let (saving, request) = answer(&asking, Answer::Save);
        let document = dirty.editor().shared_document();
        assert_eq!(
            request,
            Some(Request::Save {
                path: "a.dat".into(),
                opened: "a.dat".into(),
                document: document.clone()
            })
        );
        let (_, request) = turn(&saving, SessionEvent::Saved { path: "a.dat".into(), document });
        assert_eq!(request, discarded);
        // A failed save changes nothing.
        let (failed, request) = turn(&saving, SessionEvent::Failed(Error::usage("disk full")));
        assert_eq!((failed.is_dirty(), failed.question(), request), (true, None, None));
    }
    // An answer without a question has no effect.
    assert_eq!(answer(&dirty, Answer::Discard).1, None);
    assert!(answer(&dirty, Answer::Discard).0.is_dirty());
}

#[test]
fn a_new_cloud_is_saved_by_a_dialog_before_the_intent_follows() {
    let add = SessionEvent::Act(Action::Edit(Edit::Add(unit_box())));
    let (asking, _) = turn(&turn(&Session::default(), add).0, SessionEvent::Intend(Intent::Quit));
    let (saving, request) = answer(&asking, Answer::Save);
    assert_eq!(request, Some(Request::ChooseToSave));
    assert_eq!(turn(&saving, SessionEvent::ChosenToSave(None)).1, None);
    let (saving, request) = turn(&saving, SessionEvent::ChosenToSave(Some("n.dat".into())));
    let Some(Request::Save { path, document, .. }) = request else { panic!("{request:?}") };
    let (saved, request) = turn(&saving, SessionEvent::Saved { path, document });
    assert_eq!(
        (saved.path(), saved.is_dirty(), request),
        (Some(Path::new("n.dat")), false, Some(Request::Quit))
    );
    // A cancelled dialog drops the intent, so a later save does not quit.
    let (session, _) = turn(&answer(&asking, Answer::Save).0, SessionEvent::ChosenToSave(None));
    let document = session.editor().shared_document();
    assert_eq!(turn(&session, SessionEvent::Saved { path: "n.dat".into(), document }).1, None);
}

#[test]
fn a_file_saved_under_another_name_keeps_the_lines_of_the_opened_one() {
    let folder = tempfile::tempdir().unwrap();
    let [old, new] = ["a.dat", "b.dat"].map(|name| folder.path().join(name));
    std::fs::write(&old, "1\n1\n1 1.0 1.00 1 0 0 0 1.5\n").unwrap();
    let session = Session::from_file(&old, box_file::read(&old).unwrap());
    let (_, request) = turn(&session, SessionEvent::ChosenToSave(Some(new.clone())));
    perform(&request.expect("a request"));
    assert_eq!(std::fs::read(&new).unwrap(), std::fs::read(&old).unwrap());
}

#[test]
fn changes_made_while_a_dialog_is_open_are_asked_about() {
    let boxes = document(5).boxes;
    let arrives = || SessionEvent::Opened { path: "b.dat".into(), boxes: boxes.clone() };
    let choosing = turn(&opened(), SessionEvent::Intend(Intent::Open(None))).0;
    let (session, _) = turn(&choosing, SessionEvent::ChosenToOpen(Some("b.dat".into())));
    let (session, request) = turn(&session, arrives());
    assert_eq!(
        (session.editor().boxes().len(), session.path(), request),
        (5, Some(Path::new("b.dat")), None)
    );
    let (kept, request) = turn(&changed(&choosing), arrives());
    assert_eq!(request, Some(Request::Ask(Intent::Open(Some("b.dat".into())))));
    assert_eq!((kept.editor().boxes().len(), kept.is_dirty()), (2, true));
    // After discarding, the file opens without another question.
    let (discarded, request) = answer(&kept, Answer::Discard);
    assert_eq!(request, Some(Request::Open("b.dat".into())));
    assert_eq!(turn(&discarded, arrives()).0.editor().boxes().len(), 5);
    // Changes made during a save are unsaved.
    let begun = changed(&opened());
    let document = begun.editor().shared_document();
    let edited = turn(&begun, SessionEvent::Act(Action::Edit(Edit::Count(100)))).0;
    assert!(turn(&edited, SessionEvent::Saved { path: "a.dat".into(), document }).0.is_dirty());
}

#[test]
fn files_are_opened_and_saved() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c.dat");
    let document = Arc::new(document(4));
    let save = |path: &Path| Request::Save {
        path: path.to_owned(),
        opened: "a.dat".into(),
        document: document.clone(),
    };
    let request = save(&path);
    assert_eq!(
        perform(&request),
        Some(SessionEvent::Saved { path: path.clone(), document: document.clone() })
    );
    let opened = perform(&Request::Open(path.clone()));
    assert_eq!(opened, Some(SessionEvent::Opened { path, boxes: document.boxes.clone() }));
    let missing = perform(&Request::Open(folder.path().join("d.dat")));
    assert!(matches!(missing, Some(SessionEvent::Failed(Error::Io { .. }))), "{missing:?}");
    let nowhere = save(&folder.path().join("no").join("c.dat"));
    assert!(matches!(perform(&nowhere), Some(SessionEvent::Failed(Error::Io { .. }))));
    assert_eq!(perform(&Request::Quit), None);
}

#[test]
fn a_scenes_seed_is_no_unsaved_change() {
    let session = Session::from_file(Path::new("a.dat"), vec![super::super::fixtures::unit_box()])
        .with_seed(9);
    assert_eq!((session.editor().document().seed, session.is_dirty()), (9, false));
    assert_eq!((session.editor().history().n_undo(), session.editor().boxes().len()), (0, 1));
    assert_eq!(session.path(), Some(Path::new("a.dat")));
}
