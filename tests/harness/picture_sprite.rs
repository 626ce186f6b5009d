//! Running bounds of a sprite's exponent, as the shaders evaluate it.

use nimbus::model::camera::Pose;
use nimbus::model::cloud::Shape;

use crate::bounded::{Bounded, U, dot};

/// Outputs of the vertex shader.
pub struct Sprite {
    pub s: [Bounded; 2],
    pub z: Bounded,
    pub tau: Bounded,
    pub ellipsoid: Option<Ellipsoid>,
}

/// Values of the shaders' shape_of.
#[derive(Debug, Clone, Copy)]
pub struct Ellipsoid {
    y: [Bounded; 3],
    /// 1/a².
    inverse: Bounded,
    /// The third axis, and 1/b², of a blob among turned ones.
    third: Option<([Bounded; 3], Bounded)>,
}

impl Ellipsoid {
    pub fn new(aspect: f64, y: [f64; 3]) -> Ellipsoid {
        let square = Bounded::exact(aspect).squared();
        let inverse = Bounded::exact(1.0).over(square);
        Ellipsoid { y: y.map(Bounded::once), inverse, third: None }
    }

    /// Evaluates shape_of for turned axes.
    pub fn turned(shape: &Shape, pose: &Pose) -> Ellipsoid {
        let one = Bounded::exact(1.0);
        // Three components are whole numbers times a constant, and the fourth is a root.
        let q = shape.turn.rotation().to_array().map(|v| Bounded { value: v, error: 8.0 * U });
        let [x, y, z, w] = q;
        let twice = |a: Bounded, b: Bounded| a.plus(b).scaled(2.0);
        let rest = |a: Bounded, b: Bounded| one.minus(a.squared().plus(b.squared()).scaled(2.0));
        let minus = |a: Bounded| a.scaled(-1.0);
        let second =
            [twice(x.times(y), minus(w.times(z))), rest(x, z), twice(y.times(z), w.times(x))];
        let third =
            [twice(x.times(z), w.times(y)), twice(y.times(z), minus(w.times(x))), rest(x, y)];
        let axes = [pose.right, pose.up, pose.forward].map(|a| a.to_array().map(Bounded::once));
        let seen = |v: [Bounded; 3]| axes.map(|axis| dot(axis, v));
        let inverse = |of: f64| one.over(Bounded::exact(of).squared());
        Ellipsoid {
            y: seen(second),
            inverse: inverse(shape.aspect),
            third: Some((seen(third), inverse(shape.aspect_z))),
        }
    }

    /// Components along z, if there is one, and across y and z.
    fn side(&self, across: [Bounded; 3], v: [Bounded; 3]) -> (Bounded, [Bounded; 3]) {
        let Some((z, _)) = self.third else { return (Bounded::exact(0.0), across) };
        let side = dot(z, v);
        (side, [0, 1, 2].map(|k| across[k].minus(side.times(z[k]))))
    }

    /// Evaluates white_square and lean_of: |M s|², and what changes with the ray by that.
    fn lean(&self, s: [Bounded; 2]) -> Option<(Bounded, [Bounded; 2])> {
        let (z, inverse_z) = self.third?;
        let d = [s[0], s[1], Bounded::exact(1.0)];
        let (up, across) = self.parts(d);
        let (side, across) = self.side(across, d);
        let white = dot(across, across)
            .plus(self.inverse.times(up).times(up))
            .plus(inverse_z.times(side).times(side));
        let along = [0, 1].map(|k| {
            across[k]
                .plus(self.inverse.times(up).times(self.y[k]))
                .plus(inverse_z.times(side).times(z[k]))
        });
        Some((white, along.map(|v| v.over(white))))
    }

    /// Components along y and across it.
    pub fn parts(&self, v: [Bounded; 3]) -> (Bounded, [Bounded; 3]) {
        let up = dot(self.y, v);
        (up, [0, 1, 2].map(|k| v[k].minus(up.times(self.y[k]))))
    }

    /// Evaluates conic_of.
    pub fn conic(&self, s: [Bounded; 2], scale: Bounded) -> [Bounded; 3] {
        let (zero, one) = (Bounded::exact(0.0), Bounded::exact(1.0));
        let (up_x, x) = self.parts([zero, one, s[1].scaled(-1.0)]);
        let (up_y, y) = self.parts([one.scaled(-1.0), zero, s[0]]);
        let (side_x, x) = self.side(x, [zero, one, s[1].scaled(-1.0)]);
        let (side_y, y) = self.side(y, [one.scaled(-1.0), zero, s[0]]);
        let entry = |a: [Bounded; 3], b: [Bounded; 3], up: Bounded, side: Bounded| {
            let upright = self.inverse.times(dot(a, b)).plus(up);
            match self.third {
                None => scale.times(upright),
                Some((_, z)) => scale.times(z.times(upright).plus(self.inverse.times(side))),
            }
        };
        [
            entry(x, x, up_x.squared(), side_x.squared()),
            entry(x, y, up_x.times(up_y), side_x.times(side_y)).scaled(2.0),
            entry(y, y, up_y.squared(), side_y.squared()),
        ]
    }

