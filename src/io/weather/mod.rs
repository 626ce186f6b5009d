//! Output of weather models to plain data: variables ([`container`]), which [`netcdf`] reads
//! from every kind of the format; [`wrf`], which knows what WRF's variables mean; and its clouds as
//! particles, of one step (`blobs`) or moving from step to step (`moving`). The numbers are worked
//! on in `model::weather`.

pub mod blobs;
pub mod container;
pub mod moving;
pub mod netcdf;
mod spans;
pub mod wrf;
mod wrf_clock;
mod wrf_fields;
mod wrf_variables;
