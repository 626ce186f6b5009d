//! Means of radiance and irradiance over a surface or one of its facets.

use glam::{DVec2, DVec3};

use crate::model::surface::Surface;
use crate::reference::area::adaptive::{
    self, Accuracy, Cell, Estimate, Integrand, NOTHING, Sample, triangles,
};
use crate::reference::area::clip::{self, Line, Polygon, WHOLE};
use crate::reference::area::resolve::{
    Ball, LobeDetail, MIN_ANGLE, NEAREST, ViewOfSurface, cone, is_light_resolved, is_lobe_resolved,
};
use crate::reference::area::scene::AreaScene;
use crate::reference::occlude::Rectangle;

/// Share of the accuracy that the inner integral gets; its error adds to the outer one's.
const INNER_SHARE: f64 = 0.1;

/// Safety factor on the error of L2's mean over a surface. L2 has a kink wherever a corner appears
/// behind an edge. There the two rules' errors are of one size and no fixed sign, and one is seldom
/// more than three times their difference.
const SAFETY_FACTOR: f64 = 3.0;

/// For a mean of L2: nodes within 1.5 widths meet every peak, and e^{−4²/2} = 3e-4 of it has no
/// weight in a mean.
const MIRROR: LobeDetail = LobeDetail { widths: 3.0, reach: 4.0 };

/// A rectangle within a surface's (s, t).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Low corner.
    pub low: DVec2,
    /// High corner.
    pub high: DVec2,
}

impl Window {
    /// The whole surface.
    pub const WHOLE: Window = Window { low: DVec2::NEG_ONE, high: DVec2::ONE };

    /// Returns the window of facet `i` of a surface.
    pub fn facet(surface: &Surface, i: u32) -> Window {
        let [n_u, n_v] = surface.subdivide;
        let at = |k: u32, n: u32| 2.0 * f64::from(k) / f64::from(n) - 1.0;
        let corner = |k: u32| DVec2::new(at(i % n_u + k, n_u), at(i / n_u + k, n_v));
        Window { low: corner(0), high: corner(1) }
    }

    fn area(&self) -> f64 {
        (self.high - self.low).element_product()
    }

    fn cut(&self, polygon: &Polygon) -> Polygon {
        let lines = [
            Line([-self.low.x, 1.0, 0.0]),
            Line([self.high.x, -1.0, 0.0]),
            Line([-self.low.y, 0.0, 1.0]),
            Line([self.high.y, 0.0, -1.0]),
        ];
        lines.iter().fold(polygon.clone(), |p, line| clip::cut(&p, line, 1.0))
    }
}

impl AreaScene<'_> {
    /// Returns the means of L1 toward the eye at `eye`, and of I_d.
    pub fn mean_first(
        &self,
        i_surface: usize,
        window: &Window,
        eye: DVec3,
        accuracy: &Accuracy,
    ) -> Estimate {
        let regions = &self.regions[i_surface];
        let mean = Mean { scene: self, i_surface, eye, window, of: Quantity::First, accuracy };
        let cells = regions
            .iter()
            .enumerate()
            .flat_map(|(i, region)| triangles(&window.cut(&region.polygon), i).collect::<Vec<_>>());
        adaptive::integrate(&mean, cells, NOTHING, accuracy)
    }

    /// Returns the means of L2 toward the eye at `eye`, and of I_i.
    pub fn mean_second(
        &self,
        i_surface: usize,
        window: &Window,
        eye: DVec3,
        accuracy: &Accuracy,
    ) -> Estimate {
        let inner = Accuracy {
            relative: INNER_SHARE * accuracy.relative,
            absolute: INNER_SHARE * accuracy.absolute,
            max_evaluations: accuracy.max_evaluations,
        };
        let mean =
            Mean { scene: self, i_surface, eye, window, of: Quantity::Second, accuracy: &inner };
        adaptive::integrate(&mean, triangles(&window.cut(&WHOLE.to_vec()), 0), NOTHING, accuracy)
    }
}

enum Quantity {
    First,
    Second,
}

