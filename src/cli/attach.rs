//! Who listens to the zones of the game and the render step.

use tracing_subscriber::layer::SubscriberExt;

use crate::measure::zones::Zones;

/// Attaches Tracy, where nimbus was built with it, and where `collect` what `bench --trace` writes.
/// Where neither is there nobody listens, and a zone costs no more than a look at that.
pub fn attach(collect: bool) -> Option<Zones> {
    let zones = collect.then(Zones::default);
    #[cfg(feature = "tracy")]
    let live = Some(tracing_tracy::TracyLayer::default());
    #[cfg(not(feature = "tracy"))]
    let live = None::<tracing_subscriber::layer::Identity>;
    if zones.is_some() || live.is_some() {
        let subscriber = tracing_subscriber::registry().with(zones.clone()).with(live);
        // There is no other: this is called once, at the start.
        let _ = tracing::subscriber::set_global_default(subscriber);
    }
    zones
}
