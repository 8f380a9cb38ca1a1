//! `TARGET=mcap cargo run --release -- corpus/mcap`, built as `fuzz/run` does.
#![no_main]

use dose3_fuzz::{Target, check, target};
use std::sync::LazyLock;

static TARGET: LazyLock<&Target> = LazyLock::new(|| {
    let name = std::env::var("TARGET").unwrap_or_else(|_| "any".to_owned());
    target(&name).unwrap_or_else(|| panic!("no target {name:?}"))
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| check(&TARGET, bytes));