struct Mean<'s, 'a> {
    scene: &'s AreaScene<'a>,
    i_surface: usize,
    eye: DVec3,
    window: &'s Window,
    of: Quantity,
    /// Accuracy of the value at every point.
    accuracy: &'s Accuracy,
}

impl Integrand for Mean<'_, '_> {
    fn at(&self, i_region: usize, x: DVec2) -> Sample {
        let rect = &self.scene.rectangles[self.i_surface];
        let p = rect.point(x.x, x.y);
        let toward = (self.eye - p).normalize_or_zero();
        let [radiance, irradiance, error] = match self.of {
            Quantity::First => {
                let lit = &self.scene.regions[self.i_surface][i_region].lit;
                self.scene.first_in_region(self.i_surface, lit, p, toward)
            }
            Quantity::Second => {
                let e = self.scene.second(
                    &self.scene.on_surface(self.i_surface, p),
                    toward,
                    self.accuracy,
                );
                [e.radiance, e.irradiance, DVec3::new(e.error, e.irradiance_error, 0.0)]
            }
        };
        [radiance, irradiance, error].map(|v| v / self.window.area())
    }

    fn is_resolved(&self, cell: &Cell) -> bool {
        match self.of {
            Quantity::First => {
                let (scene, i_surface) = (self.scene, self.i_surface);
                let lit = &scene.regions[i_surface][cell.i_region].lit;
                let relative = self.accuracy.relative;
                let view = ViewOfSurface { scene, i_surface, lit, relative };
                is_first_resolved(&view, self.eye, cell)
            }
            Quantity::Second => is_second_resolved(self.scene, self.i_surface, self.eye, cell),
        }
    }

    fn length_squared(&self, _: usize, d: DVec2) -> f64 {
        self.scene.rectangles[self.i_surface].length_squared(d)
    }

    fn safety_factor(&self) -> f64 {
        match self.of {
            Quantity::First => 1.0,
            Quantity::Second => SAFETY_FACTOR,
        }
    }
}

/// Returns whether a cell of a mean of L1 toward `eye` is small enough.
fn is_first_resolved(view: &ViewOfSurface, eye: DVec3, cell: &Cell) -> bool {
    let ball = Ball::of(&view.scene.rectangles[view.i_surface], cell);
    let Some((from, spread)) = cone(&ball, eye) else { return false };
    spread < MIN_ANGLE || is_light_resolved(view, &ball, (-from, spread))
}

/// Returns whether a cell of a mean of L2 toward `eye` is small enough: for the distance or size of
/// every other surface, and for the lobe that mirrors the light sources.
fn is_second_resolved(scene: &AreaScene, i_surface: usize, eye: DVec3, cell: &Cell) -> bool {
    let (rect, brdf) = (&scene.rectangles[i_surface], &scene.brdfs[i_surface]);
    let ball = Ball::of(rect, cell);
    let view = ball.center.distance(eye);
    let glossy = brdf.ks != DVec3::ZERO;
    if glossy && ball.radius > NEAREST * view {
        return false;
    }
    let (toward, turn) =
        ((eye - ball.center).normalize_or_zero(), (ball.radius / view).min(1.0).asin());
    let others = scene.rectangles.iter().enumerate().filter(|(_, other)| !lies_behind(rect, other));
    others.into_iter().all(|(i, other)| {
        let way = other.nearest(ball.center) - ball.center;
        let narrow = other.u.length().min(other.v.length());
        let reach = way.length().max(narrow);
        if ball.radius > NEAREST * reach {
            return false;
        }
        // The lobe and the source that it mirrors blur each other, so their features are as wide as
        // the wider one.
        let ns = brdf.ns.min((reach / narrow).powi(2));
        let spread = (ball.radius / reach).asin() + turn;
        let dark = scene.regions[i].is_empty();
        let mirrors = |from: DVec3| is_lobe_resolved(ns, rect.normal, from, toward, spread, MIRROR);
        !glossy || dark || way.try_normalize().is_none_or(mirrors)
    })
}

fn lies_behind(rect: &Rectangle, other: &Rectangle) -> bool {
    WHOLE.iter().all(|x| rect.side(other.point(x.x, x.y)) <= 0.0)
}
