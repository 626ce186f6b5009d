//! Colours of particles that change with the direction of view: coefficients of real spherical
//! harmonics, as files of 3D Gaussian splatting have them (model.md §14).

/// Greatest degree.
pub const MAX_DEGREE: u32 = 3;

/// Harmonics of all degrees up to the greatest: (3 + 1)².
pub const N_HARMONICS: usize = 16;

/// Coefficients of a particle: of each harmonic, in ascending degree and order, linear RGB. The
/// first one is the whole mean colour, not a factor of the harmonic of degree 0.
pub type Coefficients = [[f32; 3]; N_HARMONICS];

/// The coefficients of all particles of a list.
#[derive(Debug, Clone, PartialEq)]
pub struct Harmonics {
    /// Greatest degree with coefficients: 1 to [`MAX_DEGREE`].
    pub degree: u32,
    /// Coefficients by particle; those of higher degrees are 0.
    pub by_particle: Vec<Coefficients>,
}

/// Returns the number of harmonics of degree 1 to `degree`.
pub const fn n_rest(degree: u32) -> u32 {
    (degree + 1) * (degree + 1) - 1
}
