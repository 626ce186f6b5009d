//! How the extinction of a cell runs between those of its neighbours (model.md §15).

/// The extinction along an axis: two straight lines that meet in the middle of the cell, relative
/// to the cell's mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Profile {
    /// The value at the first face and at the last, 0 to 2.
    ends: [f64; 2],
}

impl Profile {
    /// The same throughout.
    pub const EVEN: Profile = Profile { ends: [1.0; 2] };

    /// Returns the profile of a cell of extinction `own` between two others; `None`: there is no
    /// cell. Both cells of a face have the same extinction there: their mean, but at most twice the
    /// smaller one. So the extinction is 0 beside a clear cell, and nowhere below 0.
    pub fn between(before: Option<f64>, own: f64, after: Option<f64>) -> Profile {
        let end = |other: Option<f64>| other.map_or(1.0, |other| shared(own, &[own, other], 2.0));
        Profile { ends: [end(before), end(after)] }
    }

    /// Returns the profile through three values, at the ends and in the middle, that is 1 in the
    /// mean; even if all are 0.
    fn through([first, middle, last]: [f64; 3]) -> Profile {
        let mean = 0.25 * (first + 2.0 * middle + last);
        if mean > 0.0 { Profile { ends: [first / mean, last / mean] } } else { Profile::EVEN }
    }

    /// Returns the value in the middle, so that the mean is 1.
    fn middle(&self) -> f64 {
        2.0 - 0.5 * (self.ends[0] + self.ends[1])
    }

    /// Returns the value at `t`, from −½ at the first face to ½ at the last.
    pub fn at(&self, t: f64) -> f64 {
        line(self.ends[0], self.middle(), self.ends[1], t)
    }

    /// Returns the place, from −½ to ½, below which the share `even` + ½ of the extinction lies.
    pub fn place(&self, even: f64) -> f64 {
        let middle = self.middle();
        let share = even + 0.5;
        // From an end inward: end s + (middle − end) s² is the share up to s.
        let from = |end: f64, share: f64| {
            let root = (end * end + 4.0 * (middle - end) * share).max(0.0).sqrt();
            if share > 0.0 { (2.0 * share / (end + root)).min(0.5) } else { 0.0 }
        };
        let first = 0.25 * (self.ends[0] + middle);
        if share < first {
            from(self.ends[0], share) - 0.5
        } else {
            0.5 - from(self.ends[1], 1.0 - share)
        }
    }
}

/// The extinction across a cell, along x and z: bilinear in each quarter, relative to the mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// The values at the corners, in the middles of the edges and in the middle of the cell.
    /// *Shape*: [x][z].
    nodes: [[f64; 3]; 3],
}

/// Most of a value that cells share, over the smallest of them: with more at all eight nodes around
/// a cell, less than 0 would be left for its middle.
const MOST_SHARED: f64 = 4.0 / 3.0;

impl Plane {
    /// The same throughout.
    pub const EVEN: Plane = Plane { nodes: [[1.0; 3]; 3] };

    /// Returns the plane of the cell in the middle of nine, by their extinctions along x and z;
    /// `None`: there is no cell. The cells around a node have the same extinction there: the mean,
    /// but at most 4/3 of the smallest, so that it is 0 beside a clear cell.
    pub fn among(cells: [[Option<f64>; 3]; 3]) -> Plane {
        let own = cells[1][1].unwrap_or_default();
        let mut nodes = [[0.0; 3]; 3];
        for (x, row) in nodes.iter_mut().enumerate() {
            for (z, node) in row.iter_mut().enumerate() {
                // The cells between the node and the middle one.
                let span = |k: usize| if k == 1 { 1..=1 } else { k.min(1)..=k.max(1) };
                let around: Vec<f64> =
                    span(x).flat_map(|i| span(z).filter_map(move |j| cells[i][j])).collect();
                *node = shared(own, &around, MOST_SHARED);
            }
        }
        // A corner is a corner of one quarter of four, an edge's middle of two, the middle of all.
        let corners = nodes[0][0] + nodes[0][2] + nodes[2][0] + nodes[2][2];
        let edges = nodes[0][1] + nodes[1][0] + nodes[1][2] + nodes[2][1];
        nodes[1][1] = (4.0 - 0.25 * corners - 0.5 * edges).max(0.0);
        Plane { nodes }
    }

