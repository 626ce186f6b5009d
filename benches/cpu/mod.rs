//! Process CPU time, all threads: the figure to compare on a shared machine, where wall time also
//! says what others do.

use std::time::{Duration, Instant};

/// Of /proc/self/stat: the kernel's USER_HZ, 100 on every Linux.
const MS_PER_TICK: f64 = 10.0;
/// A sample lasts at least this long, so that a tick is 2.5 % of it where one thread is busy.
const SAMPLE: Duration = Duration::from_millis(400);
pub const N_SAMPLES: usize = 9;

/// CPU milliseconds (user and system) of this process so far; `None` without procfs.
fn process_ms() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The second field, the name in parentheses, may hold spaces; utime and stime are fields 14 and
    // 15.
    let after_name = stat.rsplit_once(')')?.1;
    let mut fields = after_name.split_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<f64>().ok();
    Some((ticks()? + ticks()?) * MS_PER_TICK)
}

/// CPU milliseconds of one call of `f`, [`N_SAMPLES`] times over; NaN without procfs.
pub fn samples(mut f: impl FnMut()) -> Vec<f64> {
    f();
    let sample = |_| {
        let (start, before) = (Instant::now(), process_ms());
        let mut n_calls = 0;
        while start.elapsed() < SAMPLE {
            f();
            n_calls += 1;
        }
        let ms = process_ms().zip(before).map_or(f64::NAN, |(after, before)| after - before);
        ms / f64::from(n_calls)
    };
    (0..N_SAMPLES).map(sample).collect()
}

/// Whether this is `cargo bench` and not a test run, which only sees that everything runs.
pub fn is_bench() -> bool {
    std::env::args().any(|a| a == "--bench")
}
