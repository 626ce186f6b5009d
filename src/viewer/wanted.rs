//! What somebody at the window wants: pure reducers on what hands do, and the keys that mean them.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::flight::{Flight, Motion};
use super::knobs::Knob;
use super::playback::{Action, Playback};
use crate::model::scene::Scene;

/// A picture to keep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keep {
    Png,
    Exr,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    Turn(Knob),
    /// Leaves out what a frame does not need, or does everything.
    Skip,
    /// The next way to show pictures that the window has.
    PresentMode,
    Play(Action),
    /// Doublings of the speed.
    Speed(f64),
    Keep(Keep),
    /// Shows panels, or hides them.
    Panels,
    /// What is odd of the next frame.
    Count,
    /// Keeps what is set as B, to be drawn beside what is set from then on; or forgets it.
    Hold,
    /// The next way to compare A with B.
    Compare,
    /// This way.
    Beside(Beside),
    /// Measures what is seen by its f64 reference, or does not.
    Judge,
    /// Writes a scene that draws what is seen.
    SaveView,
    /// Prints the command that draws what is seen.
    CommandLine,
    Help,
    Quit,
}

/// What is shown of A and B.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Beside {
    /// A left of this share of the picture, B right of it.
    Split(f64),
    /// How far they are apart, times this.
    Difference(f64),
    /// B alone.
    Other,
}

/// What is drawn as B.
#[derive(Debug, Clone)]
pub struct Other {
    pub scene: Arc<Scene>,
    pub skip: bool,
}

/// A key by its name (of letters and signs themselves), what it means, and what that is called.
pub const SHORTCUTS: [(&str, Command, &str); 27] = [
    (
        "t",
        Command::Turn(Knob::Threading),
        "game and render step one after the other, or side by side",
    ),
    ("c", Command::Turn(Knob::Simulate), "particles moved by the device, or by the game thread"),
    ("l", Command::Turn(Knob::Lighting), "no light, one reflection, two"),
    ("b", Command::Turn(Knob::Bases), "vectors of the basis"),
    ("g", Command::Turn(Knob::Gather), "second reflection from pairs, or from clusters"),
    ("o", Command::Turn(Knob::Theta), "clusters' opening angle"),
    ("p", Command::Turn(Knob::Path), "drawn by tiles in compute, or by sprites"),
    ("r", Command::Turn(Knob::Resolution), "resolution of the blobs' picture"),
    ("k", Command::Skip, "leave out what a frame does not need, or not"),
    ("v", Command::PresentMode, "when pictures are shown: fifo, mailbox, immediate"),
    ("space", Command::Play(Action::Toggle), "play or pause"),
    (".", Command::Play(Action::Step(1)), "a frame on"),
    (",", Command::Play(Action::Step(-1)), "a frame back"),
    ("home", Command::Play(Action::Seek(0)), "to the first frame"),
    ("+", Command::Speed(1.0), "fly twice as fast"),
    ("-", Command::Speed(-1.0), "fly half as fast"),
    ("f12", Command::Keep(Keep::Png), "keep the picture as PNG"),
    ("f11", Command::Keep(Keep::Exr), "keep the picture as EXR"),
    ("h", Command::Panels, "show panels, or hide them"),
    ("n", Command::Count, "count what is odd of a frame"),
    ("m", Command::Hold, "keep these settings as B to compare with, or forget them"),
    ("x", Command::Compare, "A and B split, their difference, B alone"),
    ("j", Command::Judge, "measure what is seen by its f64 reference, while it stands still"),
    ("f10", Command::SaveView, "save what is seen as a scene"),
    ("i", Command::CommandLine, "print and copy the command that draws this"),
    ("?", Command::Help, "print these keys"),
    ("escape", Command::Quit, "close the window"),
];

/// Keys that fly as long as they are held: along right, up, forward.
const FLYING: [(&str, DVec3); 6] = [
    ("w", DVec3::Z),
    ("s", DVec3::NEG_Z),
    ("d", DVec3::X),
    ("a", DVec3::NEG_X),
    ("e", DVec3::Y),
    ("q", DVec3::NEG_Y),
];

