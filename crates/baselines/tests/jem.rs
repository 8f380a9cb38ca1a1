//! JEM: it learns its labels and its energy, and never hands out weights that are not sound.

mod common;

use common::{mean, waves, windows};
use dose3_baselines::{
    Divergence, Error, FAR, Jem, JemConfig, Outcome, Precision, annotate, annotation,
};

const LENGTH: usize = 16;
const CHANNELS: usize = 3;

fn config() -> JemConfig {
    JemConfig {
        width: 16,
        levels: 2,
        batch: 32,
        steps: 150,
        learning_rate: 3e-3,
        langevin_steps: 5,
        buffer: 200,
        snapshot_every: 10,
        ..JemConfig::default()
    }
}

fn quick() -> JemConfig {
    JemConfig {
        steps: 6,
        ..config()
    }
}

/// Waves, labelled by whether the first channel ends above where it starts.
fn labelled(count: usize, seed: u64) -> (Vec<f32>, Vec<usize>) {
    let data = waves(count, LENGTH, CHANNELS, seed);
    let window = LENGTH * CHANNELS;
    let rises = |w: &[f32]| usize::from(w[window - CHANNELS] > w[0]);
    let labels = data.chunks_exact(window).map(rises).collect();
    (data, labels)
}

fn train(config: &JemConfig, seed: u64) -> Jem {
    let (data, labels) = labelled(512, 1);
    let sequences = windows(LENGTH, CHANNELS, &data);
    Jem::train(sequences, &labels, 2, config, seed, &mut |_| ()).unwrap()
}

#[test]
fn labels_and_energy_are_learned() {
    let jem = train(&config(), 1);
    assert_eq!(jem.outcome(), &Outcome::Completed { steps: 150 });
    let (unseen, labels) = labelled(128, 2);
    let logits = jem.logits(windows(LENGTH, CHANNELS, &unseen)).unwrap();
    let hits = logits
        .chunks_exact(2)
        .zip(&labels)
        .filter(|(f, y)| usize::from(f[1] > f[0]) == **y);
    assert!(hits.count() > 110, "of 128");

    let far: Vec<f32> = unseen.iter().map(|value| 3.0 * value).collect();
    let score = |data: &[f32]| mean(&jem.score(windows(LENGTH, CHANNELS, data)).unwrap());
    assert!(
        score(&far) > score(&unseen),
        "{} and {}",
        score(&far),
        score(&unseen)
    );
}

