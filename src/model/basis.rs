//! The BRDF basis, C (12): the diffuse lobe and the principal components of Blinn–Phong lobes (model.md §6).

/// How the lobes that the basis is made from are spread over the range of exponents.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    /// Evenly in ln n_s, each lobe of unit norm.
    Log,
    /// Evenly in n_s, each lobe as it is: C's own.
    Uniform,
}

impl Sampling {
    pub const NAMES: [(&'static str, Sampling); 2] = [("log", Sampling::Log), ("uniform", Sampling::Uniform)];
}

/// Most bases: the diffuse one and 31 of lobes.
pub const MAX_BASES: u32 = 32;

/// Nodes of a tabulated lobe.
pub const N_NODES: usize = 1024;

/// 1 − cos γ at node i.
pub fn node(i: usize) -> f64 {
    (i as f64 / (N_NODES - 1) as f64).powi(4)
}
