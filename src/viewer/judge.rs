//! How far what is seen is from the truth: the f64 reference of a view, computed on a thread of its
//! own, and the errors of pictures of it. A view is judged at a few hundred pixels first and at as
//! many as the time allows then; both are kept between runs (`study::kept`), so that a view that
//! was judged once is judged at once.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use glam::DVec3;
use rayon::ThreadPool;

use crate::error::{Error, Result};
use crate::io::image::display_bytes;
use crate::measure::picture::flip;
use crate::model::camera::{Camera, CameraKey};
use crate::model::film::Film;
use crate::model::scene::Scene;
use crate::reference::picture::{Pixels, Reference, ReferenceKind, RenderStage};
use crate::studies::error::errors::picture_error;
use crate::studies::error::records::PictureError;
use crate::studies::reference_cache;

/// What is seen, and what it is measured by.
#[derive(Debug, Clone)]
pub struct View {
    pub scene: Arc<Scene>,
    /// In place of the scene's camera.
    pub position: DVec3,
    pub target: DVec3,
    pub time_s: f64,
    /// Of the picture: columns and rows.
    pub size: [u32; 2],
    pub against: ReferenceKind,
}

impl View {
    /// What `scene` can be measured by: the integral over its blobs, or, where they are textured,
    /// thin sprites.
    pub fn against(scene: &Scene) -> ReferenceKind {
        if scene.clouds.iter().any(|c| !c.texture.is_none()) {
            ReferenceKind::Thin
        } else {
            ReferenceKind::Volume
        }
    }

    /// The scene with exactly this camera and film.
    pub fn exact(&self) -> Scene {
        let [width, height] = self.size;
        let key = CameraKey { time_s: 0.0, position: self.position, target: self.target };
        let camera = Camera { keys: vec![key], ..self.scene.camera };
        Scene { camera, film: Film { width, height, ..self.scene.film }, ..(*self.scene).clone() }
    }

    /// Whether one reference is right for both: what leaves things out, and how frames are run, may
    /// differ.
    fn is_as(&self, other: &View) -> bool {
        let same =
            |a: DVec3, b: DVec3| a.to_array().map(f64::to_bits) == b.to_array().map(f64::to_bits);
        self.against == other.against
            && self.time_s.to_bits() == other.time_s.to_bits()
            && self.size == other.size
            && same(self.position, other.position)
            && same(self.target, other.target)
            && (Arc::ptr_eq(&self.scene, &other.scene)
                || reference_cache::is_same(self.against, &self.exact(), &other.exact()))
    }
}

/// The truth of a view, by which pictures of it are judged.
#[derive(Debug)]
pub struct Known {
    pub view: View,
    pub pixels: Pixels,
    pub reference: Reference,
    /// Whether it was there already.
    pub from_cache: bool,
}

impl Known {
    /// How far a picture is off at the pixels of the reference: premultiplied linear RGBA, rows
    /// from the top, of the whole picture. None where it has another size, or some value is no
    /// finite number.
    pub fn error(&self, rgba: &[f32]) -> Option<PictureError> {
        let [width, height] = self.view.size.map(|n| n as usize);
        if rgba.len() != 4 * width * height {
            return None;
        }
        let pixel = |at: &[u32; 2]| {
            let i = 4 * self.pixels.index(*at);
            [0, 1, 2, 3].map(|k| f64::from(rgba[i + k]))
        };
        let picture: Vec<[f64; 4]> = self.pixels.at.iter().map(pixel).collect();
        picture_error(&self.pixels, &picture, &self.reference.rgba, self.reference.own_error)
    }

    /// FLIP's mean, of the two as the film shows them. It looks at what is around each pixel, so
    /// there is none where not all are known. Some tenths of a second of 800 by 600.
    pub fn flip(&self, rgba: &[f32]) -> Option<f64> {
        let [width, height] = self.view.size;
        if self.pixels.cell > 1 || rgba.len() != 4 * self.pixels.at.len() {
            return None;
        }
        let film = &self.view.scene.film;
        let truth: Vec<f32> = self.reference.rgba.iter().flatten().map(|v| *v as f32).collect();
        let [a, b] = [&truth[..], rgba].map(|picture| display_bytes(film, width, height, picture));
        Some(flip::flip(width, height, &a, &b, flip::PIXELS_PER_DEGREE).mean())
    }
}

