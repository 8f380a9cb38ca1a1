//! Colours that the colour-blind can tell apart.

use plotters::style::RGBColor;

/// Axes, frames and references.
pub const GREY: RGBColor = RGBColor(0x70, 0x70, 0x70);
/// What is there but not judged.
pub const LIGHT_GREY: RGBColor = RGBColor(0xb8, 0xb8, 0xb8);
/// Text and marks.
pub const BLACK: RGBColor = RGBColor(0, 0, 0);

/// Okabe and Ito 2008, without yellow, which a white page swallows.
const CATEGORIES: [RGBColor; 7] = [
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0x56, 0xb4, 0xe9),
    BLACK,
];

/// The colour of the `index`-th set or method; from the eighth on they come again.
pub fn category(index: usize) -> RGBColor {
    CATEGORIES[index % CATEGORIES.len()]
}

/// How often the colours had come before the `index`-th.
pub fn round(index: usize) -> usize {
    index / CATEGORIES.len()
}

/// The colour at `x` between stops in ascending order, linear between neighbours.
pub fn ramp(stops: &[(f64, RGBColor)], x: f64) -> RGBColor {
    let above = stops.iter().position(|(at, _)| *at >= x);
    match above {
        Some(0) => stops[0].1,
        None => stops.last().map_or(BLACK, |(_, colour)| *colour),
        Some(i) => {
            let ((low, from), (high, to)) = (stops[i - 1], stops[i]);
            mix(from, to, (x - low) / (high - low))
        }
    }
}

fn mix(from: RGBColor, to: RGBColor, share: f64) -> RGBColor {
    let channel = |a: u8, b: u8| {
        (f64::from(a) + share.clamp(0.0, 1.0) * (f64::from(b) - f64::from(a))).round() as u8
    };
    RGBColor(
        channel(from.0, to.0),
        channel(from.1, to.1),
        channel(from.2, to.2),
    )
}

/// The same hue, dark enough to be read as text.
pub fn dark(colour: RGBColor) -> RGBColor {
    mix(colour, BLACK, 0.3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_ends_at_its_stops() {
        let stops = [(0.0, RGBColor(0, 0, 0)), (2.0, RGBColor(200, 100, 50))];
        assert_eq!(ramp(&stops, -1.0), RGBColor(0, 0, 0));
        assert_eq!(ramp(&stops, 0.0), RGBColor(0, 0, 0));
        assert_eq!(ramp(&stops, 1.0), RGBColor(100, 50, 25));
        assert_eq!(ramp(&stops, 2.0), RGBColor(200, 100, 50));
        assert_eq!(ramp(&stops, 9.0), RGBColor(200, 100, 50));
    }
}
