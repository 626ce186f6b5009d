//! Charts and pages made from result records alone, without a device.

pub mod charts;
pub mod pages;
