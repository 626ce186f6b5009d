//! Whole pictures in f64, drawn from a scene alone: the light of every stage, then sprites, the
//! volume that they stand for, or the model itself.

pub mod kind;
pub mod model_light;
pub mod model_picture;
pub mod pixels;
pub mod samples;
pub mod stages;
pub mod whole;
