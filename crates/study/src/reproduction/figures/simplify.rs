//! Lines with fewer points that look the same.

/// The points of `line` without those that lie within `tolerance` of what is left (Douglas and Peucker 1973).
/// The ends stay.
pub fn simplify(line: &[(f64, f64)], tolerance: f64) -> Vec<(f64, f64)> {
    if line.len() < 3 {
        return line.to_vec();
    }
    let mut kept = vec![false; line.len()];
    kept[0] = true;
    kept[line.len() - 1] = true;
    let mut pieces = vec![(0, line.len() - 1)];
    while let Some((first, last)) = pieces.pop() {
        let farthest = (first + 1..last)
            .map(|i| (i, distance(line[i], line[first], line[last])))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((i, _)) = farthest.filter(|(_, far)| *far > tolerance) {
            kept[i] = true;
            pieces.extend([(first, i), (i, last)]);
        }
    }
    let points = line.iter().zip(kept);
    points.filter_map(|(p, kept)| kept.then_some(*p)).collect()
}

/// From a point to the piece of line between two others.
fn distance(p: (f64, f64), a: (f64, f64), b: (f64, f64)) -> f64 {
    let (ab, ap) = ((b.0 - a.0, b.1 - a.1), (p.0 - a.0, p.1 - a.1));
    let squared = ab.0 * ab.0 + ab.1 * ab.1;
    let along = if squared > 0.0 {
        ((ap.0 * ab.0 + ap.1 * ab.1) / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (ap.0 - along * ab.0).hypot(ap.1 - along * ab.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_stays_and_what_is_straight_goes() {
        let line = [(0.0, 0.0), (1.0, 0.01), (2.0, 0.0), (2.0, 1.0), (2.0, 2.0)];
        assert_eq!(simplify(&line, 0.1), [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0)]);
        assert_eq!(simplify(&line, 0.001).len(), 4);
        // A loop: its ends are one point.
        let loop_line = [(0.0, 0.0), (5.0, 5.0), (0.0, 0.0)];
        assert_eq!(simplify(&loop_line, 0.1), loop_line);
        assert_eq!(simplify(&line[..1], 0.1), line[..1]);
    }
}
