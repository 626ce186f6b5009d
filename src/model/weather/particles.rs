//! Blobs for cells: how many each cell gets, where they lie, and the extinction that preserves the
//! cell's mass (model.md §15).

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::grid::{Grid, Shape};
use super::hidden::weights;
use super::opaque::open_columns;
use super::places::CellSeed;
use super::profile::{Plane, Profile};

/// Optical depth below which a column may be without blobs, 0.1 % of the light. It applies if more
/// than one blob in [`AFFORDED`] would be needed to give every column one. The column's mass goes
/// to the next column with blobs.
pub const THIN: f64 = 1e-3;
/// Number of blobs for each of which one blob may serve thin columns.
pub const AFFORDED: usize = 10;
/// σ_xy over the spacing √(area/n) of a cell's blobs. Wider blobs blur cells into each other,
/// narrower ones leave gaps (errors: model.md §15).
pub const SPREAD: f64 = 0.40;
/// σ of a uniform distribution over a length of 1: 1/√12.
const EVEN: f64 = 0.288_675_134_594_812_9;
/// Variance across that blobs of a cell among equal ones have more than an even cell, over the
/// square of its size: ½² together.
const REACH: f64 = 0.25 - EVEN * EVEN;
/// σ_z over the thickness of a cell with several blobs. Their heights, over half of the cell, add
/// the rest of the variance: 1/16 + 1/48 = 1/12.
const THICKNESS: f64 = 0.25;

/// A Gaussian blob with a round footprint: κ exp(−(x² + z²)/2σ_xy² − y²/2σ_z²).
///
/// *Units*: metres, x east, y up from sea level, z south, from the middle of the domain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeatherBlob {
    /// Centre.
    pub position: DVec3,
    /// Standard deviation along x and z.
    pub sigma_xy: f64,
    /// Standard deviation along y.
    pub sigma_z: f64,
    /// Peak extinction, m⁻¹.
    pub kappa: f64,
}

impl WeatherBlob {
    /// Returns the integral of the extinction over space, m².
    pub fn mass(&self) -> f64 {
        self.kappa * TAU * (2.0 * PI).sqrt() * self.sigma_xy * self.sigma_xy * self.sigma_z
    }
}

/// A blob of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Index of the cell.
    pub i_cell: u32,
    /// Number of the blob within the cell.
    pub number: u32,
}

/// Numbers of blobs of all cells, and the cells whose blobs hold each cell's mass. A layout serves
/// one step, or all moments between two: blobs keep their places and only their extinction changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    seed: u32,
    n_blobs: Vec<u32>,
    /// For every cell the sum of the squares of its blobs' widths.
    areas: Vec<f64>,
    /// For every cell, how its extinction runs.
    courses: Vec<Course>,
    /// For every cell the cell whose blobs hold its mass; itself if it has blobs.
    hosts: Vec<u32>,
    /// For every column, the columns around it that its blobs may enter ([`Layout::open`]).
    open: Vec<u16>,
    /// All blobs, in an order of which any first part represents all cells evenly.
    places: Vec<Place>,
}

impl Layout {
    /// Distributes `n` blobs by the cells' weights ([`hidden`](super::hidden)). Of several moments
    /// the greatest depth of a cell counts, and the least depth around it.
    pub fn new(grid: &Grid, moments: &[&[f64]], n: usize, seed: u32) -> Self {
        let depths = greatest_depths(grid, moments);
        let n_blobs = allocate(grid, &depths, &weights(grid, moments, &depths), n);
        let hosts = hosts(grid, &depths, &n_blobs);
        let mut ordered: Vec<(f64, Place)> = Vec::with_capacity(n);
        let mut areas = vec![0.0; n_blobs.len()];
        for ((i_cell, &n_here), area) in (0u32..).zip(&n_blobs).zip(&mut areas) {
            if n_here > 0 {
                let cell = CellSeed::new(seed, i_cell);
                *area = (0..n_here).map(|number| cell.width(number, n_here).powi(2)).sum();
                ordered.extend(
                    (0..n_here)
                        .map(|number| (cell.order(number, n_here), Place { i_cell, number })),
                );
            }
        }
        ordered.sort_by(|a, b| a.0.total_cmp(&b.0));
        let places = ordered.into_iter().map(|(_, place)| place).collect();
        let courses = courses(grid, &depths);
        let open = open_columns(grid.shape(), &depths);
        Layout { seed, n_blobs, areas, courses, hosts, open, places }
    }

