//! Fewer points where eyes cannot tell.

use std::ops::Range;

/// The indices of `range` that a line through `points` needs so that no left-out point is farther than `tolerance` from
/// it, by any coordinate's scale in `scale` (Ramer, Douglas and Peucker). Both ends are kept.
pub fn path(
    points: &[[f64; 3]],
    scale: [f64; 3],
    range: Range<usize>,
    tolerance: f64,
) -> Vec<usize> {
    if range.len() < 3 {
        return range.collect();
    }
    let mut kept = vec![range.start, range.end - 1];
    let mut open = vec![(range.start, range.end - 1)];
    while let Some((first, last)) = open.pop() {
        let line = Line::new(points[first], points[last], scale);
        let farthest = (first + 1..last)
            .map(|i| (line.distance(points[i]), i))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, i)) = farthest.filter(|(distance, _)| *distance > tolerance) {
            kept.push(i);
            open.extend([(first, i), (i, last)]);
        }
    }
    kept.sort_unstable();
    kept
}

/// A piece of a line, in scaled coordinates.
struct Line {
    from: [f64; 3],
    along: [f64; 3],
    square: f64,
    scale: [f64; 3],
}

impl Line {
    fn new(from: [f64; 3], to: [f64; 3], scale: [f64; 3]) -> Self {
        let from: [f64; 3] = std::array::from_fn(|k| from[k] * scale[k]);
        let along: [f64; 3] = std::array::from_fn(|k| to[k] * scale[k] - from[k]);
        Self {
            from,
            along,
            square: along.iter().map(|x| x * x).sum(),
            scale,
        }
    }

    fn distance(&self, point: [f64; 3]) -> f64 {
        let off: [f64; 3] = std::array::from_fn(|k| point[k] * self.scale[k] - self.from[k]);
        let dot: f64 = (0..3).map(|k| off[k] * self.along[k]).sum();
        let u = match self.square > 0.0 {
            true => (dot / self.square).clamp(0.0, 1.0),
            false => 0.0,
        };
        let square: f64 = (0..3).map(|k| (off[k] - u * self.along[k]).powi(2)).sum();
        square.sqrt()
    }
}

/// Of a series over time, ranges of indices that become one or two points: single samples within the ranges of
/// `close`, as far as `most_close` allows, and about `cells` longer ones elsewhere.
pub fn cells(
    length: usize,
    close: &[Range<usize>],
    cells: usize,
    most_close: usize,
) -> Vec<Range<usize>> {
    let wide = length.div_ceil(cells.max(1)).max(1);
    let near: usize = close.iter().map(Range::len).sum();
    let narrow = near.div_ceil(most_close.max(1)).max(1).min(wide);
    let mut out = Vec::new();
    let mut at = 0;
    while at < length {
        let within = close.iter().find(|range| range.contains(&at));
        let next = close.iter().map(|range| range.start).filter(|s| *s > at);
        let end = match within {
            Some(range) => (at + narrow).min(range.end),
            None => (at + wide).min(next.min().unwrap_or(length)),
        };
        let end = end.clamp(at + 1, length);
        out.push(at..end);
        at = end;
    }
    out
}

/// One or two values of a cell, in order of time: its least and its largest; none where it has none.
pub fn extremes(values: &[Option<f64>]) -> [Option<f64>; 2] {
    let known = || {
        values
            .iter()
            .enumerate()
            .filter_map(|(i, v)| Some((i, (*v)?)))
    };
    let least = known().min_by(|a, b| a.1.total_cmp(&b.1));
    let largest = known().max_by(|a, b| a.1.total_cmp(&b.1));
    match (least, largest) {
        (Some(low), Some(high)) if low.0 <= high.0 => [Some(low.1), Some(high.1)],
        (Some(low), Some(high)) => [Some(high.1), Some(low.1)],
        _ => [None, None],
    }
}

/// Numbers to four digits of their own range, so that a page does not carry digits that no pixel shows.
pub fn rounded(values: impl Iterator<Item = Option<f64>> + Clone) -> Vec<Option<f64>> {
    let known = values.clone().flatten();
    let largest = known.map(f64::abs).fold(0.0, f64::max);
    if largest == 0.0 || !largest.is_finite() {
        return values.map(|v| v.map(|_| 0.0)).collect();
    }
    let digits = (3.0 - largest.log10().floor()) as i32;
    let factor = 10_f64.powi(digits);
    // A zero of either sign is written as 0.
    let round = |v: f64| (v * factor).round() / factor + 0.0;
    values.map(|v| v.map(round)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_point_left_out_is_farther_than_the_tolerance() {
        let points: Vec<[f64; 3]> = (0..2000)
            .map(|i| {
                let t = f64::from(i) * 0.01;
                [100.0 * t.cos(), 100.0 * t.sin(), (7.0 * t).sin()]
            })
            .collect();
        let scale = [1.0, 1.0, 10.0];
        let kept = path(&points, scale, 0..2000, 0.1);
        assert!(kept.len() < 700, "{}", kept.len());
        assert_eq!((kept[0], kept[kept.len() - 1]), (0, 1999));
        for pair in kept.windows(2) {
            let line = Line::new(points[pair[0]], points[pair[1]], scale);
            for point in &points[pair[0]..pair[1]] {
                assert!(line.distance(*point) <= 0.1);
            }
        }
        assert_eq!(path(&points, scale, 5..7, 0.1), [5, 6]);
        // A path that comes back to where it began is no line.
        let there_and_back = [[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3]];
        assert_eq!(path(&there_and_back, [1.0; 3], 0..3, 0.1), [0, 1, 2]);
    }

    #[test]
    fn cells_cover_everything_once_and_are_narrow_where_it_counts() {
        let close = [100..140, 500..520];
        let found = cells(1000, &close, 50, 1000);
        let all: Vec<usize> = found.iter().cloned().flatten().collect();
        assert_eq!(all, (0..1000).collect::<Vec<_>>());
        let narrow = |i: usize| found.iter().find(|c| c.contains(&i)).unwrap().len() == 1;
        assert!((100..140).all(narrow) && (500..520).all(narrow) && !narrow(300));
        let all = std::iter::once(0..1000).collect::<Vec<_>>();
        assert!(cells(1000, &all, 50, 100).len() <= 100);
        assert!(cells(0, &close, 50, 10).is_empty());
    }

    #[test]
    fn extremes_stay_in_order_of_time() {
        assert_eq!(
            extremes(&[Some(3.0), None, Some(-1.0)]),
            [Some(3.0), Some(-1.0)]
        );
        assert_eq!(extremes(&[Some(1.0), Some(2.0)]), [Some(1.0), Some(2.0)]);
        assert_eq!(extremes(&[None]), [None, None]);
    }

    #[test]
    fn digits_follow_the_range() {
        let values = [Some(1234.5678), Some(-0.04), None];
        assert_eq!(rounded(values.into_iter()), [Some(1235.0), Some(0.0), None]);
        let small = [Some(0.012_345_678)];
        assert_eq!(rounded(small.into_iter()), [Some(0.01235)]);
        assert_eq!(rounded([Some(0.0), None].into_iter()), [Some(0.0), None]);
    }
}
