//! Impostors: a picture of distant particles, reused from another view, with a bound on its error
//! (passes.md "impostors").

use glam::{DMat3, DVec2, DVec3};

/// Least ratio of a view depth now to the depth when the impostor was drawn; below it no bound is
/// known. Reused impostors have ratios near 1, since an error of few pixels lets the eye move only
/// a short way.
const MIN_DEPTH_RATIO: f64 = 0.9;

/// A view. Slopes are those of rays along (right, up, forward).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Position of the eye.
    pub eye: DVec3,
    /// Unit vector to the right.
    pub right: DVec3,
    /// Unit vector up.
    pub up: DVec3,
    /// Unit view direction.
    pub forward: DVec3,
    /// Greatest slopes across and up.
    pub tangents: DVec2,
}

/// Distant particles as seen when their picture was drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FarField {
    /// Least view depth of their centres.
    pub nearest: f64,
    /// Greatest view depth of their centres.
    pub farthest: f64,
    /// Greatest σ.
    pub sigma: f64,
    /// Greatest reach of their sprites.
    pub radius: f64,
}

/// An impostor layer: a picture of distant particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shell {
    /// View that it was drawn from.
    pub view: View,
    /// Particles that it shows.
    pub far: FarField,
}

/// Bound on the error of an impostor's picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedError {
    /// Error of a centre's place, slopes.
    pub shift: f64,
    /// Error of a blob's size, as a share of σ.
    pub growth: f64,
    /// Greatest σ seen, slopes.
    pub sigma: f64,
    /// Least ratio of a centre's view depth now to that when drawn.
    pub depth_ratio: f64,
}

impl PredictedError {
    /// Returns the error in slopes of a point one σ from its blob's centre, where a blob is
    /// steepest.
    pub fn slopes(&self) -> f64 {
        self.shift + self.growth * self.sigma
    }
}

impl View {
    /// Returns the ray of slopes (x, y); its view depth is 1.
    pub fn ray(&self, slopes: DVec2) -> DVec3 {
        slopes.x * self.right + slopes.y * self.up + self.forward
    }

    fn corners(&self) -> [DVec2; 4] {
        let t = self.tangents;
        [t, -t, DVec2::new(t.x, -t.y), DVec2::new(-t.x, t.y)]
    }
}

impl Shell {
    /// Returns 1/z of the plane that stands for all distant particles: the mean of their least and
    /// greatest 1/z.
    pub fn inverse_depth(&self) -> f64 {
        0.5 * (1.0 / self.far.nearest + 1.0 / self.far.farthest)
    }

    /// Returns the homography from slopes (x, y, 1) of `now` to slopes of the impostor's picture.
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

    /// Returns whether the impostor's picture covers the whole view `now`, `margin` slopes within
    /// its edges.
    pub fn covers(&self, now: &View, margin: f64) -> bool {
        let to_shell = self.homography(now);
        // Straight lines stay straight unless a ray of the view runs along the plane or away from
        // it.
        let within = |corner: DVec2| {
            let at = to_shell * corner.extend(1.0);
            let most = self.view.tangents - margin;
            at.z > 0.0 && at.x.abs() <= most.x * at.z && at.y.abs() <= most.y * at.z
        };
        1.0 - self.inverse_depth() * (now.eye - self.view.eye).dot(self.view.forward) > 0.0
            && now.corners().into_iter().all(within)
    }

    /// Returns the error of the impostor's picture in the view `now`; `None` if no bound is known
    /// because the eye comes near the particles or turns away.
    pub fn predict(&self, now: &View) -> Option<PredictedError> {
        let FarField { nearest, farthest, sigma, radius } = self.far;
        let (then, t, w) = (&self.view, now.eye - self.view.eye, self.inverse_depth());
        let spread = 0.5 * (1.0 / nearest - 1.0 / farthest);
        // Centres beside the view count if their sprites reach into it from at least this depth.
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
        // λ_p: depth of the plane when drawn, over its depth now.
        let (plane, along) = (most / left, t.dot(now.forward).abs());
        let depth_ratio = 1.0 / plane - spread * along;
        // NaN is not a bound.
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
