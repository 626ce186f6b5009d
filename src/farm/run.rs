//! One shard, from whatever is there of it to its verified result.

use std::cell::Cell;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::attempts::{Event, Log};
use super::failing::may_pass;
use super::frames;
use super::plan::{Plan, Shard, Work};
use super::store::{Manifest, Placed, SCHEMA_VERSION, Standing, Store};
use super::{bench, child, reference, study};
use crate::error::{Error, Result};
use crate::frame::DeviceChoice;
use crate::io::scene_file::LoadedScene;
use crate::timing::machine;

/// How a shard came to be there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// It was there.
    Skipped,
    Done {
        seconds: f64,
        n_resumed: usize,
    },
    /// Another run put the same there while this one worked.
    Beaten,
}

/// On which device, until when, and who is told of every item.
pub struct How<'a> {
    /// But for the shaders, which are the plan's, as the device is where none is named here.
    pub choice: &'a DeviceChoice,
    pub stop: &'a AtomicBool,
    pub on_item: &'a dyn Fn(),
}

/// Does shard `index` of the plan in `folder`, unless it is done. Errors have the exit code that
/// engines are told: 75 where another try may go well, 70 where the result contradicts one that is
/// there.
pub fn run(folder: &Path, index: usize, how: &How<'_>) -> Result<Outcome> {
    let plan = Plan::read(folder)?;
    let shard = plan.shard(index)?;
    let log = Log::open(folder)?;
    let store = Store::open(folder);
    let (begin, n_new) = (Instant::now(), Cell::new(0));
    // A stale plan is refused even where its results are there: they are not of what the files say
    // now.
    let ended = plan.scene_as_planned().and_then(|loaded| {
        let attempt = Attempt {
            plan: &plan,
            loaded: &loaded,
            shard,
            store: &store,
            log: &log,
            how,
            n_new: &n_new,
        };
        attempt.run(begin).or_else(|error| match store.standing(&plan, shard) {
            // Whatever went wrong here: somebody else may have done it meanwhile, and cleared away
            // what we worked in.
            Standing::Verified(_) if !matches!(error, Error::Conflict { .. }) => {
                Ok(Outcome::Beaten)
            }
            _ => Err(may_pass(error)),
        })
    });
    let seconds = begin.elapsed().as_secs_f64();
    let event = match &ended {
        Ok(Outcome::Skipped) => Event::Skipped,
        Ok(Outcome::Done { seconds, n_resumed }) => {
            Event::Done { seconds: *seconds, n_resumed: *n_resumed }
        }
        Ok(Outcome::Beaten) => Event::Beaten { seconds },
        Err(error) => {
            let (exit_code, what) = (error.exit_code(), error.to_string());
            Event::Failed { seconds, exit_code, n_new: n_new.get(), what }
        }
    };
    // On a full disk nothing can be written down either, and a result counts without a line about
    // it.
    let _ = log.say(index, &shard.key, event);
    ended
}

struct Attempt<'a> {
    plan: &'a Plan,
    loaded: &'a LoadedScene,
    shard: &'a Shard,
    store: &'a Store,
    log: &'a Log,
    how: &'a How<'a>,
    /// Is told how many files it finished, also where it fails.
    n_new: &'a Cell<usize>,
}

impl Attempt<'_> {
    fn run(&self, begin: Instant) -> Result<Outcome> {
        let Attempt { plan, loaded, shard, store, log, .. } = self;
        let who = format!("{}.{}", log.node, log.pid);
        match store.standing(plan, shard) {
            Standing::Verified(_) => return Ok(Outcome::Skipped),
            Standing::Missing => {}
            Standing::Unreadable(error) => return Err(error),
            Standing::Broken(what) => {
                if let Some(to) = store.put_aside(plan, shard, &who)? {
                    let event = Event::PutAside { what, to: to.display().to_string() };
                    let _ = log.say(shard.index, &shard.key, event);
                }
            }
        }
        let begun = machine::utc_now();
        // The log tells people; without it work goes on.
        let _ = log.say(shard.index, &shard.key, Event::Begun);
        let mut workplace = store.begin(shard, &who)?;
        let choice = DeviceChoice {
            device: self.how.choice.device.clone().or_else(|| plan.device.clone()),
            shaders: plan.scene.shaders.clone(),
            ..self.how.choice.clone()
        };
        let stop = self.how.stop;
        let made = match &plan.work {
            Work::Frames { .. } => {
                let of = (*store, *plan, *shard, *loaded);
                frames::draw(of, &choice, &mut workplace, stop, self.how.on_item)
            }
            Work::Reference(cut) => {
                let of = (*store, *plan, *shard, *loaded);
                reference::draw(of, cut, &mut workplace, stop, self.how.on_item)
            }
            Work::Error { arguments, .. } => {
                study::measure((*plan, *shard, arguments), &choice, &mut workplace, stop)
            }
            Work::Bench { arguments, .. } => {
                bench::measure((*plan, *shard, arguments), &choice, &mut workplace, stop)
            }
        };
        self.n_new.set(workplace.n_new());
        let device = made?;
        let (seconds, n_resumed) = (begin.elapsed().as_secs_f64(), workplace.n_resumed);
        let manifest = Manifest {
            schema: SCHEMA_VERSION,
            key: shard.key.clone(),
            index: shard.index,
            files: Vec::new(),
            node: log.node.clone(),
            pid: log.pid,
            device,
            cpu: machine::cpu(),
            environment: machine::environment(),
            begun,
            seconds,
            n_resumed,
            exclusive: std::env::var_os(child::EXCLUSIVE).is_some_and(|value| value == "1"),
        };
        workplace.finish(manifest)?;
        match store.put(workplace, plan, shard, &who)? {
            Placed::First => Ok(Outcome::Done { seconds, n_resumed }),
            Placed::Same => Ok(Outcome::Beaten),
        }
    }
}
