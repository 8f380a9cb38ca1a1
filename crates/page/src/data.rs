//! What the page's charts are drawn from.

use crate::quantities::{self, Shown};
use crate::thin;
use crate::views::Views;
use dose3::datasets::Frame;
use dose3::report::{PoseSpan, Segment};
use dose3::series::Series;
use dose3::{Detector, Report, Score};
use serde::Serialize;
use std::ops::Range;

/// A line that is off by this share of the drawing is drawn by the same pixels.
const TOLERANCE: f64 = 1.0 / 3000.0;
/// Points of a path beyond which the tolerance grows.
const MOST_POINTS: usize = 2500;
/// Points of one bad stretch, which can be looked at from near.
const MOST_CLOSE: usize = 200;
/// Changes from window to window that are drawn at their very pose; of more, only those across the threshold.
const MOST_CHANGES: usize = 1500;
/// Bad stretches with all their poses.
pub const CLOSE: usize = 12;
/// Cells of a chart over time, each with its least and its largest value.
const CELLS: usize = 400;
/// Single poses of a chart over time, all bad stretches together.
const MOST_SINGLE: usize = 1200;
/// Windows of the chart of scores; a log of ten hours at 10 Hz has 11 000.
const MOST_WINDOWS: usize = 4000;

/// Runs of poses that stick out, the worst first.
const MOST_SPANS: usize = 300;

/// Everything that the scripts of a page are given. Times are seconds from the first pose.
#[derive(Serialize)]
pub struct Data {
    row_kind: String,
    duration: f64,
    threshold: f64,
    usual: f64,
    pose_threshold: Option<f64>,
    path: Path,
    windows: Windows,
    poses: Option<Line>,
    quantities: Quantities,
    stretches: Vec<Span>,
    spans: Vec<[f64; 2]>,
    gaps: Vec<[f64; 2]>,
}

/// The path in its own axes, metres.
#[derive(Serialize)]
struct Path {
    along: Vec<Option<f64>>,
    across: Vec<Option<f64>>,
    up: Vec<Option<f64>>,
    t: Vec<Option<f64>>,
    row: Vec<u64>,
    /// Window score, of the window that the pose lies in the middle of.
    score: Vec<Option<f64>>,
    /// Positions in these lists at which a new piece begins.
    breaks: Vec<usize>,
    up_of_body: bool,
}

#[derive(Serialize)]
struct Windows {
    /// Middle of the window.
    t: Vec<Option<f64>>,
    score: Vec<Option<f64>>,
}

#[derive(Serialize)]
struct Line {
    t: Vec<Option<f64>>,
    v: Vec<Option<f64>>,
}

#[derive(Serialize)]
struct Quantities {
    t: Vec<Option<f64>>,
    of: Vec<QuantityLine>,
}

#[derive(Serialize)]
struct QuantityLine {
    name: String,
    unit: &'static str,
    drives: bool,
    v: Vec<Option<f64>>,
    band: Option<[f64; 2]>,
}

#[derive(Serialize)]
struct Span {
    from: f64,
    to: f64,
    worst: f64,
    /// Where its most unusual pose is.
    at: f64,
}

impl Data {
    /// `series` of the log that `report` is of, whose body's axes are those of `frame`.
    pub fn new(detector: &Detector, series: &Series, frame: Frame, report: &Report) -> Self {
        let calibration = detector.header().statistics.calibration();
        let close: Vec<Range<usize>> = worst(&report.segments).iter().map(|s| range(s)).collect();
        let time = Time(&series.stamps);
        let cells = thin::cells(series.len(), &close, CELLS, MOST_SINGLE);
        let shown = quantities::shown(series, report);
        Self {
            row_kind: report.log.row_kind.to_string(),
            duration: time.at(series.len().saturating_sub(1)),
            threshold: report.evidence.threshold.value(),
            usual: calibration.windows.quantile(0.5),
            pose_threshold: series.threshold.map(Score::value),
            path: Path::new(series, frame, report, &close, &time),
            windows: windows(report, &time),
            poses: pose_scores(series, &cells, &time),
            quantities: Quantities {
                t: time.of_cells(&cells),
                of: shown.iter().map(|shown| line(shown, &cells)).collect(),
            },
            stretches: report.segments.iter().map(|s| span(s, report)).collect(),
            spans: report
                .pose_spans
                .iter()
                .take(MOST_SPANS)
                .map(|s| seconds(&s.place))
                .collect(),
            gaps: series
                .stretches
                .windows(2)
                .map(|pair| [time.at(pair[0].end - 1), time.at(pair[1].start)])
                .collect(),
        }
    }
}

