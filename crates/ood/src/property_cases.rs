//! How many cases a property is tried on; the property tests of all crates include this file.

use proptest::test_runner::{Config, RngSeed};

/// `count` cases, in every run the same. `DOSE3_MORE_CASES=100` in the environment asks for 100
/// times as many, drawn anew; the seed of a case that fails is printed with it.
pub fn cases(count: u32) -> Config {
    let more = std::env::var("DOSE3_MORE_CASES").ok().map(|text| {
        let times: Result<u32, _> = text.parse();
        times.unwrap_or_else(|_| panic!("DOSE3_MORE_CASES: {text:?} is not a number"))
    });
    let cases = count.saturating_mul(more.unwrap_or(1));
    Config {
        cases,
        // Cases outside of a property's domain, which are not counted.
        max_global_rejects: cases.saturating_mul(4),
        rng_seed: match more {
            Some(_) => RngSeed::Random,
            None => RngSeed::Fixed(20_240_705),
        },
        // A case worth keeping becomes a test of its own, which says what it is about.
        failure_persistence: None,
        ..Config::default()
    }
}