/// What `?` prints.
pub fn help() -> String {
    let keys =
        SHORTCUTS.iter().map(|(key, _, what)| format!("  {key:<7} {what}\n")).collect::<String>();
    format!(
        "keys:\n{keys}  w a s d q e  fly\nmouse: left button turns the eye, right button goes \
         around what is looked at, wheel nearer and farther\n"
    )
}

/// The state that hands change and frames are drawn by.
#[derive(Debug, Clone)]
pub struct Wanted {
    pub flight: Flight,
    pub playback: Playback,
    /// As it was turned; its film is what the window makes it.
    pub scene: Arc<Scene>,
    pub skip: bool,
    /// Changes where a frame cannot go on as it is: scene or skipping.
    pub version: u64,
    /// Changes with each wish for another way to show pictures.
    pub n_mode_turns: u32,
    /// Of the window, in pixels.
    pub size: [u32; 2],
    pub keep: Option<Keep>,
    pub panels: bool,
    /// The next frame is to be counted.
    pub counts: bool,
    pub other: Option<Other>,
    pub beside: Beside,
    pub judges: bool,
    /// The next frame's pictures are to be read back.
    pub reads: bool,
    /// Changes where shaders have: they are to be compiled anew.
    pub n_shader_loads: u64,
    pub quits: bool,
    held: BTreeSet<&'static str>,
}

/// What is to be said of a command.
#[derive(Debug, Clone, PartialEq)]
pub enum Said {
    Nothing,
    Text(String),
    /// The command line is asked for.
    CommandLine,
    /// A scene file of what is seen is.
    Scene,
}

/// A difference of a tenth of white becomes nearly white.
const GAIN: f64 = 8.0;
/// The eye turns by so much where the mouse goes across the window.
const TURN: f64 = std::f64::consts::FRAC_PI_2;

impl Wanted {
    /// At the scene's first frame, from its camera; None where that looks nowhere.
    pub fn new(scene: Arc<Scene>, skip: bool) -> Option<Wanted> {
        let camera = &scene.camera;
        let pose = camera.pose(scene.time.start_s)?;
        let flight = Flight::new(&pose, camera.up, camera.keys.first()?.target);
        Some(Wanted {
            flight,
            playback: Playback::new(scene.time.n_frames),
            size: [scene.film.width, scene.film.height],
            scene,
            skip,
            version: 0,
            n_mode_turns: 0,
            keep: None,
            panels: false,
            counts: false,
            other: None,
            beside: Beside::Split(0.5),
            judges: false,
            reads: false,
            n_shader_loads: 0,
            quits: false,
            held: BTreeSet::new(),
        })
    }

    /// Goes on with a scene that was read anew, from where the eye is; B was another scene's.
    pub fn reload(&mut self, scene: Arc<Scene>) {
        self.playback = self.playback.among(scene.time.n_frames);
        (self.scene, self.other) = (scene, None);
        self.version += 1;
    }

    /// A key went down; names as in [`SHORTCUTS`].
    pub fn press(&mut self, key: &str) -> Said {
        if let Some((name, _)) = FLYING.iter().find(|(name, _)| *name == key) {
            self.held.insert(name);
            return Said::Nothing;
        }
        match SHORTCUTS.iter().find(|(name, ..)| *name == key) {
            Some((_, command, _)) => self.act(*command),
            None => Said::Nothing,
        }
    }

    pub fn release(&mut self, key: &str) {
        self.held.retain(|held| *held != key);
    }

    /// Nobody knows which keys are down any more.
    pub fn release_all(&mut self) {
        self.held.clear();
    }

