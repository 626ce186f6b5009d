//! The numerical stress suite, `nimbus stress`: computations of the device at the limits of the
//! accepted input, compared with `f64` references.
//!
//! Every case has an error bound derived from the precision that Vulkan guarantees; see
//! docs/explanation/stability.md. [`cases`] lists the cases; [`Case::run`] runs one on a
//! [`StressContext`].

mod brdf;
mod case;
mod colours;
mod compositing;
mod context;
mod count;
mod determinism;
mod functions;
mod generation;
mod live;
mod merged;
mod metamorphic;
mod moisture;
mod scattering;
mod scenes;
mod skies;
mod sorting;
mod space;
mod sums;
mod transmittance;
mod transport;
mod views;

pub use case::{Case, Comparison, Outcome, Verdict, Worst};
pub use context::{DeviceFrame, StressContext};

/// Returns every case, family by family.
pub fn cases() -> Vec<Case> {
    [
        functions::CASES,
        generation::CASES,
        live::CASES,
        count::CASES,
        moisture::CASES,
        brdf::CASES,
        transport::CASES,
        sums::CASES,
        transmittance::CASES,
        scattering::CASES,
        sorting::CASES,
        compositing::CASES,
        merged::CASES,
        colours::CASES,
        skies::CASES,
        space::CASES,
        views::CASES,
        determinism::CASES,
        metamorphic::CASES,
    ]
    .concat()
}
