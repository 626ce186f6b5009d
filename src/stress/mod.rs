//! `nimbus stress`: whether a device computes at the edges what nimbus claims, case by case, each
//! with a bound that is derived (docs/stability.md) from the precision that Vulkan promises.

mod brdf;
mod case;
mod compositing;
mod count;
mod desk;
mod determinism;
mod functions;
mod generation;
mod live;
mod metamorphic;
mod moisture;
mod run;
mod scenes;
mod sorting;
mod space;
mod transmittance;
mod transport;

pub use case::{Case, Comparison, Found, Outcome, Verdict, Worst};
pub use desk::{Desk, Played};
pub use run::run_case;

/// Every case, family by family.
pub fn cases() -> Vec<Case> {
    let families: [&[Case]; 13] = [
        functions::CASES,
        generation::CASES,
        live::CASES,
        count::CASES,
        moisture::CASES,
        brdf::CASES,
        transport::CASES,
        transmittance::CASES,
        sorting::CASES,
        compositing::CASES,
        space::CASES,
        determinism::CASES,
        metamorphic::CASES,
    ];
    families.concat()
}