    pub fn act(&mut self, command: Command) -> Said {
        match command {
            Command::Turn(knob) => {
                let scene = Arc::make_mut(&mut self.scene);
                if let Err(why) = knob.turn(scene) {
                    return Said::Text(format!(
                        "{} stays {}: {why}",
                        knob.key(),
                        knob.value(scene)
                    ));
                }
                self.version += 1;
                return Said::Text(format!("{} = {}", knob.key(), knob.value(scene)));
            }
            Command::Skip => {
                self.skip = !self.skip;
                self.version += 1;
                return Said::Text(format!("skipping is {}", if self.skip { "on" } else { "off" }));
            }
            Command::PresentMode => self.n_mode_turns += 1,
            Command::Play(action) => self.playback = self.playback.after(action),
            Command::Speed(doublings) => {
                self.flight = self.flight.after(Motion::Speed { doublings })
            }
            Command::Keep(keep) => self.keep = Some(keep),
            Command::Panels => self.panels = !self.panels,
            Command::Count => self.counts = true,
            Command::Hold => {
                let held = Other { scene: self.scene.clone(), skip: self.skip };
                self.other = if self.other.is_none() { Some(held) } else { None };
                self.version += 1;
                let is_held = self.other.is_some();
                let text = if is_held {
                    "B is what is set now: what you turn is A"
                } else {
                    "there is no B any more"
                };
                return Said::Text(text.to_owned());
            }
            Command::Compare => {
                self.beside = match self.beside {
                    Beside::Split(_) => Beside::Difference(GAIN),
                    Beside::Difference(_) => Beside::Other,
                    Beside::Other => Beside::Split(0.5),
                };
            }
            Command::Beside(beside) => self.beside = beside,
            Command::Judge => self.judges = !self.judges,
            Command::SaveView => return Said::Scene,
            Command::CommandLine => return Said::CommandLine,
            Command::Help => return Said::Text(help()),
            Command::Quit => self.quits = true,
        }
        Said::Nothing
    }

    /// The mouse went so many pixels to the right and down with a button held.
    pub fn drag(&mut self, by: DVec2, orbits: bool) {
        let turn = by * TURN / f64::from(self.size[0].max(1));
        let motion = match orbits {
            true => Motion::Orbit { right: -turn.x, upward: turn.y },
            false => Motion::Look { right: turn.x, upward: -turn.y },
        };
        self.flight = self.flight.after(motion);
    }

    pub fn approach(&mut self, notches: f64) {
        self.flight = self.flight.after(Motion::Approach { notches });
    }

    /// Time goes on for keys that are held.
    pub fn fly(&mut self, seconds: f64) {
        let along: DVec3 = FLYING
            .iter()
            .filter(|(name, _)| self.held.contains(name))
            .map(|(_, along)| *along)
            .sum();
        if along != DVec3::ZERO {
            self.flight = self.flight.after(Motion::Fly { along, seconds });
        }
    }

    /// A picture to keep and whether pictures are to be read, of a frame of this version of what is
    /// wanted; neither is wished for any more then.
    pub fn take_wishes(&mut self, version: u64) -> (Option<Keep>, bool) {
        if self.version != version {
            return (None, false);
        }
        (self.keep.take(), std::mem::take(&mut self.reads))
    }

    /// The frame to draw now.
    pub fn next_frame(&mut self) -> u32 {
        let (i_frame, after) = self.playback.next();
        self.playback = after;
        i_frame
    }

    /// Keys of the scene and values, as `--set` has them, that make `first`, as it was opened, what
    /// is seen: what was turned, and where the eye is. The size is that of [`Wanted::size`].
    pub fn settings(&self, first: &Scene) -> Vec<(&'static str, String)> {
        let turned = Knob::ALL.iter().filter(|knob| knob.value(first) != knob.value(&self.scene));
        let mut settings: Vec<_> =
            turned.map(|knob| (knob.key(), knob.value(&self.scene))).collect();
        let place = |v: DVec3| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
        let (position, target) = (place(self.flight.position()), place(self.flight.target()));
        match first.camera.keys.len() {
            1 => settings.extend([("camera.position", position), ("camera.target", target)]),
            _ => {
                let path =
                    format!("[{{ time_s = 0.0, position = {position}, target = {target} }}]");
                settings.push(("camera.path", path));
            }
        }
        settings
    }

    /// Knobs that were turned since `first`, as `--set` has them.
    pub fn turned(&self, first: &Scene) -> Vec<String> {
        let turned = Knob::ALL.iter().filter(|knob| knob.value(first) != knob.value(&self.scene));
        turned.map(|knob| format!("{}={}", knob.key(), knob.value(&self.scene))).collect()
    }

