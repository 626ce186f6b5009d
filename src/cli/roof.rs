//! `nimbus devices --roof`: measures what a device can do at most.

use std::time::Duration;

use super::args::DevicesArgs;
use super::interrupt::graceful_stop;
use super::output::{self, header, or_dash};
use super::progress::{Progress, progress};
use crate::error::Result;
use crate::frame::{DeviceChoice, GpuContext};
use crate::gpu::{DeviceOptions, Limits};
use crate::io::console::say;
use crate::roof::{Budget, measure};
use crate::timing::roofs::{Roof, Roofs};

/// Time for all samples of a device: with compilation, a measurement ends within 30 s.
const TIME: Duration = Duration::from_secs(20);

/// Measures the roofs of the device of `args`, keeps them and prints them.
///
/// # Errors
/// Fails if there is no such device, it computes a wrong result or is lost, or Ctrl-C came.
pub fn run(args: &DevicesArgs) -> Result<()> {
    let choice = DeviceChoice {
        device: args.device.clone(),
        validation: args.validation,
        options: DeviceOptions { max_submit_ms: args.max_submit_ms, ..DeviceOptions::default() },
        ..DeviceChoice::default()
    };
    let context = GpuContext::open(&choice)?;
    let info = context.device.info().clone();
    let budget = Budget { time: TIME, max_submit_ms: args.max_submit_ms };
    let mut bar: Option<Progress> = None;
    let roofs = measure(&context, budget, graceful_stop(), &mut |_, n| {
        bar.get_or_insert_with(|| progress(n, "roofs", args.quiet)).advance();
    });
    drop(bar);
    let roofs = roofs?;
    let kept = roofs.keep(&info);
    if args.json {
        output::object(&roofs)?;
    } else {
        output::text(&text(&roofs, &info.limits))?;
    }
    // The roofs are printed; they only are not there for bench.
    if let (Err(error), false) = (kept, args.quiet) {
        say!("warning: the roofs are not kept for bench: {error}");
    }
    context.close()
}

fn text(roofs: &Roofs, limits: &Limits) -> String {
    let mut rows = header(["roof", "by", "data", "n", "p50", "p5", "p95", "max", "spread", "unit"]);
    rows.extend(roofs.roofs.iter().map(row));
    let mut out = format!("{} ({})\n", roofs.device.name, roofs.device.driver);
    out += &output::table(&rows);
    for roof in roofs.roofs.iter().filter(|roof| !roof.is_stable) {
        let way = roof.way.as_ref().map_or(String::new(), |way| format!(" by {way}"));
        let set = roof.set_bytes.map_or(String::new(), |bytes| format!(" of {}", binary(bytes)));
        out += &format!("{}{way}{set}: the samples did not agree in time\n", roof.name);
    }
    roofs.absent.iter().for_each(|absent| out += &format!("{absent}\n"));
    let clock = match limits.timestamp_valid_bits {
        0 => "the host's clock: the device has no timestamps",
        _ => "the device's clock",
    };
    out + &format!(
        "last cache level: {}; {:.1} s, by {clock}\nA copied byte counts twice, a multiply-add is \
         two operations. All results were checked.\n",
        binary(roofs.cache_bytes),
        roofs.seconds
    )
}

fn row(roof: &Roof) -> Vec<String> {
    let (scale, unit) = scaled(roof.max);
    let rate = |value: f64| format!("{:.3}", value / scale);
    let mut row = vec![
        roof.name.clone(),
        or_dash(roof.way.clone(), |way| way),
        or_dash(roof.set_bytes, binary),
        roof.n.to_string(),
    ];
    row.extend([roof.p50, roof.p5, roof.p95, roof.max].map(rate));
    row.push(format!("{:.1}%", 100.0 * (roof.p95 - roof.p5) / roof.p50));
    row.push(format!("{unit}{}", roof.unit));
    row
}

/// Returns the power of 1000 that a rate is shown by, and its prefix.
fn scaled(rate: f64) -> (f64, &'static str) {
    match rate {
        r if r >= 1e12 => (1e12, "T"),
        r if r >= 1e9 => (1e9, "G"),
        r if r >= 1e6 => (1e6, "M"),
        _ => (1e3, "k"),
    }
}

/// Returns bytes in KiB, MiB or GiB.
fn binary(bytes: u64) -> String {
    match bytes {
        b if b >= 1 << 30 => format!("{} GiB", b >> 30),
        b if b >= 1 << 20 => format!("{} MiB", b >> 20),
        b => format!("{} KiB", b >> 10),
    }
}
