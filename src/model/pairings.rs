//! Pairs of regions that can exchange light, and the surfaces that may stand between them (model.md
//! §7). Surfaces do not move, so a gather skips whole regions by this table.

use glam::DVec3;

use super::surface::Surface;

/// A region whose light can reach a receiving region.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pairing {
    /// Index of the emitting region.
    pub i_emitter: usize,
    /// Indices of the surfaces that may hide one region from the other.
    pub occluders: Vec<usize>,
}

/// Share of its reach within which a corner lies in a plane, so that the rounding of typed digits
/// does not decide. The GPU's own tolerance (2⁻²⁰) is larger, so nothing that it would see is left
/// out.
const IN_PLANE: f64 = 1e-9;

/// Returns for every region the regions whose light can reach it. Surfaces come before the
/// `n_others` (ground and clouds), which face every way.
pub fn pairings(surfaces: &[Surface], n_others: usize) -> Vec<Vec<Pairing>> {
    let n = surfaces.len() + n_others;
    let of = |i: usize| (0..n).filter_map(|k| pairing(surfaces, i, k)).collect();
    (0..n).map(of).collect()
}

fn pairing(surfaces: &[Surface], i_receiver: usize, i_emitter: usize) -> Option<Pairing> {
    let (a, b) = (surfaces.get(i_receiver), surfaces.get(i_emitter));
    if let (Some(a), Some(b)) = (a, b)
        && (i_receiver == i_emitter || !reaches_before(a, b) || !reaches_before(b, a))
    {
        return None;
    }
    let may_hide = |&i: &usize| {
        let c = &surfaces[i];
        // The way runs in front of both, so whatever lies behind either is never on it.
        let before = |s: Option<&Surface>| s.is_none_or(|s| reaches_before(s, c));
        let between = match (a, b) {
            (Some(a), Some(b)) => parts(c, a, b) && near_both(c, a, b),
            _ => true,
        };
        i != i_receiver && i != i_emitter && before(a) && before(b) && between
    };
    Some(Pairing { i_emitter, occluders: (0..surfaces.len()).filter(may_hide).collect() })
}

/// Returns the least and greatest signed distance of `s`'s corners from the plane of `plane`; 0
/// within it.
fn sides(plane: &Surface, s: &Surface) -> (f64, f64) {
    let n = plane.normal();
    let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
        .map(|(x, y)| s.center + x * s.u + y * s.v);
    let distances = corners.map(|p| {
        let o = p - plane.center;
        let e = n.dot(o);
        if e.abs() > IN_PLANE * (o.abs().element_sum() + plane.u.length() + plane.v.length()) {
            e
        } else {
            0.0
        }
    });
    (
        distances.into_iter().fold(f64::INFINITY, f64::min),
        distances.into_iter().fold(f64::NEG_INFINITY, f64::max),
    )
}

/// Returns whether part of `s` lies in front of `plane`.
fn reaches_before(plane: &Surface, s: &Surface) -> bool {
    sides(plane, s).1 > 0.0
}

/// Returns whether `a` and `b` together lie on both sides of `c`'s plane.
fn parts(c: &Surface, a: &Surface, b: &Surface) -> bool {
    let (a, b) = (sides(c, a), sides(c, b));
    a.0.min(b.0) < 0.0 && a.1.max(b.1) > 0.0
}

/// Returns whether `c` reaches into the box around `a` and `b`.
fn near_both(c: &Surface, a: &Surface, b: &Surface) -> bool {
    let (a, b, c) = (a.bounds(), b.bounds(), c.bounds());
    let (low, high): (DVec3, DVec3) = (a.0.min(b.0), a.1.max(b.1));
    // Bounds are sums of typed numbers that round, and touching suffices.
    let slack = DVec3::splat(1e-9 * (low.abs().max_element() + high.abs().max_element()));
    c.0.cmple(high + slack).all() && c.1.cmpge(low - slack).all()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface(center: [f64; 3], u: DVec3, v: DVec3) -> Surface {
        Surface { center: DVec3::from(center), u, v, i_material: 0, subdivide: [1, 1] }
    }

    fn emitters(pairings: &[Pairing]) -> Vec<(usize, &[usize])> {
        pairings.iter().map(|p| (p.i_emitter, &p.occluders[..])).collect()
    }

    #[test]
    fn surfaces_that_face_each_other_are_paired_with_the_ones_between() {
        let floor = surface([0.0, 0.0, 0.0], DVec3::Z, DVec3::X);
        let ceiling = surface([0.0, 2.0, 0.0], DVec3::X, DVec3::Z);
        let shelf = surface([0.0, 1.0, 0.0], DVec3::Z * 0.1, DVec3::X * 0.1);
        let below = surface([0.0, -1.0, 0.0], DVec3::Z, DVec3::X);
        let aside = surface([9.0, 1.0, 0.0], DVec3::Z, DVec3::X);
        let found = pairings(&[floor, ceiling, shelf, below, aside], 0);
        // Floor (up) and ceiling (down) see each other, the shelf (up) sees only the ceiling. The
        // floor hides all of `below` but its rim, and `below` faces the floor's back, which sends
        // nothing.
        assert_eq!(emitters(&found[0]), [(1, &[2][..])]);
        assert_eq!(emitters(&found[2]), [(1, &[][..])]);
        let of_ceiling = emitters(&found[1]);
        assert_eq!(of_ceiling[0], (0, &[2][..]));
        assert_eq!(of_ceiling.iter().map(|p| p.0).collect::<Vec<_>>(), [0, 2, 3, 4]);
        assert_eq!(of_ceiling[2].1, [0, 2]);
    }

    #[test]
    fn clouds_are_paired_with_all_and_with_themselves() {
        let floor = surface([0.0, 0.0, 0.0], DVec3::Z, DVec3::X);
        let below = surface([0.0, -1.0, 0.0], DVec3::Z, DVec3::X);
        let found = pairings(&[floor, below], 1);
        assert_eq!(emitters(&found[2]), [(0, &[][..]), (1, &[0][..]), (2, &[0, 1][..])]);
        // A surface behind the floor cannot stand between the floor and the cloud.
        assert_eq!(emitters(&found[0]), [(2, &[][..])]);
    }
}
