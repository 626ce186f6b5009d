//! Zones: the spans of the `tracing` crate by thread, collected for a time line.
//!
//! A zone lasts from entering a span to leaving it, so that the zones of a thread are nested or
//! disjoint. A zone takes 24 bytes. At most [`MAX_ZONES`] are kept, the first ones, so that the
//! beginning of the time line is complete; further ones are counted.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id};
use tracing::{Metadata, Subscriber};
use tracing_subscriber::layer::{Context, Layer};
use tracing_subscriber::registry::LookupSpan;

/// Most zones that are kept: 24 MiB, or some 50 000 frames with 20 zones.
pub const MAX_ZONES: usize = 1 << 20;
/// Field of a span that is appended to its name: "pass first".
const NAME_FIELD: &str = "name";
/// Target of the spans of this program; others are ignored.
const TARGET: &str = env!("CARGO_CRATE_NAME");

/// The time between a thread's entering a span and leaving it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zone {
    /// Index into [`Collected::names`].
    pub i_name: u16,
    /// Index into [`Collected::threads`].
    pub i_thread: u16,
    /// Beginning, in ns from [`Collected::epoch`].
    pub begin_ns: u64,
    /// End, in ns from [`Collected::epoch`].
    pub end_ns: u64,
}

/// The zones so far.
#[derive(Debug, Clone)]
pub struct Collected {
    /// Zero of the zones' times.
    pub epoch: Instant,
    /// Names of zones.
    pub names: Vec<String>,
    /// Names of threads. Threads of the same name, of which nimbus runs one at a time, count as
    /// one.
    pub threads: Vec<String>,
    /// Zones, in the order in which they ended.
    pub zones: Vec<Zone>,
    /// Number of zones that were dropped because [`MAX_ZONES`] were there.
    pub n_dropped: u64,
}

/// A collector of zones; clones share the same zones.
#[derive(Clone)]
pub struct Zones {
    collected: Arc<Mutex<Collected>>,
    max_zones: usize,
}

impl Default for Zones {
    fn default() -> Self {
        Zones::at_most(MAX_ZONES)
    }
}

impl Zones {
    fn at_most(max_zones: usize) -> Zones {
        let nothing = Collected {
            epoch: Instant::now(),
            names: vec![],
            threads: vec![],
            zones: vec![],
            n_dropped: 0,
        };
        Zones { collected: Arc::new(Mutex::new(nothing)), max_zones }
    }

    /// Takes the collected zones; the collector is empty afterwards.
    pub fn take(&self) -> Collected {
        let mut collected = self.lock();
        Collected {
            n_dropped: std::mem::take(&mut collected.n_dropped),
            zones: std::mem::take(&mut collected.zones),
            ..collected.clone()
        }
    }

    fn lock(&self) -> MutexGuard<'_, Collected> {
        // A poisoned lock is harmless: no change of the data can panic halfway.
        self.collected.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The data that is attached to a span.
struct SpanData {
    i_name: u16,
    begin: Option<Instant>,
}

/// Reads the field [`NAME_FIELD`].
#[derive(Default)]
struct NameVisitor(Option<String>);

impl Visit for NameVisitor {
    fn record_str(&mut self, field: &Field, value: &str) {
        if field.name() == NAME_FIELD {
            self.0 = Some(value.to_owned());
        }
    }

    fn record_debug(&mut self, _: &Field, _: &dyn std::fmt::Debug) {}
}

impl<S: Subscriber + for<'a> LookupSpan<'a>> Layer<S> for Zones {
    fn enabled(&self, metadata: &Metadata<'_>, _: Context<'_, S>) -> bool {
        metadata.target().starts_with(TARGET)
    }

    fn on_new_span(&self, attributes: &Attributes<'_>, id: &Id, context: Context<'_, S>) {
        let mut name = NameVisitor::default();
        attributes.record(&mut name);
        let of_span = attributes.metadata().name();
        let name = name.0.map_or(of_span.to_owned(), |name| format!("{of_span} {name}"));
        let i_name = index_of(&mut self.lock().names, &name);
        if let Some(span) = context.span(id) {
            span.extensions_mut().insert(SpanData { i_name, begin: None });
        }
    }

    fn on_enter(&self, id: &Id, context: Context<'_, S>) {
        let Some(span) = context.span(id) else { return };
        if let Some(data) = span.extensions_mut().get_mut::<SpanData>() {
            // The clock is read last, so that the work of this function is outside the zone.
            data.begin = Some(Instant::now());
        }
    }

