//! Blinn–Phong materials, C (11): f = K_d/π + K_s (n_s+2)/(2π) cos^{n_s} γ.

use glam::DVec3;

#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    pub name: String,
    pub kd: DVec3,
    pub ks: DVec3,
    pub ns: f64,
}

impl Material {
    /// The greatest K_d + 4 K_s over the channels: above 1 the material can reflect more than it receives
    /// (model.md §5: with γ from the half vector the lobe's albedo tends to 4 K_s cos²θ).
    pub fn greatest_albedo(&self) -> f64 {
        (self.kd + 4.0 * self.ks).max_element()
    }
}