    /// |d|² across y and along it, and |M d|².
    pub fn squares(&self, ray: [Bounded; 2]) -> [Bounded; 3] {
        let (up, across) = self.parts([ray[0], ray[1], Bounded::exact(1.0)]);
        let (rest, along) = (dot(across, across), up.squared());
        [rest, along, rest.plus(self.inverse.times(along))]
    }
}

fn difference(ray: [Bounded; 2], s: [Bounded; 2]) -> [Bounded; 2] {
    [ray[0].minus(s[0]), ray[1].minus(s[1])]
}

impl Sprite {
    pub fn difference(&self, ray: [Bounded; 2]) -> [Bounded; 2] {
        difference(ray, self.s)
    }

    /// Returns τ of a ray through the centre in this direction.
    pub fn deep(&self, ray: [Bounded; 2]) -> Bounded {
        let Some(e) = &self.ellipsoid else { return self.tau };
        if let Some(white) = self.leaning(e, ray) {
            let norm = Bounded::exact(1.0).plus(ray[0].squared()).plus(ray[1].squared());
            return self.tau.times(norm.over(white).root());
        }
        let [rest, along, white] = e.squares(ray);
        self.tau.times(rest.plus(along).over(white).root())
    }

    /// Returns b²/2σ² by the conic, times the part of `scale` above z²/2σ².
    pub fn by_conic(&self, e: &Ellipsoid, ray: [Bounded; 2], scale: Bounded) -> Bounded {
        let sum = self.form(e, ray, self.s, scale);
        // One more product if the division is by an inverse.
        let white = self.leaning(e, ray).unwrap_or_else(|| e.squares(ray)[2]);
        sum.times(Bounded::exact(1.0).over(white))
    }

    /// Evaluates the conic's form of the difference between a ray and `s`.
    fn form(&self, e: &Ellipsoid, ray: [Bounded; 2], s: [Bounded; 2], scale: Bounded) -> Bounded {
        let ([xx, xy, yy], [dx, dy]) = (e.conic(s, scale), difference(ray, s));
        xx.times(dx).times(dx).plus(xy.times(dx).times(dy)).plus(yy.times(dy).times(dy))
    }

    /// Evaluates |M d|² from the conic, where ellipsoids are turned. The identity holds with any
    /// `s`, and the scale cancels: only what is rounded after those counts.
    fn leaning(&self, e: &Ellipsoid, ray: [Bounded; 2]) -> Option<Bounded> {
        let (s, scale) = (self.s.map(|v| Bounded::exact(v.value)), Bounded::exact(self.z.value));
        let (white, lean) = e.lean(s)?;
        let (across, [dx, dy]) = (self.form(e, ray, s, scale), difference(ray, s));
        let along = Bounded::exact(1.0).plus(lean[0].times(dx)).plus(lean[1].times(dy));
        Some(white.times(along).times(along).plus(across.over(scale.times(white))))
    }

    /// Evaluates the same in powers of two, as the tile path does: a polynomial along the row over
    /// the norm.
    pub fn tiled_exponent(&self, ray: [Bounded; 2]) -> Bounded {
        let (one, s) = (Bounded::exact(1.0), &self.s);
        // log2 e is one more factor.
        let scale = self.z.times(Bounded::once(std::f64::consts::LOG2_E));
        if let Some(e) = &self.ellipsoid {
            return self.by_conic(e, ray, scale);
        }
        let [dx, dy] = [ray[0].minus(s[0]), ray[1].minus(s[1])];
        let a = scale.times(one.plus(s[1].squared()));
        let b = scale.scaled(-2.0).times(s[0]).times(s[1]).times(dy);
        let c = scale.times(one.plus(s[0].squared())).times(dy).times(dy);
        let norm = one.plus(ray[0].squared()).plus(ray[1].squared());
        a.times(dx).plus(b).times(dx).plus(c).times(one.over(norm))
    }

    /// Evaluates b²/2σ² as the fragment shader does.
    pub fn exponent(&self, ray: [Bounded; 2]) -> Bounded {
        if let Some(e) = &self.ellipsoid {
            return self.by_conic(e, ray, self.z);
        }
        let d = self.difference(ray);
        let twist = self.s[0].times(d[1]).minus(self.s[1].times(d[0]));
        let above = d[0].squared().plus(d[1].squared()).plus(twist.squared());
        let below = Bounded::exact(1.0).plus(ray[0].squared().plus(ray[1].squared()));
        self.z.times(above).over(below)
    }
}
