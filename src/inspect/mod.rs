//! The rows that `nimbus inspect` prints: the buffers of each stage of a frame ([`stages`],
//! [`particles`]), the [`air`] and the BRDF [`basis`]. [`mitsuba`] has a scene as another program
//! reads it.

pub mod air;
pub mod basis;
pub mod mitsuba;
pub mod particles;
pub mod stages;
