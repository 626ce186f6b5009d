//! The scene's BRDF basis as rows, and warnings about materials that it represents badly.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;
use serde::Serialize;

use crate::model::basis::{Basis, N_NODES, node, node_t};
use crate::model::material::{Material, MaterialKey};
use crate::model::scene::{LightingMode, Scene};

/// Relative error of a material's lobe above which a warning is printed.
const WARN_ABOVE: f64 = 0.01;
/// Exponents over the range whose errors are listed, ends included.
const N_SHOWN: usize = 17;
/// Exponents tried between two keys of an edited material.
const N_BETWEEN_KEYS: u32 = 8;

/// The output of `nimbus inspect --basis --json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BasisReport {
    /// N_b of the scene, the number of bases that it asks for.
    pub asked: u32,
    /// Number of bases; fewer if the lobes over the range of exponents differ too little.
    pub kept: u32,
    /// Sampling of the exponents.
    pub sampling: &'static str,
    /// Range of the exponents n_s.
    pub exponents: [f64; 2],
    /// The singular values.
    pub singular_values: Vec<ValueRow>,
    /// The errors of lobes.
    pub errors: Vec<ErrorRow>,
    /// The basis functions.
    pub table: NodeTable,
}

/// A singular value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ValueRow {
    /// Number of the basis; 1 is the first after the diffuse one.
    pub basis: usize,
    /// The value.
    pub singular_value: f64,
    /// Whether the basis is used.
    pub kept: bool,
}

/// The error of the basis for the lobe of an exponent.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ErrorRow {
    /// `range`: one of a set over the range; `worst`: the worst of the range; `material`: the worst
    /// of a material over time.
    pub of: &'static str,
    /// Name of the material.
    pub material: Option<String>,
    /// The exponent n_s.
    pub ns: f64,
    /// Relative, L2 under the weight 4 cos γ sin γ dγ.
    pub error: f64,
}

/// The basis functions at the nodes, column by column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NodeTable {
    /// Parameter of the nodes.
    pub t: Vec<f64>,
    /// Angle γ of the nodes in degrees.
    pub gamma_deg: Vec<f64>,
    /// Values of the bases, the diffuse one first.
    pub bases: Vec<Vec<f64>>,
}

/// Returns the basis of the scene's settings.
fn of_scene(scene: &Scene) -> Basis {
    Basis::new(scene.lighting.exponents, scene.lighting.bases, scene.lighting.sampling)
}

/// Returns everything about the scene's basis.
pub fn report(scene: &Scene) -> BasisReport {
    let basis = of_scene(scene);
    let values = basis.singular_values().iter().enumerate();
    BasisReport {
        asked: basis.n_asked(),
        kept: basis.n_bases(),
        sampling: scene.lighting.sampling.name(),
        exponents: basis.exponents(),
        singular_values: values
            .map(|(i, s)| ValueRow {
                basis: i + 1,
                singular_value: *s,
                kept: i < basis.vectors().len(),
            })
            .collect(),
        errors: errors(&basis, &scene.materials),
        table: table(&basis),
    }
}

/// Returns a note if the basis has fewer functions than the scene asks for.
pub fn note(report: &BasisReport) -> Option<String> {
    let [low, high] = report.exponents;
    let (asked, kept) = (report.asked, report.kept);
    (kept < asked).then(|| {
        format!(
            "{asked} bases asked for, {kept} kept: the lobes of n_s from {low} to {high} differ in \
             no more"
        )
    })
}

/// Returns a warning for every glossy material whose lobe the basis represents with an error above
/// 1 % at some time.
pub fn basis_warnings(scene: &Scene) -> Vec<String> {
    let is_lit = scene.lighting.mode != LightingMode::None;
    if !is_lit || !scene.materials.iter().any(Material::is_glossy) {
        return vec![];
    }
    let basis = of_scene(scene);
    let worst = scene.materials.iter().filter_map(|m| Some((m, worst_of(&basis, m)?)));
    worst.filter(|(_, w)| w.1 > WARN_ABOVE).map(|(m, w)| warning(&basis, m, w)).collect()
}

fn warning(basis: &Basis, material: &Material, (ns, error): (f64, f64)) -> String {
    let name = &material.name;
    match basis.n_bases() {
        1 => format!(
            "material `{name}`: lighting.bases = 1 is the diffuse basis alone and leaves out its \
             lobe; raise it"
        ),
        n => format!(
            "material `{name}`: {n} bases represent n_s = {} only to {:.2} %; raise lighting.bases \
             or narrow lighting.exponents",
            (ns * 100.0).round() / 100.0,
            error * 100.0
        ),
    }
}

fn errors(basis: &Basis, materials: &[Material]) -> Vec<ErrorRow> {
    let of_range = |(ns, error)| ErrorRow { of: "range", material: None, ns, error };
    let mut shown = basis.spread(N_SHOWN);
    shown.dedup();
    let mut rows: Vec<ErrorRow> =
        shown.into_iter().map(|ns| of_range((ns, basis.error(ns)))).collect();
    rows.push(ErrorRow { of: "worst", ..of_range(basis.worst()) });
    rows.extend(materials.iter().filter_map(|m| {
        let (ns, error) = worst_of(basis, m)?;
        Some(ErrorRow { of: "material", material: Some(m.name.clone()), ns, error })
    }));
    rows
}

