//! Rules of the second reflection's approximation (model.md §7, passes.md "second"): when a pair of
//! facets, or a cluster, is taken as one and when it is divided. The shaders declare the same
//! numbers, and `tests/layout.rs` compares them.

/// Lobes count within this many of their widths: e⁻⁸ of the peak lies beyond.
pub const LOBE_REACH: f64 = 4.0;

/// Width of a facet in lobe widths, times pair_size, up to which it is taken as one. At the default
/// 0.5 the half vector turns by 3/4 of a width from one facet to the next, where the midpoint rule
/// on a Gaussian is exact to 10⁻⁷.
pub const LOBE_STEP: f64 = 3.0;

/// Factor on [`LOBE_STEP`] for a cell, whose quarters evaluate lobes separately.
pub const LOBE_PARTS: f64 = 1.5;

/// Turn of the half vector from a cell's centre to its corner, over the cell's width per distance:
/// half the direction's turn, of half a diagonal of √2, twice that where the light is as near as
/// the receiver.
pub const TURN: f64 = 0.75;

/// Wider facets than this share of their distance count as discs.
pub const NEAR: f64 = 1.0;

/// Facets wider than this share of pair_size are divided where shadow edges cross both the
/// receiver's view of them and a light on them.
pub const EDGE_WIDTH: f64 = 0.125;

/// The same where a shadow edge crosses only one of the two.
pub const SINGLE_EDGE_WIDTH: f64 = 0.25;

/// Cells wider than this many pair_size are quartered; narrower ones are evaluated at 4 × 4 points.
pub const CELL_WIDTH: f64 = 3.0;

/// Clusters that a shadow edge crosses are opened down to this share of θ.
pub const CLUSTER_EDGE_WIDTH: f64 = 0.5;

/// Opening angle of a cloud's clusters over that of surfaces': their facets overlap and face every
/// way, so that they need a smaller angle for the same error, 1 % of L2 at θ = 0.4.
pub const CLOUD_THETA: f64 = 0.4;

/// First-order error of a cloud's cluster, over radius per distance times the normals' spread.
pub const MIXED: f64 = 0.5;

/// Clusters whose mean normal is at least this long have a single normal but for rounding.
pub const EVEN: f64 = 0.9999;
