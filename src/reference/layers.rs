//! Number of blobs over each pixel, a measure of a picture's cost before anything is drawn.

use super::Blob;
use super::view::View;
use crate::model::edge::Edge;

/// Returns the number of blobs in whose rectangles, out to the `edge`, each pixel lies: about its
/// number of layers.
pub fn n_layers(view: &View, blobs: &[Blob], edge: Edge) -> Vec<u32> {
    let (width, height) = (view.width as usize, view.height as usize);
    // Differences along rows and columns, with a place beyond either end.
    let mut steps = vec![0i64; (width + 1) * (height + 1)];
    for blob in blobs {
        let c = blob.position - view.pose.position;
        let reach = edge.reach(blob.deepest());
        if c.dot(view.pose.forward) < view.near || reach <= 0.0 {
            continue;
        }
        let [(left, right), (top, bottom)] = view.rectangle(blob, c, reach);
        for (row, sign) in [(top, 1), (bottom, -1)] {
            steps[row as usize * (width + 1) + left as usize] += sign;
            steps[row as usize * (width + 1) + right as usize] -= sign;
        }
    }
    let mut above = vec![0i64; width];
    let mut counts = Vec::with_capacity(width * height);
    for row in steps.chunks_exact(width + 1).take(height) {
        let mut sum = 0;
        for (above, step) in above.iter_mut().zip(row) {
            sum += step;
            *above += sum;
            counts.push(u32::try_from(*above).unwrap_or(0));
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::model::cloud::Shape;

    const VIEW: View = View::ONE_PIXEL;

    #[test]
    fn layers_are_counted_where_blobs_lie() {
        // 9 by 7 pixels; a blob in the middle, one to the lower right, one behind the eye.
        let view = View { width: 9, height: 7, ..VIEW };
        let at = |x: f64, y: f64, z: f64| Blob {
            shape: Shape::BALL,
            position: DVec3::new(x, y, -z),
            sigma: 0.05,
            kappa: 1.0,
        };
        let blobs = [at(0.0, 0.0, 4.0), at(0.9, -0.9, 4.0), at(0.0, 0.0, -4.0)];
        let counts = n_layers(&view, &blobs, view.edge);
        let rectangle = |b: &Blob| view.rectangle(b, b.position, 3.0);
        for (k, n) in counts.iter().enumerate() {
            let (i, j) = (k as u32 % 9, k as u32 / 9);
            let lies = |b: &&Blob| {
                let [(left, right), (top, bottom)] = rectangle(b);
                (left..right).contains(&i) && (top..bottom).contains(&j)
            };
            assert_eq!(*n as usize, blobs[..2].iter().filter(lies).count(), "{i} {j}");
        }
        assert!(counts[3 * 9 + 4] >= 1 && counts[0] == 0 && counts.contains(&2));
    }
}
