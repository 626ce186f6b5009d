//! Resolution of cells before their cubature. A rule of 22 points reports no error for a cell whose
//! lobe, near light or small blob falls between its nodes. Such cells are halved before any is
//! evaluated.

use glam::DVec3;

use super::adaptive::Cell;
use super::scene::{AreaScene, Exposure, Receiver};
use crate::model::light::{Light, MIN_PENUMBRA};
use crate::reference::Blob;
use crate::reference::occlude::{Rectangle, Source, source_of};

/// Greatest radius of a cell, over its distance from anything that varies as 1/d². There the
/// integrand has no feature narrower than d, and neighbouring nodes are at most 0.5 radii apart.
pub(super) const NEAREST: f64 = 0.7;
/// Resolution of a lobe, in widths 1/√n_s.
pub(super) struct LobeDetail {
    /// Greatest spread of the half vector over a cell.
    pub widths: f64,
    /// Distance from the peak beyond which the lobe vanishes.
    pub reach: f64,
}

/// Neighbouring nodes lie within a width; e^{−8²/2} = 1.3e-14 of the peak is left at the reach.
const LOBE: LobeDetail = LobeDetail { widths: 1.5, reach: 8.0 };
/// Greatest radius of a cell and reach of a blob, σ. At the reach e^{−4²/2} = 3e-4 of the depth is
/// left.
const BLOB_WIDTHS: f64 = 1.5;
const BLOB_REACH: f64 = 4.0;
/// Greatest angular radius of a cell in a spot's penumbra, in widths of the penumbra. Neighbouring
/// nodes are at most a third of the penumbra apart. Light missed along an edge falls with the
/// square (inner edge) and the cube (outer edge) of the radius; at this radius 6e-6 of a cone's
/// flux was measured.
const PENUMBRA_WIDTHS: f64 = 0.7;
const PENUMBRA_TOLERANCE: f64 = 1e-4;
/// Angular radius below which a cell is small enough, since a lobe at grazing angles could be
/// divided without end.
pub(super) const MIN_ANGLE: f64 = 1e-9;

/// The ball about a cell's centroid that contains the cell.
pub(super) struct Ball {
    pub center: DVec3,
    pub radius: f64,
}

impl Ball {
    pub fn of(rect: &Rectangle, cell: &Cell) -> Ball {
        let corners = cell.corners.map(|x| rect.point(x.x, x.y));
        let center = (corners[0] + corners[1] + corners[2]) / 3.0;
        Ball { center, radius: corners.iter().map(|c| c.distance(center)).fold(0.0, f64::max) }
    }
}

/// A surface's region seen from somewhere.
pub(super) struct ViewOfSurface<'s, 'a> {
    /// The scene.
    pub scene: &'s AreaScene<'a>,
    /// Index of the surface.
    pub i_surface: usize,
    /// The lights that reach the region.
    pub lit: &'s [(usize, Exposure)],
    /// Relative accuracy of the integral.
    pub relative: f64,
}

/// Returns whether a cell is small enough for the light that `at` reflects from it along `toward`.
pub(super) fn is_incident_resolved(
    view: &ViewOfSurface,
    at: &Receiver,
    toward: DVec3,
    cell: &Cell,
) -> bool {
    let ball = Ball::of(&view.scene.rectangles[view.i_surface], cell);
    let Some((from, spread)) = cone(&ball, at.position) else { return false };
    if spread < MIN_ANGLE {
        return true;
    }
    let gloss = &at.brdf;
    (gloss.ks == DVec3::ZERO || is_lobe_resolved(gloss.ns, at.normal, toward, from, spread, LOBE))
        && is_light_resolved(view, &ball, (-from, spread))
        && are_blobs_resolved(view.scene, &ball, Source::At(at.position), view.relative)
}

/// Returns whether the first reflection from the ball along `along`, a direction and how far it
/// turns over the ball, is resolved.
pub(super) fn is_light_resolved(view: &ViewOfSurface, ball: &Ball, along: (DVec3, f64)) -> bool {
    let ViewOfSurface { scene, i_surface, lit, relative } = *view;
    let (brdf, normal) = (&scene.brdfs[i_surface], scene.rectangles[i_surface].normal);
    lit.iter().filter(|(_, exposure)| *exposure == Exposure::Open).all(|&(i_light, _)| {
        let light = &scene.lights[i_light];
        let Some((toward, spread)) = light_cone(light, ball, relative) else { return false };
        let no_lobe = light.is_sky() || brdf.ks == DVec3::ZERO;
        (no_lobe || is_lobe_resolved(brdf.ns, normal, toward, along.0, spread + along.1, LOBE))
            && are_blobs_resolved(scene, ball, source_of(light), relative)
    })
}

