//! The shape of a Gaussian blob, model.md §14: a ball, or an ellipsoid whose axes are turned.

use glam::{DMat3, DQuat, DVec3, DVec4};

/// Least aspect of a blob; the greatest is its inverse.
pub const MIN_ASPECT: f64 = 1e-3;

/// A rotation in 64 bits: the three components of a unit quaternion other than the greatest, in
/// steps of 1.35e-6. All bits are 0 without a rotation.
///
/// Error: 4.7e-6 radians, 2√3 steps. Three components are rounded by half a step, √3/2 together.
/// The fourth at most doubles their distance, and the angle is twice that of quaternions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Turn([u32; 2]);

/// Components are stored as whole multiples of this; the greatest of 20 bits is 1/√2.
const STEP: f64 = std::f64::consts::FRAC_1_SQRT_2 / 524_287.0;
/// The bits of a component.
const BITS: u32 = 20;

impl Turn {
    /// No rotation.
    pub const NONE: Turn = Turn([0; 2]);

    /// Returns the stored rotation next to a unit quaternion.
    #[inline]
    pub fn new(rotation: DQuat) -> Turn {
        // w counts first, so that 0 is no rotation.
        let [x, y, z, w] = rotation.to_array();
        let of = [w, x, y, z];
        let greatest =
            (1..4).fold(0, |most, i| if of[i].abs() > of[most].abs() { i } else { most });
        let sign = if of[greatest] < 0.0 { -1.0 } else { 1.0 };
        let others = [[x, y, z], [w, y, z], [w, x, z], [w, x, y]][greatest];
        let bits = |v: f64| (sign * v / STEP).round() as i32 as u32 & ((1 << BITS) - 1);
        let bits = [bits(others[0]), bits(others[1]), bits(others[2])];
        Turn([
            bits[0] | bits[2] << BITS,
            bits[1] | (bits[2] >> 12) << BITS | (greatest as u32) << 28,
        ])
    }

    /// Returns the rotation that has these words: those of [`Turn::words`].
    pub const fn of_words(words: [u32; 2]) -> Turn {
        Turn(words)
    }

    /// Returns the rotation in two words.
    pub const fn words(self) -> [u32; 2] {
        self.0
    }

    /// Returns the rotation as a unit quaternion.
    #[inline]
    pub fn rotation(self) -> DQuat {
        let [low, high] = self.0;
        let component =
            |bits: u32| STEP * f64::from((bits << (32 - BITS)).cast_signed() >> (32 - BITS));
        let thirds = low >> BITS | (high >> BITS & 0xff) << 12;
        let [a, b, c] = [component(low), component(high), component(thirds)];
        let rest = (1.0 - (a * a + b * b + c * c)).max(0.0).sqrt();
        let [w, x, y, z] = match high >> 28 & 3 {
            0 => [rest, a, b, c],
            1 => [a, rest, b, c],
            2 => [a, b, rest, c],
            _ => [a, b, c, rest],
        };
        DQuat::from_xyzw(x, y, z, w).normalize()
    }
}

/// Returns a quaternion of finite numbers as one of length 1; `None` of zeros.
#[inline]
pub fn unit_quaternion(of: DQuat) -> Option<DQuat> {
    let greatest = DVec4::from(of).abs().max_element();
    // Squares of any numbers do not overflow then, nor vanish.
    (greatest > 0.0).then(|| DQuat::from_vec4(DVec4::from(of) / greatest).normalize())
}

/// The kinds of shapes among some blobs. Each includes those before it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shapes {
    /// Balls.
    #[default]
    Balls,
    /// Ellipsoids with one axis along y, the others equal.
    Upright,
    /// Any ellipsoids.
    Turned,
}

/// The shape of a blob: its half axes over σ, and their directions. Its first axis is σ long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Length of the second axis over that of the first. Without a turn the second lies along y.
    pub aspect: f64,
    /// Length of the third axis over that of the first.
    pub aspect_z: f64,
    /// Turns the axes from x, y and z.
    pub turn: Turn,
}

