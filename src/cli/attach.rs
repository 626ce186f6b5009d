//! Attaches the receivers of the zones of the game and the render step.

use tracing_subscriber::layer::SubscriberExt;

use crate::measure::zones::Zones;

/// Attaches Tracy, if nimbus was built with it, and, with `collect`, the collector of `bench
/// --trace`, which is returned. Without a receiver a zone only costs the check for one.
pub fn attach(collect: bool) -> Option<Zones> {
    let zones = collect.then(Zones::default);
    #[cfg(feature = "tracy")]
    let live = Some(tracing_tracy::TracyLayer::default());
    #[cfg(not(feature = "tracy"))]
    let live = None::<tracing_subscriber::layer::Identity>;
    if zones.is_some() || live.is_some() {
        let subscriber = tracing_subscriber::registry().with(zones.clone()).with(live);
        // Setting it fails only if there is another subscriber; this is called once, at the start.
        let _ = tracing::subscriber::set_global_default(subscriber);
    }
    zones
}
