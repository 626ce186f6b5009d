//! What is dirty, what is asked, and what happens then.

use super::super::action::{Edit, Select};
use super::super::samples::{document, unit_box};
use super::*;

fn opened() -> Session {
    Session::opened(Path::new("a.dat"), document(2).boxes)
}

fn turn(session: &Session, event: Event) -> (Session, Option<Request>) {
    let Turn { session, request, .. } = session.after(&event).unwrap();
    (session, request)
}

fn changed(session: &Session) -> Session {
    let session = turn(session, Event::Act(Action::Select(Select::All))).0;
    turn(&session, Event::Act(Action::Edit(Edit::Count(99)))).0
}

fn answer(session: &Session, answer: Answer) -> (Session, Option<Request>) {
    turn(session, Event::Answer(answer))
}

#[test]
fn dirty_is_what_differs_from_the_file() {
    let session = opened();
    assert!(!session.is_dirty());
    let dirty = changed(&session);
    assert!(dirty.is_dirty());
    let undone = turn(&dirty, Event::Act(Action::Undo)).0;
    assert!(!undone.is_dirty());
    // Saved after a step, it is what lies before that step that is not saved.
    let document = dirty.editor().shared_document();
    let saved = turn(&dirty, Event::Saved { path: "a.dat".into(), document }).0;
    assert!(!saved.is_dirty() && turn(&saved, Event::Act(Action::Undo)).0.is_dirty());
    // −0 is not 0 in the file; the seed is not in it at all.
    let zero = Edit::Center(super::super::Axis::Y, -0.0);
    let session = turn(&session, Event::Act(Action::Select(Select::All))).0;
    assert!(turn(&session, Event::Act(Action::Edit(zero))).0.is_dirty());
    assert!(!turn(&session, Event::Act(Action::Edit(Edit::Seed(7)))).0.is_dirty());
}

#[test]
fn nothing_is_asked_where_nothing_is_lost() {
    let (session, request) = turn(&opened(), Event::Wish(Wish::New));
    assert_eq!((session.editor().boxes().len(), session.path(), request), (0, None, None));
    assert_eq!(turn(&opened(), Event::Wish(Wish::Quit)).1, Some(Request::Quit));
    let wish = Wish::Open(Some("b.dat".into()));
    assert_eq!(turn(&opened(), Event::Wish(wish)).1, Some(Request::Open("b.dat".into())));
    assert_eq!(turn(&opened(), Event::Wish(Wish::Open(None))).1, Some(Request::ChooseToOpen));
}

#[test]
fn each_wish_that_would_lose_changes_is_asked_about() {
    let dirty = changed(&opened());
    for (wish, discarded) in [
        (Wish::New, None),
        (Wish::Open(None), Some(Request::ChooseToOpen)),
        (Wish::Open(Some("b.dat".into())), Some(Request::Open("b.dat".into()))),
        (Wish::Quit, Some(Request::Quit)),
    ] {
        let (asking, request) = turn(&dirty, Event::Wish(wish.clone()));
        assert_eq!((request, asking.asked()), (Some(Request::Ask(wish.clone())), Some(&wish)));
        assert!(asking.editor().document().is_same(dirty.editor().document()));
        let (kept, request) = answer(&asking, Answer::Cancel);
        assert_eq!((kept.is_dirty(), kept.asked(), request), (true, None, None));
        assert_eq!(answer(&asking, Answer::Discard).1, discarded.clone());
        // Saved first, then what was wished for.
        let (saving, request) = answer(&asking, Answer::Save);
        let document = dirty.editor().shared_document();
        assert_eq!(
            request,
            Some(Request::Save { path: "a.dat".into(), document: document.clone() })
        );
        let (_, request) = turn(&saving, Event::Saved { path: "a.dat".into(), document });
        assert_eq!(request, discarded);
        // A save that fails leaves all as it is.
        let (failed, request) = turn(&saving, Event::Failed(Error::usage("disk full")));
        assert_eq!((failed.is_dirty(), failed.asked(), request), (true, None, None));
    }
    // An answer that nobody asked for is none.
    assert_eq!(answer(&dirty, Answer::Discard).1, None);
    assert!(answer(&dirty, Answer::Discard).0.is_dirty());
}

