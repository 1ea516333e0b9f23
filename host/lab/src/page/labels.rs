//! Placement of labels beside the points of a chart, without overlaps.

/// Rectangle: left, top, right, bottom.
pub(super) type Area = [f64; 4];

/// A label that has a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placed {
    /// Left end of the text.
    pub x: f64,
    /// Baseline of the text.
    pub y: f64,
    /// True if the label is so far from its point that a line must join them.
    pub is_far: bool,
    /// Place that the text covers.
    pub area: Area,
}

/// Mean width of a character, and height of a line, in units of the chart.
const TEXT: (f64, f64) = (6.2, 14.0);

/// Radius around a point that no label covers.
const POINT: f64 = 7.0;

/// Distances of a label from its point that are tried, the nearest first.
const DISTANCES: [f64; 8] = [4.0, 18.0, 34.0, 52.0, 74.0, 100.0, 130.0, 165.0];

fn overlap(a: &Area, b: &Area) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// Returns a place for each label inside `frame`: beside its point, or as near as no other label
/// and none of `points` is covered; `None` where there is no such place.
pub(super) fn place(labels: &[(f64, f64, &str)], points: &[(f64, f64)], frame: &Area) -> Vec<Option<Placed>> {
    let around = |&(x, y): &(f64, f64)| [x - POINT, y - POINT, x + POINT, y + POINT];
    let mut taken: Vec<Area> = points.iter().map(around).collect();
    labels
        .iter()
        .map(|&(x, y, text)| {
            let width = TEXT.0 * text.chars().count() as f64;
            let found = DISTANCES.into_iter().find_map(|distance| {
                let gap = POINT + distance;
                let slant = 0.7 * gap;
                // Right, left, above and below, and the diagonals.
                let places = [
                    (x + gap, y),
                    (x + slant, y - slant),
                    (x + slant, y + slant),
                    (x - gap - width, y),
                    (x - slant - width, y + slant),
                    (x - slant - width, y - slant),
                    (x - 0.5 * width, y - gap),
                    (x - 0.5 * width, y + gap),
                ];
                places.into_iter().find_map(|(left, middle)| {
                    let area = [left, middle - 0.5 * TEXT.1, left + width, middle + 0.5 * TEXT.1];
                    let inside = area[0] >= frame[0]
                        && area[1] >= frame[1]
                        && area[2] <= frame[2]
                        && area[3] <= frame[3];
                    let free = !taken.iter().any(|other| overlap(&area, other));
                    (inside && free).then_some(Placed {
                        x: left,
                        y: middle + 0.3 * TEXT.1,
                        is_far: distance > DISTANCES[0],
                        area,
                    })
                })
            });
            taken.extend(found.map(|placed| placed.area));
            found
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Area = [0.0, 0.0, 800.0, 400.0];

    #[test]
    fn labels_do_not_overlap() {
        let points: Vec<(f64, f64, &str)> =
            (0..12).map(|i| (300.0 + 6.0 * f64::from(i), 200.0 - 5.0 * f64::from(i), "a label")).collect();
        let places: Vec<(f64, f64)> = points.iter().map(|&(x, y, _)| (x, y)).collect();
        let placed = place(&points, &places, &FRAME);
        let areas: Vec<Area> = placed.iter().flatten().map(|label| label.area).collect();
        assert_eq!(areas.len(), points.len());
        for (index, a) in areas.iter().enumerate() {
            assert!(areas[..index].iter().all(|b| !overlap(a, b)), "{index}");
            assert!(a[0] >= 0.0 && a[1] >= 0.0 && a[2] <= 800.0 && a[3] <= 400.0);
            assert!(points.iter().all(|&(x, y, _)| !(a[0] < x && x < a[2] && a[1] < y && y < a[3])));
        }
        assert!(placed.iter().flatten().any(|label| label.is_far));
    }

    #[test]
    fn a_lone_label_is_beside_its_point() {
        let placed = place(&[(100.0, 100.0, "abc")], &[(100.0, 100.0)], &FRAME);
        assert!(placed[0].is_some_and(|label| !label.is_far && label.x > 100.0 && label.x < 115.0));
        // Another point that is in the way turns it away.
        let others = [(100.0, 100.0), (118.0, 100.0)];
        let placed = place(&[(100.0, 100.0, "abc")], &others, &FRAME);
        assert!(placed[0].is_some_and(|label| label.area[2] < 100.0), "{placed:?}");
        // At the right edge it is on the left.
        let placed = place(&[(795.0, 100.0, "abc")], &[], &FRAME);
        assert!(placed[0].is_some_and(|label| label.area[2] < 795.0));
        // No place at all.
        assert_eq!(place(&[(5.0, 5.0, "abc")], &[], &[0.0, 0.0, 10.0, 10.0]), [None]);
    }
}
