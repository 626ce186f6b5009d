//! Weather models' output to plain data: a [`container`] of variables, which [`netcdf`] reads in
//! every kind of the format, and [`wrf`], which knows what WRF's variables mean. What is done with
//! the numbers is `model::weather`.

pub mod container;
pub mod netcdf;
pub mod wrf;
mod wrf_clock;
mod wrf_fields;
