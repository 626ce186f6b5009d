//! Progress on stderr. A terminal shows bars for work whose parts are counted, and spinners for
//! other work. Elsewhere, as in a log, a line says from time to time how far the work is.

use std::io::IsTerminal;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::io::console::say;
use crate::reference::picture::RenderStage;

/// Time after which work is long enough to be shown on a terminal.
const DELAY: Duration = Duration::from_secs(1);
/// Time between two steps of a spinner.
const SPINNER_STEP: Duration = Duration::from_millis(100);
/// Seconds between two lines where stderr is not a terminal.
const LINE_STEP_S: f64 = 15.0;

/// Where progress is shown.
#[derive(Clone, Copy)]
enum Medium {
    /// Nowhere.
    Nothing,
    /// On a terminal, which shows a line that changes.
    Terminal,
    /// In a log, whose lines are this time apart.
    Log(Duration),
}

impl Medium {
    fn new(quiet: bool) -> Medium {
        if quiet {
            return Medium::Nothing;
        }
        if std::io::stderr().is_terminal() {
            return Medium::Terminal;
        }
        let asked = std::env::var("NIMBUS_PROGRESS_S").ok().and_then(|text| text.parse().ok());
        match Duration::try_from_secs_f64(asked.unwrap_or(LINE_STEP_S)) {
            Ok(step) if !step.is_zero() => Medium::Log(step),
            _ => Medium::Nothing,
        }
    }
}

/// Progress of work whose parts are counted. Any thread can advance it; dropping it removes its bar
/// from the terminal.
pub struct Progress {
    bar: ProgressBar,
    medium: Medium,
    begin: Instant,
    /// The time of the last line.
    last: Mutex<Instant>,
}

/// Returns the progress of `n` parts of the work `what`.
pub fn progress(n: u64, what: &str, quiet: bool) -> Progress {
    let bar = ProgressBar::with_draw_target(Some(n), ProgressDrawTarget::hidden());
    let bar = styled(bar.with_message(what.to_owned()), "{msg} {wide_bar} {pos}/{len} {eta}");
    let begin = Instant::now();
    Progress { bar, medium: Medium::new(quiet), begin, last: Mutex::new(begin) }
}

fn styled(bar: ProgressBar, template: &str) -> ProgressBar {
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

impl Progress {
    /// Counts one more part as done.
    pub fn advance(&self) {
        self.bar.inc(1);
        match self.medium {
            Medium::Terminal if self.bar.is_hidden() && self.begin.elapsed() > DELAY => {
                self.bar.set_draw_target(ProgressDrawTarget::stderr());
            }
            Medium::Log(step) => {
                let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
                if last.elapsed() >= step {
                    *last = Instant::now();
                    say!("{}", self.line());
                }
            }
            Medium::Terminal | Medium::Nothing => {}
        }
    }

    /// Adds parts that were not known before.
    pub fn add_parts(&self, n: u64) {
        self.bar.inc_length(n);
    }

    /// Names the work that follows.
    pub fn set_name(&self, what: &'static str) {
        self.bar.set_message(what);
    }

    /// Returns the line of a log. The time left assumes that all parts take as long as those done.
    fn line(&self) -> String {
        let (done, n) = (self.bar.position(), self.bar.length().unwrap_or(0));
        let per_part_s = self.begin.elapsed().as_secs_f64() / done.max(1) as f64;
        let left = about(per_part_s * n.saturating_sub(done) as f64);
        format!("progress: {}: {done} of {n}, about {left} left", self.bar.message())
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Returns a time that is not known exactly, in the unit of a person.
pub fn about(seconds: f64) -> String {
    match seconds.ceil() {
        s if s < 100.0 => format!("{s:.0} s"),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.0} h", s / 3600.0),
    }
}

/// Progress of work without counted parts: on a terminal, a spinner that appears after a second and
/// disappears when it is dropped.
pub struct Spinner {
    /// The thread that draws, and the sender whose end makes it end.
    drawn: Option<(Sender<()>, JoinHandle<()>)>,
}

/// Returns the progress of the work `what`.
pub fn spinner(what: &'static str, quiet: bool) -> Spinner {
    let (done, waiting) = mpsc::channel::<()>();
    let is_over = move |time| waiting.recv_timeout(time) != Err(RecvTimeoutError::Timeout);
    let drawing: Box<dyn FnOnce() + Send> = match Medium::new(quiet) {
        Medium::Nothing => return Spinner { drawn: None },
        Medium::Terminal => Box::new(move || {
            if is_over(DELAY) {
                return;
            }
            let spinner = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
            let spinner = styled(spinner.with_message(what), "{spinner} {msg} {elapsed}");
            let spinner = spinner.with_elapsed(DELAY);
            while !is_over(SPINNER_STEP) {
                spinner.tick();
            }
            spinner.finish_and_clear();
        }),
        Medium::Log(step) => Box::new(move || {
            let begin = Instant::now();
            while !is_over(step) {
                say!("progress: {what}, for {} now", about(begin.elapsed().as_secs_f64()));
            }
        }),
    };
    // Where no thread can be started, the work goes on without a spinner.
    let thread = std::thread::Builder::new().name("spinner".into()).spawn(drawing);
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
    line: Mutex<Line>,
    quiet: bool,
}

/// The progress that is shown.
enum Line {
    /// Nothing, while one line replaces another.
    Nothing,
    /// A spinner between two works.
    Spinner { _spinner: Spinner },
    /// A bar over the parts of a work.
    Bar { work: RenderStage, n_left: usize, bar: Progress },
}

impl ReferenceProgress {
    /// Begins with a spinner.
    pub fn new(quiet: bool) -> ReferenceProgress {
        ReferenceProgress { line: Mutex::new(Line::spinner(quiet)), quiet }
    }

    /// Counts one of the `n` parts of `work` as done.
    pub fn advance(&self, work: RenderStage, n: usize) {
        let mut line = self.line.lock().unwrap_or_else(PoisonError::into_inner);
        if !matches!(&*line, Line::Bar { work: current, .. } if *current == work) {
            let what = match work {
                RenderStage::Lighting => "lighting",
                RenderStage::Drawing => "drawing",
                RenderStage::Sampling => "samples",
            };
            // The line is cleared before another is drawn on it.
            *line = Line::Nothing;
            let bar = progress(n as u64, what, self.quiet);
            *line = Line::Bar { work, n_left: n, bar };
        }
        if let Line::Bar { n_left, bar, .. } = &mut *line {
            bar.advance();
            *n_left -= 1;
            if *n_left == 0 {
                *line = Line::Nothing;
                *line = Line::spinner(self.quiet);
            }
        }
    }
}

impl Line {
    fn spinner(quiet: bool) -> Line {
        Line::Spinner { _spinner: spinner("drawing in f64", quiet) }
    }
}
