//! The meaning of a row's properties: those of a particle in a list, or of a splat of 3D Gaussian
//! splatting (Kerbl et al. 2023).

use glam::{DQuat, DVec3};

use super::header::{Element, Scalar};
use super::rows::{Fault, Made, OfRow};
use crate::io::bounds::{AMOUNT, COORDINATE, DIVISOR, LEAST, is_size, wrong_size};
use crate::io::document::suggest::list;
use crate::io::particle_file::wrong_height;
use crate::model::cloud::{Particle, SIGMA_PER_RADIUS, SQRT_TAU, Shape, unit_quaternion};
use crate::model::harmonics::{Coefficients, MAX_DEGREE, n_rest};

/// Greatest opacity of a splat, as in the rasterizer of Kerbl et al.: no splat hides all behind it.
const MOST_OPACITY: f64 = 0.99;
/// Y₀₀ = ½/√π: the harmonic of degree 0, by which f_dc counts.
const HARMONIC: f64 = 0.282_094_791_773_878_14;
const FINITE: &str = "a finite number";
/// p of Thomsen's formula for the mean area of an ellipsoid.
const THOMSEN: f64 = 1.6075;

/// Three properties, by their numbers.
type Three = [usize; 3];

enum Size {
    /// σ or a multiple of it, σ along y and z, and the rotation.
    Sigma { wide: usize, factor: f64, others: [Option<usize>; 2], rotation: Option<[usize; 4]> },
    /// Logarithms of σ along three axes, and their rotation.
    Scales(Three, Option<[usize; 4]>),
}

enum Density {
    Kappa(usize),
    /// The logit of the opacity.
    Opacity(usize),
}

enum Color {
    White,
    /// Linear, with the number that counts as 1.
    Linear(Three, [f64; 3]),
    /// Coefficients of harmonics of degree 0.
    Harmonics(Three),
}

/// The properties of which particles are made.
pub struct Columns {
    position: Three,
    size: Size,
    density: Density,
    color: Color,
    harmonics: Option<HarmonicColumns>,
}

/// The properties of which colours are made that change with the direction of view.
pub struct HarmonicColumns {
    degree: u32,
    mean: Three,
    /// Of each harmonic from degree 1 on, by channel.
    rest: Vec<Three>,
}

impl HarmonicColumns {
    /// Finds the properties `f_rest_0`…, which have all harmonics of a channel together.
    fn find(element: &Element, mean: Three) -> Result<Option<HarmonicColumns>, String> {
        let n = element.properties.iter().filter(|p| p.name.starts_with("f_rest_")).count();
        if n == 0 {
            return Ok(None);
        }
        let expected = || {
            let counts: Vec<String> =
                (1..=MAX_DEGREE).map(|d| (3 * n_rest(d) - 1).to_string()).collect();
            format!("expected f_rest_0 to f_rest_{}, of degree 1 to 3, found {n}", counts.join("/"))
        };
        let degree =
            (1..=MAX_DEGREE).find(|d| 3 * n_rest(*d) as usize == n).ok_or_else(expected)?;
        let of = |k: usize| {
            let name = format!("f_rest_{k}");
            element.properties.iter().position(|p| p.name == name).ok_or_else(expected)
        };
        let n_harmonics = n / 3;
        let rest: Result<Vec<Three>, String> = (0..n_harmonics)
            .map(|k| Ok([of(k)?, of(k + n_harmonics)?, of(k + 2 * n_harmonics)?]))
            .collect();
        Ok(Some(HarmonicColumns { degree, mean, rest: rest? }))
    }

    /// Returns the greatest degree.
    pub fn degree(&self) -> u32 {
        self.degree
    }
}

impl OfRow<Coefficients> for HarmonicColumns {
    #[inline]
    fn made(&self, value: impl Fn(usize) -> f64) -> Made<Coefficients> {
        let mut made = Coefficients::default();
        for (channel, i) in self.mean.into_iter().enumerate() {
            made[0][channel] = (0.5 + HARMONIC * coordinate(i, value(i))?) as f32;
        }
        let mut are_right = true;
        for (to, of) in made[1..].iter_mut().zip(&self.rest) {
            for channel in 0..3 {
                let v = value(of[channel]);
                are_right &= COORDINATE.contains(v);
                to[channel] = v as f32;
            }
        }
        if !are_right {
            for i in self.rest.as_flattened() {
                coordinate(*i, value(*i))?;
            }
        }
        Ok(made)
    }
}

