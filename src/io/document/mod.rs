//! TOML documents whose every key and value knows its origin: [`tree`] turns text into a tree,
//! [`overrides`] lays `--set` arguments over it, and [`section`] hands out the values of one table
//! and writes down what they came to.

mod depth;
mod other_files;
pub mod overrides;
pub mod section;
pub mod suggest;
pub mod tree;
