//! P, Tables 2 and 3, made from nothing by what a hand does: boxes are added and duplicated,
//! dragged onto the grid, mirrored, and given numbers as they are printed; then saved, and compared
//! with the tables as values.

use std::path::{Path, PathBuf};

use glam::DVec3;
use nimbus::io::box_file;
use nimbus::viewer::editor::action::Modifiers;
use nimbus::viewer::editor::handles::Handle;
use nimbus::viewer::editor::mirror::{Outcome, Plane};
use nimbus::viewer::editor::ray::Ray;
use nimbus::viewer::editor::session::{Answer, Event, Request, Session, Wish, perform};
use nimbus::viewer::editor::snap::Snap;
use nimbus::viewer::editor::{Action, Axis, DragAction, Edit, Setting, document, numbers};

/// How often each kind of act was of use.
#[derive(Debug, Default)]
struct Acts {
    n_added: usize,
    n_duplicated: usize,
    n_dragged: usize,
    n_mirrored: usize,
    n_densities: usize,
    n_typed: usize,
}

struct Hand {
    session: Session,
    acts: Acts,
}

impl Hand {
    fn act(&mut self, action: Action) {
        let turn = self.session.after(&Event::Act(action.clone()));
        self.session = turn.unwrap_or_else(|refusal| panic!("{action:?}: {refusal}")).session;
    }

    fn edit(&mut self, edit: Edit) {
        self.act(Action::Edit(edit));
    }

    fn active(&self) -> nimbus::model::boxes::CloudBox {
        *self.session.editor().active_box().unwrap().1
    }

    /// A line of the table, as it is printed there.
    fn make(&mut self, fields: &[&str]) {
        let typed = |i: usize| numbers::length(fields[i], 1.0).unwrap();
        if self.session.editor().active_box().is_some() {
            self.edit(Edit::Duplicate);
            self.acts.n_duplicated += 1;
        } else {
            let new = self.session.editor().new_box(DVec3::ZERO);
            self.edit(Edit::Add(new));
            self.acts.n_added += 1;
        }
        for axis in Axis::ALL {
            let v = typed(1 + axis.index());
            if self.active().extent[axis.index()] != v {
                self.edit(Edit::Extent(axis, v));
                self.acts.n_typed += 1;
            }
        }
        // Left of the middle what was placed right of it is mirrored.
        let x = typed(4);
        self.place(
            DVec3::new(x.abs(), typed(5), typed(6)),
            [fields[4].trim_start_matches('-'), fields[5], fields[6]],
        );
        if x < 0.0 {
            self.edit(Edit::Mirror { axis: Axis::X, plane: Plane::Zero, outcome: Outcome::Move });
            self.acts.n_mirrored += 1;
        }
        self.fill(numbers::count(fields[0]).unwrap());
        if self.active().radius_max != typed(7) {
            self.edit(Edit::Radius(typed(7)));
            self.acts.n_typed += 1;
        }
    }

    /// Along x and y by a drag onto the grid of tenths, from wherever the box was; what does not
    /// lie on it is typed.
    fn place(&mut self, to: DVec3, printed: [&str; 3]) {
        let from = self.active().center;
        // Three hundredths beside the mark: that is what the grid is for.
        for (axis, beside) in
            [(Axis::X, DVec3::new(0.03, 5.0, 0.0)), (Axis::Y, DVec3::new(-5.0, -0.03, 0.0))]
        {
            let ray = |v: DVec3| Ray { origin: v + 20.0 * DVec3::Z, direction: -DVec3::Z };
            let begin = DragAction::Begin {
                handle: Handle::MoveAxis(axis),
                ray: ray(from),
                forward: -DVec3::Z,
            };
            let to = |share: f64| DragAction::To {
                ray: ray(from + share * (to - from) + beside),
                modifiers: Modifiers::default(),
            };
            for step in [begin, to(0.3), to(1.4), to(1.0), DragAction::End] {
                self.act(Action::Drag(step));
            }
            self.acts.n_dragged += 1;
        }
        for axis in Axis::ALL {
            let v = numbers::length(printed[axis.index()], 1.0).unwrap();
            if self.active().center[axis.index()] != v {
                self.edit(Edit::Center(axis, v));
                self.acts.n_typed += 1;
            }
        }
    }

    /// By density where the box has one to give, else by number.
    fn fill(&mut self, n: u32) {
        let volume = document::volume(&self.active());
        self.edit(Edit::Density(f64::from(n) / volume));
        self.acts.n_densities += 1;
        assert_eq!(self.active().n_particles, n);
    }
}

fn rebuild(table: &str) -> Acts {
    let path = Path::new("scenes").join(table);
    let expected = box_file::read(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let mut hand = Hand { session: Session::new(), acts: Acts::default() };
    hand.act(Action::Set(Setting::Snap(Snap { on: true, step: 0.1 })));
    for line in text.lines().skip(2).filter(|line| !line.trim().is_empty()) {
        hand.make(&line.split(',').map(str::trim).collect::<Vec<_>>());
    }
    let folder = tempfile::tempdir().unwrap();
    let saved = save_before_quitting(&hand.session, folder.path().join("made.dat"));
    assert_eq!(box_file::read(saved.path().unwrap()).unwrap(), expected);
    assert_eq!(
        saved.editor().document().n_particles(),
        expected.iter().map(|b| u64::from(b.n_particles)).sum::<u64>()
    );
    // And all the way back.
    while hand.session.editor().history().n_undo() > 0 {
        hand.act(Action::Undo);
    }
    assert!(hand.session.editor().boxes().is_empty() && !hand.session.is_dirty());
    hand.acts
}

/// Quit, save, a name, and gone.
fn save_before_quitting(session: &Session, path: PathBuf) -> Session {
    let after = |session: &Session, event: Event| {
        let turn = session.after(&event).unwrap();
        (turn.session, turn.request)
    };
    let (session, request) = after(session, Event::Wish(Wish::Quit));
    assert_eq!(request, Some(Request::Ask(Wish::Quit)));
    let (session, request) = after(&session, Event::Answer(Answer::Save));
    assert_eq!(request, Some(Request::ChooseToSave));
    let (session, request) = after(&session, Event::ChosenToSave(Some(path)));
    let (session, request) = after(&session, perform(&request.unwrap()).unwrap());
    assert_eq!((session.is_dirty(), request), (false, Some(Request::Quit)));
    session
}

#[test]
fn the_cloud_of_554_particles_is_made_by_hand() {
    let acts = rebuild("cubes-554.dat");
    assert_eq!(
        (acts.n_added, acts.n_duplicated, acts.n_dragged, acts.n_densities),
        (1, 16, 34, 17),
        "{acts:?}"
    );
    // Left of the middle lie eight boxes, by the table.
    assert_eq!(acts.n_mirrored, 8, "{acts:?}");
    // Of 17 · 8 numbers the grid and what was duplicated leave these: by the table, edges and radii
    // that differ from the line before, heights z that do, and places x and y with more than one
    // decimal.
    assert_eq!(acts.n_typed, 49, "{acts:?}");
}

#[test]
fn the_cloud_of_615_particles_is_made_by_hand() {
    let acts = rebuild("cubes-615.dat");
    assert_eq!(
        (acts.n_added, acts.n_duplicated, acts.n_dragged, acts.n_densities),
        (1, 22, 46, 23),
        "{acts:?}"
    );
    assert_eq!((acts.n_mirrored, acts.n_typed), (8, 58), "{acts:?}");
}
