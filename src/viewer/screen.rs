//! The thread that draws what a window shows: the loops that bench times, each frame's picture
//! shown as it ends.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::flight::Flight;
use super::pane::{Pane, Showing};
use super::second::{Cast, Poses, Second, compare_of};
use super::seen::{OF_DRAWING, SharedSeen, lock as lock_seen};
use super::wanted::{Keep, Other, Wanted};
use super::widgets::SharedFace;
use crate::error::{Error, Result};
use crate::frame::counts::Counts;
use crate::frame::game::Game;
use crate::frame::render::Renderer;
use crate::frame::stage::{DeviceChoice, Player};
use crate::frame::{FrameTimes, parallel, serial};
use crate::gpu::{Compiler, Instance, PresentMode, Surface};
use crate::measure::stats::Summary;
use crate::model::film::Film;
use crate::model::scene::{Scene, Threading};

/// What hands want, and the thread that draws.
pub type Shared = Arc<Mutex<Wanted>>;

/// Nobody panics while it is held; if somebody did, what is in it is whole all the same.
pub fn lock(wanted: &Shared) -> MutexGuard<'_, Wanted> {
    wanted.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What the thread tells the window.
#[derive(Debug)]
pub enum Told {
    /// For the window's title.
    Status(String),
    /// For whoever reads.
    Said(String),
    /// A picture to keep: premultiplied linear RGBA.
    Picture {
        keep: Keep,
        film: Film,
        rgba: Vec<f32>,
    },
    Read(Read),
    /// Something went wrong, which [`super::seen::Seen::wrong`] says.
    Wrong,
    Ended,
}

/// A frame's pictures, A's and B's, as [`Wanted::reads`] asked for.
#[derive(Debug)]
pub struct Read {
    /// Of what was wanted ([`Wanted::version`]).
    pub version: u64,
    pub flight: Flight,
    pub i_frame: u32,
    pub film: Film,
    pub pictures: [Option<Vec<f32>>; 2],
}

/// What is told where nobody listens any more is lost.
pub type Tell = Box<dyn Fn(Told) + Send>;

/// Frame times of one loop, ms.
#[derive(Debug, Clone, Copy)]
pub struct LoopTimes {
    pub threading: Threading,
    /// Panels were shown beside the picture.
    pub has_panels: bool,
    pub frame_ms: Summary,
}

/// What the window and the thread that draws it have in common.
pub struct Ties {
    pub wanted: Shared,
    pub seen: SharedSeen,
    pub face: SharedFace,
    pub tell: Tell,
    /// Whoever sets it ends the thread.
    pub stop: &'static AtomicBool,
}

pub struct Screen {
    pane: Pane,
    choice: DeviceChoice,
    n_shader_loads: u64,
    /// What was wanted when something could not be drawn: version and shaders.
    wrong_at: Option<(u64, u64)>,
    ties: Ties,
    n_mode_turns: u32,
    /// Frames to show; all that come without.
    n_left: Option<u32>,
    /// Frame times by loop, serial first, and by whether panels were shown, without those of frames
    /// after something was made anew.
    times: [[Vec<f64>; 2]; 2],
}

/// The frames after something was made are not counted among the times: as many as a bench leaves
/// out unless told otherwise.
const N_WARM_UP: u32 = 10;
/// So often the title says how long frames take.
const STATUS: Duration = Duration::from_millis(500);
/// And so long nothing is tried where nothing of the window is seen.
const UNSEEN: Duration = Duration::from_millis(50);

impl Screen {
    /// On a window's `surface`; `mode` where there is such, else fifo.
    pub fn new(
        surface: (Arc<Instance>, Surface),
        choice: &DeviceChoice,
        mode: PresentMode,
        n_frames: Option<u32>,
        ties: Ties,
    ) -> Result<Screen> {
        let pane = Pane::open(surface, choice, mode)?;
        if pane.mode() != mode {
            let (mode, found) = (mode.name(), pane.mode().name());
            (ties.tell)(Told::Said(format!("this window has no {mode}: {found} in its place")));
        }
        lock_seen(&ties.seen).device = pane.bed.device.info().name.clone();
        Ok(Screen {
            pane,
            choice: choice.clone(),
            n_shader_loads: 0,
            wrong_at: None,
            ties,
            n_mode_turns: 0,
            n_left: n_frames,
            times: Default::default(),
        })
    }

