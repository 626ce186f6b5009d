//! Error studies: run time against error over the knobs of a scene.
//!
//! Every configuration of the [`knobs`] ([`design`]) is drawn once and compared with a reference;
//! all are timed in alternating [`blocks`], on the device ([`device_runner`]). [`study`] runs it
//! all, [`front`] says which configurations are worth having, [`files`] writes and reads the
//! [`records`], and [`parts`] joins studies that several nodes made. [`Study::label`] names the
//! unchanged scene by its own values.
//!
//! [`Study::label`]: records::Study::label

mod base;
pub mod blocks;
pub mod design;
pub mod device_runner;
pub mod files;
pub mod front;
pub mod knobs;
pub mod parts;
pub mod records;
pub mod study;
