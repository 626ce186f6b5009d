//! Least squares whose coefficients are not negative: the x ≥ 0 for which ‖A x − b‖ is least. For
//! small dense problems.
//!
//! Lawson & Hanson 1974, "Solving Least Squares Problems", ch. 23: columns enter a passive set by
//! the largest gradient of what is left, the passive ones are solved for without a bound, and what
//! would become negative goes out at 0 on the way there. Each passive set is solved by
//! Householder's QR of its columns, since the normal equations would square the condition. Columns
//! and b are first brought to length 1, so that units don't matter.

/// The greatest number of columns: every set of them may be visited, and there are 2⁸.
pub const MAX_COLUMNS: usize = 8;

/// The constant c of Householder's QR with m rows and k columns: its solution is the exact one of a
/// problem whose columns and b are changed by c m k ε/2 of their lengths (Higham 2002, theorem
/// 20.3, who leaves c open as "a small integer"). 4 is a choice; the conditions of a minimum hold
/// within it over thousands of random problems.
const HOUSEHOLDER_CONSTANT: f64 = 4.0;

/// x ≥ 0, one for every column, with ‖Σ xⱼ columnⱼ − b‖ least; its unit is b's over the column's.
/// Where columns depend on one another many x are as good, and one of them comes out: a column that
/// adds nothing to those taken before it has 0, as a column of zeros has. At least one finite x
/// always exists; Err where the input is not finite, the lengths differ, there are more than
/// [`MAX_COLUMNS`], or x itself is beyond f64.
pub fn solve(columns: &[Vec<f64>], b: &[f64]) -> Result<Vec<f64>, String> {
    check(columns, b)?;
    let scaled: Vec<Scaled> = columns.iter().map(|column| Scaled::of(column)).collect();
    let target = Scaled::of(b);
    let (x, _) = Problem::new(&scaled, target.unit.clone()).solve();
    let x: Vec<f64> = x.iter().zip(&scaled).map(|(x, column)| x * target.over(column)).collect();
    match x.iter().position(|x| !x.is_finite()) {
        Some(j) => Err(format!(
            "least squares: the coefficient of column {j} is beyond f64, expected another unit"
        )),
        None => Ok(x),
    }
}

/// Whether each column is something that the others together cannot make, to rounding; where it is
/// not, its coefficient is one of many that fit as well. Errors as of [`solve`].
pub fn told_apart(columns: &[Vec<f64>]) -> Result<Vec<bool>, String> {
    let zeros = vec![0.0; columns.first().map_or(0, Vec::len)];
    check(columns, &zeros)?;
    let scaled: Vec<Scaled> = columns.iter().map(|column| Scaled::of(column)).collect();
    let problem = Problem::new(&scaled, zeros);
    let all = (1 << columns.len()) - 1;
    Ok((0..columns.len()).map(|j| problem.rank(all) > problem.rank(all & !(1 << j))).collect())
}

fn check(columns: &[Vec<f64>], b: &[f64]) -> Result<(), String> {
    if columns.len() > MAX_COLUMNS {
        return Err(format!(
            "least squares: {} columns, expected at most {MAX_COLUMNS}",
            columns.len()
        ));
    }
    if let Some(column) = columns.iter().find(|column| column.len() != b.len()) {
        return Err(format!(
            "least squares: a column of {} rows, expected {}",
            column.len(),
            b.len()
        ));
    }
    match columns.iter().flatten().chain(b).find(|value| !value.is_finite()) {
        Some(value) => {
            Err(format!("least squares: {value} among the numbers, expected finite ones"))
        }
        None => Ok(()),
    }
}

/// A list as a direction and its length, `largest` · `rest`: squares of the numbers themselves may
/// be beyond f64.
struct Scaled {
    unit: Vec<f64>,
    largest: f64,
    rest: f64,
}

impl Scaled {
    /// Zeros have no direction: zeros, and the length 1, by which nothing becomes NaN.
    fn of(values: &[f64]) -> Scaled {
        let largest = values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
        if largest == 0.0 {
            return Scaled { unit: values.to_vec(), largest: 1.0, rest: 1.0 };
        }
        let mut unit: Vec<f64> = values.iter().map(|value| value / largest).collect();
        let rest = length(&unit);
        unit.iter_mut().for_each(|value| *value /= rest);
        Scaled { unit, largest, rest }
    }

    /// The ratio of the lengths.
    fn over(&self, other: &Scaled) -> f64 {
        self.largest / other.largest * (self.rest / other.rest)
    }
}

/// Columns and b of length 1 or 0. Sets of columns are the bits of a number.
struct Problem<'a> {
    columns: Vec<&'a [f64]>,
    b: Vec<f64>,
    /// What rounding alone makes of a distance or a gradient, relative to ‖b‖ + Σ ‖xⱼ columnⱼ‖. The
    /// gradient Aᵀr at the computed x is that of the changed problem, 0, and the change: at most 2
    /// c m k ε/2 of that sum. A column that is no farther than this from the others' span cannot be
    /// told from one within it.
    tolerance: f64,
}

/// A turn either ends in a set of columns that no turn ended in before, of which there are 2ᵏ − 1
/// beside the empty one, or refuses a column, at most k times before and after each; and the last
/// one finds nothing to enter.
fn most_turns(n_columns: usize) -> usize {
    (n_columns + 1) << n_columns
}

impl<'a> Problem<'a> {
    fn new(columns: &'a [Scaled], b: Vec<f64>) -> Self {
        let tolerance = HOUSEHOLDER_CONSTANT * (b.len() * columns.len()) as f64 * f64::EPSILON;
        Problem {
            columns: columns.iter().map(|column| column.unit.as_slice()).collect(),
            b,
            tolerance,
        }
    }

