//! The rows that `nimbus inspect` prints: what each stage of a frame holds, the air, and the basis.

pub mod air;
pub mod basis;
pub mod stages;
