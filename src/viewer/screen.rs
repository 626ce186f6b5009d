//! The thread that draws what a window shows: the loops that bench times, each frame's picture shown as it ends.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::wanted::{Keep, Wanted};
use crate::error::{Error, Result};
use crate::frame::render::Renderer;
use crate::frame::stage::{Bed, DeviceChoice, Player};
use crate::frame::{FrameTimes, parallel, serial};
use crate::gpu::memory::TargetFormat;
use crate::gpu::{Buffer, Instance, Place, PresentMode, Shown, Surface, Swapchain};
use crate::measure::stats::Summary;
use crate::model::film::{Film, ToneMap};
use crate::model::scene::{Scene, Threading};
use crate::passes::present::{self, Present};

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
    Ended,
}

/// What is told where nobody listens any more is lost.
pub type Tell = Box<dyn Fn(Told) + Send>;

/// Frame times of one loop, ms.
#[derive(Debug, Clone, Copy)]
pub struct LoopTimes {
    pub threading: Threading,
    pub frame_ms: Summary,
}

pub struct Screen {
    // Dropped in this order: what lies on the device before the device, that before the surface.
    swapchain: Option<Swapchain>,
    bed: Bed,
    surface: Surface,
    wanted: Shared,
    tell: Tell,
    stop: &'static AtomicBool,
    modes: Vec<PresentMode>,
    i_mode: usize,
    n_mode_turns: u32,
    /// Frames to show; all that come without.
    n_left: Option<u32>,
    /// Frame times by loop, serial first, without those of frames after something was made anew.
    times: [Vec<f64>; 2],
}

/// The frames after something was made are not counted among the times.
const N_WARM_UP: u32 = 3;
/// So often the title says how long frames take.
const STATUS: Duration = Duration::from_millis(500);
/// And so long nothing is tried where nothing of the window is seen.
const UNSEEN: Duration = Duration::from_millis(50);

