//! The likelihood ratio: what it ranks, and that it is the same every time.

mod common;

use common::{mean, waves, windows};
use dose3_baselines::{Error, FAR, GlowConfig, GlowRatio, Progress};

fn config() -> GlowConfig {
    GlowConfig {
        levels: 2,
        steps_per_level: 3,
        hidden: 16,
        batch: 32,
        steps: 120,
        learning_rate: 3e-3,
        ..GlowConfig::default()
    }
}

fn quick() -> GlowConfig {
    GlowConfig {
        steps: 6,
        ..config()
    }
}

fn train(config: &GlowConfig, seed: u64) -> GlowRatio {
    let data = waves(256, 16, 4, 1);
    GlowRatio::train(windows(16, 4, &data), config, seed, &mut |_| ()).unwrap()
}

#[test]
fn windows_with_a_foreign_pose_score_higher() {
    let ratio = train(&config(), 1);
    let unseen = waves(64, 16, 4, 2);
    let mut broken = unseen.clone();
    for window in broken.chunks_exact_mut(64) {
        // The pose in the middle is mirrored about the mean: possible alone, not in its place.
        for value in &mut window[32..35] {
            *value = 6.0 - *value;
        }
    }
    let trusted = mean(&ratio.score(windows(16, 4, &unseen)).unwrap());
    let foreign = mean(&ratio.score(windows(16, 4, &broken)).unwrap());
    assert!(foreign > trusted + 0.5, "{trusted} and {foreign}");
    assert!(
        trusted < 0.0,
        "the background should be worse on trusted windows: {trusted}"
    );
}

#[test]
fn the_score_is_the_ratio_of_its_two_densities() {
    let ratio = train(&quick(), 1);
    let data = waves(5, 16, 4, 9);
    let score = ratio.score(windows(16, 4, &data)).unwrap();
    let p = ratio
        .foreground()
        .log_density(windows(16, 4, &data))
        .unwrap();
    let q = ratio
        .background()
        .log_density(windows(16, 4, &data))
        .unwrap();
    for i in 0..5 {
        assert!((score[i] - (q[i] - p[i]) / 64.0).abs() < 1e-12);
        assert!(p[i] != q[i], "the two models are one");
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    let bytes = |seed| train(&quick(), seed).to_bytes().unwrap();
    let first = bytes(4);
    assert_eq!(first, bytes(4));
    assert_ne!(first, bytes(5));
}

#[test]
fn bytes_are_read_back_as_they_were() {
    let ratio = train(&quick(), 1);
    let bytes = ratio.to_bytes().unwrap();
    let read = GlowRatio::from_bytes(&bytes).unwrap();
    assert_eq!(read.to_bytes().unwrap(), bytes);
    assert_eq!(read.parameters(), ratio.parameters());
    let data = waves(5, 16, 4, 9);
    let score = |model: &GlowRatio| model.score(windows(16, 4, &data)).unwrap();
    assert_eq!(score(&read), score(&ratio));

    assert!(GlowRatio::from_bytes(&bytes[..bytes.len() - 1]).is_err());
    let renamed = String::from_utf8_lossy(&bytes[..200]).replace("glow-ratio", "glow-ratia");
    let other = [renamed.as_bytes(), &bytes[200..]].concat();
    assert!(matches!(
        GlowRatio::from_bytes(&other),
        Err(Error::Header(_))
    ));
}

#[test]
fn windows_beyond_f32_score_far_and_nan_is_refused() {
    let ratio = train(&quick(), 1);
    let mut data = waves(2, 16, 4, 9);
    data[3] = 1e30;
    let score = ratio.score(windows(16, 4, &data)).unwrap();
    assert_eq!(score[0], FAR);
    assert!(score[1] < FAR);
    data[3] = f32::NAN;
    let refused = ratio.score(windows(16, 4, &data));
    assert!(matches!(refused, Err(Error::NotFinite { index: 3, .. })));
    let misshapen = ratio.score(windows(8, 4, &data[4..36]));
    assert!(matches!(misshapen, Err(Error::OtherShape { .. })));
}

#[test]
fn progress_counts_both_models() {
    let data = waves(16, 16, 4, 1);
    let mut seen: Vec<Progress> = Vec::new();
    let sequences = windows(16, 4, &data);
    GlowRatio::train(sequences, &quick(), 1, &mut |p| seen.push(p)).unwrap();
    let stages: Vec<_> = seen.iter().map(|p| (p.stage, p.step, p.steps)).collect();
    assert_eq!(stages.len(), 12);
    assert_eq!(
        (stages[0], stages[11]),
        (("glow", 1, 6), ("background", 6, 6))
    );
}
