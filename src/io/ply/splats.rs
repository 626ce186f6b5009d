//! The meaning of a row's properties: those of a particle in a list, or of a splat of 3D Gaussian
//! splatting (Kerbl et al. 2023).

use glam::{DQuat, DVec3};

use super::header::{Element, Scalar};
use super::rows::{Fault, Made, OfRow};
use crate::io::bounds::{
    AMOUNT, COORDINATE, DIVISOR, GREATEST, LEAST, wrong_coordinate, wrong_size,
};
use crate::io::document::suggest::list;
use crate::io::particle_file::wrong_height;
use crate::model::cloud::{Particle, SIGMA_PER_RADIUS, SQRT_TAU, Shape, unit_quaternion};
use crate::model::harmonics::{Coefficients, MAX_DEGREE, n_rest};

/// Greatest opacity of a splat, as in the rasterizer of Kerbl et al.: no splat hides all behind it.
const MOST_OPACITY: f64 = 0.99;
/// Y₀₀ = ½/√π: the harmonic of degree 0, by which f_dc counts.
const HARMONIC: f64 = 0.282_094_791_773_878_14;
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
    fn made(&self, value: impl Fn(usize) -> f64) -> Made<Coefficients> {
        let number = |i: usize| {
            let v = value(i);
            if COORDINATE.contains(v) {
                return Ok(v);
            }
            let finite = (!v.is_finite()).then(|| "a finite number".to_owned());
            let of = finite.unwrap_or_else(|| COORDINATE.to_string());
            Err(Fault { i, what: format!("expected {of}, found `{v}`") })
        };
        let mut made = Coefficients::default();
        for (channel, i) in self.mean.into_iter().enumerate() {
            made[0][channel] = (0.5 + HARMONIC * number(i)?) as f32;
        }
        for (to, of) in made[1..].iter_mut().zip(&self.rest) {
            for (channel, i) in of.iter().enumerate() {
                to[channel] = number(*i)? as f32;
            }
        }
        Ok(made)
    }
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
    fn made(&self, value: impl Fn(usize) -> f64) -> Made<Particle> {
        let checked = |i: usize, v: f64, expected: Option<String>| match expected {
            None => Ok(v),
            Some(of) => Err(Fault { i, what: format!("expected {of}, found `{}`", value(i)) }),
        };
        let finite = |i: usize| {
            let v = value(i);
            checked(i, v, (!v.is_finite()).then(|| "a finite number".to_owned()))
        };
        let size = |i: usize, v: f64, least: f64| {
            let wrong = if v.is_finite() { wrong_size(v, least) } else { Some(AMOUNT.to_string()) };
            checked(i, v, wrong)
        };
        let coordinate = |i: usize| finite(i).and_then(|v| checked(i, v, wrong_coordinate(v)));
        let [x, y, z] = self.position.map(coordinate);
        let position = DVec3::new(x?, y?, z?);
        let turn = |rotation: Option<[usize; 4]>| {
            let Some(of) = rotation else { return Ok(DQuat::IDENTITY) };
            let [w, x, y, z] = of.map(finite);
            let turn = unit_quaternion(DQuat::from_xyzw(x?, y?, z?, w?));
            let expected = "a rotation other than zero".to_owned();
            checked(of[0], 0.0, turn.is_none().then_some(expected))?;
            Ok(turn.unwrap_or_default())
        };
        // Where an aspect is limited, κ is `share` of the given one, so that the mass stays.
        let (sigma, shape, logs, share) = match self.size {
            Size::Sigma { wide, factor, others, rotation } => {
                let sigma = size(wide, factor * value(wide), LEAST)?;
                let other = |j: Option<usize>, than: [f64; 2]| match j {
                    Some(j) if sigma > 0.0 => {
                        let of = finite(j)?;
                        let wrong = than.into_iter().find_map(|than| wrong_height(of, than));
                        checked(j, of, wrong.or_else(|| wrong_size(of, LEAST)))
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
                let [a, b, c] = of.map(|i| {
                    let sigma = libm::exp(finite(i)?);
                    let wrong = sigma < LEAST && sigma != 0.0 || sigma > GREATEST;
                    let expected = || format!("a logarithm of 0 or of {DIVISOR}");
                    checked(i, sigma, wrong.then(expected))
                });
                let scales = DVec3::new(a?, b?, c?);
                let (sigma, shape) = Shape::of(scales, turn(rotation)?);
                let own = sigma * sigma * sigma * shape.volume();
                let share = if own > 0.0 { scales.element_product() / own } else { 1.0 };
                (sigma, shape, of.map(&value), share)
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
                let [r, g, b] = of.map(|i| {
                    let v = (0.5 + HARMONIC * finite(i)?).max(0.0);
                    size(i, v, 0.0)
                });
                DVec3::new(r?, g?, b?)
            }
        };
        Ok(Particle { position, sigma, shape, kappa, color })
    }
}

/// Returns the logarithm of the mean over all directions of an ellipsoid's projected area, over π,
/// from the logarithms of its half axes.
fn log_area([a, b, c]: [f64; 3]) -> f64 {
    let pairs = [a + b, a + c, b + c];
    let most = pairs.into_iter().fold(f64::NEG_INFINITY, f64::max);
    // The greatest term is 1.
    let of = |pair: f64| if pair == most { 1.0 } else { libm::exp(THOMSEN * (pair - most)) };
    most + libm::log(pairs.into_iter().map(of).sum::<f64>() / 3.0) / THOMSEN
}