    /// Returns all blobs in drawing order.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// Returns the number of blobs of each cell.
    pub fn n_blobs(&self) -> &[u32] {
        &self.n_blobs
    }

    /// Returns the blobs that represent `extinction`, m⁻¹ a cell, on `grid`. Their mass is ∫ β dV,
    /// and each cell's blobs hold the mass of the cells they serve. The result is linear in
    /// `extinction`, which may be positive only where it is in a moment of the layout.
    pub fn blobs(&self, grid: &Grid, extinction: &[f64]) -> Vec<WeatherBlob> {
        let n_columns = grid.shape().n_columns();
        let mut masses = vec![0.0; extinction.len()];
        for (i, beta) in extinction.iter().enumerate().filter(|(_, beta)| **beta > 0.0) {
            masses[self.hosts[i] as usize] +=
                beta * grid.thickness_m(i) * grid.ground.area_m2(i % n_columns);
        }
        self.places
            .iter()
            .map(|place| self.blob(grid, *place, masses[place.i_cell as usize]))
            .collect()
    }

    /// Returns where a blob of a cell would be, from −½ to ½, if its extinction were even.
    pub fn even(&self, place: Place) -> DVec3 {
        CellSeed::new(self.seed, place.i_cell).place(place.number)
    }

    /// Returns how the extinction of a cell runs.
    pub fn course(&self, i_cell: usize) -> &Course {
        &self.courses[i_cell]
    }

    /// Returns the columns around one that its blobs may be displaced into: bit 3 east + south,
    /// each from 0 to 2 with 1 for its own. All of
    /// them are opaque.
    pub fn open(&self, i_column: usize) -> u16 {
        self.open[i_column]
    }

    /// Returns the extinction at a blob's place over the mean of its cell.
    pub fn relative(&self, place: Place) -> f64 {
        let at = self.place_in_cell(place);
        let Course { across, upward, .. } = self.courses[place.i_cell as usize];
        across.at(at.x, at.z) * upward.at(at.y)
    }

    /// Returns a blob's place in its cell, from −½ to ½.
    pub fn place_in_cell(&self, place: Place) -> DVec3 {
        let even = self.even(place);
        let Course { across, upward, .. } = self.courses[place.i_cell as usize];
        let [x, z] = across.place([even.x, even.z]);
        DVec3::new(x, upward.place(even.y), z)
    }

    fn blob(&self, grid: &Grid, place: Place, mass_of_cell: f64) -> WeatherBlob {
        let i = place.i_cell as usize;
        let (i_column, ground) = (i % grid.shape().n_columns(), &grid.ground);
        let SizeInCell { sigma_xy, sigma_z, room } = self.size(grid, place);
        let middle =
            DVec3::new(ground.east_m[i_column], grid.middle_m(i), ground.south_m[i_column]);
        let position = middle + room * self.place_in_cell(place);
        let mut blob = WeatherBlob { position, sigma_xy, sigma_z, kappa: 1.0 };
        blob.kappa = mass_of_cell * self.share(place) / blob.mass();
        blob
    }

    fn width(&self, Place { i_cell, number }: Place) -> f64 {
        CellSeed::new(self.seed, i_cell).width(number, self.n_blobs[i_cell as usize])
    }

    /// Returns the share of its cell's mass that a blob has: as its area's.
    fn share(&self, place: Place) -> f64 {
        self.width(place).powi(2) / self.areas[place.i_cell as usize]
    }

    /// Returns the widths of a blob, and the room of its centre.
    pub fn size(&self, grid: &Grid, place: Place) -> SizeInCell {
        let i = place.i_cell as usize;
        let (n, ground) = (f64::from(self.n_blobs[i]), &grid.ground);
        let i_column = i % grid.shape().n_columns();
        let (dx, dy, thickness) =
            (ground.dx_m[i_column], ground.dy_m[i_column], grid.thickness_m(i));
        // Where the cells around are alike, blobs may reach into them: single ones would be a row
        // of balls.
        let across = (EVEN * EVEN + self.courses[i].evenness * REACH).sqrt();
        let sigma_xy = (SPREAD * self.width(place) * (dx * dy / n).sqrt()).min(across * dx.min(dy));
        let sigma_z = if n > 1.0 { THICKNESS } else { EVEN } * thickness;
        // Centres and widths together have this variance: the centres' range shrinks as blobs are
        // wider.
        let room = |size: f64, sigma: f64, together: f64| {
            let centers = (together * together - (sigma / size).powi(2)).max(0.0).sqrt();
            size * (centers / EVEN).min(1.0)
        };
        let room = DVec3::new(
            room(dx, sigma_xy, across),
            room(thickness, sigma_z, EVEN),
            room(dy, sigma_xy, across),
        );
        SizeInCell { sigma_xy, sigma_z, room }
    }
}