impl Default for Shape {
    fn default() -> Shape {
        Shape::BALL
    }
}

impl Shape {
    /// A ball.
    pub const BALL: Shape = Shape::upright(1.0);

    /// Returns the shape of σ along x and z and `aspect` σ along y.
    pub const fn upright(aspect: f64) -> Shape {
        Shape { aspect, aspect_z: 1.0, turn: Turn::NONE }
    }

    /// Returns whether one axis lies along y, and the others are equal.
    #[inline]
    pub fn is_upright(&self) -> bool {
        self.aspect_z == 1.0 && self.turn == Turn::NONE
    }

    /// Returns the kind of the shape.
    pub fn kind(&self) -> Shapes {
        match self.is_upright() {
            true if self.aspect == 1.0 => Shapes::Balls,
            true => Shapes::Upright,
            false => Shapes::Turned,
        }
    }

    /// Returns σ and the shape of an ellipsoid. `scales` are its σ along x, y and z before the
    /// rotation `turned`.
    ///
    /// The returned σ is the greatest of the three. An upright ellipsoid has the σ along x and z
    /// instead. An axis shorter than [`MIN_ASPECT`] of the longest is raised to that.
    #[inline]
    pub fn of(scales: DVec3, turned: DQuat) -> (f64, Shape) {
        let within =
            |v: f64| if v > 0.0 { v.clamp(MIN_ASPECT, 1.0 / MIN_ASPECT) } else { MIN_ASPECT };
        if scales.max_element() <= 0.0 {
            return (0.0, Shape::BALL);
        }
        let scales = scales.max(DVec3::splat(MIN_ASPECT * scales.max_element()));
        let (wide, high) = match scales.x == scales.z {
            true if scales.x == scales.y || turned == DQuat::IDENTITY => (scales.x, scales.y),
            _ => upright_of(scales, turned).unwrap_or_default(),
        };
        if wide > 0.0 {
            return (wide, Shape::upright(within(high / wide)));
        }
        // The axes change places in a circle, which is a turn by a third about their diagonal: of
        // the quaternion, cos 60° and sin 60°/√3.
        let first = (1..3).fold(0, |most, i| if scales[i] > scales[most] { i } else { most });
        let third = DQuat::from_xyzw(0.5, 0.5, 0.5, 0.5);
        let of = [scales.x, scales.y, scales.z];
        let sigma = of[first];
        let turned = (0..first).fold(turned, |turned, _| turned * third);
        let shape = Shape {
            aspect: within(of[(first + 1) % 3] / sigma),
            aspect_z: within(of[(first + 2) % 3] / sigma),
            turn: Turn::new(turned),
        };
        // The stored rotation may make it upright. It must be the same after it was written and
        // read.
        match upright_of(sigma * shape.lengths(), shape.turn.rotation()) {
            Some((wide, high)) => (wide, Shape::upright(within(high / wide))),
            None => (sigma, shape),
        }
    }

    /// Returns the lengths of the axes over σ.
    #[inline]
    pub fn lengths(&self) -> DVec3 {
        DVec3::new(1.0, self.aspect, self.aspect_z)
    }

    /// Returns the axes, unit vectors, as columns.
    #[inline]
    pub fn axes(&self) -> DMat3 {
        if self.turn == Turn::NONE {
            return DMat3::IDENTITY;
        }
        DMat3::from_quat(self.turn.rotation())
    }

    /// Returns M v, which is as long across the blob as along it: M divides by the lengths of the
    /// axes.
    pub fn whiten(&self, v: DVec3) -> DVec3 {
        self.along_axes(v, |of, length| of / length)
    }

    /// Returns M⁻¹ v: from the unit sphere to the blob's.
    pub fn stretch(&self, v: DVec3) -> DVec3 {
        self.along_axes(v, |of, length| of * length)
    }