    /// Returns the value at a place, from −½ to ½ along x and z.
    pub fn at(&self, x: f64, z: f64) -> f64 {
        let [first, middle, last] = self.across(x);
        line(first, middle, last, z)
    }

    /// Returns where two even numbers, from −½ to ½, lie if the shares of the extinction are even.
    pub fn place(&self, [x, z]: [f64; 2]) -> [f64; 2] {
        let sums = self.nodes.map(|[first, middle, last]| first + 2.0 * middle + last);
        let x = Profile::through(sums).place(x);
        [x, Profile::through(self.across(x)).place(z)]
    }

    /// Returns the values of the three nodes along z at a place along x.
    fn across(&self, x: f64) -> [f64; 3] {
        [0, 1, 2].map(|k| line(self.nodes[0][k], self.nodes[1][k], self.nodes[2][k], x))
    }
}

/// Returns what `own` and other cells have at a point that all touch, over `own`.
fn shared(own: f64, cells: &[f64], most: f64) -> f64 {
    let mean = cells.iter().sum::<f64>() / cells.len() as f64;
    let least = cells.iter().copied().fold(f64::INFINITY, f64::min);
    if own > 0.0 { mean.min(most * least) / own } else { 1.0 }
}

/// Returns the value at `t`, from −½ to ½, of two straight lines through three values.
fn line(first: f64, middle: f64, last: f64, t: f64) -> f64 {
    let end = if t > 0.0 { last } else { first };
    middle + (end - middle) * 2.0 * t.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_by_hand() {
        let of = |a, b, c| Profile::between(a, b, c);
        assert_eq!(of(Some(2.0), 2.0, Some(2.0)), Profile::EVEN);
        assert_eq!(of(None, 2.0, None), Profile::EVEN);
        // Alone: a tent, of which an eighth lies in the first quarter.
        let tent = of(Some(0.0), 3.0, Some(0.0));
        assert_eq!((tent.ends, tent.middle()), ([0.0; 2], 2.0));
        assert!((tent.place(-0.375) + 0.25).abs() < 1e-15 && tent.place(0.0).abs() < 1e-15);
        assert!((tent.place(0.375) - 0.25).abs() < 1e-15);
        // Between 1 and 9: twice the smaller one counts, and the mean of 4 and 9.
        let rising = of(Some(1.0), 4.0, Some(9.0));
        assert_eq!(rising.ends, [0.5, 1.625]);
        assert_eq!([-0.5, -0.25, 0.0, 0.5].map(|t| tent.at(t)), [0.0, 1.0, 2.0, 0.0]);
        // A face has one value.
        assert_eq!(of(Some(4.0), 9.0, None).ends[0] * 9.0, 1.625 * 4.0);
    }

    #[test]
    fn places_follow_the_profile() {
        for ends in [[1.0, 1.0], [0.0, 0.0], [0.0, 2.0], [2.0, 0.3], [2.0, 2.0], [0.2, 1.4]] {
            let of = Profile { ends };
            let n = 10_000;
            let at = |k: i32| of.place((f64::from(k) + 0.5) / f64::from(n) - 0.5);
            let places: Vec<f64> = (0..n).map(at).collect();
            assert!(places.is_sorted() && places[0] >= -0.5 && places[n as usize - 1] <= 0.5);
            // The share below t, by the area under the lines.
            for t in [-0.4, -0.1, 0.0, 0.2, 0.45] {
                let below = places.iter().filter(|place| **place < t).count() as f64 / 1e4;
                let line = |from: f64, to: f64, s: f64| from * s + (to - from) * s * s;
                let expected = if t < 0.0 {
                    line(ends[0], of.middle(), t + 0.5)
                } else {
                    1.0 - line(ends[1], of.middle(), 0.5 - t)
                };
                assert!((below - expected).abs() < 2e-4, "{ends:?} {t}: {below} {expected}");
            }
        }
    }

    #[test]
    fn planes_by_hand() {
        let even = Plane::among([[Some(3.0); 3]; 3]);
        assert_eq!(even, Plane::EVEN);
        assert_eq!(Plane::among([[None, None, None], [None, Some(3.0), None], [None; 3]]), even);
        // Alone: a pyramid of height 4 on the cell.
        let clear = Some(0.0);
        let alone = Plane::among([[clear; 3], [clear, Some(2.0), clear], [clear; 3]]);
        assert_eq!(alone.at(0.0, 0.0), 4.0);
        assert_eq!(
            [alone.at(0.5, 0.1), alone.at(-0.2, -0.5), alone.at(0.25, 0.25)],
            [0.0, 0.0, 1.0]
        );
        // Cells of 1, 2 and 6: the mean of 1 and 2 is more than 4/3, and that of 2 and 6 more than
        // 8/3.
        let row = [Some(1.0), Some(2.0), Some(6.0)].map(|v| [v; 3]);
        let rising = Plane::among(row);
        let near = |found: f64, expected: f64| (found - expected).abs() < 1e-14;
        assert!(near(rising.at(-0.5, 0.3), 2.0 / 3.0) && near(rising.at(0.5, 0.0), 4.0 / 3.0));
        // The greatest that nine cells share leaves nothing in the middle.
        let low = Plane::among([[Some(9.0); 3], [Some(9.0), Some(1.0), Some(9.0)], [Some(9.0); 3]]);
        assert!(low.at(0.0, 0.0).abs() < 1e-14 && near(low.at(0.5, 0.5), 4.0 / 3.0));
    }

    #[test]
    fn cells_share_the_values_at_their_edges() {
        let field = [[1.0, 0.0, 4.0, 2.0], [3.0, 5.0, 1.0, 0.5], [0.2, 2.0, 7.0, 3.0]];
        let of = |j: usize| {
            let cells = [0, 1, 2].map(|x| [0, 1, 2].map(|z| Some(field[x][j + z - 1])));
            (Plane::among(cells), field[1][j])
        };
        let ((a, own_a), (b, own_b)) = (of(1), of(2));
        for x in [-0.5, -0.3, 0.0, 0.2, 0.5] {
            assert!((a.at(x, 0.5) * own_a - b.at(x, -0.5) * own_b).abs() < 1e-14);
        }
    }

    #[test]
    fn places_follow_the_plane() {
        let cells = [[0.0, 2.0, 3.0], [1.0, 4.0, 5.0], [0.0, 3.0, 9.0]].map(|row| row.map(Some));
        let plane = Plane::among(cells);
        let n = 1000;
        let part = |k: usize| (k as f64 + 0.5) / n as f64 - 0.5;
        let places: Vec<[f64; 2]> =
            (0..n * n).map(|k| plane.place([part(k % n), part(k / n)])).collect();
        // Shares of sixteen parts: the means over points of the plane, whose mean is 1.
        for part_of in 0..16 {
            let low = [part_of % 4, part_of / 4].map(|k| k as f64 / 4.0 - 0.5);
            let within = |p: &&[f64; 2]| (0..2).all(|k| p[k] >= low[k] && p[k] < low[k] + 0.25);
            let found = places.iter().filter(within).count() as f64 / (n * n) as f64;
            let at = |k: usize| {
                let t = |i: usize| 0.25 * (i as f64 + 0.5) / 20.0;
                plane.at(low[0] + t(k % 20), low[1] + t(k / 20))
            };
            let expected = (0..400).map(at).sum::<f64>() / 400.0 / 16.0;
            assert!((found - expected).abs() < 3e-4, "{low:?}: {found} {expected}");
        }
    }
}
