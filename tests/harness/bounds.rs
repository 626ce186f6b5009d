//! What Vulkan's precision rules allow the shaders' functions to err.

use nimbus::reference::rounding::U_F32;

/// |formula − erf| of Abramowitz and Stegun 7.1.28, and on top of it what f32 makes of the formula at `x`: a running
/// bound over Horner's scheme, four squarings (which double a relative error), a division of 2.5 ulp = 5 u, and a
/// subtraction.
pub fn erf_bound(x: f64) -> f64 {
    const FORMULA: f64 = 3e-7;
    const COEFFICIENTS: [f64; 6] = [0.0705230784, 0.0422820123, 0.0092705272, 0.0001520143, 0.0002765672, 0.0000430638];
    let (u, a) = (U_F32, x.abs());
    let (mut s, mut error) = (0.0, 0.0);
    for c in COEFFICIENTS.into_iter().rev() {
        // c + a·s: the product's rounding, the coefficient's, the sum's.
        let product = a * s;
        error = a * error + u * product + u * c;
        s = c + product;
        error += u * (s + error);
    }
    let d = 1.0 + a * s;
    let mut relative = (a * error + u * (a * s) + u * d) * (1.0 + 4.0 * u) / d;
    for _ in 0..4 {
        relative = (1.0 + relative).powi(2) * (1.0 + u) - 1.0;
    }
    let q = d.powi(-16);
    let quotient = q * ((1.0 + 5.0 * u) / (1.0 - relative) - 1.0);
    FORMULA + quotient + u * (1.0 - q + quotient)
}