    /// The same with the size, as `io::scene_view::save` takes them.
    pub fn overrides(&self, first: &Scene) -> Vec<String> {
        let [width, height] = self.size;
        let size = [("film.width", width.to_string()), ("film.height", height.to_string())];
        size.into_iter()
            .chain(self.settings(first))
            .map(|(key, value)| format!("{key}={value}"))
            .collect()
    }

    /// The command that draws what is seen, of the scene at `path`, from `first` as it was opened.
    pub fn command_line(&self, path: &str, first: &Scene) -> String {
        let set = |(key, value): (&str, String)| format!(" --set '{key}={value}'");
        let settings: String = self.settings(first).into_iter().map(set).collect();
        let no_skip = if self.skip { "" } else { " --no-skip" };
        let [width, height] = self.size;
        let i_frame = self.playback.i_frame();
        format!(
            "nimbus render {path} -o view.png --frame {i_frame} --size \
             {width}x{height}{no_skip}{settings}"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::scene_file;

    fn wanted() -> Wanted {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
        Wanted::new(Arc::new(scene_file::load(&path, &[], None).unwrap().scene), true).unwrap()
    }

    #[test]
    fn keys_mean_one_thing_each() {
        let names: Vec<&str> =
            SHORTCUTS.iter().map(|s| s.0).chain(FLYING.iter().map(|f| f.0)).collect();
        assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), names.len());
        assert!(
            SHORTCUTS.iter().all(|(key, _, what)| help().contains(key) && help().contains(what))
        );
        let mut w = wanted();
        assert_eq!(w.press("t"), Said::Text("threads.mode = \"serial\"".to_owned()));
        assert_eq!((w.press("k"), w.version), (Said::Text("skipping is off".to_owned()), 2));
        assert_eq!((w.press("nothing"), w.press("i")), (Said::Nothing, Said::CommandLine));
        w.press("f12");
        w.press("escape");
        assert!(w.keep == Some(Keep::Png) && w.quits);
    }

    #[test]
    fn keys_that_are_held_fly_until_they_are_let_go() {
        let mut w = wanted();
        let from = w.flight.position();
        w.fly(1.0);
        assert_eq!(w.flight.position(), from);
        w.press("w");
        w.press("w");
        w.fly(0.5);
        let ahead = w.flight.position() - from;
        assert!((ahead.length() - 0.5 * w.flight.speed()).abs() < 1e-9 * w.flight.speed());
        assert!(ahead.normalize().dot(w.flight.pose().forward) > 1.0 - 1e-12);
        w.release("w");
        w.fly(1.0);
        assert_eq!(w.flight.position() - from, ahead);
        // ReferenceKind each other they stand still.
        w.press("a");
        w.press("d");
        w.fly(1.0);
        assert_eq!(w.flight.position() - from, ahead);
        w.release_all();
        w.drag(DVec2::new(100.0, 0.0), false);
        assert!(w.flight.pose().forward.dot(ahead.normalize()) < 0.999);
    }

    /// What is printed draws what is seen: read back as a scene it has the same camera and knobs.
    #[test]
    fn the_command_line_says_it_all() {
        let mut w = wanted();
        let first = w.scene.clone();
        for key in ["l", "b", "r", "k", ".", "."] {
            w.press(key);
        }
        w.drag(DVec2::new(31.0, -17.0), true);
        let line = w.command_line("scenes/hello.toml", &first);
        assert!(
            line.starts_with("nimbus render scenes/hello.toml -o view.png --frame 2 --size "),
            "{line}"
        );
        assert!(line.contains(" --no-skip"));
        let set: Vec<String> = line
            .split(" --set '")
            .skip(1)
            .map(|part| part.split('\'').next().unwrap().to_owned())
            .collect();
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
        let read = scene_file::load(&path, &set, None).unwrap().scene;
        for knob in Knob::ALL {
            assert_eq!(knob.value(&read), knob.value(&w.scene));
        }
        let key = read.camera.keys[0];
        assert!(key.position == w.flight.position() && key.target == w.flight.target(), "{line}");
    }
}