    /// Draws until somebody wants no more; the times of each loop that ran.
    pub fn run(mut self) -> Result<Vec<LoopTimes>> {
        let mut good: Option<(Arc<Scene>, Option<Other>)> = None;
        while !self.is_over() {
            let seen = lock(&self.ties.wanted).clone();
            if !self.remake(&seen)? {
                std::thread::sleep(UNSEEN);
                continue;
            }
            let before = self.follow_shaders(&seen);
            match self.make(&seen) {
                Ok(Some(cast)) => {
                    // What was wrong is right only where something else is wanted since.
                    if self.wrong_at.is_some_and(|at| at != (seen.version, seen.n_shader_loads)) {
                        self.wrong_at = None;
                        lock_seen(&self.ties.seen).wrong[OF_DRAWING] = None;
                    }
                    good = Some((seen.scene.clone(), seen.other.clone()));
                    self.play(cast, &seen)?;
                }
                Ok(None) => {}
                // What does not fit, or does not compile, turns back to what did.
                Err(error @ (Error::Limit { .. } | Error::Shader { .. })) => {
                    self.turn_back(error, before.ok().flatten(), good.as_ref(), &seen)?;
                }
                Err(error) => return Err(error),
            }
        }
        let Screen { pane, times, .. } = self;
        pane.close()?;
        let mut loops = vec![];
        for (threading, by_panels) in
            [Threading::Serial, Threading::Parallel].into_iter().zip(&times)
        {
            for (has_panels, ms) in [false, true].into_iter().zip(by_panels) {
                loops.extend(Summary::of(ms).map(|frame_ms| LoopTimes {
                    threading,
                    has_panels,
                    frame_ms,
                }));
            }
        }
        Ok(loops)
    }

    /// Takes the shaders as they are now, where they have changed: the compiler of those before; an
    /// error where they cannot be read, which is shown, and those before stay.
    fn follow_shaders(&mut self, seen: &Wanted) -> std::result::Result<Option<Compiler>, ()> {
        if std::mem::replace(&mut self.n_shader_loads, seen.n_shader_loads) == seen.n_shader_loads {
            return Ok(None);
        }
        let taken = self.choice.sources().and_then(|sources| self.pane.bed.set_sources(sources));
        taken.map(Some).map_err(|error| self.show_wrong(&error, seen))
    }

    fn show_wrong(&mut self, error: &Error, seen: &Wanted) {
        self.wrong_at = Some((seen.version, seen.n_shader_loads));
        let text = format!("{}; back to what was", error.to_string().trim_end());
        lock_seen(&self.ties.seen).wrong[OF_DRAWING] = Some(text.clone());
        (self.ties.tell)(Told::Wrong);
        (self.ties.tell)(Told::Said(text));
    }

    /// Back to the shaders of `before`, or to the scene that was good; the error where there is
    /// nothing to go back to.
    fn turn_back(
        &mut self,
        error: Error,
        before: Option<Compiler>,
        good: Option<&(Arc<Scene>, Option<Other>)>,
        seen: &Wanted,
    ) -> Result<()> {
        match (before, good) {
            (Some(compiler), _) => self.pane.bed.set_compiler(compiler),
            (None, Some((scene, other)))
                if *scene != seen.scene || other.is_none() && seen.other.is_some() =>
            {
                let mut wanted = lock(&self.ties.wanted);
                // Somebody may have turned on meanwhile.
                if wanted.version == seen.version {
                    (wanted.scene, wanted.other) = (scene.clone(), other.clone());
                }
            }
            _ => return Err(error),
        }
        self.show_wrong(&error, seen);
        Ok(())
    }

    /// All that draws what is wanted; none where nothing of the window is seen.
    fn make(&mut self, seen: &Wanted) -> Result<Option<Cast>> {
        let film_of = |scene: &Arc<Scene>| self.scene_of(scene);
        let bed = &self.pane.bed;
        let player = bed.player(film_of(&seen.scene), seen.skip)?;
        let other = seen
            .other
            .as_ref()
            .map(|other| bed.player(film_of(&other.scene), other.skip))
            .transpose()?;
        let showing = self.pane.showing(&player.renderer, &player.scene.film)?;
        Ok(showing.map(|showing| Cast { showing, player, other: other.map(Second::new) }))
    }

