//! A picture of what is far, seen again from elsewhere: where it shows what, and how far off that
//! may be (docs/model.md §11 "impostors").

use glam::{DMat3, DVec2, DVec3};

/// A view depth over what it was when the shell was made; below it no bound is given. Shells that
/// are used again have ratios near 1, since a bound of pixels leaves the eye no long way.
pub const MIN_DEPTH_RATIO: f64 = 0.9;

/// Where a picture is taken from; slopes are those of rays along (right, up, forward).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    pub eye: DVec3,
    pub right: DVec3,
    pub up: DVec3,
    pub forward: DVec3,
    /// Greatest slopes across and up.
    pub tangents: DVec2,
}

/// What is far, as seen when its picture was made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FarField {
    /// View depths of its particles' centres lie between these.
    pub nearest: f64,
    pub farthest: f64,
    /// Greatest σ.
    pub sigma: f64,
    /// How far its sprites reach.
    pub radius: f64,
}

/// A picture of what is far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shell {
    pub view: View,
    pub far: FarField,
}

/// How far off a shell's picture is at most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedError {
    /// Slopes between where a centre is shown and where it is seen.
    pub shift: f64,
    /// Share of σ between what is shown and what is seen.
    pub growth: f64,
    /// Greatest σ that is seen, in slopes.
    pub sigma: f64,
    /// Least view depth of a centre now over what it was.
    pub depth_ratio: f64,
}

impl PredictedError {
    /// Slopes by which a point one σ from its blob's centre is off: there a blob is steepest.
    pub fn slopes(&self) -> f64 {
        self.shift + self.growth * self.sigma
    }
}

impl View {
    /// Direction of the ray of slopes (x, y); its view depth is 1.
    pub fn ray(&self, slopes: DVec2) -> DVec3 {
        slopes.x * self.right + slopes.y * self.up + self.forward
    }

    fn corners(&self) -> [DVec2; 4] {
        let t = self.tangents;
        [t, -t, DVec2::new(t.x, -t.y), DVec2::new(-t.x, t.y)]
    }
}

impl Shell {
    /// 1/z of the plane that stands for all that is far: the middle of what its depths have.
    pub fn inverse_depth(&self) -> f64 {
        0.5 * (1.0 / self.far.nearest + 1.0 / self.far.farthest)
    }

    /// From slopes (x, y, 1) of `now` to slopes of the shell's picture, homogeneous.
    pub fn homography(&self, now: &View) -> DMat3 {
        let (then, t, w) = (&self.view, now.eye - self.view.eye, self.inverse_depth());
        let left = 1.0 - w * t.dot(then.forward);
        let column = |d: DVec3| {
            let depth = d.dot(then.forward);
            let along = |axis: DVec3| w * t.dot(axis) * depth + left * d.dot(axis);
            DVec3::new(along(then.right), along(then.up), depth)
        };
        DMat3::from_cols(column(now.right), column(now.up), column(now.forward))
    }

    /// Whether all that `now` sees lies in the shell's picture, `margin` slopes within its edges.
    pub fn covers(&self, now: &View, margin: f64) -> bool {
        let to_shell = self.homography(now);
        // A straight line stays one where no ray of the view runs along the shell's plane or away
        // from it.
        let within = |corner: DVec2| {
            let at = to_shell * corner.extend(1.0);
            let most = self.view.tangents - margin;
            at.z > 0.0 && at.x.abs() <= most.x * at.z && at.y.abs() <= most.y * at.z
        };
        1.0 - self.inverse_depth() * (now.eye - self.view.eye).dot(self.view.forward) > 0.0
            && now.corners().into_iter().all(within)
    }

    /// What the shell's picture may be off by in `now`'s view; `None` where no bound is known: the
    /// eye comes near to what is far, or turns away.
    pub fn predict(&self, now: &View) -> Option<PredictedError> {
        let FarField { nearest, farthest, sigma, radius } = self.far;
        let (then, t, w) = (&self.view, now.eye - self.view.eye, self.inverse_depth());
        let spread = 0.5 * (1.0 / nearest - 1.0 / farthest);
        // Centres beside the view whose sprites reach into it, at least so deep.
        let depth = MIN_DEPTH_RATIO * nearest;
        let beside = |tan: f64| tan + radius / depth * (1.0 + tan * tan).sqrt();
        let [tan_x, tan_y] = now.tangents.to_array().map(beside);
        let turned = |axis: DVec3| axis.dot(then.forward);
        let most =
            turned(now.forward) + tan_x * turned(now.right).abs() + tan_y * turned(now.up).abs();
        let least =
            turned(now.forward) - tan_x * turned(now.right).abs() - tan_y * turned(now.up).abs();
        let left = 1.0 - w * t.dot(then.forward);
        if !(least > 0.0 && left > 0.0) {
            return None;
        }
        // λ_p: the plane's depth when made over its depth now.
        let (plane, along) = (most / left, t.dot(now.forward).abs());
        let depth_ratio = 1.0 / plane - spread * along;
        // NaN is no bound.
        if depth_ratio.is_nan() || depth_ratio < MIN_DEPTH_RATIO {
            return None;
        }
        let across =
            DVec2::new(t.dot(now.right).abs() + tan_x * along, t.dot(now.up).abs() + tan_y * along)
                .length();
        let shift = spread * across / depth_ratio;
        let slant = (1.0 + tan_x * tan_x + tan_y * tan_y).sqrt();
        let stretch = plane * spread * along;
        let growth = stretch * slant + shift + (1.0 + stretch) * w * across;
        Some(PredictedError {
            shift,
            growth,
            sigma: sigma * slant / (nearest * depth_ratio),
            depth_ratio,
        })
    }
}
