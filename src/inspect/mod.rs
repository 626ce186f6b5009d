//! The rows that `nimbus inspect` prints. They are buffers of a frame's [`stages`], its
//! [`particles`], the [`air`] and the BRDF [`basis`]. [`mitsuba`] has a scene as another program
//! reads it.

pub mod air;
pub mod basis;
pub mod mitsuba;
pub mod particles;
pub mod stages;