    fn is_over(&self) -> bool {
        lock(&self.ties.wanted).quits
            || self.ties.stop.load(Ordering::Relaxed)
            || self.n_left == Some(0)
    }

    /// `scene` with the window's film.
    fn scene_of(&self, scene: &Arc<Scene>) -> Arc<Scene> {
        let mut scene = scene.clone();
        if let Some([width, height]) = self.pane.size() {
            let film = scene.film;
            Arc::make_mut(&mut scene).film = Film { width, height, ..film };
        }
        scene
    }

    /// Makes what pictures are shown by, as it is wanted; false where nothing of the window is
    /// seen.
    fn remake(&mut self, seen: &Wanted) -> Result<bool> {
        let (size, n_mode_turns) = (seen.size, seen.n_mode_turns);
        let turns = n_mode_turns
            .wrapping_sub(std::mem::replace(&mut self.n_mode_turns, n_mode_turns))
            as usize;
        self.pane.turn_mode(turns);
        if turns > 0 {
            (self.ties.tell)(Told::Said(format!(
                "pictures are shown by {}",
                self.pane.mode().name()
            )));
        }
        lock_seen(&self.ties.seen).present = Some(self.pane.mode());
        self.pane.remake(size)
    }

    /// Runs the loop that is wanted until something is wanted that takes another beginning.
    fn play(&mut self, cast: Cast, seen: &Wanted) -> Result<()> {
        let Cast { showing, player, mut other } = cast;
        let Player { mut renderer, game, scene, choices, impostor_choice } = player;
        let said = choices.iter().map(|c| c.text()).chain(impostor_choice.map(|c| c.text()));
        said.for_each(|text| (self.ties.tell)(Told::Said(text)));
        let (wanted, poses) = (self.ties.wanted.clone(), Poses::default());
        let kept = poses.clone();
        let mut game = game.seen_from(Box::new(move || kept.push(lock(&wanted).flight)));
        let drawn = (&mut game, &mut renderer, &*scene);
        let ended = self.run_loops(drawn, other.as_mut(), &showing, &poses, seen);
        self.pane.finish();
        lock_seen(&self.ties.seen).other_ms = None;
        ended
    }