/// The stretches that come with all their poses.
fn worst(segments: &[Segment]) -> Vec<&Segment> {
    let mut worst: Vec<&Segment> = segments.iter().collect();
    worst.sort_by_key(|s| std::cmp::Reverse(s.worst_score));
    worst.truncate(CLOSE);
    worst
}

fn range(segment: &Segment) -> Range<usize> {
    segment.place.first_pose..segment.place.last_pose + 1
}

fn seconds(place: &dose3::report::Place) -> [f64; 2] {
    [milliseconds(place.start_s), milliseconds(place.end_s)]
}

fn span(segment: &Segment, report: &Report) -> Span {
    let [from, to] = seconds(&segment.place);
    let within = |span: &&PoseSpan| {
        let [start, end] = seconds(&span.place);
        start >= from && end <= to
    };
    // Without poses that stick out, the middle of the worst window.
    let worst = report.pose_spans.iter().find(within);
    let at = worst.map_or((from + to) / 2.0, |s| {
        let [start, end] = seconds(&s.place);
        (start + end) / 2.0
    });
    Span {
        from,
        to,
        worst: segment.worst_score.value(),
        at,
    }
}

/// Seconds from the first pose.
struct Time<'a>(&'a [i64]);

impl Time<'_> {
    fn at(&self, pose: usize) -> f64 {
        match (self.0.first(), self.0.get(pose)) {
            (Some(first), Some(stamp)) => milliseconds(stamp.saturating_sub(*first) as f64 * 1e-9),
            _ => 0.0,
        }
    }

    /// One or two points a cell.
    fn of_cells(&self, cells: &[Range<usize>]) -> Vec<Option<f64>> {
        let points = cells.iter().flat_map(|cell| match cell.len() {
            1 => vec![cell.start],
            length => vec![cell.start, cell.start + length / 2],
        });
        points.map(|pose| Some(self.at(pose))).collect()
    }
}

fn milliseconds(seconds: f64) -> f64 {
    (seconds * 1e3).round() / 1e3
}

fn of_cells(values: &[Option<f64>], cells: &[Range<usize>]) -> Vec<Option<f64>> {
    let points = cells.iter().flat_map(|cell| match cell.len() {
        1 => vec![values[cell.start]],
        _ => thin::extremes(&values[cell.clone()]).to_vec(),
    });
    let points: Vec<Option<f64>> = points.collect();
    thin::rounded(points.into_iter())
}

fn line(shown: &Shown<'_>, cells: &[Range<usize>]) -> QuantityLine {
    let values: Vec<Option<f64>> = shown
        .values
        .iter()
        .map(|v| v.map(|v| v * shown.factor))
        .collect();
    QuantityLine {
        name: shown.name.clone(),
        unit: shown.unit,
        drives: shown.drives,
        v: of_cells(&values, cells),
        band: shown.band,
    }
}

fn pose_scores(series: &Series, cells: &[Range<usize>], time: &Time<'_>) -> Option<Line> {
    series.threshold?;
    let values: Vec<Option<f64>> = series.scores.iter().map(|s| s.map(Score::value)).collect();
    values.iter().any(Option::is_some).then(|| Line {
        t: time.of_cells(cells),
        v: of_cells(&values, cells),
    })
}

/// The scores of windows over the times of their middles; of several windows that share a pixel the highest.
fn windows(report: &Report, time: &Time<'_>) -> Windows {
    let cell = report.windows.len().div_ceil(MOST_WINDOWS).max(1);
    let highest = report.windows.chunks(cell).filter_map(|windows| {
        let worst = windows.iter().max_by_key(|w| w.score)?;
        let middle = (worst.first_pose + worst.last_pose) / 2;
        Some((time.at(middle), worst.score.value()))
    });
    let (mut t, mut score) = (Vec::new(), Vec::new());
    let mut before: Option<usize> = None;
    for (windows, (at, value)) in report.windows.chunks(cell).zip(highest) {
        // A line does not go on across a gap.
        if before.is_some_and(|last| windows[0].first_pose > last) {
            t.push(Some(milliseconds(at - 1e-3)));
            score.push(None);
        }
        before = windows.last().map(|w| w.last_pose);
        t.push(Some(at));
        score.push(Some(value));
    }
    Windows {
        t,
        score: thin::rounded(score.into_iter()),
    }
}

