//! Placement of labels beside points without overlaps.

use super::medium::Medium;

/// Upper left and lower right corner, px.
type Rect = [i32; 4];

/// Returns the left end and the middle of the height of every label, or None if there is no room
/// for it. Earlier labels choose first. Labels do not cover `points`, given with their radii.
pub fn place_labels(
    medium: Medium,
    labels: &[((i32, i32), String)],
    points: &[((i32, i32), i32)],
    bounds: [i32; 4],
) -> Vec<Option<(i32, i32)>> {
    let mut taken: Vec<Rect> =
        points.iter().map(|((x, y), r)| [x - r, y - r, x + r, y + r]).collect();
    let mut places = Vec::new();
    for ((x, y), text) in labels {
        let (width, half) = (medium.width_of(text), medium.down(8, 1) / 2);
        let (near, up) = (medium.across(8, 1), medium.down(13, 1));
        // For long labels, places above and below are nearer to the point than those beside it.
        let sides = [
            (x + near, y - up),
            (x + near, *y),
            (x + near, y + up),
            (x - width / 2, y - up),
            (x - width / 2, y + up),
            (x - near - width, y - up),
            (x - near - width, y + up),
            (x - near - width, *y),
            (x - width / 2, y - 2 * up),
            (x + 2 * near, y - 2 * up),
            (x - 2 * near - width, y + 2 * up),
            (x - width / 2, y + 2 * up),
        ];
        let rect = |(left, middle): (i32, i32)| [left, middle - half, left + width, middle + half];
        let is_free = |place: &(i32, i32)| {
            let of = rect(*place);
            let is_within = of[0] >= bounds[0]
                && of[1] >= bounds[1]
                && of[2] <= bounds[2]
                && of[3] <= bounds[3];
            is_within && taken.iter().all(|other| !overlap(of, *other))
        };
        let place = sides.into_iter().find(is_free);
        taken.extend(place.map(rect));
        places.push(place);
    }
    places
}

fn overlap(a: Rect, b: Rect) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_cover_neither_labels_nor_points() {
        let at: Vec<(i32, i32)> = (0..30).map(|i| (100 + i * 7 % 50, 100 + i * 11 % 60)).collect();
        let texts: Vec<_> =
            at.iter().enumerate().map(|(i, at)| (*at, (i + 1).to_string())).collect();
        let points: Vec<_> = at.iter().map(|at| (*at, 5)).collect();
        let places = place_labels(Medium::Picture, &texts, &points, [0, 0, 300, 300]);
        let rects: Vec<Rect> = places
            .iter()
            .zip(&texts)
            .filter_map(|(place, (_, text))| {
                let (x, y) = (*place)?;
                Some([x, y - 4, x + Medium::Picture.width_of(text), y + 4])
            })
            .collect();
        assert!(rects.len() >= 8 && rects.len() < 30, "{}", rects.len());
        for (i, a) in rects.iter().enumerate() {
            assert!(rects[..i].iter().all(|b| !overlap(*a, *b)));
            assert!(points.iter().all(|((x, y), r)| !overlap(*a, [x - r, y - r, x + r, y + r])));
        }
        // A single point has its label; a label in a corner stays within the bounds.
        assert!(
            place_labels(Medium::Picture, &texts[..1], &points[..1], [0, 0, 300, 300])[0].is_some()
        );
        let corner = [((299, 1), "12".to_owned())];
        assert!(
            place_labels(Medium::Picture, &corner, &[((299, 1), 5)], [0, 0, 300, 300])[0]
                .is_some_and(|(x, _)| x < 290)
        );
    }
}
