//! Charts and pages, made from the records of results alone.

pub mod charts;
pub mod pages;