/// How far the reference under way is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    pub work: RenderStage,
    /// Parts of that, facets or rows.
    pub n_done: usize,
    pub n: usize,
    /// At which it will be known.
    pub n_pixels: usize,
}

/// Where the judging of the view last asked for stands.
#[derive(Debug, Clone, Default)]
pub struct Standing {
    /// The best truth there is of it so far.
    pub known: Option<Arc<Known>>,
    /// None before there is something to count, and when all is known that will be.
    pub progress: Option<Progress>,
    /// Whether a better truth is to come.
    pub works: bool,
    /// Why there is none.
    pub failed: Option<String>,
}

/// Computes references of views, one at a time.
pub struct Judge {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    desk: Mutex<Desk>,
    /// There is a view to begin, or nothing to wait for any more.
    wake: Condvar,
    /// Changes with what is wanted: whoever works on what was wanted before stops.
    wish: AtomicU64,
}

#[derive(Default)]
struct Desk {
    /// Not begun yet.
    next: Option<View>,
    /// Begun, and all that is said is of it.
    current: Option<View>,
    standing: Standing,
    quits: bool,
}

/// Of the picture, before anybody knows how long a pixel takes.
const N_FIRST: usize = 256;

impl Judge {
    /// Keeps references in `folder` (`study::kept::default_folder`), if there is one. Of one view
    /// they take about `budget` in all, as far as its light alone does not take longer.
    pub fn new(folder: Option<PathBuf>, budget: Duration) -> Result<Judge> {
        let fail = |e: String| Error::Fault { what: format!("no thread for references: {e}") };
        // The window is to go on meanwhile.
        let n_threads = std::thread::available_parallelism().map_or(1, |n| (n.get() / 2).max(1));
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .thread_name(|i| format!("judge-{i}"));
        let pool = pool.build().map_err(|e| fail(e.to_string()))?;
        let shared = Arc::new(Shared {
            desk: Mutex::default(),
            wake: Condvar::new(),
            wish: AtomicU64::new(0),
        });
        let worker = Worker { shared: shared.clone(), pool, folder, budget };
        let thread = std::thread::Builder::new().name("judge".into()).spawn(move || worker.run());
        Ok(Judge { shared, thread: Some(thread.map_err(|e| fail(e.to_string()))?) })
    }

    /// Wants `view` judged, and nothing else any more; what is under way for another is stopped,
    /// for the same it goes on. To be asked where the eye stands still.
    pub fn ask(&self, view: View) {
        let mut desk = self.shared.lock();
        let Desk { next, current, .. } = &mut *desk;
        if let Some(asked) = next.as_mut().or(current.as_mut())
            && asked.is_as(&view)
        {
            // The next time it is known at once.
            asked.scene = view.scene;
            return;
        }
        desk.standing = Standing { works: true, ..Standing::default() };
        desk.next = Some(view);
        self.shared.stop_what_is_under_way();
    }

    /// Wants nothing judged: leaves the processor to the frames of an eye that moves.
    pub fn rest(&self) {
        let mut desk = self.shared.lock();
        (desk.next, desk.current, desk.standing) = (None, None, Standing::default());
        self.shared.stop_what_is_under_way();
    }

    pub fn standing(&self) -> Standing {
        self.shared.lock().standing.clone()
    }
}

impl Drop for Judge {
    /// Waits for the thread, which ends at the next part of its work.
    fn drop(&mut self) {
        let mut desk = self.shared.lock();
        desk.quits = true;
        self.shared.stop_what_is_under_way();
        drop(desk);
        // It catches what its work panics with.
        drop(self.thread.take().map(JoinHandle::join));
    }
}

