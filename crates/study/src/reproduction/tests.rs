//! Small experiments on synthetic sets, from windows to the written report.

use super::findings::tests::{findings, found};
use super::*;
use crate::provenance::Provenance;
use crate::rows::{LOW_NOISE, Row, SPLIT, SPLIT_SHARED};
use crate::sets;
use dose3::backend::Computing;
use record::Record;
use std::path::Path;

fn options(out: &Path) -> Options {
    Options {
        data: None,
        synthetic: true,
        quick: true,
        density: "mixture:1".into(),
        resamples: 10,
        out: out.into(),
        render: None,
        computing: Computing {
            threads: 1,
            ..Computing::default()
        },
        command: "benchmark --all".into(),
    }
}

fn sets() -> Vec<DataSet> {
    sets::synthetic(0, 4).unwrap()
}

const ROWS: [Row; 3] = [SPLIT, SPLIT_SHARED, LOW_NOISE];

/// The shipped network with a few rows on few windows.
fn small() -> Experiment {
    let readings = Experiment::readings();
    Experiment {
        rows: &ROWS,
        view: experiment::View {
            most: 100,
            ..readings.view
        },
        ..readings
    }
}

fn run_of<'a>(options: &Options, sets: &'a [DataSet], density: &'a DensityConfig) -> Run<'a> {
    Run {
        sets,
        settings: Settings {
            density,
            resamples: options.resamples,
            effort: Effort::Quick,
            computing: options.computing,
            learned: Weights::Vehicle { steps: 1 },
        },
        without_baselines: None,
        store: Store::new(options.out.join("all"), &inputs(options, sets), true),
        outcomes: Vec::new(),
        clock: Clock::new(&[small()], Effort::Quick, sets.len()).unwrap(),
    }
}

fn record_of(run: &Run<'_>) -> Record {
    match &run.outcomes[0].1 {
        Outcome::Found(found) => (**found).clone(),
        Outcome::NotRun(reason) => panic!("{reason}"),
    }
}

#[test]
fn an_experiment_is_measured_once_and_taken_up_afterwards() {
    let folder = tempfile::tempdir().unwrap();
    let (options, sets) = (options(folder.path()), sets());
    let density: DensityConfig = options.density.parse().unwrap();
    let measure = || {
        let mut run = run_of(&options, &sets, &density);
        run.experiment(&small()).unwrap();
        record_of(&run)
    };
    let measured = measure();
    assert_eq!(measured.rows.len(), 3);
    let splits = || measured.rows.iter().flat_map(|row| &row.splits);
    assert_eq!(splits().count(), 6);
    assert!(splits().all(|split| split.cells.len() == 6));
    let network = measured.network.as_ref().unwrap();
    assert_eq!((network.steps, network.visited), (30, 10));
    let numbers = |found: &Record| -> Vec<f64> {
        let splits = found.rows.iter().flat_map(|row| &row.splits);
        let cells = splits.flat_map(|split| &split.cells);
        cells.map(|cell| cell.auroc.value).collect()
    };
    // Half of the steps is another statistic.
    let all = numbers(&measured);
    assert_ne!(all[12..24], all[24..36]);

    let again = measure();
    assert_eq!(again.seconds, measured.seconds);
    assert_eq!(numbers(&again), all);

    // The same numbers come again from the same data.
    std::fs::remove_dir_all(folder.path().join("all")).unwrap();
    assert_eq!(numbers(&measure()), all);
}

#[test]
fn a_network_that_is_missing_is_a_reason_and_stops_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (options, sets) = (options(folder.path()), sets());
    let density: DensityConfig = options.density.parse().unwrap();
    let mut run = run_of(&options, &sets, &density);
    let missing = networks::Network {
        name: "no-such-network",
        ..networks::KITTI
    };
    let experiment = Experiment {
        subject: Subject::Trained(missing),
        ..small()
    };
    run.experiment(&experiment).unwrap();
    let Outcome::NotRun(reason) = &run.outcomes[0].1 else {
        panic!("a network without weights was run")
    };
    assert!(reason.contains("--study no-such-network"), "{reason}");
}

#[test]
fn the_report_is_one_page_with_tables_and_numbers_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let documents = folder.path().join("documents");
    let options = Options {
        render: Some(documents.clone()),
        ..options(folder.path())
    };
    let findings = findings([
        found(Experiment::first(), &[(SPLIT, 0.75)]),
        (Experiment::motion(), Outcome::NotRun("no weights".into())),
    ]);
    let report = report::Report {
        source: Some("--data".into()),
        resumed: true,
        density: "mixture:1".into(),
        quick: false,
        training: Some(60.0),
        missing: vec!["figure roc: why".into()],
        provenance: Provenance {
            command: "benchmark --all".into(),
            ..Provenance::default()
        },
    };
    let figure = |key| figures::Figure {
        key,
        title: key.to_string(),
        caption: "shown".into(),
        svg: format!("<svg>{key}</svg>"),
    };
    let drawn = vec![figure("roc"), figure("trajectories")];
    report.write(&options, &findings, drawn).unwrap();

    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let html = read("all.html");
    assert!(html.contains("0.750") && html.contains("not run: no weights"));
    assert!(html.contains("<svg>roc</svg>") && html.contains("<svg>trajectories</svg>"));
    assert!(html.contains("Not drawn: figure roc: why."));
    let json: serde_json::Value = serde_json::from_str(&read("all.json")).unwrap();
    let experiment = &json["experiments"][0]["experiment"];
    assert_eq!(experiment["subject"]["trained"]["name"], "kitti");
    assert_eq!(experiment["rows"][2]["statistics"]["set"], "paper24");
    assert_eq!(json["not_run"][0]["reason"], "no weights");
    let document = read("documents/paper-tables.md");
    assert!(document.contains("| *paper, as printed* |"));
    assert!(document.contains("![roc](figures/roc.svg)"));
    // Paths of the data sets stay out of the repository.
    assert!(documents.join("figures/roc.svg").exists());
    assert!(!documents.join("figures/trajectories.svg").exists());
}
