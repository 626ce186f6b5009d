//! The state of the machine while a bench runs: clocks, heat, power, memory, other work.
//!
//! A [`Sampler`] has a thread of its own, which reads ten times a second from the [`Sources`] of
//! the device and the host. Its [`StateRow`]s are kept raw in `state.csv`. The [`rules`] are pure
//! functions over these rows: they flag frames that ran at a low clock, and tell a clock that
//! drifts. [`Observed`] summarizes both for `run.json`.

mod amd;
mod card;
mod device_source;
mod host;
mod intel;
mod nvml;
mod record;
mod row;
pub mod rules;
mod sampler;
mod sources;
mod summary;
mod sysfs;
mod text;

pub use card::{AMD, INTEL, NVIDIA, card};
pub use device_source::DeviceSource;
pub use record::{CaseState, Drift, RunState, Spread, ThrottleCount};
pub use row::{Event, STATE_FILE, StateRow, parse_rows, rows_text};
pub use rules::{Flags, FrameMark};
pub use sampler::{BlockWatch, Sampler, StateLog};
pub use sources::{DeviceNames, Folders, Sources};
pub use summary::{BenchState, Judging, Observed, TimedFrame};
pub use text::{case_line, remark_lines, run_line};