/// Widths of a blob, and the extent of its centre.
#[derive(Debug, Clone, Copy)]
pub struct SizeInCell {
    /// Standard deviation along x and z, m.
    pub sigma_xy: f64,
    /// Standard deviation along y, m.
    pub sigma_z: f64,
    /// Extent of the centres along x, y and z, m.
    pub room: DVec3,
}

/// Returns the vertical optical depth of every cell, the greatest of all moments.
fn greatest_depths(grid: &Grid, moments: &[&[f64]]) -> Vec<f64> {
    let greatest = |i: usize| moments.iter().map(|m| m[i]).fold(0.0, f64::max);
    (0..grid.shape().n_cells()).map(|i| greatest(i) * grid.thickness_m(i)).collect()
}

/// How the extinction runs in a cell: across, and in height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Course {
    /// Along x and z.
    pub across: Plane,
    /// Upward.
    pub upward: Profile,
    /// Least extinction of the eight cells around over the cell's own, at most 1; 0 at the edge of
    /// the domain.
    pub evenness: f64,
}

impl Course {
    /// The same throughout.
    const EVEN: Course = Course { across: Plane::EVEN, upward: Profile::EVEN, evenness: 0.0 };
}

/// Returns how the extinction runs in cells of vertical optical depths `depths`.
pub fn courses(grid: &Grid, depths: &[f64]) -> Vec<Course> {
    let Shape { nx, ny, nz } = grid.shape();
    let extinction = |i: usize| depths[i] / grid.thickness_m(i);
    let of = |i: usize| {
        if depths[i] <= 0.0 {
            return Course::EVEN;
        }
        let (i_column, k) = (i % (nx * ny), i / (nx * ny));
        let (x, y) = (i_column % nx, i_column / nx);
        // Rows run north, and z points south.
        let at = |east: usize, south: usize| {
            let (x, y) = ((x + east).checked_sub(1)?, (y + 1).checked_sub(south)?);
            (x < nx && y < ny).then(|| extinction(x + nx * (y + ny * k)))
        };
        let around = [0, 1, 2].map(|east| [0, 1, 2].map(|south| at(east, south)));
        let across = Plane::among(around);
        let least = around
            .as_flattened()
            .iter()
            .fold(extinction(i), |least, other| least.min(other.unwrap_or(0.0)));
        let evenness = if extinction(i) > 0.0 { least / extinction(i) } else { 0.0 };
        let below = (k > 0).then(|| extinction(i - nx * ny));
        let above = (k + 1 < nz).then(|| extinction(i + nx * ny));
        Course { across, upward: Profile::between(below, extinction(i), above), evenness }
    };
    (0..depths.len()).map(of).collect()
}

/// Returns the number of blobs of each cell. Columns get blobs by their cells' weights, and the
/// cells of a column by rounding the running sum, so that cells of little weight share one.
fn allocate(grid: &Grid, depths: &[f64], of_cells: &[f64], n: usize) -> Vec<u32> {
    let shape = grid.shape();
    let n_columns = shape.n_columns();
    let mut weights = vec![0.0; n_columns];
    let mut of_columns = vec![0.0; n_columns];
    for (i, depth) in depths.iter().enumerate() {
        weights[i % n_columns] += of_cells[i];
        of_columns[i % n_columns] += depth;
    }
    let mut n_blobs = vec![0u32; depths.len()];
    for (i_column, &n_column) in
        apportion(&weights, &of_columns, n, &boustrophedon(shape)).iter().enumerate()
    {
        let (mut sum, mut n_before) = (0.0, 0);
        for k in 0..shape.nz {
            let i = shape.cell(k, i_column);
            sum += of_cells[i];
            // The last sum equals the weight to the bit.
            let n_until = if n_column == 0 {
                0
            } else {
                (n_column as f64 * (sum / weights[i_column]) + 0.5) as u32
            };
            n_blobs[i] = n_until - n_before;
            n_before = n_until;
        }
    }
    n_blobs
}