impl Path {
    fn new(
        series: &Series,
        frame: Frame,
        report: &Report,
        close: &[Range<usize>],
        time: &Time<'_>,
    ) -> Self {
        let views = Views::new(&series.poses, frame);
        let window = report.window_of_each_pose();
        let pieces = &series.stretches;
        let kept = keep(&views.points, pieces, close, &changes(report, &window));
        let first_of = |piece: &Range<usize>| kept.partition_point(|&i| i < piece.start);
        let coordinate = |axis: usize| {
            let of: Vec<Option<f64>> = kept.iter().map(|&i| Some(views.points[i][axis])).collect();
            of
        };
        let digits = |axis: usize| five_digits(&coordinate(axis), &views.points);
        let score = |&i: &usize| window[i].map(|w| report.windows[w].score.value());
        let scores: Vec<Option<f64>> = kept.iter().map(score).collect();
        Self {
            along: digits(0),
            across: digits(1),
            up: digits(2),
            t: kept.iter().map(|&i| Some(time.at(i))).collect(),
            row: kept.iter().map(|&i| series.rows[i]).collect(),
            score: thin::rounded(scores.into_iter()),
            breaks: pieces.iter().skip(1).map(first_of).collect(),
            up_of_body: views.up_of_body,
        }
    }
}

/// The longest side of the box around some points.
fn extents(points: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|axis| {
        let of = points.iter().map(|p| p[axis]);
        (of.clone().fold(f64::NEG_INFINITY, f64::max) - of.fold(f64::INFINITY, f64::min)).max(0.0)
    })
}

/// Coordinates to a hundred-thousandth of the drawing, so that a bad stretch can be looked at from near.
fn five_digits(values: &[Option<f64>], points: &[[f64; 3]]) -> Vec<Option<f64>> {
    let largest = extents(points).into_iter().fold(0.0, f64::max);
    if largest == 0.0 {
        return vec![Some(0.0); values.len()];
    }
    let factor = 10_f64.powi((5.0 - largest.log10().floor()) as i32);
    let round = |v: f64| (v * factor).round() / factor + 0.0;
    values.iter().map(|v| v.map(round)).collect()
}

/// The poses of a drawing: every piece to its tolerance, bad stretches to their own, and where the window changes.
fn keep(
    points: &[[f64; 3]],
    pieces: &[Range<usize>],
    close: &[Range<usize>],
    changes: &[usize],
) -> Vec<usize> {
    let mut kept = simplest(points, pieces, MOST_POINTS);
    for range in close {
        kept.extend(simplest(points, std::slice::from_ref(range), MOST_CLOSE));
    }
    kept.extend(changes);
    kept.sort_unstable();
    kept.dedup();
    kept
}

/// The poses at which another window begins to count.
fn changes(report: &Report, window: &[Option<usize>]) -> Vec<usize> {
    let all = (1..window.len()).filter(|&i| window[i] != window[i - 1]);
    let beyond = |i: usize| window[i].map(|w| report.windows[w].beyond);
    match all.clone().count() <= MOST_CHANGES {
        true => all.collect(),
        false => all.filter(|&i| beyond(i) != beyond(i - 1)).collect(),
    }
}

fn simplest(points: &[[f64; 3]], pieces: &[Range<usize>], most: usize) -> Vec<usize> {
    let within: Vec<[f64; 3]> = pieces
        .iter()
        .flat_map(|p| points[p.clone()].iter().copied())
        .collect();
    let extents = extents(&within);
    let largest = extents.into_iter().fold(0.0, f64::max);
    // Heights are drawn up to 50 times as large as they are, but no higher than the drawing is wide.
    let exaggerated = (0.3 * largest / extents[2].max(1e-9)).clamp(1.0, 50.0);
    let scale = [1.0, 1.0, exaggerated];
    let mut tolerance = largest * TOLERANCE;
    loop {
        let kept: Vec<usize> = pieces
            .iter()
            .flat_map(|piece| thin::path(points, scale, piece.clone(), tolerance))
            .collect();
        if kept.len() <= most.max(2 * pieces.len()) {
            return kept;
        }
        tolerance *= 2.0;
    }
}
