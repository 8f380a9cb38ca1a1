//! The colours of scores: one hue up to the threshold, another beyond it.

use super::super::canvas::{Anchor, Canvas, Stroke};
use super::super::palette::{BLACK, LIGHT_GREY, ramp};
use super::super::panel::{NORMAL, SMALL};
use anyhow::Result;
use plotters::style::RGBColor;

/// Colours that are told apart.
const LEVELS: usize = 48;
/// The p-values that are named.
const NAMED: [f64; 9] = [1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002];

/// Blue at p = 1, light blue before the threshold, orange behind it, dark red at the smallest p-value there is.
pub struct ScoreScale {
    references: usize,
    alpha: f64,
    threshold: f64,
    end: f64,
}

impl ScoreScale {
    /// For p-values among so many `references` and a threshold at `alpha`.
    pub fn new(references: usize, alpha: f64) -> Self {
        let threshold = -alpha.log10();
        let smallest = ((references + 1) as f64).log10();
        Self {
            references,
            alpha,
            threshold,
            end: smallest.max(threshold + 0.3),
        }
    }

    /// The level of -log10 p: poses of one level have one colour. A level lies on one side of the threshold.
    pub fn level(&self, surprise: Option<f64>) -> Option<usize> {
        let surprise = surprise?.clamp(0.0, self.end);
        let half = LEVELS as f64 / 2.0;
        let (share, first) = if surprise < self.threshold {
            (surprise / self.threshold, 0)
        } else {
            let beyond = surprise - self.threshold;
            (beyond / (self.end - self.threshold), LEVELS / 2)
        };
        Some(first + ((share * half) as usize).min(LEVELS / 2 - 1))
    }

    /// The colour of a level; grey for poses without a score.
    pub fn colour(&self, level: Option<usize>) -> RGBColor {
        let Some(level) = level else {
            return LIGHT_GREY;
        };
        let half = LEVELS / 2;
        let share = (level % half) as f64 / (half - 1) as f64;
        if level < half {
            ramp(&TRUSTED, share)
        } else {
            ramp(&BEYOND, share)
        }
    }

    /// A horizontal bar with its p-values.
    ///
    /// # Errors
    /// Coordinates that are not finite.
    pub fn bar(
        &self,
        canvas: &Canvas<'_>,
        (left, top): (f64, f64),
        width: f64,
        set: &str,
    ) -> Result<()> {
        let at = |surprise: f64| left + width * surprise / self.end;
        let bottom = top + HEIGHT;
        let colour = |share: f64| self.colour(self.level(Some(share * self.end)));
        canvas.gradient([(left, top), (left + width, bottom)], 240, colour)?;
        let thin = Stroke::solid(BLACK, 1.0);
        for p in NAMED.into_iter().filter(|p| -p.log10() < self.end - 0.12) {
            let x = at(-p.log10());
            canvas.line(&[(x, bottom), (x, bottom + 4.0)], thin)?;
            canvas.text(
                &p.to_string(),
                (x, bottom + 12.0),
                SMALL,
                BLACK,
                Anchor::Middle,
            )?;
        }
        let smallest = format!("1/{}", self.references + 1);
        canvas.text(
            &smallest,
            (left + width, bottom + 12.0),
            SMALL,
            BLACK,
            Anchor::Middle,
        )?;
        let x = at(self.threshold);
        canvas.line(
            &[(x, top - 5.0), (x, bottom + 5.0)],
            Stroke::solid(BLACK, 2.0),
        )?;
        let threshold = format!("{} % threshold", 100.0 * self.alpha);
        canvas.text(&threshold, (x, top - 13.0), NORMAL, BLACK, Anchor::Middle)?;
        let name = format!(
            "p-value among {} held-out windows of {set}",
            self.references
        );
        let below = (left + width / 2.0, bottom + 30.0);
        canvas.text(&name, below, NORMAL, BLACK, Anchor::Middle)
    }
}

const HEIGHT: f64 = 13.0;
const TRUSTED: [(f64, RGBColor); 2] = [
    (0.0, RGBColor(0x0b, 0x3c, 0x7d)),
    (1.0, RGBColor(0x7c, 0xc4, 0xee)),
];
const BEYOND: [(f64, RGBColor); 3] = [
    (0.0, RGBColor(0xf2, 0xa9, 0x1f)),
    (0.5, RGBColor(0xd5, 0x5e, 0x00)),
    (1.0, RGBColor(0x7a, 0x0c, 0x02)),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_of_the_scale_and_both_sides_of_the_threshold() {
        let scale = ScoreScale::new(399, 0.05);
        let colour = |p: f64| scale.colour(scale.level(Some(-p.log10())));
        assert_eq!(colour(1.0), TRUSTED[0].1);
        assert_eq!(colour(1.0 / 400.0), BEYOND[2].1);
        assert_eq!(colour(1e-9), BEYOND[2].1);
        assert_eq!(colour(0.0501), TRUSTED[1].1);
        assert_eq!(colour(0.0499), BEYOND[0].1);
        assert_eq!(scale.colour(scale.level(None)), LIGHT_GREY);
    }

    #[test]
    fn few_references_leave_room_beyond_the_threshold() {
        let scale = ScoreScale::new(5, 0.05);
        assert_eq!(scale.level(Some(1e9)), Some(LEVELS - 1));
        assert!(scale.level(Some(6f64.log10())).unwrap() < LEVELS / 2);
    }
}