    fn along_axes(&self, v: DVec3, change: impl Fn(DVec3, DVec3) -> DVec3) -> DVec3 {
        if self.turn == Turn::NONE {
            return change(v, self.lengths());
        }
        let axes = self.axes();
        axes * change(axes.transpose() * v, self.lengths())
    }

    /// Takes a point of the unit ball, whose axes are those of the blob, to the blob. Lengths are
    /// over σ.
    pub fn from_ball(&self, v: DVec3) -> DVec3 {
        self.axes() * (self.lengths() * v)
    }

    /// Returns a gradient over the ball of [`Shape::from_ball`] as one over the blob.
    pub fn gradient_from_ball(&self, g: DVec3) -> DVec3 {
        self.axes() * (g / self.lengths())
    }

    /// Returns S = M⁻²: the covariance over σ².
    pub fn covariance(&self) -> DMat3 {
        let lengths = DMat3::from_diagonal(self.lengths() * self.lengths());
        let axes = self.axes();
        axes * lengths * axes.transpose()
    }

    /// Returns the standard deviations along x, y and z over σ.
    #[inline]
    pub fn extents(&self) -> DVec3 {
        if self.turn == Turn::NONE {
            return self.lengths();
        }
        let (axes, lengths) = (self.axes(), self.lengths());
        let along = |i: usize| (lengths * axes.row(i)).length();
        DVec3::new(along(0), along(1), along(2))
    }

    /// Returns the greatest length of an axis over σ.
    #[inline]
    pub fn widest(&self) -> f64 {
        self.lengths().max_element()
    }

    /// Returns the least length of an axis over σ.
    #[inline]
    pub fn narrowest(&self) -> f64 {
        self.lengths().min_element()
    }

    /// Returns the standard deviation along y over that across y, in the mean over x and z by its
    /// square.
    #[inline]
    pub fn aspect_upright(&self) -> f64 {
        self.aspect_upright_of(self.extents())
    }

    /// Returns [`Shape::aspect_upright`] from [`Shape::extents`].
    #[inline]
    pub fn aspect_upright_of(&self, extents: DVec3) -> f64 {
        if self.is_upright() {
            return self.aspect;
        }
        extents.y / (0.5 * (extents.x * extents.x + extents.z * extents.z)).sqrt()
    }

    /// Returns the volume over that of the ball of σ.
    #[inline]
    pub fn volume(&self) -> f64 {
        self.aspect * self.aspect_z
    }
}

