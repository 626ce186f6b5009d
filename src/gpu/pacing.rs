//! Pacing: commands are submitted in parts, none of which is predicted to take longer than a limit.
//!
//! A system resets a GPU that does not answer for some seconds. Nobody knows how long a command
//! takes before it has run. So the first work of a pipeline is run in growing parts, one by one,
//! and each is timed. Later, the times of passes correct what was found.

use std::time::Instant;

use super::interface::Pipeline;
use super::rate::{Units, Work};
use super::recorder::Recorder;
use crate::error::Result;

/// The rate of a pipeline is known once a part has taken this share of the limit. Of 500 ms it is
/// 8 ms, beside which the host's time for a submission is small.
const TELLING: f64 = 1.0 / 64.0;

/// The first part is the work divided by this. It is within a limit of 500 ms if the whole work
/// takes less than eight minutes, and ten more parts, each as long as all before it, do the rest.
const FIRST_PART: u32 = 1024;

impl Recorder<'_> {
    /// Records `units` of work of `pipeline` by calls of `record` with first unit and number of
    /// units: one call, or several whose parts are submitted one after another.
    ///
    /// # Errors
    /// `record` fails, or the device is lost.
    pub(super) fn paced(
        &mut self,
        pipeline: &Pipeline,
        units: Units,
        mut record: impl FnMut(&mut Self, u32, u32) -> Result<()>,
    ) -> Result<()> {
        let Pipeline { rate, indirect_rate, .. } = pipeline;
        let (rate, n_units, is_divisible) = match units {
            Units::Apart(n) => (rate, n, true),
            Units::Together(n) => (rate, n, false),
            Units::Indirect => (indirect_rate, 1, false),
        };
        let limit_ns = match self.commands.shared.max_submit_ns {
            Some(limit) if self.commands.is_divisible => limit,
            _ => return record(self, 0, n_units),
        };
        let mut first = 0;
        while first < n_units {
            let rest = n_units - first;
            let Some(unit_ns) = rate.get() else {
                let part = match is_divisible {
                    true => first.max(n_units.div_ceil(FIRST_PART)).min(rest),
                    false => rest,
                };
                let ns = self.timed(|rec| record(rec, first, part))?;
                let i_scope = self.i_scope;
                self.commands.pace.timed.extend(i_scope);
                first += part;
                if ns >= TELLING * limit_ns || first == n_units {
                    rate.set(ns / f64::from(part));
                }
                continue;
            };
            let pending = self.commands.pace.pending_ns;
            let room = ((limit_ns - pending) / unit_ns).max(0.0) as u32;
            let fits = room >= if is_divisible { 1 } else { rest };
            if !fits && pending > 0.0 {
                self.commands.begin_part()?;
                continue;
            }
            let part = if is_divisible { room.clamp(1, rest) } else { rest };
            let ns = unit_ns * f64::from(part);
            if ns > limit_ns {
                self.commands.shared.over_limit.add(&pipeline.name, ns);
            }
            record(self, first, part)?;
            first += part;
            let work = Work { i_scope: self.i_scope, rate: rate.clone(), n_units: part.into() };
            let pace = &mut self.commands.pace;
            pace.pending_ns += ns;
            pace.work.push(work);
        }
        Ok(())
    }

    /// Runs what `record` records alone and returns the time that it takes, in ns.
    fn timed(&mut self, record: impl FnOnce(&mut Self) -> Result<()>) -> Result<f64> {
        self.commands.finish_part()?;
        let start = Instant::now();
        record(self)?;
        self.commands.finish_part()?;
        Ok(start.elapsed().as_secs_f64() * 1e9)
    }
}