    fn on_exit(&self, id: &Id, context: Context<'_, S>) {
        let end = Instant::now();
        let Some(span) = context.span(id) else { return };
        let Some((i_name, begin)) = span
            .extensions_mut()
            .get_mut::<SpanData>()
            .and_then(|data| Some((data.i_name, data.begin.take()?)))
        else {
            return;
        };
        let mut collected = self.lock();
        if collected.zones.len() >= self.max_zones {
            collected.n_dropped += 1;
            return;
        }
        let i_thread =
            index_of(&mut collected.threads, std::thread::current().name().unwrap_or("unnamed"));
        let [begin_ns, end_ns] =
            [begin, end].map(|at| at.saturating_duration_since(collected.epoch).as_nanos() as u64);
        collected.zones.push(Zone { i_name, i_thread, begin_ns, end_ns });
    }
}

/// Returns the index of `name` in a list of a few dozen, which it is added to if it is new.
fn index_of(list: &mut Vec<String>, name: &str) -> u16 {
    let found = list.iter().position(|known| known == name).unwrap_or_else(|| {
        list.push(name.to_owned());
        list.len() - 1
    });
    // The source has far fewer names and threads.
    u16::try_from(found).unwrap_or(u16::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tracing::{Dispatch, dispatcher, info_span};
    use tracing_subscriber::layer::SubscriberExt;

    fn collect(zones: &Zones, f: impl FnOnce()) -> Collected {
        let dispatch = Dispatch::new(tracing_subscriber::registry().with(zones.clone()));
        dispatcher::with_default(&dispatch, f);
        zones.take()
    }

    #[test]
    fn zones_are_nested_and_named_by_thread() {
        let work = || {
            let _outer = info_span!("step").entered();
            for name in ["first", "second"] {
                let _inner = info_span!("pass", name).entered();
                std::thread::sleep(std::time::Duration::from_micros(50));
            }
            let _elsewhere = info_span!(target: "another_crate", "not ours").entered();
        };
        let found = collect(&Zones::default(), || {
            work();
            let dispatch = dispatcher::get_default(Dispatch::clone);
            let other = std::thread::Builder::new().name("other".into());
            other.spawn(move || dispatcher::with_default(&dispatch, work)).unwrap().join().unwrap();
        });
        assert_eq!(found.names, ["step", "pass first", "pass second"]);
        assert_eq!(
            (found.threads.len(), found.threads[1].as_str(), found.n_dropped),
            (2, "other", 0)
        );
        let of = |i_thread| {
            found.zones.iter().filter(move |zone| zone.i_thread == i_thread).collect::<Vec<_>>()
        };
        for zones in [of(0), of(1)] {
            // In the order in which they ended: the outer one last.
            let [first, second, step] = zones[..] else { panic!("{zones:?}") };
            assert_eq!([first, second, step].map(|zone| zone.i_name), [1, 2, 0]);
            assert!(step.begin_ns <= first.begin_ns && first.begin_ns + 50_000 <= first.end_ns);
            assert!(first.end_ns <= second.begin_ns && second.end_ns <= step.end_ns);
        }
        assert!(of(0)[2].end_ns <= of(1)[2].begin_ns);
    }

    #[test]
    fn zones_beyond_the_limit_are_counted() {
        let zones = Zones::at_most(3);
        let ten = || (0..10).for_each(|_| drop(info_span!("zone").entered()));
        let found = collect(&zones, ten);
        assert_eq!((found.zones.len(), found.n_dropped), (3, 7));
        assert!(found.zones.windows(2).all(|w| w[0].end_ns <= w[1].begin_ns), "the first ones");
        // After the zones were taken there is room again.
        let again = collect(&zones, || drop(info_span!("zone").entered()));
        assert_eq!((again.zones.len(), again.n_dropped), (1, 0));
        assert_eq!(size_of::<Zone>(), 24);
    }

    #[test]
    #[ignore = "prints what a span costs: a time, which no machine promises"]
    fn what_a_span_costs() {
        const N: u32 = 1_000_000;
        let spans = || {
            let begin = Instant::now();
            for i in 0..N {
                let _zone = info_span!("zone").entered();
                std::hint::black_box(i);
            }
            begin.elapsed().as_nanos() as f64 / f64::from(N)
        };
        println!("without a receiver: {:.1} ns a span", spans());
        collect(&Zones::at_most(N as usize), || println!("collected: {:.0} ns a span", spans()));
    }
}