/// Returns the direction of a ball's centre from `p` and the half angle of the cone about it;
/// `None` if the ball is too near.
pub(super) fn cone(ball: &Ball, p: DVec3) -> Option<(DVec3, f64)> {
    let way = ball.center - p;
    let distance = way.length();
    (ball.radius <= NEAREST * distance).then(|| (way / distance, (ball.radius / distance).asin()))
}

/// Returns the direction toward a light from the ball's centre and how far it turns within the
/// ball; `None` if the ball is too large for the light's distance or cone.
fn light_cone(light: &Light, ball: &Ball, relative: f64) -> Option<(DVec3, f64)> {
    let arrival = light.arrival(ball.center);
    if arrival.distance.is_infinite() {
        return Some((arrival.toward, 0.0));
    }
    let (toward, spread) = (arrival.toward, (ball.radius / arrival.distance).min(1.0).asin());
    if let Light::Spot { direction, cos_inner, cos_outer, .. } = *light {
        let outer = cos_outer.clamp(-1.0, 1.0).acos();
        let inner = cos_inner.min(1.0).max(cos_outer + MIN_PENUMBRA).min(1.0).acos();
        let off_axis = (-toward).angle_between(direction);
        if off_axis - spread > outer {
            return Some((toward, spread));
        }
        // Light ends within the penumbra, and a cell's share may fall between its nodes: a strip as
        // wide as the cell along the outer edge, where light begins with the square, or along the
        // inner edge, where it bends.
        let strict = (relative / PENUMBRA_TOLERANCE).min(1.0);
        let crosses = |edge: f64| (off_axis - edge).abs() < spread;
        let finer = if crosses(inner) {
            strict.sqrt()
        } else if crosses(outer) {
            strict.cbrt()
        } else {
            1.0
        };
        if off_axis + spread > inner && spread > PENUMBRA_WIDTHS * finer * (outer - inner) {
            return None;
        }
    }
    (ball.radius <= NEAREST * arrival.distance).then_some((toward, spread))
}

/// Returns whether the half vector of directions within `spread` of `a` and `b` together turns
/// little compared with the lobe's width, or stays where the lobe vanishes.
pub(super) fn is_lobe_resolved(
    ns: f64,
    normal: DVec3,
    a: DVec3,
    b: DVec3,
    spread: f64,
    detail: LobeDetail,
) -> bool {
    let width = 1.0 / ns.max(1.0).sqrt();
    let sum = a + b;
    // The half vector turns by ½ of a direction's turn along the arc between both, and by 1/(2
    // cos(θ/2)) of it across, θ the angle between them.
    let half_angle = (0.5 * sum.length()).min(1.0).acos() + 0.5 * spread;
    if half_angle >= std::f64::consts::FRAC_PI_2 {
        return spread <= MIN_ANGLE;
    }
    let turn = 0.5 * spread / half_angle.cos();
    if turn <= detail.widths * width {
        return true;
    }
    let gamma = normal.angle_between(sum);
    gamma - turn > detail.reach * width
}

/// Returns whether every blob that casts a shadow between the ball and `end` is wide compared with
/// the rays from the ball there.
fn are_blobs_resolved(scene: &AreaScene, ball: &Ball, end: Source, relative: f64) -> bool {
    let (way, length) = match end {
        Source::At(q) => ((q - ball.center).normalize_or_zero(), ball.center.distance(q)),
        Source::Toward(d) => (d, f64::INFINITY),
    };
    let matters = |blob: &&Blob| {
        let depth = (1.0 - scene.forward) * blob.deepest();
        blob.sigma > 0.0 && depth > relative
    };
    scene.blobs.iter().filter(matters).all(|blob| {
        let offset = blob.position - ball.center;
        let reach = BLOB_REACH * blob.widest();
        let along = offset.dot(way);
        // Rays from the ball converge to a point; rays to a direction stay as wide as the ball.
        let radius = ball.radius * (1.0 - along.clamp(0.0, length) / length);
        let before = along > -reach - ball.radius;
        let before_end = along < length + reach;
        let near = (offset - along * way).length() < reach + radius;
        !(before && before_end && near) || radius <= BLOB_WIDTHS * blob.narrowest()
    })
}
