//! Settings that people type.

use dose3_datasets::{Columns, Format, Frame, GroupBy, LostKind, StampUnit};
use dose3_ood::{DensityConfig, StatisticsSet};
use std::fmt::Display;
use std::str::FromStr;

/// Every kind of setting; one that is accepted reads back from what it says of itself.
pub fn settings(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    for word in text.lines().take(8) {
        said::<StatisticsSet>(word);
        accepted::<DensityConfig>(word);
        said::<Format>(word);
        said::<Frame>(word);
        accepted::<Columns>(word);
        accepted::<GroupBy>(word);
        accepted::<LostKind>(word);
        accepted::<StampUnit>(word);
    }
}

fn accepted<T: FromStr<Err: Display>>(word: &str) -> Option<T> {
    match word.parse::<T>() {
        Ok(value) => Some(value),
        Err(error) => {
            assert!(!error.to_string().is_empty(), "an error without words");
            None
        }
    }
}

fn said<T: FromStr<Err: Display> + Display + PartialEq>(word: &str) {
    if let Some(value) = accepted::<T>(word) {
        let text = value.to_string();
        assert!(
            text.parse::<T>().is_ok_and(|back| back == value),
            "{word:?} says {text:?} of itself"
        );
    }
}
