//! Statistics of the joint network, by weights that learnt nothing.

use dose3::joint::{JointHeader, JointModel, VERSION};
use dose3::prelude::*;
use dose3::{Computing, Error, FitOptions, Model, Probe, ProbePlan};
use dose3_datasets::synthetic::{Platform, suite, trajectory};
use dose3_datasets::windows;
use dose3_diffusion::NoiseSharing;
use dose3_diffusion::joint::JointTrainConfig;
use dose3_model::Precision;
use dose3_model::joint::{JointConfig, JointParameters};

fn model() -> Model {
    dose3::built_in::motion().unwrap().with_joint(weights())
}

fn weights() -> JointModel {
    let network = JointConfig::new(16, &[1, 2]);
    JointModel {
        parameters: JointParameters::init(&network, 1).unwrap(),
        header: JointHeader {
            format_version: VERSION,
            network,
            training: JointTrainConfig::default(),
            sets: Vec::new(),
            validation: None,
            version: "test".into(),
        },
    }
}

fn options(statistics: &str) -> FitOptions {
    FitOptions {
        statistics: Some(statistics.parse().unwrap()),
        density: "mixture:1".parse().unwrap(),
        ..FitOptions::default()
    }
}

#[test]
fn a_detector_carries_the_network_that_it_asks() {
    let trusted = suite(Platform::Drone, 4, 1);
    let fit = |statistics: &str, model: Model| {
        let builder = Detector::builder()
            .model(model)
            .options(options(statistics));
        builder.fit(&trusted)
    };
    let fitted = fit(
        "kinematic/joint,joint-given,joint-quantiles+joint-elbo,joint-score",
        model(),
    )
    .unwrap();
    assert_eq!(fitted.model().joint, model().joint);
    let bytes = fitted.to_bytes().unwrap();
    let read = Detector::from_bytes(&bytes).unwrap();
    assert_eq!(read, fitted);
    let log = trajectory(Platform::Drone, 20, 500, 20.0);
    let report = fitted.judge(&log).unwrap();
    let threads = Computing {
        threads: 2,
        ..Computing::default()
    };
    assert_eq!(read.on(threads).judge(&log).unwrap(), report);
    // Any length goes.
    assert!(fitted.judge(&log.cut(0..80)).is_ok());

    // A file of joint weights alone is a model of motion with them.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("joint.dose3");
    weights().write(&path, Precision::F32).unwrap();
    assert_eq!(Model::read(&path).unwrap(), model());

    let plain = fit("kinematic", model()).unwrap();
    assert_eq!(plain.model().joint, None);
    let without = Model {
        joint: None,
        ..model()
    };
    let refused = fit("joint", without).unwrap_err();
    assert!(matches!(refused, Error::NoJointNetwork), "{refused}");
}

#[test]
fn a_windows_numbers_depend_on_it_alone_and_not_on_the_unit() {
    let plan = ProbePlan {
        steps: 6,
        draws: 2,
        seed: 3,
        sharing: NoiseSharing::Shared,
    };
    let set: dose3_ood::StatisticsSet = "joint-given+joint-score".parse().unwrap();
    let rows = |logs: &[Trajectory]| {
        let mut probe = Probe::for_sets(&model(), &plan, [&set], Computing::default()).unwrap();
        let groups = dose3_datasets::LogGroups::of(logs);
        probe.learn(logs, &groups, &set).unwrap();
        let cut = windows(logs, probe.poses(), 64);
        (probe.rows(logs, &cut, &set).unwrap(), cut, probe)
    };
    let logs = suite(Platform::Vehicle, 2, 5);
    let (all, cut, mut probe) = rows(&logs);
    let alone = probe.rows(&logs, &cut[3..4], &set).unwrap();
    assert_eq!(alone[0], all[3]);
    // In centimetres the trusted logs are as large as in metres: the scale is theirs.
    let mut scaled = logs.clone();
    for log in &mut scaled {
        log.poses.iter_mut().for_each(|p| p.translation *= 100.0);
    }
    let (other, ..) = rows(&scaled);
    for (a, b) in all.iter().flatten().zip(other.iter().flatten()) {
        assert!((a - b).abs() < 1e-3, "{a} {b}");
    }
}

#[test]
fn held_out_trusted_logs_say_whether_the_network_is_asked() {
    let run = |logs: &[Trajectory]| {
        let options = FitOptions {
            statistics: None,
            ..options("kinematic")
        };
        let builder = Detector::builder().model(model()).options(options);
        builder.run(logs, &mut ()).unwrap()
    };
    let said = |fitted: &dose3::detector::Fitted| {
        let of_network = fitted.notes.iter().find_map(|note| match note {
            dose3::logs::Note::JointNetwork {
                asked,
                pieces,
                with,
                without,
                ..
            } => Some((*asked, *pieces, *with, *without)),
            _ => None,
        });
        of_network.unwrap()
    };
    let log = |seed| trajectory(Platform::Vehicle, seed, 1700, 10.0);
    let trusted: Vec<Trajectory> = (60..66).map(log).collect();
    let fitted = run(&trusted);
    let (asked, pieces, with, without) = said(&fitted);
    assert!(pieces > 200 && without > 10, "{without} of {pieces}");
    assert!(!asked || with > without);
    let statistics = &fitted.detector.header().statistics.config().statistics;
    assert_eq!(statistics.needs_joint(), asked);
    assert_eq!(fitted.detector.model().joint.is_some(), asked);
    // Three logs leave none to hold out in halves.
    let fitted = run(&trusted[..3]);
    assert_eq!(said(&fitted), (false, 0, 0, 0));
    assert_eq!(fitted.detector.model().joint, None);
}