#[test]
fn a_new_cloud_is_saved_where_a_dialog_says_and_then_the_wish_is_granted() {
    let add = Event::Act(Action::Edit(Edit::Add(unit_box())));
    let (asking, _) = turn(&turn(&Session::new(), add).0, Event::Wish(Wish::Quit));
    let (saving, request) = answer(&asking, Answer::Save);
    assert_eq!(request, Some(Request::ChooseToSave));
    assert_eq!(turn(&saving, Event::ChosenToSave(None)).1, None);
    let (saving, request) = turn(&saving, Event::ChosenToSave(Some("n.dat".into())));
    let Some(Request::Save { path, document }) = request else { panic!("{request:?}") };
    let (saved, request) = turn(&saving, Event::Saved { path, document });
    assert_eq!(
        (saved.path(), saved.is_dirty(), request),
        (Some(Path::new("n.dat")), false, Some(Request::Quit))
    );
    // After a cancelled dialog a later save does not quit.
    let (session, _) = turn(&answer(&asking, Answer::Save).0, Event::ChosenToSave(None));
    let document = session.editor().shared_document();
    assert_eq!(turn(&session, Event::Saved { path: "n.dat".into(), document }).1, None);
}

#[test]
fn what_changed_behind_a_dialog_is_asked_about() {
    let boxes = document(5).boxes;
    let arrives = || Event::Opened { path: "b.dat".into(), boxes: boxes.clone() };
    let choosing = turn(&opened(), Event::Wish(Wish::Open(None))).0;
    let (session, _) = turn(&choosing, Event::ChosenToOpen(Some("b.dat".into())));
    let (session, request) = turn(&session, arrives());
    assert_eq!(
        (session.editor().boxes().len(), session.path(), request),
        (5, Some(Path::new("b.dat")), None)
    );
    let (kept, request) = turn(&changed(&choosing), arrives());
    assert_eq!(request, Some(Request::Ask(Wish::Open(Some("b.dat".into())))));
    assert_eq!((kept.editor().boxes().len(), kept.is_dirty()), (2, true));
    // Discarded, the file comes in without a further question.
    let (discarded, request) = answer(&kept, Answer::Discard);
    assert_eq!(request, Some(Request::Open("b.dat".into())));
    assert_eq!(turn(&discarded, arrives()).0.editor().boxes().len(), 5);
    // Edited between a save's beginning and its end, it is still dirty.
    let begun = changed(&opened());
    let document = begun.editor().shared_document();
    let edited = turn(&begun, Event::Act(Action::Edit(Edit::Count(100)))).0;
    assert!(turn(&edited, Event::Saved { path: "a.dat".into(), document }).0.is_dirty());
}

#[test]
fn files_are_opened_and_saved_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c.dat");
    let document = Arc::new(document(4));
    let request = Request::Save { path: path.clone(), document: document.clone() };
    assert_eq!(
        perform(&request),
        Some(Event::Saved { path: path.clone(), document: document.clone() })
    );
    let opened = perform(&Request::Open(path.clone()));
    assert_eq!(opened, Some(Event::Opened { path, boxes: document.boxes.clone() }));
    let missing = perform(&Request::Open(folder.path().join("d.dat")));
    assert!(matches!(missing, Some(Event::Failed(Error::Io { .. }))), "{missing:?}");
    let nowhere = Request::Save { path: folder.path().join("no").join("c.dat"), document };
    assert!(matches!(perform(&nowhere), Some(Event::Failed(Error::Io { .. }))));
    assert_eq!(perform(&Request::Quit), None);
}

#[test]
fn a_scenes_seed_is_no_change() {
    let session =
        Session::opened(Path::new("a.dat"), vec![super::super::samples::unit_box()]).seeded(9);
    assert_eq!((session.editor().document().seed, session.is_dirty()), (9, false));
    assert_eq!((session.editor().history().n_undo(), session.editor().boxes().len()), (0, 1));
    assert_eq!(session.path(), Some(Path::new("a.dat")));
}
