//! Coefficients of harmonics by particle, which a shader reads by texels: mean colour and κ, then
//! three numbers for each harmonic, four numbers a texel.

use crate::model::harmonics::{Coefficients, n_rest};

/// Returns the texels of a particle whose harmonics end at `degree`.
pub const fn n_texels(degree: u32) -> u32 {
    1 + (3 * n_rest(degree)).div_ceil(4)
}

/// Appends the texels of a particle.
pub fn push_texels(to: &mut Vec<[f32; 4]>, of: &Coefficients, kappa: f64, degree: u32) {
    let [r, g, b] = of[0];
    to.push([r, g, b, kappa as f32]);
    let numbers = of[1..=n_rest(degree) as usize].as_flattened();
    to.extend(numbers.chunks(4).map(|some| {
        let mut four = [0.0; 4];
        four[..some.len()].copy_from_slice(some);
        four
    }));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_lie_in_fours_after_the_mean() {
        let mut of = Coefficients::default();
        of.as_flattened_mut().iter_mut().zip(1..).for_each(|(v, k)| *v = k as f32);
        for (degree, n) in [(1, 4), (2, 7), (3, 13)] {
            let mut texels = vec![];
            push_texels(&mut texels, &of, 7.0, degree);
            assert_eq!((n_texels(degree), texels.len()), (n, n as usize));
            assert_eq!(texels[0], [1.0, 2.0, 3.0, 7.0]);
            assert_eq!(texels[1], [4.0, 5.0, 6.0, 7.0]);
            let n_numbers = 3 * n_rest(degree) as usize;
            let rest = texels[1..].as_flattened();
            assert_eq!(rest[n_numbers - 1], 3.0 + n_numbers as f32);
            assert!(rest[n_numbers..].iter().all(|v| *v == 0.0));
        }
    }
}