#[test]
fn the_score_is_minus_logsumexp_of_the_logits() {
    let jem = train(&quick(), 1);
    let (data, _) = labelled(4, 3);
    let logits = jem.logits(windows(LENGTH, CHANNELS, &data)).unwrap();
    let score = jem.score(windows(LENGTH, CHANNELS, &data)).unwrap();
    for (f, score) in logits.chunks_exact(2).zip(score) {
        let sum: f64 = f.iter().map(|&logit| f64::from(logit).exp()).sum();
        assert!((score + sum.ln()).abs() < 1e-6);
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_they_read_back() {
    let first = train(&quick(), 4);
    let bytes = first.to_bytes().unwrap();
    assert_eq!(bytes, train(&quick(), 4).to_bytes().unwrap());
    assert_ne!(bytes, train(&quick(), 5).to_bytes().unwrap());
    let read = Jem::from_bytes(&bytes).unwrap();
    assert_eq!(read.to_bytes().unwrap(), bytes);
    assert_eq!(read.report(), first.report());
    assert!(Jem::from_bytes(&bytes[..bytes.len() - 4]).is_err());
}

#[test]
fn a_note_travels_with_the_weights() {
    let bytes = train(&quick(), 4).to_bytes().unwrap();
    assert!(matches!(
        annotation::<Vec<f64>>(&bytes),
        Err(Error::Header(_))
    ));
    let note = vec![0.1, 1.0 / 3.0];
    let first = annotate(&bytes, &"first", Precision::F32).unwrap();
    let noted = annotate(&first, &note, Precision::F32).unwrap();
    assert_eq!(annotation::<Vec<f64>>(&noted).unwrap(), note);
    let read = Jem::from_bytes(&noted).unwrap();
    assert_eq!(read.to_bytes().unwrap(), bytes);
    assert!(annotate(&noted[..noted.len() - 4], &note, Precision::F32).is_err());
}

#[test]
fn half_precision_halves_the_file_and_hardly_moves_the_scores() {
    let jem = train(&quick(), 4);
    let bytes = jem.to_bytes().unwrap();
    let halved = annotate(&bytes, &"note", Precision::F16).unwrap();
    assert!(halved.len() < bytes.len() * 6 / 10);
    let read = Jem::from_bytes(&halved).unwrap();
    let (data, _) = labelled(20, 3);
    let score = |jem: &Jem| jem.score(windows(LENGTH, CHANNELS, &data)).unwrap();
    let (full, half) = (score(&jem), score(&read));
    for (full, half) in full.iter().zip(&half) {
        assert!(
            (full - half).abs() < 1e-2 * full.abs().max(1.0),
            "{full} {half}"
        );
    }
    assert_ne!(full, half);
    // What is rounded once stays as it is.
    assert_eq!(annotate(&halved, &"note", Precision::F16).unwrap(), halved);
}

#[test]
fn an_energy_gap_beyond_the_bound_ends_training_with_sound_weights() {
    let config = JemConfig {
        learning_rate: 0.3,
        energy_gap_bound: 0.5,
        ..config()
    };
    let jem = train(&config, 1);
    let Outcome::Diverged {
        step,
        snapshot,
        sign,
    } = jem.outcome()
    else {
        panic!("did not diverge: {:?}", jem.report());
    };
    assert!(
        snapshot <= step && snapshot % 10 == 0,
        "{snapshot} of {step}"
    );
    let gap = match sign {
        Divergence::EnergyGap { gap, bound } => {
            assert_eq!(*bound, 0.5);
            gap.abs()
        }
        Divergence::NotFinite => panic!("the gap should be seen first"),
    };
    assert!(gap > 0.5);
    let (data, _) = labelled(16, 2);
    let score = jem.score(windows(LENGTH, CHANNELS, &data)).unwrap();
    assert!(score.iter().all(|s| s.is_finite() && *s < FAR));
    assert_eq!(
        Jem::from_bytes(&jem.to_bytes().unwrap()).unwrap().outcome(),
        jem.outcome()
    );
}

#[test]
fn numbers_that_overflow_are_seen_as_divergence() {
    let config = JemConfig {
        langevin_step_size: 1e38,
        langevin_noise: 1e38,
        ..quick()
    };
    let jem = train(&config, 1);
    let diverged = Outcome::Diverged {
        step: 0,
        snapshot: 0,
        sign: Divergence::NotFinite,
    };
    assert_eq!(jem.outcome(), &diverged);
    assert!(jem.to_bytes().is_ok());
}

#[test]
fn what_does_not_fit_is_refused() {
    let (data, mut labels) = labelled(8, 1);
    let sequences = windows(LENGTH, CHANNELS, &data);
    let fails = |labels: &[usize], classes, config: &JemConfig| {
        Jem::train(sequences, labels, classes, config, 0, &mut |_| ()).unwrap_err()
    };
    assert!(matches!(fails(&labels[1..], 2, &quick()), Error::Labels(_)));
    assert!(matches!(fails(&labels, 1, &quick()), Error::Labels(_)));
    let small_buffer = JemConfig {
        buffer: 8,
        ..quick()
    };
    assert!(matches!(fails(&labels, 2, &small_buffer), Error::Config(_)));
    labels[3] = 2;
    assert!(matches!(fails(&labels, 2, &quick()), Error::Labels(_)));
}