impl Screen {
    /// On a window's `surface`; `mode` where there is such, else fifo.
    pub fn new(
        (instance, surface): (Arc<Instance>, Surface),
        choice: &DeviceChoice,
        mode: PresentMode,
        n_frames: Option<u32>,
        (wanted, tell, stop): (Shared, Tell, &'static AtomicBool),
    ) -> Result<Screen> {
        let bed = Bed::of_instance(instance, choice, choice.sources()?)?;
        surface.check(&bed.device)?;
        let modes = surface.modes(&bed.device)?;
        let i_mode = modes.iter().position(|m| *m == mode).unwrap_or_else(|| {
            tell(Told::Said(format!("this window has no {}: {} in its place", mode.name(), PresentMode::Fifo.name())));
            0
        });
        Ok(Screen {
            swapchain: None,
            bed,
            surface,
            wanted,
            tell,
            stop,
            modes,
            i_mode,
            n_mode_turns: 0,
            n_left: n_frames,
            times: [vec![], vec![]],
        })
    }

    /// Draws until somebody wants no more; the times of each loop that ran.
    pub fn run(mut self) -> Result<Vec<LoopTimes>> {
        let mut last_good: Option<Arc<Scene>> = None;
        while !self.is_over() {
            if !self.make_swapchain()? {
                std::thread::sleep(UNSEEN);
                continue;
            }
            let seen = lock(&self.wanted).clone();
            let scene = self.scene_of(&seen);
            match self.bed.player(scene, seen.skip) {
                Ok(player) => {
                    last_good = Some(seen.scene.clone());
                    self.play(player, &seen)?;
                }
                // What does not fit turns back to what did.
                Err(error @ Error::Limit { .. }) => match &last_good {
                    Some(good) if *good != seen.scene => {
                        (self.tell)(Told::Said(format!("{error}; back to what was")));
                        lock(&self.wanted).scene = good.clone();
                    }
                    _ => return Err(error),
                },
                Err(error) => return Err(error),
            }
        }
        let Screen { swapchain, bed, surface, times, .. } = self;
        drop(swapchain);
        // The device goes before the surface, the instance after both.
        let closed = bed.close();
        drop(surface);
        closed?;
        let of =
            |(threading, ms): (Threading, &Vec<f64>)| Summary::of(ms).map(|frame_ms| LoopTimes { threading, frame_ms });
        Ok([Threading::Serial, Threading::Parallel].into_iter().zip(&times).filter_map(of).collect())
    }

    fn is_over(&self) -> bool {
        lock(&self.wanted).quits || self.stop.load(Ordering::Relaxed) || self.n_left == Some(0)
    }

    /// `seen`'s scene with the window's film.
    fn scene_of(&self, seen: &Wanted) -> Arc<Scene> {
        let mut scene = seen.scene.clone();
        if let Some([width, height]) = self.swapchain.as_ref().map(Swapchain::size) {
            let film = scene.film;
            Arc::make_mut(&mut scene).film = Film { width, height, ..film };
        }
        scene
    }

    /// Makes what pictures are shown by, where it is not as it is wanted; false where nothing of the window is seen.
    fn make_swapchain(&mut self) -> Result<bool> {
        let (size, n_mode_turns) = {
            let wanted = lock(&self.wanted);
            (wanted.size, wanted.n_mode_turns)
        };
        let turns = n_mode_turns.wrapping_sub(std::mem::replace(&mut self.n_mode_turns, n_mode_turns)) as usize;
        self.i_mode = (self.i_mode + turns) % self.modes.len().max(1);
        let mode = self.modes.get(self.i_mode).copied().unwrap_or(PresentMode::Fifo);
        if turns > 0 {
            (self.tell)(Told::Said(format!("pictures are shown by {}", mode.name())));
        }
        // A surface has one at a time.
        self.swapchain = None;
        self.swapchain = Swapchain::new(&self.bed.device, &self.surface, size, mode)?;
        Ok(self.swapchain.is_some())
    }

    /// Runs the loop that is wanted until something is wanted that takes another beginning.
    fn play(&mut self, player: Player, seen: &Wanted) -> Result<()> {
        let Player { mut renderer, game, scene, choices, impostor_choice } = player;
        let said = choices.iter().map(|c| c.text()).chain(impostor_choice.map(|c| c.text()));
        said.for_each(|text| (self.tell)(Told::Said(text)));
        let wanted = self.wanted.clone();
        let mut game = game.seen_from(Box::new(move || lock(&wanted).flight.pose()));
        let mut shown = Showing::new(&self.bed, self.swapchain.take(), &renderer, &scene)?;
        let frames = Frames { wanted: self.wanted.clone(), last: Instant::now() };
        let threading = scene.threads.mode;
        let mut n_warm_up = N_WARM_UP;
        let mut last_status = (Instant::now(), self.times[threading as usize].len());
        let mut on_frame = |times: FrameTimes, renderer: &mut Renderer| -> Result<bool> {
            let is_shown = shown.show(renderer)?;
            match n_warm_up {
                0 => self.times[threading as usize].push(times.frame_ms),
                _ => n_warm_up -= 1,
            }
            self.n_left = self.n_left.map(|n| n - u32::from(n > 0));
            if last_status.0.elapsed() >= STATUS {
                let new = &self.times[threading as usize][last_status.1..];
                let text = status(&scene, threading, new, &times);
                last_status = (Instant::now(), self.times[threading as usize].len());
                (self.tell)(Told::Status(text));
            }
            if let Some(keep) = lock(&self.wanted).keep.take() {
                let rgba = renderer.image()?;
                (self.tell)(Told::Picture { keep, film: scene.film, rgba });
            }
            let now = lock(&self.wanted);
            let goes_on = now.version == seen.version
                && now.size == seen.size
                && now.n_mode_turns == seen.n_mode_turns
                && !now.quits;
            drop(now);
            Ok(is_shown && goes_on && !self.stop.load(Ordering::Relaxed) && self.n_left != Some(0))
        };
        match threading {
            Threading::Serial => serial::run(&mut game, &mut renderer, frames, &mut on_frame),
            Threading::Parallel => parallel::run(&mut game, &mut renderer, frames, &mut on_frame),
        }
    }
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

/// What takes a renderer's pictures to the window.
struct Showing {
    swapchain: Option<Swapchain>,
    present: Option<Present>,
    picture: Buffer,
    shown: present::Shown,
}

impl Showing {
    fn new(bed: &Bed, swapchain: Option<Swapchain>, renderer: &Renderer, scene: &Scene) -> Result<Showing> {
        let (format, n_bytes): (TargetFormat, u64) = renderer.picture_format();
        let Film { width, height, background, exposure, tone_map, .. } = scene.film;
        let present = |chain: &Swapchain| Present::new(&bed.device, bed.compiler(), format, chain.format());
        Ok(Showing {
            present: swapchain.as_ref().map(present).transpose()?,
            swapchain,
            picture: Buffer::new::<u8>(&bed.device, "window.picture", n_bytes, Place::Device)?,
            shown: present::Shown {
                background: background.as_vec3().to_array(),
                exposure: exposure as f32,
                size: [width, height],
                corner: [0, 0],
                is_neutral: tone_map == ToneMap::Neutral,
            },
        })
    }

    /// Shows the picture of the frame that ended last; false where the window is another by now.
    fn show(&mut self, renderer: &mut Renderer) -> Result<bool> {
        let (Some(swapchain), Some(present)) = (&mut self.swapchain, &self.present) else { return Ok(false) };
        let shown = swapchain.show(|rec, image| {
            renderer.record_picture(rec, &self.picture);
            present.record(rec, &self.picture, image, &self.shown)
        })?;
        Ok(shown != Shown::Outdated)
    }
}

/// How long frames take, for the title.
fn status(scene: &Scene, threading: Threading, ms: &[f64], last: &FrameTimes) -> String {
    let title = if scene.title.is_empty() { "nimbus" } else { &scene.title };
    let name = threading.name();
    let times =
        Summary::of(ms).map_or(String::new(), |s| format!(" | {:.1} ms p50, {:.1} p99 of {}", s.p50, s.p99, s.n));
    format!("{title} | {name}{times} | frame {} | {} particles | ? for keys", last.i_frame, last.n_shown())
}