/// Apportions `n` items by weight. If there are enough, every item that is not thin gets one, and
/// the rest goes by largest remainder, ties to the first. The others get theirs by rounding the
/// running sum in `order`, so that some neighbours share one.
fn apportion(weights: &[f64], depths: &[f64], n: usize, order: &[usize]) -> Vec<usize> {
    let mut apportioned = vec![0; weights.len()];
    let total: f64 = weights.iter().sum();
    if total <= 0.0 {
        return apportioned;
    }
    // Columns without a cloud get none.
    let n_cloudy = weights.iter().filter(|weight| **weight > 0.0).count();
    let least = if n_cloudy <= n / AFFORDED { f64::MIN_POSITIVE } else { THIN };
    let n_thick = depths.iter().filter(|depth| **depth >= least).count();
    let is_thick = |i: usize| n_thick <= n && depths[i] >= least;
    let (mut sum, mut n_thin) = (0.0, 0);
    let room = if n_thick <= n { n - n_thick } else { n };
    for &i in order.iter().filter(|i| !is_thick(**i)) {
        sum += weights[i];
        let n_until = ((n as f64 * (sum / total) + 0.5) as usize).min(room);
        apportioned[i] = n_until - n_thin;
        n_thin = n_until;
    }
    if n_thick > n || n_thick == 0 {
        // Rounding may leave the last sum short of `n`.
        if let Some(&i) = order.iter().rev().find(|i| weights[**i] > 0.0) {
            apportioned[i] += n.saturating_sub(n_thin);
        }
        return apportioned;
    }
    let left = room - n_thin;
    let thick: Vec<usize> = (0..weights.len()).filter(|&i| is_thick(i)).collect();
    // Each one's share beyond the item it has; if nobody has a share, it goes by weight.
    let due: Vec<f64> =
        thick.iter().map(|&i| (n as f64 * weights[i] / total - 1.0).max(0.0)).collect();
    let due = if due.iter().sum::<f64>() > 0.0 {
        due
    } else {
        thick.iter().map(|&i| weights[i]).collect()
    };
    let due_together: f64 = due.iter().sum();
    let quotas: Vec<f64> = due.iter().map(|d| left as f64 * (d / due_together)).collect();
    let mut by_remainder: Vec<usize> = (0..thick.len()).collect();
    by_remainder.sort_by(|&a, &b| quotas[b].fract().total_cmp(&quotas[a].fract()).then(a.cmp(&b)));
    let n_whole: usize = quotas.iter().map(|q| *q as usize).sum();
    thick.iter().zip(&quotas).for_each(|(&i, quota)| apportioned[i] = 1 + *quota as usize);
    for &i in by_remainder.iter().take(left.saturating_sub(n_whole)) {
        apportioned[thick[i]] += 1;
    }
    apportioned
}

/// Returns the columns row by row from the south, alternately eastward and westward, so that each
/// is a neighbour of the one before it.
fn boustrophedon(shape: Shape) -> Vec<usize> {
    let along =
        |j: usize, i: usize| j * shape.nx + if j.is_multiple_of(2) { i } else { shape.nx - 1 - i };
    (0..shape.ny).flat_map(|j| (0..shape.nx).map(move |i| along(j, i))).collect()
}

/// Returns the cell whose blobs hold each cell's mass: its own; else the nearest level of its
/// column with blobs; else of the next column with blobs in boustrophedon order.
fn hosts(grid: &Grid, depths: &[f64], n_blobs: &[u32]) -> Vec<u32> {
    let shape = grid.shape();
    let n_columns = shape.n_columns();
    let has_some = |i_column: usize| (0..shape.nz).any(|k| n_blobs[shape.cell(k, i_column)] > 0);
    // For every column the next one with blobs in that order; the columns after the last one use
    // the last one.
    let mut holders = vec![None; n_columns];
    let order = boustrophedon(shape);
    let backwards: Vec<usize> = order.iter().rev().copied().collect();
    for order in [backwards, order] {
        let mut next = None;
        for i_column in order {
            next = if has_some(i_column) { Some(i_column) } else { holders[i_column].or(next) };
            holders[i_column] = next;
        }
    }
    let mut hosts: Vec<u32> = (0..depths.len() as u32).collect();
    for (i, host) in
        hosts.iter_mut().enumerate().filter(|(i, _)| n_blobs[*i] == 0 && depths[*i] > 0.0)
    {
        let Some(holder) = holders[i % n_columns] else { continue };
        let k = i / n_columns;
        let with_some = (0..shape.nz).filter(|&k| n_blobs[shape.cell(k, holder)] > 0);
        let nearest = with_some.min_by_key(|other| other.abs_diff(k));
        *host = nearest.map_or(i, |k| shape.cell(k, holder)) as u32;
    }
    hosts
}
