//! Whoever listens to a long computation can end it.

use dose3::datasets::Kind;
use dose3::diffusion::trainer::LogRow;
use dose3::model::PairConfig;
use dose3::train::{HoldOut, TrainOptions, train};
use dose3::{Detector, Error, FitOptions, JudgeOptions, Progress};
use dose3_datasets::synthetic::{Platform, suite};

/// Has had enough after so many windows or steps.
struct Enough {
    after: usize,
    heard: usize,
}

impl Progress for Enough {
    fn windows(&mut self, done: usize, _: usize) {
        self.heard = done;
    }

    fn step(&mut self, row: &LogRow) {
        self.heard = row.step;
    }

    fn stop(&mut self) -> bool {
        self.heard >= self.after
    }
}

#[test]
fn fit_judgement_and_training_end_where_they_are_told_to() {
    let logs = suite(Platform::Vehicle, 3, 1);
    let builder = Detector::builder().options(FitOptions {
        statistics: Some("kinematic".parse().unwrap()),
        density: "mixture:1".parse().unwrap(),
        ..FitOptions::default()
    });
    let enough = || Enough { after: 3, heard: 0 };

    let mut listener = enough();
    let fitted = builder.run(&logs, &mut listener);
    assert!(matches!(fitted, Err(Error::Stopped)), "{fitted:?}");
    assert_eq!(listener.heard, 3);

    let detector = builder.fit(&logs).unwrap();
    let mut listener = enough();
    let judged = detector.judge_with(&logs[0], &JudgeOptions::default(), &mut listener);
    assert!(matches!(judged, Err(Error::Stopped)), "{judged:?}");
    assert_eq!(listener.heard, 3);
    // The detector is as good as before.
    assert!(detector.judge(&logs[0]).is_ok());

    let mut options = TrainOptions {
        window: 32,
        network: PairConfig::new(8, &[1, 2]),
        hold_out: HoldOut::Fraction(0.0),
        ..TrainOptions::of(Kind::Motion)
    };
    options.config.steps = 10;
    options.config.batch = 2;
    let mut listener = enough();
    let trained = train(&logs, &options, &mut listener);
    assert!(
        matches!(trained, Err(Error::Stopped)),
        "{:?}",
        trained.err()
    );
    assert_eq!(listener.heard, 3);
}
