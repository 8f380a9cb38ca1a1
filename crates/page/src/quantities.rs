//! Which quantities of the motion are drawn, and what they are trusted to be.

use dose3::Report;
use dose3::report::{Reason, ReasonAxis, ReasonKind};
use dose3::series::{Axis, Column, Part, Quantity, Series};

/// Quantities that are drawn because the log differs in them, beside the six speeds and turn rates.
const DRIVING: usize = 4;
/// Share of the trusted poses on either side of the band.
const BEYOND_BAND: f64 = 0.001;

/// A quantity as it is drawn.
pub struct Shown<'a> {
    /// In words.
    pub name: String,
    /// The unit that people read.
    pub unit: &'static str,
    /// How many of it one SI unit is.
    pub factor: f64,
    /// SI, one a pose.
    pub values: &'a [Option<f64>],
    /// What all but two of a thousand trusted poses keep to, in `unit`.
    pub band: Option<[f64; 2]>,
    /// Whether a reason speaks of it.
    pub drives: bool,
}

/// Those that the reasons speak of, the strongest first, then the speeds and turn rates.
pub fn shown<'a>(series: &'a Series, report: &Report) -> Vec<Shown<'a>> {
    let mut reasons: Vec<&Reason> = report.segments.iter().flat_map(|s| &s.reasons).collect();
    reasons.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    let mut driving: Vec<Quantity> = Vec::new();
    for quantity in reasons.into_iter().flat_map(quantities_of) {
        if driving.len() < DRIVING && !driving.contains(&quantity) {
            driving.push(quantity);
        }
    }
    let speeds = Axis::ALL.map(Quantity::Velocity);
    let others = speeds.into_iter().filter(|q| !driving.contains(q));
    let all = driving.iter().copied().chain(others);
    all.filter_map(|quantity| {
        let column = series.column(quantity)?;
        let known = column.values.iter().any(Option::is_some);
        known.then(|| one(column, report, driving.contains(&quantity)))
    })
    .collect()
}

fn one<'a>(column: &'a Column, report: &Report, drives: bool) -> Shown<'a> {
    let (unit, factor) = column.quantity.unit().readable();
    let band = column.trusted.map(|trusted| {
        [BEYOND_BAND, 1.0 - BEYOND_BAND].map(|level| trusted.poses.at(level) * factor)
    });
    Shown {
        name: column.quantity.label(report.log.named_axes),
        unit,
        factor,
        values: &column.values,
        band,
        drives,
    }
}

/// The quantities in which a reason shows.
fn quantities_of(reason: &Reason) -> Vec<Quantity> {
    let axis = match reason.axis {
        ReasonAxis::Forward => Some(Axis::Forward),
        ReasonAxis::Left => Some(Axis::Left),
        ReasonAxis::Up => Some(Axis::Up),
        ReasonAxis::Roll => Some(Axis::Roll),
        ReasonAxis::Pitch => Some(Axis::Pitch),
        ReasonAxis::Yaw => Some(Axis::Yaw),
        _ => None,
    };
    let of_axis = |quantity: fn(Axis) -> Quantity| axis.map(quantity).into_iter().collect();
    match reason.kind {
        ReasonKind::Velocity => of_axis(Quantity::Velocity),
        ReasonKind::Acceleration => of_axis(Quantity::Acceleration),
        ReasonKind::Noise => of_axis(Quantity::Noise),
        ReasonKind::Coupling => of_axis(Quantity::Unexplained),
        ReasonKind::Frozen => of_axis(Quantity::Frozen),
        ReasonKind::Direction => vec![Quantity::Sideslip, Quantity::Climb],
        ReasonKind::Interpolated => vec![Quantity::Steady],
        ReasonKind::Repeats => match reason.axis {
            ReasonAxis::Attitude => vec![Quantity::Repeats(Part::Attitude)],
            _ => vec![Quantity::Repeats(Part::Position)],
        },
        _ => Vec::new(),
    }
}
