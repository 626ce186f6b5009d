//! Vertical optical depth of every column, of the blobs that represent a file's cells.

use std::f64::consts::TAU;

use libm::erf;
use nimbus::model::weather::grid::Grid;
use nimbus::model::weather::particles::WeatherBlob;

/// Radius of a blob's footprint, σ_xy: 2 · 10⁻⁹ of its mass lies beyond.
const REACH: f64 = 6.0;

/// Returns the blobs' vertical optical depth, averaged over the area of each column. The share of a
/// footprint within a column is a product of differences of erf.
pub fn of_blobs(grid: &Grid, blobs: &[WeatherBlob]) -> Vec<f64> {
    let ground = &grid.ground;
    let mut depths = vec![0.0; ground.shape.n_columns()];
    for blob in blobs {
        let reach = REACH * blob.sigma_xy;
        for i_column in near(grid, blob, reach) {
            let share = |centre: f64, size: f64, at: f64| {
                let to = |edge: f64| erf((edge - at) / (blob.sigma_xy * std::f64::consts::SQRT_2));
                0.5 * (to(centre + size / 2.0) - to(centre - size / 2.0))
            };
            let within = share(ground.east_m[i_column], ground.dx_m[i_column], blob.position.x)
                * share(ground.south_m[i_column], ground.dy_m[i_column], blob.position.z);
            depths[i_column] += blob.mass() * within / ground.area_m2(i_column);
        }
    }
    depths
}

/// Returns the blobs' vertical optical depth at `side`² points of each column, in the middles of
/// equal parts. *Shape*: [column][point].
pub fn at_points(grid: &Grid, blobs: &[WeatherBlob], side: usize) -> Vec<f64> {
    let ground = &grid.ground;
    let n_points = side * side;
    let mut depths = vec![0.0; ground.shape.n_columns() * n_points];
    for blob in blobs {
        let peak = blob.mass() / (TAU * blob.sigma_xy * blob.sigma_xy);
        for i_column in near(grid, blob, REACH * blob.sigma_xy) {
            for (i_point, depth) in depths[i_column * n_points..][..n_points].iter_mut().enumerate()
            {
                let part = |i: usize| (i as f64 + 0.5) / side as f64 - 0.5;
                let x = ground.east_m[i_column] + part(i_point % side) * ground.dx_m[i_column]
                    - blob.position.x;
                let z = ground.south_m[i_column] + part(i_point / side) * ground.dy_m[i_column]
                    - blob.position.z;
                *depth += peak * (-(x * x + z * z) / (2.0 * blob.sigma_xy * blob.sigma_xy)).exp();
            }
        }
    }
    depths
}

/// Returns the root mean square difference of e^{−τ}; `b` may have several values for each of `a`.
pub fn transmittance_rms(a: &[f64], b: &[f64]) -> f64 {
    let each = b.len() / a.len().max(1);
    let square = |(i, depth): (usize, &f64)| ((-depth).exp() - (-a[i / each.max(1)]).exp()).powi(2);
    (b.iter().enumerate().map(square).sum::<f64>() / b.len().max(1) as f64).sqrt()
}

/// Returns the columns that a blob reaches, and some around them.
fn near(grid: &Grid, blob: &WeatherBlob, reach: f64) -> impl Iterator<Item = usize> {
    let ground = &grid.ground;
    let (nx, ny) = (ground.shape.nx, ground.shape.ny);
    let row = move |south_m: f64| nearest(ny, south_m, |j| ground.south_m[j * nx + nx / 2]);
    let rows = margin(row(blob.position.z + reach), row(blob.position.z - reach), ny);
    rows.flat_map(move |j| {
        let column = |east_m: f64| nearest(nx, east_m, |i| ground.east_m[j * nx + i]);
        let columns = margin(column(blob.position.x - reach), column(blob.position.x + reach), nx);
        columns.map(move |i| j * nx + i).collect::<Vec<_>>()
    })
}

/// Returns the range between two indices, widened by one on each side.
fn margin(a: usize, b: usize, n: usize) -> std::ops::Range<usize> {
    a.min(b).saturating_sub(1)..(a.max(b) + 2).min(n)
}

/// Returns the index of the place nearest to `at`, of `n` that rise or fall.
fn nearest(n: usize, at: f64, place: impl Fn(usize) -> f64) -> usize {
    let falls = n > 1 && place(n - 1) < place(0);
    let is_before = |i: usize| if falls { place(i) > at } else { place(i) < at };
    let (mut low, mut high) = (0, n);
    while low < high {
        let middle = (low + high) / 2;
        if is_before(middle) { low = middle + 1 } else { high = middle }
    }
    low.min(n.saturating_sub(1))
}
