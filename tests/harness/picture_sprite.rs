//! Running bounds of a sprite's exponent, as the shaders evaluate it.

use crate::bounded::{Bounded, dot};

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
}

impl Ellipsoid {
    pub fn new(aspect: f64, y: [f64; 3]) -> Ellipsoid {
        let square = Bounded::exact(aspect).squared();
        Ellipsoid { y: y.map(Bounded::once), inverse: Bounded::exact(1.0).over(square) }
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
        let entry = |a: [Bounded; 3], b: [Bounded; 3], up: Bounded| {
            scale.times(self.inverse.times(dot(a, b)).plus(up))
        };
        [
            entry(x, x, up_x.squared()),
            entry(x, y, up_x.times(up_y)).scaled(2.0),
            entry(y, y, up_y.squared()),
        ]
    }

    /// |d|² across y and along it, and |M d|².
    pub fn squares(&self, ray: [Bounded; 2]) -> [Bounded; 3] {
        let (up, across) = self.parts([ray[0], ray[1], Bounded::exact(1.0)]);
        let (rest, along) = (dot(across, across), up.squared());
        [rest, along, rest.plus(self.inverse.times(along))]
    }
}

impl Sprite {
    pub fn difference(&self, ray: [Bounded; 2]) -> [Bounded; 2] {
        [ray[0].minus(self.s[0]), ray[1].minus(self.s[1])]
    }

    /// Returns τ of a ray through the centre in this direction.
    pub fn deep(&self, ray: [Bounded; 2]) -> Bounded {
        let Some(e) = &self.ellipsoid else { return self.tau };
        let [rest, along, white] = e.squares(ray);
        self.tau.times(rest.plus(along).over(white).root())
    }

    /// Returns b²/2σ² by the conic, times the part of `scale` above z²/2σ².
    pub fn by_conic(&self, e: &Ellipsoid, ray: [Bounded; 2], scale: Bounded) -> Bounded {
        let ([xx, xy, yy], [dx, dy]) = (e.conic(self.s, scale), self.difference(ray));
        let sum = xx.times(dx).times(dx).plus(xy.times(dx).times(dy)).plus(yy.times(dy).times(dy));
        // One more product if the division is by an inverse.
        sum.times(Bounded::exact(1.0).over(e.squares(ray)[2]))
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
