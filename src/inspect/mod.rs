//! The rows that `nimbus inspect` prints: the buffers of each stage of a frame ([`stages`]), the
//! [`air`] and the BRDF [`basis`].

pub mod air;
pub mod basis;
pub mod stages;
