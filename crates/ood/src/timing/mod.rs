//! Whether the stamps of a log come as those of trusted logs do: poses lost, late, doubled, irregular, at another
//! rate.
//!
//! Poses at a fixed rate, as statistics of windows need them, no longer show this: interpolation fills in what is
//! missing. So these numbers come from the stamps as they were recorded.
//!
//! A [`Cadence`] describes the stamps of one log by what goes wrong in spans of 64 steps ([`Symptom`]). A
//! [`TimingReference`] holds the worst of each symptom in each trusted log, and judges another log by its own worst:
//! by rank among the trusted logs, and beyond all of them by an exponential tail of `ln(1 + symptom / floor)`. Floors
//! are what any sensor may do ([`Symptom::floor`]), so that logs with perfect stamps do not make an alarm of every
//! microsecond. The symptoms share the chance of a false alarm by fixed weights ([`Symptom::weight`]).
//!
//! ```
//! use dose3_ood::timing::{Cadence, TimingReference};
//!
//! // Four logs at 20 Hz, and one that loses every fifth pose for ten seconds.
//! let stamps = |log: i64| -> Vec<i64> { (0..2000).map(|i| i * 50_000_000 + (i * i * (log + 3)) % 400_000).collect() };
//! let trusted: Vec<Vec<i64>> = (0..4).map(stamps).collect();
//! let trusted: Vec<Cadence> = trusted.iter().filter_map(|log| Cadence::of(log)).collect();
//! let reference = TimingReference::fit(&trusted, &[0, 1, 2, 3])?;
//!
//! let lossy: Vec<i64> = stamps(9).into_iter().enumerate()
//!     .filter(|(i, _)| !(800..1000).contains(i) || i % 5 != 0)
//!     .map(|(_, stamp)| stamp)
//!     .collect();
//! let verdict = reference.judge(&Cadence::of(&lossy).unwrap(), 0.005);
//! assert!(verdict.chance < 0.005);
//! assert_eq!(verdict.events[0].to_string(), "20 % of poses missing between 40.0 s and 49.8 s, trusted at most 0 %");
//! # Ok::<(), dose3_ood::Error>(())
//! ```

mod cadence;
mod event;
mod reference;
mod student;
mod symptom;
mod watch;

pub use cadence::{Cadence, Span};
pub use event::TimingEvent;
pub use reference::{TimingFinding, TimingReference, TimingVerdict};
pub use symptom::Symptom;
pub use watch::{StampFinding, StampLevels};