/// Returns `v`, the value of property `i`, if it is a coordinate.
#[inline]
fn coordinate(i: usize, v: f64) -> Made<f64> {
    let wrong = || if v.is_finite() { COORDINATE.to_string() } else { FINITE.to_owned() };
    if COORDINATE.contains(v) { Ok(v) } else { Err(fault(i, v, wrong)) }
}

/// Returns `v`, the value of property `i`, if it is a finite number.
#[inline]
fn finite(i: usize, v: f64) -> Made<f64> {
    if v.is_finite() { Ok(v) } else { Err(fault(i, v, || FINITE.to_owned())) }
}

/// Returns the fault of property `i`, whose value is `found`.
#[cold]
fn fault(i: usize, found: f64, expected: impl FnOnce() -> String) -> Fault {
    Fault { i, what: format!("expected {}, found `{found}`", expected()) }
}

impl Columns {
    /// Finds the properties of an element. A failure says which one is missing.
    pub fn find(element: &Element) -> Result<Columns, String> {
        let find = |name: &str| element.properties.iter().position(|p| p.name == name);
        let Ok(Some(position)) = all_of(element, ["x", "y", "z"]) else {
            return Err("expected properties `x`, `y`, `z`".to_owned());
        };
        let scales = all_of(element, ["scale_0", "scale_1", "scale_2"])?;
        let sizes = (find("sigma"), find("radius"), scales);
        let rotation = all_of(element, ["rot_0", "rot_1", "rot_2", "rot_3"])?;
        let others = ["sigma_y", "sigma_z"].map(find);
        let of_sigma = |wide, factor| Size::Sigma { wide, factor, others, rotation };
        let size = match sizes {
            (Some(i), None, None) => of_sigma(i, 1.0),
            (None, Some(i), None) => of_sigma(i, SIGMA_PER_RADIUS),
            (None, None, Some(scales)) => Size::Scales(scales, rotation),
            (None, None, None) => {
                return Err("expected a property `sigma`, `radius` (3 sigma), or `scale_0`, \
                            `scale_1`, `scale_2` (logarithms of sigma)"
                    .to_owned());
            }
            _ => return Err("expected one of `sigma`, `radius` and `scale_0`".to_owned()),
        };
        let density = match (find("kappa"), find("opacity")) {
            (Some(i), None) => Density::Kappa(i),
            (None, Some(i)) => Density::Opacity(i),
            (None, None) => {
                return Err("expected a property `kappa`, or `opacity` (its logit)".to_owned());
            }
            _ => return Err("expected `kappa` or `opacity`, found both".to_owned()),
        };
        let [linear, named, harmonics] =
            [["r", "g", "b"], ["red", "green", "blue"], ["f_dc_0", "f_dc_1", "f_dc_2"]]
                .map(|names| all_of(element, names));
        let color = match (linear?.or(named?), harmonics?) {
            (Some(of), _) => {
                let full = |i: usize| element.properties[i].scalar.and_then(Scalar::full);
                Color::Linear(of, of.map(|i| full(i).unwrap_or(1.0)))
            }
            (None, Some(of)) => Color::Harmonics(of),
            (None, None) => Color::White,
        };
        let harmonics = match color {
            Color::Harmonics(mean) => HarmonicColumns::find(element, mean)?,
            _ => None,
        };
        Ok(Columns { position, size, density, color, harmonics })
    }

    /// Returns the properties of colours that change with the direction of view.
    pub fn harmonics(&self) -> Option<&HarmonicColumns> {
        self.harmonics.as_ref()
    }
}

/// Returns the numbers of properties that stand together; `None` if the element has none of them.
fn all_of<const N: usize>(
    element: &Element,
    names: [&str; N],
) -> Result<Option<[usize; N]>, String> {
    let find = |name: &str| element.properties.iter().position(|p| p.name == name);
    let found: Vec<usize> = names.iter().filter_map(|name| find(name)).collect();
    match found.try_into() {
        Ok(all) => Ok(Some(all)),
        Err(some) if some.is_empty() => Ok(None),
        Err(_) => Err(format!("expected all of {} or none", list(&names))),
    }
}