    fn run_loops(
        &mut self,
        (game, renderer, scene): (&mut Game, &mut Renderer, &Scene),
        mut other: Option<&mut Second>,
        showing: &Showing,
        poses: &Poses,
        seen: &Wanted,
    ) -> Result<()> {
        let threading = scene.threads.mode;
        let mut n_warm_up = N_WARM_UP;
        let mut status = Status { since: Instant::now(), frame_ms: vec![] };
        loop {
            poses.clear();
            if std::mem::take(&mut lock(&self.ties.wanted).counts) {
                self.count(game, renderer, scene)?;
                poses.clear();
            }
            let frames = Frames { wanted: self.ties.wanted.clone(), last: Instant::now() };
            let mut on_frame = |times: FrameTimes, renderer: &mut Renderer| -> Result<bool> {
                let flight = poses.pop();
                let now = lock(&self.ties.wanted).clone();
                if let (Some(other), Some(flight)) = (&mut other, &flight) {
                    let ms = other.step(times.i_frame, flight)?;
                    lock_seen(&self.ties.seen).other_ms = Some(ms);
                }
                let second = other.as_mut().map(|other| &mut other.player.renderer);
                let compare = second.as_ref().map(|_| compare_of(now.beside, scene.film.width));
                let is_shown = self.pane.show(
                    showing,
                    [Some(&mut *renderer), second],
                    compare,
                    &self.ties.face,
                )?;
                // One after the other: no game step runs beside it, or this loop would be a little
                // parallel.
                if threading == Threading::Serial {
                    self.pane.wait()?;
                }
                match (n_warm_up, &other) {
                    (0, None) => {
                        self.times[threading as usize][usize::from(now.panels)].push(times.frame_ms)
                    }
                    // Two pictures are no scene's frame time.
                    (0, Some(_)) => {}
                    _ => n_warm_up -= 1,
                }
                if now.panels {
                    lock_seen(&self.ties.seen).push(threading, &times, scene.n_particles());
                }
                self.n_left = self.n_left.map(|n| n - u32::from(n > 0));
                if let Some(text) = status.after(scene, &times) {
                    (self.ties.tell)(Told::Status(text));
                }
                // Nothing is held while pictures are read back.
                let (keep, reads) = lock(&self.ties.wanted).take_wishes(seen.version);
                if let Some(keep) = keep {
                    let rgba = renderer.image()?;
                    (self.ties.tell)(Told::Picture { keep, film: scene.film, rgba });
                }
                if let (true, Some(flight)) = (reads, flight) {
                    let second =
                        other.as_mut().map(|other| other.player.renderer.image()).transpose()?;
                    let (film, pictures) = (scene.film, [Some(renderer.image()?), second]);
                    let version = seen.version;
                    (self.ties.tell)(Told::Read(Read {
                        version,
                        flight,
                        i_frame: times.i_frame,
                        film,
                        pictures,
                    }));
                }
                Ok(is_shown
                    && goes_on(&now, seen)
                    && !self.ties.stop.load(Ordering::Relaxed)
                    && self.n_left != Some(0))
            };
            match threading {
                Threading::Serial => serial::run(game, renderer, frames, &mut on_frame)?,
                Threading::Parallel => parallel::run(game, renderer, frames, &mut on_frame)?,
            }
            if !lock(&self.ties.wanted).counts {
                return Ok(());
            }
        }
    }

    /// Draws a frame alone and counts what is odd of it.
    fn count(&self, game: &mut Game, renderer: &mut Renderer, scene: &Scene) -> Result<()> {
        let i_frame = lock(&self.ties.wanted).playback.i_frame();
        renderer.step(game.step(i_frame)?)?;
        let counts = Counts::of(renderer, &self.pane.bed.device, scene)?;
        (self.ties.tell)(Told::Said(format!("frame {i_frame}: {}", counts.text())));
        lock_seen(&self.ties.seen).counts = Some((i_frame, counts));
        Ok(())
    }
}

/// Whether the loop that began with `seen` can go on.
fn goes_on(now: &Wanted, seen: &Wanted) -> bool {
    let begun = |w: &Wanted| (w.version, w.n_shader_loads, w.size, w.n_mode_turns);
    begun(now) == begun(seen) && !now.quits && !now.counts
}

/// Frames as somebody wants them, one after the other; keys that are held fly on at each.
struct Frames {
    wanted: Shared,
    last: Instant,
}

/// However long a frame took, nobody flies farther at once than in this time, s.
const LONGEST_STEP_S: f64 = 0.25;

impl Iterator for Frames {
    type Item = u32;

    fn next(&mut self) -> Option<u32> {
        let seconds = self.last.elapsed().as_secs_f64().min(LONGEST_STEP_S);
        self.last = Instant::now();
        let mut wanted = lock(&self.wanted);
        wanted.fly(seconds);
        Some(wanted.next_frame())
    }
}

/// How long frames take, for the title.
struct Status {
    since: Instant,
    frame_ms: Vec<f64>,
}

impl Status {
    /// With one more frame; the title where it is time for another.
    fn after(&mut self, scene: &Scene, last: &FrameTimes) -> Option<String> {
        self.frame_ms.push(last.frame_ms);
        if self.since.elapsed() < STATUS {
            return None;
        }
        self.since = Instant::now();
        let title = if scene.title.is_empty() { "nimbus" } else { &scene.title };
        let name = scene.threads.mode.name();
        let summary = Summary::of(&std::mem::take(&mut self.frame_ms));
        let times = summary.map_or(String::new(), |s| {
            format!(" | {:.1} ms p50, {:.1} p99 of {}", s.p50, s.p99, s.n)
        });
        Some(format!(
            "{title} | {name}{times} | frame {} | {} particles | ? for keys",
            last.i_frame,
            last.n_shown()
        ))
    }
}