    /// x and how many turns it took, at most [`most_turns`]. Without rounding ‖A x − b‖ falls from
    /// turn to turn and no set comes twice. With it one could, so sets are remembered, and a column
    /// that leads back to one is refused.
    fn solve(&self) -> (Vec<f64>, usize) {
        let k = self.columns.len();
        let (mut x, mut passive, mut refused) = (vec![0.0; k], 0, 0);
        let mut seen = vec![false; 1 << k];
        seen[0] = true;
        for turn in 1..=most_turns(k) {
            let gradient = self.gradient(&x);
            let least = self.tolerance * (1.0 + x.iter().sum::<f64>());
            let may_enter =
                (0..k).filter(|j| (passive | refused) >> j & 1 == 0 && gradient[*j] > least);
            // The first of equal ones: min_by keeps it.
            let Some(j) = may_enter.min_by(|i, j| gradient[*j].total_cmp(&gradient[*i])) else {
                return (x, turn);
            };
            match self.enter(&x, passive, j).filter(|(_, set)| !seen[*set]) {
                Some((next, set)) => {
                    (x, passive, refused) = (next, set, 0);
                    seen[set] = true;
                }
                None => refused |= 1 << j,
            }
        }
        (x, most_turns(k))
    }

    /// Column j joins the passive ones: the solution of what stays passive, and which those are.
    /// None where j adds nothing to the others, or rounding alone made its gradient positive, which
    /// its own coefficient shows.
    fn enter(&self, x: &[f64], passive: usize, j: usize) -> Option<(Vec<f64>, usize)> {
        let (mut x, mut set) = (x.to_vec(), passive | 1 << j);
        let mut free = self.least_squares(set)?;
        if free[j] <= 0.0 {
            return None;
        }
        // Every pass takes a column out, so that there are at most k of them.
        while let Some((out, share)) = first_at_zero(&x, &free, set) {
            for i in members(set) {
                x[i] += share * (free[i] - x[i]);
            }
            x[out] = 0.0;
            for i in members(set).filter(|i| x[*i] <= 0.0).collect::<Vec<_>>() {
                x[i] = 0.0;
                set &= !(1 << i);
            }
            free = self.least_squares(set)?;
        }
        Some((free, set))
    }

    /// Aᵀ(b − A x): how fast half the square of the distance falls with each coefficient.
    fn gradient(&self, x: &[f64]) -> Vec<f64> {
        let mut left = self.b.clone();
        for (column, x) in self.columns.iter().zip(x).filter(|(_, x)| **x != 0.0) {
            left.iter_mut().zip(*column).for_each(|(left, a)| *left -= a * x);
        }
        self.columns.iter().map(|column| inner(column, &left)).collect()
    }

    /// Coefficients of the set's columns without a bound, 0 for the others. None where one of them
    /// depends on those before it. It follows from the set alone, so that the same set gives the
    /// same bits.
    fn least_squares(&self, set: usize) -> Option<Vec<f64>> {
        let set: Vec<usize> = members(set).collect();
        let mut columns: Vec<Vec<f64>> = set.iter().map(|j| self.columns[*j].to_vec()).collect();
        let mut b = self.b.clone();
        for p in 0..set.len() {
            let (done, rest) = columns.split_at_mut(p + 1);
            let column = &mut done[p];
            let distance = length(&column[p..]);
            if distance <= self.tolerance {
                return None;
            }
            // The sign that does not cancel.
            let diagonal = if column[p] > 0.0 { -distance } else { distance };
            let mut normal = column[p..].to_vec();
            normal[0] -= diagonal;
            column[p] = diagonal;
            for other in rest.iter_mut().chain([&mut b]) {
                reflect(&mut other[p..], &normal);
            }
        }
        let mut x = vec![0.0; self.columns.len()];
        for p in (0..set.len()).rev() {
            let known: f64 = (p + 1..set.len()).map(|q| columns[q][p] * x[set[q]]).sum();
            x[set[p]] = (b[p] - known) / columns[p][p];
        }
        Some(x)
    }

    /// How many columns of the set none of those before them make.
    fn rank(&self, set: usize) -> u32 {
        let join = |kept: usize, j: usize| {
            self.least_squares(kept | 1 << j).map_or(kept, |_| kept | 1 << j)
        };
        members(set).fold(0, join).count_ones()
    }
}

fn members(set: usize) -> impl Iterator<Item = usize> {
    (0..MAX_COLUMNS).filter(move |j| set >> j & 1 == 1)
}

/// On the straight way from x to `free`: which coefficient of the set is the first to be 0, and at
/// what share of the way. None where all of `free` is above 0.
fn first_at_zero(x: &[f64], free: &[f64], set: usize) -> Option<(usize, f64)> {
    let falling = members(set).filter(|j| free[*j] <= 0.0);
    // One that is 0 already goes out where it stands.
    let shares = falling.map(|j| (j, if x[j] > 0.0 { x[j] / (x[j] - free[j]) } else { 0.0 }));
    shares.min_by(|(_, a), (_, b)| a.total_cmp(b))
}

/// Mirrored at the plane across `normal`, which is not 0.
fn reflect(values: &mut [f64], normal: &[f64]) {
    let twice = 2.0 * inner(values, normal) / inner(normal, normal);
    values.iter_mut().zip(normal).for_each(|(value, normal)| *value -= twice * normal);
}

fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn length(values: &[f64]) -> f64 {
    inner(values, values).sqrt()
}

#[cfg(test)]
mod tests;