impl OfRow<Particle> for Columns {
    #[inline]
    fn made(&self, value: impl Fn(usize) -> f64) -> Made<Particle> {
        // Three million splats are read in a second: sentences are made of faults alone.
        let finite = |i: usize| finite(i, value(i));
        let size = |i: usize, v: f64, least: f64| {
            let wrong = || match wrong_size(v, least) {
                Some(expected) if v.is_finite() => expected,
                _ => AMOUNT.to_string(),
            };
            if is_size(v, least) { Ok(v) } else { Err(fault(i, value(i), wrong)) }
        };
        let place = |k: usize| coordinate(self.position[k], value(self.position[k]));
        let position = DVec3::new(place(0)?, place(1)?, place(2)?);
        let turn = |rotation: Option<[usize; 4]>| {
            let Some([w, x, y, z]) = rotation else { return Ok(DQuat::IDENTITY) };
            let turn = DQuat::from_xyzw(finite(x)?, finite(y)?, finite(z)?, finite(w)?);
            let zero = || fault(w, value(w), || "a rotation other than zero".to_owned());
            unit_quaternion(turn).ok_or_else(zero)
        };
        // Where an aspect is limited, κ is `share` of the given one, so that the mass stays.
        let (sigma, shape, logs, share) = match self.size {
            Size::Sigma { wide, factor, others, rotation } => {
                let sigma = size(wide, factor * value(wide), LEAST)?;
                let other = |j: Option<usize>, than: [f64; 2]| match j {
                    Some(j) if sigma > 0.0 => {
                        let of = finite(j)?;
                        match than.into_iter().find_map(|than| wrong_height(of, than)) {
                            Some(expected) => Err(fault(j, of, || expected)),
                            None => size(j, of, LEAST),
                        }
                    }
                    _ => Ok(sigma),
                };
                let high = other(others[0], [sigma; 2])?;
                let deep = other(others[1], [sigma, high])?;
                // Without a third axis and a rotation no number is rounded.
                let (first, shape) = match (others[1], rotation) {
                    _ if sigma == 0.0 => (sigma, Shape::BALL),
                    (None, None) => (sigma, Shape::upright(high / sigma)),
                    (_, rotation) => Shape::of(DVec3::new(sigma, high, deep), turn(rotation)?),
                };
                (first, shape, [sigma, high, deep].map(libm::log), 1.0)
            }
            Size::Scales(of, rotation) => {
                let scale = |i: usize| {
                    let sigma = libm::exp(finite(i)?);
                    let expected = || format!("a logarithm of 0 or of {DIVISOR}");
                    let is_right = is_size(sigma, LEAST);
                    if is_right { Ok(sigma) } else { Err(fault(i, value(i), expected)) }
                };
                let scales = DVec3::new(scale(of[0])?, scale(of[1])?, scale(of[2])?);
                let (sigma, shape) = Shape::of(scales, turn(rotation)?);
                let own = sigma * sigma * sigma * shape.volume();
                let share = if own > 0.0 { scales.element_product() / own } else { 1.0 };
                (sigma, shape, [value(of[0]), value(of[1]), value(of[2])], share)
            }
        };
        let own = sigma * sigma * sigma * shape.volume();
        let kappa = match self.density {
            Density::Kappa(i) => share * size(i, value(i), 0.0)?,
            Density::Opacity(i) => {
                let opacity = 1.0 / (1.0 + libm::exp(-finite(i)?));
                let depth = -libm::log1p(-opacity.min(MOST_OPACITY));
                // κ (2π)^{3/2} V = τ 2π A, with V and A over those of the unit ball.
                let mass = depth * libm::exp(log_area(logs)) / SQRT_TAU;
                let kappa = if own > 0.0 { mass / own } else { 0.0 };
                size(i, kappa, 0.0)?
            }
        };
        let color = match self.color {
            Color::White => DVec3::ONE,
            Color::Linear(of, full) => {
                let of = |k: usize| size(of[k], value(of[k]) / full[k], 0.0);
                DVec3::new(of(0)?, of(1)?, of(2)?)
            }
            Color::Harmonics(of) => {
                let mean = |i: usize| size(i, (0.5 + HARMONIC * finite(i)?).max(0.0), 0.0);
                DVec3::new(mean(of[0])?, mean(of[1])?, mean(of[2])?)
            }
        };
        Ok(Particle { position, sigma, shape, kappa, color })
    }
}

/// Returns the logarithm of the mean over all directions of an ellipsoid's projected area, over π,
/// from the logarithms of its half axes.
fn log_area([a, b, c]: [f64; 3]) -> f64 {
    let [ab, ac, bc] = [a + b, a + c, b + c];
    let most = ab.max(ac).max(bc);
    // The greatest term is 1.
    let of = |pair: f64| if pair == most { 1.0 } else { libm::exp(THOMSEN * (pair - most)) };
    most + libm::log((of(ab) + of(ac) + of(bc)) / 3.0) / THOMSEN
}
