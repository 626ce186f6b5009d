//! Height of the density grid's cells over their width.

use glam::DVec3;

use super::grid::MARGIN_CELLS;
use super::shape::MIN_ASPECT;

/// The fewest layers of cells within the margins. Fewer layers raise the error of diffuse light by
/// more than the same number of cells saves across (model.md §18, "Layers").
const LEAST_LAYERS: u32 = 12;

/// Returns the height over the width of cells for clouds in a box of the given extent.
/// `mean_aspect` is that of the blobs; `None` if all are balls. The longest axis has `grid` cells.
///
/// With `layers` given it is what they need. Otherwise balls have cubes. Other blobs have cells
/// that are at most as high as wide, and as flat as the blobs are. Cells are flatter where clouds
/// would lie in fewer than [`LEAST_LAYERS`], but no layers beyond `grid` are made for that.
pub(super) fn cell_aspect(
    mean_aspect: Option<f64>,
    extent: DVec3,
    grid: u32,
    layers: Option<u32>,
) -> f64 {
    let flat = extent.y / extent.x.max(extent.z);
    let has_shape = flat > 0.0 && flat.is_finite();
    // The aspect with so many layers within the margins.
    let with_layers = |n: u32| flat * f64::from(inner(grid)) / f64::from(n);
    let aspect = match (layers, mean_aspect) {
        (Some(layers), _) if has_shape => with_layers(inner(layers.min(grid))),
        (_, None) => return 1.0,
        (None, Some(mean)) if has_shape => {
            let most = mean.min(1.0);
            most.min(with_layers(LEAST_LAYERS)).max(most.min(flat))
        }
        (_, Some(mean)) => mean,
    };
    aspect.clamp(MIN_ASPECT, 1.0 / MIN_ASPECT)
}

/// Returns how many of `n` cells lie within the margins.
fn inner(n: u32) -> u32 {
    n.saturating_sub(2 * MARGIN_CELLS).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::grid::GridSpec;

    fn cells(mean: Option<f64>, y: f64, grid: u32, layers: Option<u32>) -> [u32; 3] {
        let half = 0.5 * DVec3::new(8.0, y, 4.0);
        let aspect = cell_aspect(mean, 2.0 * half, grid, layers);
        GridSpec::fit(-half, half, grid, aspect).n_cells.to_array()
    }

    #[test]
    fn cells_are_cubes_unless_clouds_or_blobs_are_flat() {
        // 60 cells across within the margins, 4 in a box half as high.
        assert_eq!(cells(Some(1.5), 4.0, 64, None), [64, 34, 34]);
        assert_eq!(cells(None, 4.0, 64, None), [64, 34, 34]);
        // Blobs half as high as wide.
        assert_eq!(cells(Some(0.5), 4.0, 64, None), [64, 64, 34]);
        // Clouds a fortieth as high as wide: 12 layers, however high the blobs are.
        assert_eq!(cells(Some(3.0), 0.2, 64, None), [64, 16, 34]);
        assert_eq!(cells(None, 0.2, 64, None), [64, 6, 34]);
        // No more layers than cells across for that.
        assert_eq!(cells(Some(3.0), 0.2, 12, None), [12, 12, 8]);
        // Clouds higher than wide have cubes.
        assert_eq!(cells(Some(3.0), 16.0, 36, None), [20, 36, 12]);
    }

    #[test]
    fn layers_are_as_given() {
        for mean in [None, Some(1.5)] {
            for (layers, n) in [(8, 8), (24, 24), (9, 10), (200, 64)] {
                assert_eq!(cells(mean, 1.0, 64, Some(layers))[1], n, "{layers}");
                assert_eq!(cells(mean, 16.0, 64, Some(layers))[1], n, "{layers}");
            }
            assert_eq!(cells(mean, 1.0, 63, Some(9)), [63, 9, 35]);
            // A box without height has the fewest.
            assert_eq!(cells(mean, 0.0, 64, Some(24))[1], 6);
        }
    }
}
