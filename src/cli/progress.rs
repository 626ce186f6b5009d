//! Progress on stderr: bars for work whose parts are counted, spinners for other work.

use std::io::IsTerminal;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::reference::picture::RenderStage;

/// Returns a progress bar, hidden if `quiet` is set or stderr is not a terminal.
pub fn progress(n: u64, what: &str, quiet: bool) -> ProgressBar {
    let is_hidden = quiet || !std::io::stderr().is_terminal();
    let target =
        if is_hidden { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let bar = ProgressBar::with_draw_target(Some(n), target).with_message(what.to_owned());
    styled(bar, "{msg} {wide_bar} {pos}/{len} {eta}")
}

fn styled(bar: ProgressBar, template: &str) -> ProgressBar {
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// A bar that appears after a second and disappears when it is dropped. Any thread can advance it.
pub struct LateProgress {
    bar: ProgressBar,
    begin: Instant,
    may_show: bool,
}

impl LateProgress {
    /// Returns a bar for `n` parts; it never appears if `quiet` is set or stderr is not a terminal.
    pub fn new(n: u64, what: &str, quiet: bool) -> LateProgress {
        LateProgress {
            bar: progress(n, what, true),
            begin: Instant::now(),
            may_show: !quiet && std::io::stderr().is_terminal(),
        }
    }

    /// Counts one more part as done.
    pub fn advance(&self) {
        self.bar.inc(1);
        if self.may_show && self.bar.is_hidden() && self.begin.elapsed() > SPINNER_DELAY {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
    }
}

impl Drop for LateProgress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

const SPINNER_DELAY: Duration = Duration::from_secs(1);
const SPINNER_STEP: Duration = Duration::from_millis(100);

/// A spinner that appears after a second and disappears when it is dropped.
pub struct Spinner {
    /// The thread that draws, and the sender whose end makes it end.
    drawn: Option<(Sender<()>, JoinHandle<()>)>,
}

/// Returns a spinner; it never appears if `quiet` is set or stderr is not a terminal.
pub fn spinner(what: &'static str, quiet: bool) -> Spinner {
    if quiet || !std::io::stderr().is_terminal() {
        return Spinner { drawn: None };
    }
    let (done, waiting) = mpsc::channel::<()>();
    let draw = move || {
        if waiting.recv_timeout(SPINNER_DELAY) != Err(RecvTimeoutError::Timeout) {
            return;
        }
        let spinner =
            ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr()).with_message(what);
        let spinner = styled(spinner, "{spinner} {msg} {elapsed}").with_elapsed(SPINNER_DELAY);
        while waiting.recv_timeout(SPINNER_STEP) == Err(RecvTimeoutError::Timeout) {
            spinner.tick();
        }
        spinner.finish_and_clear();
    };
    // Where no thread can be started, the work goes on without a spinner.
    let thread = std::thread::Builder::new().name("spinner".into()).spawn(draw);
    Spinner { drawn: thread.ok().map(|thread| (done, thread)) }
}

impl Drop for Spinner {
    fn drop(&mut self) {
        if let Some((done, thread)) = self.drawn.take() {
            drop(done);
            // Joining clears the line before anything else is printed. A thread that panicked has
            // drawn nothing.
            let _ = thread.join();
        }
    }
}

/// Progress of a picture in f64, which any thread can report: a bar for work with counted parts, a
/// spinner in between.
pub struct ReferenceProgress {
    shown: Mutex<Shown>,
    quiet: bool,
}

/// The line that the terminal shows.
enum Shown {
    /// Nothing, while one line replaces another.
    Nothing,
    /// A spinner between two works.
    Spinner { _spinner: Spinner },
    /// A bar over the parts of a work.
    Bar { work: RenderStage, n_left: usize, bar: LateProgress },
}

impl ReferenceProgress {
    /// Begins with a spinner.
    pub fn new(quiet: bool) -> ReferenceProgress {
        ReferenceProgress { shown: Mutex::new(Shown::spinner(quiet)), quiet }
    }

    /// Counts one of the `n` parts of `work` as done.
    pub fn advance(&self, work: RenderStage, n: usize) {
        let mut shown = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
        if !matches!(&*shown, Shown::Bar { work: current, .. } if *current == work) {
            let what = match work {
                RenderStage::Lighting => "lighting",
                RenderStage::Drawing => "drawing",
                RenderStage::Sampling => "samples",
            };
            // The line is cleared before another is drawn on it.
            *shown = Shown::Nothing;
            let bar = LateProgress::new(n as u64, what, self.quiet);
            *shown = Shown::Bar { work, n_left: n, bar };
        }
        if let Shown::Bar { n_left, bar, .. } = &mut *shown {
            bar.advance();
            *n_left -= 1;
            if *n_left == 0 {
                *shown = Shown::Nothing;
                *shown = Shown::spinner(self.quiet);
            }
        }
    }
}

impl Shown {
    fn spinner(quiet: bool) -> Shown {
        Shown::Spinner { _spinner: spinner("drawing in f64", quiet) }
    }
}