impl Shared {
    /// What is in it is whole at every moment: nobody panics between two changes that belong
    /// together.
    fn lock(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn stop_what_is_under_way(&self) {
        self.wish.fetch_add(1, Ordering::Relaxed);
        self.wake.notify_all();
    }
}

/// What a reference that nobody wants any more is left with.
struct Stopped;

/// The thread that computes.
struct Worker {
    shared: Arc<Shared>,
    pool: ThreadPool,
    folder: Option<PathBuf>,
    budget: Duration,
}

impl Worker {
    fn run(self) {
        let mut desk = self.shared.lock();
        while !desk.quits {
            let Some(view) = desk.next.take() else {
                desk = self.shared.wake.wait(desk).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            desk.current = Some(view.clone());
            // Read under the lock, under which it is changed.
            let wish = self.shared.wish.load(Ordering::Relaxed);
            drop(desk);
            let judged = catch_unwind(AssertUnwindSafe(|| self.judge(&view, wish)));
            desk = self.shared.lock();
            // Of a view that nobody wants any more nothing is said.
            if self.is_wanted(wish) {
                desk.standing.failed = failure(judged);
                (desk.standing.works, desk.standing.progress) = (false, None);
            }
        }
    }

    fn is_wanted(&self, wish: u64) -> bool {
        self.shared.wish.load(Ordering::Relaxed) == wish
    }

    /// The truth at a few pixels; then at as many as there is time for.
    fn judge(&self, view: &View, wish: u64) -> Result<()> {
        let (scene, [width, height]) = (view.exact(), view.size);
        let n_all = width as usize * height as usize;
        let first = Pixels::sample(width, height, N_FIRST);
        let (cell, n_first) = (first.cell, first.at.len());
        let Reference { seconds, pixels_s, .. } =
            self.reference(view, &scene, first, wish)?.reference;
        // As the first took it also where it was there already: the same pixels come again, and
        // they are there too.
        let left_s = self.budget.as_secs_f64() - seconds - (seconds - pixels_s);
        let n_more = (left_s / (pixels_s / n_first as f64)).clamp(0.0, n_all as f64) as usize;
        let more = Pixels::sample(width, height, n_more.max(1));
        if more.cell < cell {
            self.reference(view, &scene, more, wish)?;
        }
        Ok(())
    }

    /// The truth at `pixels`, said to be known. Unwinds with [`Stopped`] where it is not wanted any
    /// more.
    fn reference(
        &self,
        view: &View,
        scene: &Scene,
        pixels: Pixels,
        wish: u64,
    ) -> Result<Arc<Known>> {
        let n_pixels = pixels.at.len();
        let listener = |work: RenderStage, n: usize| {
            let mut desk = self.shared.lock();
            if !self.is_wanted(wish) {
                drop(desk);
                // As a panic that nobody reads of. All that is being computed is dropped on the
                // way, and files are written aside and renamed.
                resume_unwind(Box::new(Stopped));
            }
            let before =
                desk.standing.progress.filter(|p| p.work == work && p.n_pixels == n_pixels);
            let n_done = before.map_or(1, |p| p.n_done + 1);
            desk.standing.progress = Some(Progress { work, n_done, n, n_pixels });
        };
        let folder = self.folder.as_deref();
        let compute = || {
            reference_cache::reference(view.against, scene, view.time_s, &pixels, folder, &listener)
        };
        let found = self.pool.install(compute)?;
        let (view, reference_cache::Kept { reference, from_cache, .. }) = (view.clone(), found);
        let known = Arc::new(Known { view, pixels, reference, from_cache });
        let mut desk = self.shared.lock();
        if self.is_wanted(wish) {
            (desk.standing.known, desk.standing.progress) = (Some(known.clone()), None);
            return Ok(known);
        }
        drop(desk);
        resume_unwind(Box::new(Stopped))
    }
}

/// What is to be said of a view whose judging ended like this.
fn failure(judged: std::result::Result<Result<()>, Box<dyn Any + Send>>) -> Option<String> {
    match judged {
        Ok(Ok(())) => None,
        Ok(Err(error)) => Some(error.to_string()),
        Err(payload) if payload.is::<Stopped>() => None,
        Err(_) => Some("the reference panicked".to_owned()),
    }
}
