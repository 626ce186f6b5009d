//! The layers of a picture: what its pixels are made of.

/// The layers of a picture, row 0 at the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers {
    /// Columns and rows.
    pub size: [u32; 2],
    /// The picture, premultiplied linear RGBA.
    pub beauty: Vec<f32>,
    /// View depth of the nearest particle or surface, scene units; infinite where there is none.
    pub depth: Vec<f32>,
    /// Optical depth of all particles before the surface.
    pub optical_depth: Vec<f32>,
    /// Number of particles before the surface.
    pub n_particles: Vec<f32>,
    /// The picture of the first reflection alone, premultiplied linear RGB.
    pub first: Vec<f32>,
    /// The picture of the second reflection alone, premultiplied linear RGB.
    pub second: Vec<f32>,
}

impl Layers {
    /// Returns the number of values of the picture and its reflections that are not finite.
    pub fn n_not_finite(&self) -> usize {
        let all = [&self.beauty, &self.first, &self.second, &self.optical_depth];
        all.into_iter().flatten().filter(|v| !v.is_finite()).count()
    }
}
