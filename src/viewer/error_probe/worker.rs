//! The thread that computes references, and the state it shares with its owner.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rayon::ThreadPool;

use super::request::{ProbeRequest, ReferencePicture};
use crate::error::Result;
use crate::model::scene::Scene;
use crate::reference::picture::{PathLimits, Pixels, Reference, ReferenceRequest, RenderStage};
use crate::studies::kept_paths::Traced;
use crate::studies::reference_cache::{self, CachedReference, Making};
use crate::viewer::sync::lock;

/// Progress of the reference that is being computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Kind of the parts.
    pub work: RenderStage,
    /// Facets or rows that are done.
    pub n_done: usize,
    /// Facets or rows in all.
    pub n: usize,
    /// Pixels that the reference will have.
    pub n_pixels: usize,
}

/// State of the last request.
#[derive(Debug, Clone, Default)]
pub struct ProbeStatus {
    /// The reference with the most pixels so far.
    pub reference: Option<Arc<ReferencePicture>>,
    /// `None` before the first part is done, and when no better reference follows.
    pub progress: Option<Progress>,
    /// Whether a better reference follows.
    pub is_working: bool,
    /// Why there is no reference.
    pub failure: Option<String>,
}

/// State shared by an error probe and its thread.
#[derive(Default)]
pub struct Shared {
    state: Mutex<State>,
    /// Signalled when the request changes or the probe closes.
    changed: Condvar,
    /// Counts changes of the request, so that work on an older request stops.
    version: AtomicU64,
}

#[derive(Default)]
struct State {
    request: Option<ProbeRequest>,
    /// The thread has begun the request.
    has_begun: bool,
    status: ProbeStatus,
    is_closed: bool,
}

impl Shared {
    /// Replaces the request, unless both have the same reference.
    pub fn request(&self, request: ProbeRequest) {
        if let Some(current) = &mut self.lock().request
            && current.has_same_reference(&request)
        {
            // The next request with this scene is recognized by its pointer, which is fast.
            current.scene = request.scene;
            return;
        }
        self.replace(Some(request));
    }

    /// Replaces or withdraws the request, and stops the work in progress.
    pub fn replace(&self, request: Option<ProbeRequest>) {
        let mut state = self.lock();
        let status = ProbeStatus { is_working: request.is_some(), ..ProbeStatus::default() };
        *state = State { request, has_begun: false, status, is_closed: state.is_closed };
        self.interrupt();
    }

    /// Stops the work in progress and ends the thread.
    pub fn close(&self) {
        let mut state = self.lock();
        state.is_closed = true;
        self.interrupt();
    }

    /// Returns the state of the last request.
    pub fn status(&self) -> ProbeStatus {
        self.lock().status.clone()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }

    /// Stops the work in progress. The caller holds the lock.
    fn interrupt(&self) {
        self.version.fetch_add(1, Ordering::Relaxed);
        self.changed.notify_all();
    }
}

/// Panic payload of work that was interrupted.
struct Interrupted;

/// The thread that computes references.
pub struct Worker {
    /// State shared with the owner.
    pub shared: Arc<Shared>,
    /// The threads that compute a reference.
    pub pool: ThreadPool,
    /// Folder of cached references.
    pub cache_folder: Option<PathBuf>,
    /// Time for the pixels of one view.
    pub budget: Duration,
}

/// A request with the version of the shared state at which it began.
struct Job {
    request: ProbeRequest,
    scene: Scene,
    version: u64,
}

impl Worker {
    /// Computes references until the probe closes.
    pub fn run(self) {
        let mut state = self.shared.lock();
        while !state.is_closed {
            let Some(request) = state.request.clone().filter(|_| !state.has_begun) else {
                let woken = self.shared.changed.wait(state);
                state = woken.unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            state.has_begun = true;
            let version = self.shared.version.load(Ordering::Relaxed);
            drop(state);
            let job = Job { scene: request.exact_scene(), request, version };
            let result = catch_unwind(AssertUnwindSafe(|| self.compute(&job)));
            state = self.shared.lock();
            if self.is_current(version) {
                state.status.failure = failure(result);
                (state.status.is_working, state.status.progress) = (false, None);
            }
        }
    }

    fn is_current(&self, version: u64) -> bool {
        self.shared.version.load(Ordering::Relaxed) == version
    }

    /// Computes the reference at a few pixels, then at as many as the budget allows.
    fn compute(&self, job: &Job) -> Result<()> {
        /// Pixels of the first reference, before the time of one pixel is known: few, so that the
        /// user soon sees an error.
        const N_FIRST: usize = 256;
        let [width, height] = job.request.size;
        let n_all = width as usize * height as usize;
        let first = Pixels::sample(width, height, N_FIRST);
        let (cell, n_first) = (first.cell, first.at.len());
        let Reference { seconds, pixels_s, .. } = self.reference(job, first)?.reference;
        // The budget also pays for the first reference and for the light of the second. A cached
        // reference carries the times of its computation, so a later run chooses the same pixels
        // and finds them in the cache.
        let left_s = self.budget.as_secs_f64() - seconds - (seconds - pixels_s);
        let n_more = (left_s / (pixels_s / n_first as f64)).clamp(0.0, n_all as f64) as usize;
        let more = Pixels::sample(width, height, n_more.max(1));
        if more.cell < cell {
            self.reference(job, more)?;
        }
        Ok(())
    }

    /// Computes the reference at `pixels` and publishes it. Unwinds with [`Interrupted`] when the
    /// request has changed.
    fn reference(&self, job: &Job, pixels: Pixels) -> Result<Arc<ReferencePicture>> {
        let n_pixels = pixels.at.len();
        let on_progress = |work: RenderStage, n: usize| {
            let mut state = self.lock_current(job);
            let before = state.status.progress.filter(|p| p.work == work && p.n_pixels == n_pixels);
            let n_done = before.map_or(1, |p| p.n_done + 1);
            state.status.progress = Some(Progress { work, n_done, n, n_pixels });
        };
        let request = job.request.clone();
        let (kind, time_s, scene) = (request.kind, request.time_s, &job.scene);
        let (never, limits) = (AtomicBool::new(false), PathLimits::USUAL);
        let (folder, traced) = (self.cache_folder.as_deref(), &Traced::default());
        let how = Making { folder, limits, stop: &never, traced };
        let CachedReference { reference, from_cache, .. } = self.pool.install(|| {
            let of = ReferenceRequest { kind, scene, time_s };
            reference_cache::reference(&of, &pixels, &how, &on_progress)
        })?;
        let picture = Arc::new(ReferencePicture { request, pixels, reference, from_cache });
        let mut state = self.lock_current(job);
        (state.status.reference, state.status.progress) = (Some(picture.clone()), None);
        Ok(picture)
    }

    /// Locks the state if `job` is still wanted, and unwinds with [`Interrupted`] if not.
    ///
    /// The computation has no other way out. Unwinding drops its buffers, and cache files are
    /// written under a temporary name first.
    fn lock_current(&self, job: &Job) -> MutexGuard<'_, State> {
        let state = self.shared.lock();
        if !self.is_current(job.version) {
            drop(state);
            resume_unwind(Box::new(Interrupted));
        }
        state
    }
}

/// Returns the message for a computation that ended with `result`.
fn failure(result: std::result::Result<Result<()>, Box<dyn Any + Send>>) -> Option<String> {
    match result {
        Ok(Ok(())) => None,
        Ok(Err(error)) => Some(error.to_string()),
        Err(payload) if payload.is::<Interrupted>() => None,
        Err(_) => Some("the reference panicked".to_owned()),
    }
}