/// Returns the exponent with the greatest error among those that the material has while it has a
/// lobe, and this error.
fn worst_of(basis: &Basis, material: &Material) -> Option<(f64, f64)> {
    let has_lobe = |k: &MaterialKey| k.brdf.ks != DVec3::ZERO;
    let at_keys = material.keys.iter().filter(|k| has_lobe(k)).map(|k| k.brdf.ns);
    let moving =
        material.keys.windows(2).filter(|k| k[0].brdf.ns != k[1].brdf.ns && k.iter().any(has_lobe));
    let between = moving.flat_map(|k| {
        let part = |i: u32| f64::from(i) / f64::from(N_BETWEEN_KEYS + 1);
        (1..=N_BETWEEN_KEYS).map(move |i| k[0].brdf.ns + part(i) * (k[1].brdf.ns - k[0].brdf.ns))
    });
    let tried = at_keys.chain(between).map(|ns| (ns, basis.error(ns)));
    tried.reduce(|worst, next| if next.1 > worst.1 { next } else { worst })
}

fn table(basis: &Basis) -> NodeTable {
    // w = 1 − cos γ = 2 sin²(γ/2).
    let gamma_deg = |i: usize| (2.0 * (0.5 * node(i)).sqrt().asin()).to_degrees();
    let diffuse = vec![FRAC_1_PI; N_NODES];
    NodeTable {
        t: (0..N_NODES).map(node_t).collect(),
        gamma_deg: (0..N_NODES).map(gamma_deg).collect(),
        bases: std::iter::once(diffuse).chain(basis.vectors().iter().cloned()).collect(),
    }
}

impl NodeTable {
    /// Returns the names of the columns: t, gamma_deg, b0, b1, ...
    pub fn names(&self) -> Vec<String> {
        let bases = (0..self.bases.len()).map(|b| format!("b{b}"));
        ["t", "gamma_deg"].map(str::to_owned).into_iter().chain(bases).collect()
    }

    /// Returns a row for every node.
    pub fn rows(&self) -> impl Iterator<Item = Vec<f64>> {
        let columns = [&self.t, &self.gamma_deg].into_iter().chain(&self.bases).collect::<Vec<_>>();
        (0..self.t.len()).map(move |i| columns.iter().map(|c| c[i]).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::basis::Sampling;
    use crate::model::cover::Cover;
    use crate::model::material::Brdf;
    use crate::model::phase::Scattering;

    fn material(keys: &[(f64, f64, f64)]) -> Material {
        let key = |&(time_s, ks, ns): &(f64, f64, f64)| MaterialKey {
            time_s,
            brdf: Brdf { kd: DVec3::splat(0.5), ks: DVec3::splat(ks), ns },
        };
        Material {
            name: "m".into(),
            keys: keys.iter().map(key).collect(),
            scattering: Scattering::default(),
            cover: Cover::Plain,
        }
    }

    #[test]
    fn the_error_of_a_material_is_the_worst_while_it_has_a_lobe() {
        let basis = Basis::new([1.0, 256.0], 4, Sampling::Log);
        assert_eq!(worst_of(&basis, &material(&[(0.0, 0.0, 256.0)])), None);
        assert_eq!(worst_of(&basis, &material(&[(0.0, 0.1, 9.0)])), Some((9.0, basis.error(9.0))));
        let (ns, error) =
            worst_of(&basis, &material(&[(0.0, 0.1, 1.0), (1.0, 0.1, 256.0)])).expect("a lobe");
        let of_ends = basis.error(1.0).max(basis.error(256.0));
        assert!(error >= of_ends && error == basis.error(ns) && error <= basis.worst().1 * 1.001);
        // The lobe is gone before the exponent moves.
        let fades = material(&[(0.0, 0.1, 9.0), (1.0, 0.0, 9.0), (2.0, 0.0, 256.0)]);
        assert_eq!(worst_of(&basis, &fades), Some((9.0, basis.error(9.0))));
    }

    #[test]
    fn warnings_state_the_error_and_the_remedy() {
        let basis = Basis::new([1.0, 10000.0], 8, Sampling::Log);
        let text = warning(&basis, &material(&[(0.0, 0.1, 1e4)]), (1e4, 0.048));
        let expected = "material `m`: 8 bases represent n_s = 10000 only to 4.80 %; raise \
                        lighting.bases or narrow lighting.exponents";
        assert_eq!(text, expected);
        let alone = Basis::new([1.0, 10000.0], 1, Sampling::Log);
        assert!(
            warning(&alone, &material(&[(0.0, 0.1, 1e4)]), (1e4, 1.0))
                .contains("leaves out its lobe")
        );
    }
}
