//! Error of the current view: the f64 reference is computed in the background, and pictures are
//! compared with it.
//!
//! A probe computes the reference at a few hundred pixels first, then at as many pixels as its time
//! budget allows. Both results go to the reference cache, so a view that was measured before is
//! measured at once.

mod request;
mod worker;

use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

pub use request::{ProbeRequest, ReferencePicture};
pub use worker::{ProbeStatus, Progress};
use worker::{Shared, Worker};

use crate::error::{Error, Result};

/// A background thread that computes the reference of one view at a time.
pub struct ErrorProbe {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl ErrorProbe {
    /// Starts the thread. References are kept in `cache_folder`, if there is one.
    ///
    /// `budget` bounds the time for the pixels of one view. The light of the reference takes the
    /// time that it takes.
    ///
    /// # Errors
    /// The system starts no thread.
    pub fn new(cache_folder: Option<PathBuf>, budget: Duration) -> Result<ErrorProbe> {
        fn fail(e: impl ToString) -> Error {
            Error::Fault { what: format!("no thread for references: {}", e.to_string()) }
        }
        // Half of the cores stay free for the window's frames.
        let n_threads = std::thread::available_parallelism().map_or(1, |n| (n.get() / 2).max(1));
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .thread_name(|i| format!("error-probe-{i}"))
            .build()
            .map_err(fail)?;
        let shared = Arc::new(Shared::default());
        let worker = Worker { shared: shared.clone(), pool, cache_folder, budget };
        let thread = std::thread::Builder::new().name("error-probe".into());
        let thread = thread.spawn(move || worker.run()).map_err(fail)?;
        Ok(ErrorProbe { shared, thread: Some(thread) })
    }

    /// Replaces the requested view. Work on another view stops; work on the same view goes on.
    pub fn request(&self, request: ProbeRequest) {
        self.shared.request(request);
    }

    /// Withdraws the request, which leaves the processor to the window's frames.
    pub fn cancel(&self) {
        self.shared.replace(None);
    }

    /// Returns the state of the last request.
    pub fn status(&self) -> ProbeStatus {
        self.shared.status()
    }
}

impl Drop for ErrorProbe {
    /// Waits for the thread, which ends at the next row or facet of its work.
    fn drop(&mut self) {
        self.shared.close();
        // The thread catches the panics of its work.
        drop(self.thread.take().map(JoinHandle::join));
    }
}