/// Returns σ along x and z, and along y, of an ellipsoid that is upright after it is turned; `None`
/// of others. Rotations in f32 are rounded by 6e-8, so that a relative difference of 1e-6 counts as
/// none.
#[inline]
fn upright_of(scales: DVec3, turned: DQuat) -> Option<(f64, f64)> {
    // Squares of the axes are the eigenvalues of the covariance. If the bounds below hold, all its
    // elements are within 1e-6 of the greatest from those of an upright one. Then two eigenvalues
    // are within 6e-6 of it from each other (Weyl), and most ellipsoids need no matrix.
    let squares = scales * scales;
    let apart = (squares - DVec3::new(squares.y, squares.z, squares.x)).abs();
    if apart.min_element() > 1e-4 * squares.max_element() {
        return None;
    }
    // Covariance: the sum of σ² r rᵀ over the turned axes r.
    let (mut own, mut across) = (DVec3::ZERO, DVec3::ZERO);
    let axes = DMat3::from_quat(turned);
    for (axis, sigma) in [axes.x_axis, axes.y_axis, axes.z_axis].iter().zip(scales.to_array()) {
        let r = sigma * *axis;
        own += r * r;
        across += r * DVec3::new(r.y, r.z, r.x);
    }
    let wide = 0.5 * (own.x + own.z);
    // Of an upright one these differences and products are zero.
    let most = [wide.max(own.y), wide.max(own.y), wide];
    let is_upright = (own.x - wide).abs() <= 1e-6 * wide
        && across.to_array().iter().zip(most).all(|(of, most)| of.abs() <= 1e-6 * most);
    is_upright.then(|| (wide.sqrt(), own.y.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quaternions_may_have_any_length() {
        let unit = DQuat::from_xyzw(0.5, -0.5, 0.5, 0.5);
        for length in [2.0, 1e-300, 1e300] {
            let found = unit_quaternion(unit * length).unwrap();
            assert!(found.abs_diff_eq(unit, 1e-15), "{length}: {found}");
        }
        assert_eq!(unit_quaternion(unit * 0.0), None);
    }

    fn rotations() -> Vec<DQuat> {
        let mut all = vec![DQuat::IDENTITY];
        for k in 1..60 {
            let k = f64::from(k);
            let axis = DVec3::new((1.7 * k).sin(), (2.9 * k).cos(), (0.3 * k * k).sin());
            all.push(DQuat::from_axis_angle(axis.normalize(), 0.37 * k));
        }
        // Two or more components are greatest at once.
        all.extend(
            [[0.5; 4], [-0.5, 0.5, -0.5, 0.5], [0.0, 0.0, -1.0, 0.0]].map(DQuat::from_array),
        );
        all
    }

    #[test]
    fn turns_are_within_their_rounding() {
        assert_eq!(Turn::new(DQuat::IDENTITY), Turn::NONE);
        for of in rotations() {
            let turn = Turn::new(of);
            let off = (of.inverse() * turn.rotation()).normalize();
            let angle = 2.0 * off.xyz().length();
            assert!(angle <= 2.0 * 3f64.sqrt() * STEP, "{of} {angle:e}");
            // −q is the same rotation.
            assert_eq!(Turn::new(-of), turn);
        }
    }

    #[test]
    fn shapes_are_the_same_from_every_order_of_axes() {
        for turned in rotations() {
            for scales in [
                DVec3::new(0.2, 1.0, 0.5),
                DVec3::new(3.0, 0.1, 0.5),
                DVec3::new(0.3, 0.1, 5.0),
                DVec3::new(0.3, 2.0, 0.3),
            ] {
                let (sigma, shape) = Shape::of(scales, turned);
                let axes = DMat3::from_quat(turned);
                let expected = axes * DMat3::from_diagonal(scales * scales) * axes.transpose();
                let found = sigma * sigma * shape.covariance();
                // An angle ε changes the covariance by at most 2 ε times the greatest variance.
                let off = 2.0 * 2.0 * 3f64.sqrt() * STEP * scales.max_element().powi(2);
                assert!(found.abs_diff_eq(expected, off));
                assert!(
                    (sigma.powi(3) * shape.volume() / scales.element_product() - 1.0).abs() < 1e-12
                );
                for axis in 0..3 {
                    let extent = sigma * shape.extents()[axis];
                    assert!((extent - found.col(axis)[axis].sqrt()).abs() < 1e-12 * sigma);
                }
                let v = DVec3::new(0.3, -2.0, 1.0);
                assert!(shape.stretch(shape.whiten(v)).abs_diff_eq(v, 1e-12));
                let square = shape.whiten(v).length_squared();
                assert!((v.dot(shape.covariance().inverse() * v) / square - 1.0).abs() < 1e-9);
            }
        }
        let upright = Shape::of(DVec3::new(2.0, 0.5, 2.0), DQuat::IDENTITY);
        assert_eq!(upright, (2.0, Shape::upright(0.25)));
        assert!(upright.1.is_upright());
        assert_eq!(Shape::of(DVec3::splat(2.0), rotations()[7]), (2.0, Shape::BALL));
        assert_eq!(Shape::of(DVec3::ZERO, rotations()[7]), (0.0, Shape::BALL));
        assert_eq!(Shape::of(DVec3::new(0.0, 1.0, 1.0), DQuat::IDENTITY).1.narrowest(), MIN_ASPECT);
    }
}
