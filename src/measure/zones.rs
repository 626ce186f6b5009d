//! What every thread did when: the spans of the `tracing` crate, collected while a time line is
//! asked for.
//!
//! A span is a zone from when a thread enters it to when it leaves; zones of a thread so lie one in
//! another or side by side. What is known of a zone is 24 bytes, and at most [`MAX_ZONES`] are
//! kept, the first ones: a time line's begin is worth more than a torn end. How many came after
//! that is counted.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id};
use tracing::{Metadata, Subscriber};
use tracing_subscriber::layer::{Context, Layer};
use tracing_subscriber::registry::LookupSpan;

/// 24 MiB of zones: some 50 000 frames of 20.
pub const MAX_ZONES: usize = 1 << 20;
/// The field that names a zone beside its span's own name: "pass first".
const NAME_FIELD: &str = "name";
/// Only spans of this program.
const TARGET: &str = env!("CARGO_CRATE_NAME");

/// One stay of a thread in a span.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zone {
    /// Into [`Collected::names`].
    pub i_name: u16,
    /// Into [`Collected::threads`].
    pub i_thread: u16,
    /// From [`Collected::epoch`].
    pub begin_ns: u64,
    pub end_ns: u64,
}

/// All there is so far.
#[derive(Debug, Clone)]
pub struct Collected {
    pub epoch: Instant,
    pub names: Vec<String>,
    /// Threads of one name, of which nimbus runs one at a time, are one.
    pub threads: Vec<String>,
    /// In the order in which they ended.
    pub zones: Vec<Zone>,
    /// Zones that came when [`MAX_ZONES`] were there.
    pub n_dropped: u64,
}

/// Where zones are collected; clones are the same place.
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

    /// Takes what was collected, and begins anew.
    pub fn take(&self) -> Collected {
        let mut collected = self.lock();
        Collected {
            n_dropped: std::mem::take(&mut collected.n_dropped),
            zones: std::mem::take(&mut collected.zones),
            ..collected.clone()
        }
    }

    fn lock(&self) -> MutexGuard<'_, Collected> {
        // Nothing that is pushed here can panic halfway.
        self.collected.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What a span carries from its making to its end.
struct Carried {
    i_name: u16,
    begin: Option<Instant>,
}

/// The value of the field that names a zone.
#[derive(Default)]
struct NameOf(Option<String>);

impl Visit for NameOf {
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
        let mut name = NameOf::default();
        attributes.record(&mut name);
        let of_span = attributes.metadata().name();
        let name = name.0.map_or(of_span.to_owned(), |name| format!("{of_span} {name}"));
        let i_name = index_of(&mut self.lock().names, &name);
        if let Some(span) = context.span(id) {
            span.extensions_mut().insert(Carried { i_name, begin: None });
        }
    }

    fn on_enter(&self, id: &Id, context: Context<'_, S>) {
        let Some(span) = context.span(id) else { return };
        if let Some(carried) = span.extensions_mut().get_mut::<Carried>() {
            // Last, so that what was done here lies outside.
            carried.begin = Some(Instant::now());
        }
    }

    fn on_exit(&self, id: &Id, context: Context<'_, S>) {
        let end = Instant::now();
        let Some(span) = context.span(id) else { return };
        let Some((i_name, begin)) = span
            .extensions_mut()
            .get_mut::<Carried>()
            .and_then(|carried| Some((carried.i_name, carried.begin.take()?)))
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

/// Where `name` stands in a list of a few dozen, which it joins where it is new.
fn index_of(list: &mut Vec<String>, name: &str) -> u16 {
    let found = list.iter().position(|known| known == name).unwrap_or_else(|| {
        list.push(name.to_owned());
        list.len() - 1
    });
    // Names are those in the source, threads those that it starts.
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
    fn zones_nest_and_are_named_and_threads_are_apart() {
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
    fn what_is_too_many_is_counted() {
        let zones = Zones::at_most(3);
        let ten = || (0..10).for_each(|_| drop(info_span!("zone").entered()));
        let found = collect(&zones, ten);
        assert_eq!((found.zones.len(), found.n_dropped), (3, 7));
        assert!(found.zones.windows(2).all(|w| w[0].end_ns <= w[1].begin_ns), "the first ones");
        // Taken away, there is room again.
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
        println!("nobody listens: {:.1} ns a span", spans());
        collect(&Zones::at_most(N as usize), || println!("collected: {:.0} ns a span", spans()));
    }
}
