//! The sums of C (13)–(16) over the tensors, model.md §7 and passes.md "contract".
//!
//! In: T1 [light][row], T2 [light][column][row], the lights' energies, the columns' coefficients.
//! Out: I_d and I_i (W m⁻²), L1 and L2 (W m⁻² sr⁻¹), RGB a facet.

use std::f64::consts::PI;

use glam::DVec3;

/// Both tensors.
#[derive(Debug, Clone, Copy)]
pub struct Tensors<'a> {
    /// T1. *Shape*: [light][row].
    pub t1: &'a [f64],
    /// T2. *Shape*: [light][column][row].
    pub t2: &'a [f64],
    /// Number of rows.
    pub n_rows: usize,
    /// Number of columns; 0 without the second reflection.
    pub n_columns: usize,
}

/// A facet as a receiver.
#[derive(Debug, Clone, PartialEq)]
pub struct Receiver {
    /// Row of the diffuse basis.
    pub row: usize,
    /// Distance in rows from a basis to the next one.
    pub stride: usize,
    /// c_0 = K_d times the facet's colour.
    pub albedo: DVec3,
    /// c_b of the facet's lobe.
    pub lobe: Vec<DVec3>,
}

/// Light of a facet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflected {
    /// I_d.
    pub direct: DVec3,
    /// I_i.
    pub indirect: DVec3,
    /// L1 toward the eye.
    pub first: DVec3,
    /// L2 toward the eye.
    pub second: DVec3,
}

/// Contracts the tensors for one receiver. `columns` are C, then K_d or one channel of it, then K_s
/// c_b(n_s), of every region; at least as many as T2 has.
pub fn contract(
    tensors: &Tensors<'_>,
    energies: &[DVec3],
    columns: &[DVec3],
    receiver: &Receiver,
) -> Reflected {
    let Tensors { t1, t2, n_rows, n_columns } = *tensors;
    let first = |row: usize| -> DVec3 {
        energies.iter().enumerate().map(|(l, e)| *e * t1[l * n_rows + row]).sum()
    };
    let second = |row: usize| -> DVec3 {
        let of_light = |l: usize| -> DVec3 {
            (0..n_columns).map(|c| columns[c] * t2[(l * n_columns + c) * n_rows + row]).sum()
        };
        energies.iter().enumerate().map(|(l, e)| *e * of_light(l)).sum()
    };
    let c = std::iter::once(&receiver.albedo).chain(&receiver.lobe);
    let rows = (0..).map(|b: usize| receiver.row + b * receiver.stride);
    let (l1, l2) = c.zip(rows).fold((DVec3::ZERO, DVec3::ZERO), |(l1, l2), (c, row)| {
        (l1 + *c * first(row), l2 + *c * second(row))
    });
    Reflected {
        direct: PI * first(receiver.row),
        indirect: PI * second(receiver.row),
        first: l1,
        second: l2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lambertian_pair_gives_what_c_15_and_16_give_by_hand() {
        // One light of energy 2 on two facets with g = ½: T1 = g/π. The emitter (K_d = ½) sends A
        // g/π through a form factor V cos cos/(d² + A/π) = ¼ with A = 2: T2[0] = (1/π)·¼·2·½/π.
        let (g, form, area) = (0.5, 0.25, 2.0);
        let t1 = [g / PI, g / PI];
        let t2 = [0.0, form * area * g / PI / PI];
        let tensors = Tensors { t1: &t1, t2: &t2, n_rows: 2, n_columns: 1 };
        let receiver = Receiver { row: 1, stride: 2, albedo: DVec3::splat(0.25), lobe: vec![] };
        let lit = contract(&tensors, &[DVec3::splat(2.0)], &[DVec3::splat(0.5)], &receiver);
        // I_d = E g = 1; L1 = K_d I_d/π; I_i = form A L1_emitter = ½·(½·1/π); L2 = K_d I_i/π.
        let close = |a: DVec3, b: f64| assert!((a - DVec3::splat(b)).length() < 1e-15, "{a} {b}");
        close(lit.direct, 1.0);
        close(lit.first, 0.25 / PI);
        close(lit.indirect, 0.25 / PI);
        close(lit.second, 0.0625 / (PI * PI));
    }

    #[test]
    fn channels_lights_and_bases_find_their_places() {
        // Two lights, a lobe of one vector (rows 0 and 1), three columns: red, green, blue of one
        // region.
        let t1 = [1.0, 10.0, 2.0, 20.0];
        let t2: Vec<f64> = (0..12).map(f64::from).collect();
        let tensors = Tensors { t1: &t1, t2: &t2, n_rows: 2, n_columns: 3 };
        let receiver = Receiver {
            row: 0,
            stride: 1,
            albedo: DVec3::new(1.0, 0.0, 0.0),
            lobe: vec![DVec3::new(0.0, 1.0, 0.0)],
        };
        let energies = [DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, 0.0, 1.0)];
        let lit = contract(&tensors, &energies, &DVec3::AXES, &receiver);
        assert_eq!(lit.direct, PI * DVec3::new(3.0, 1.0, 2.0));
        assert_eq!(lit.first, DVec3::new(3.0, 10.0, 0.0));
        // Row 0: light 0 has columns 0, 2, 4, light 1 has 6, 8, 10. Row 1: 1, 3, 5 and 7, 9, 11.
        assert_eq!(lit.indirect, PI * DVec3::new(6.0, 2.0, 10.0));
        assert_eq!(lit.second, DVec3::new(6.0, 3.0, 0.0));
    }
}
