//! P, Tables 2 and 3, made by actions from an empty document.
//!
//! Boxes are added, duplicated, dragged onto the grid, mirrored, and given numbers as printed. The
//! saved file is compared with the tables.

use std::path::{Path, PathBuf};

use glam::DVec3;
use nimbus::io::box_file;
use nimbus::viewer::editor::{
    Action, Answer, Axis, DragAction, DragModifiers, Edit, GridSnap, Handle, Intent, MirrorPlane,
    MirrorResult, Ray, Request, Session, SessionEvent, Setting, document, numbers, perform,
};

/// Number of actions of each kind.
#[derive(Debug, Default)]
struct Acts {
    n_added: usize,
    n_duplicated: usize,
    n_dragged: usize,
    n_mirrored: usize,
    n_densities: usize,
    n_typed: usize,
}

struct Rebuild {
    session: Session,
    acts: Acts,
}

impl Rebuild {
    fn act(&mut self, action: Action) {
        let next = self.session.after(&SessionEvent::Act(action.clone()));
        self.session = next.unwrap_or_else(|refusal| panic!("{action:?}: {refusal}")).0;
    }

    fn edit(&mut self, edit: Edit) {
        self.act(Action::Edit(edit));
    }

    fn active(&self) -> nimbus::model::boxes::CloudBox {
        *self.session.editor().active_box().unwrap().1
    }

    /// Makes the box of one printed line of the table.
    fn make(&mut self, fields: &[&str]) {
        let typed = |i: usize| numbers::length(fields[i], 1.0).unwrap();
        if self.session.editor().active_box().is_some() {
            self.edit(Edit::Duplicate);
            self.acts.n_duplicated += 1;
        } else {
            let new = self.session.editor().new_box(DVec3::ZERO, 10.0);
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
        // A box left of the middle is placed right of it and mirrored.
        let x = typed(4);
        self.place(
            DVec3::new(x.abs(), typed(5), typed(6)),
            [fields[4].trim_start_matches('-'), fields[5], fields[6]],
        );
        if x < 0.0 {
            self.edit(Edit::Mirror {
                axis: Axis::X,
                plane: MirrorPlane::Zero,
                result: MirrorResult::Move,
            });
            self.acts.n_mirrored += 1;
        }
        self.fill(numbers::count(fields[0]).unwrap());
        if self.active().radius_max != typed(7) {
            self.edit(Edit::Radius(typed(7)));
            self.acts.n_typed += 1;
        }
    }

    /// Moves the box along x and y by drags onto the grid of tenths. Other coordinates are typed.
    fn place(&mut self, to: DVec3, printed: [&str; 3]) {
        let from = self.active().center;
        // The drags miss their places by three hundredths, and the grid corrects them.
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
                modifiers: DragModifiers::default(),
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

    /// Sets the number of particles by their density.
    fn fill(&mut self, n: u32) {
        let volume = document::volume(&self.active());
        self.edit(Edit::Density(f64::from(n) / volume));
        self.acts.n_densities += 1;
        assert_eq!(self.active().n_particles, n);
    }
}

fn rebuild_table(table: &str) -> Acts {
    let path = Path::new("scenes").join(table);
    let expected = box_file::read(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let mut rebuild = Rebuild { session: Session::default(), acts: Acts::default() };
    rebuild.act(Action::Set(Setting::Snap(GridSnap { is_on: true, step: 0.1 })));
    for line in text.lines().skip(2).filter(|line| !line.trim().is_empty()) {
        rebuild.make(&line.split(',').map(str::trim).collect::<Vec<_>>());
    }
    let folder = tempfile::tempdir().unwrap();
    let saved = save_before_quitting(&rebuild.session, folder.path().join("made.dat"));
    assert_eq!(box_file::read(saved.path().unwrap()).unwrap(), expected);
    assert_eq!(
        saved.editor().document().n_particles(),
        expected.iter().map(|b| u64::from(b.n_particles)).sum::<u64>()
    );
    // Every step can be undone.
    while rebuild.session.editor().history().n_undo() > 0 {
        rebuild.act(Action::Undo);
    }
    assert!(rebuild.session.editor().boxes().is_empty() && !rebuild.session.is_dirty());
    rebuild.acts
}

/// Quits, answers the question by saving, and gives a path.
fn save_before_quitting(session: &Session, path: PathBuf) -> Session {
    let after = |session: &Session, event: SessionEvent| session.after(&event).unwrap();
    let (session, request) = after(session, SessionEvent::Intend(Intent::Quit));
    assert_eq!(request, Some(Request::Ask(Intent::Quit)));
    let (session, request) = after(&session, SessionEvent::Answer(Answer::Save));
    assert_eq!(request, Some(Request::ChooseToSave));
    let (session, request) = after(&session, SessionEvent::ChosenToSave(Some(path)));
    let (session, request) = after(&session, perform(&request.unwrap()).unwrap());
    assert_eq!((session.is_dirty(), request), (false, Some(Request::Quit)));
    session
}

#[test]
fn the_cloud_of_554_particles_is_made_by_hand() {
    let acts = rebuild_table("cubes-554.dat");
    assert_eq!(
        (acts.n_added, acts.n_duplicated, acts.n_dragged, acts.n_densities),
        (1, 16, 34, 17),
        "{acts:?}"
    );
    // The table has eight boxes left of the middle.
    assert_eq!(acts.n_mirrored, 8, "{acts:?}");
    // Of 17 · 8 numbers these are typed: extents, radii and heights z that differ from the line
    // before, and places x and y with more than one decimal.
    assert_eq!(acts.n_typed, 49, "{acts:?}");
}

#[test]
fn the_cloud_of_615_particles_is_made_by_hand() {
    let acts = rebuild_table("cubes-615.dat");
    assert_eq!(
        (acts.n_added, acts.n_duplicated, acts.n_dragged, acts.n_densities),
        (1, 22, 46, 23),
        "{acts:?}"
    );
    assert_eq!((acts.n_mirrored, acts.n_typed), (8, 58), "{acts:?}");
}
