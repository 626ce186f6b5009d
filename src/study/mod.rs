//! Measures a scene: runs it, compares it with the references, and writes down what came out.

pub mod against;
pub mod basis;
pub mod bench;
pub mod beside;
pub mod cases;
pub mod compare;
pub mod difference;
pub mod inspect;
pub mod kept;
pub mod ledger;
pub mod machine;
pub mod model_light;
pub mod outcome;
pub mod overlap;
pub mod picture;
pub mod pixels;
pub mod plot;
pub mod provenance;
pub mod recorded;
pub mod records;
pub mod report;
pub mod stage;
pub mod stress;
pub mod trace;
pub mod tradeoff;
pub mod truth;
