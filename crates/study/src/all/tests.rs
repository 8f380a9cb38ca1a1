//! Small jobs on synthetic sets, from windows to the written report.

use super::findings::tests::job as made_up;
use super::jobs::{Change, Job};
use super::*;
use crate::sets;
use clap::Parser;
use std::path::Path;

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    args: BenchmarkArgs,
}

fn args(out: &Path) -> BenchmarkArgs {
    let out = out.to_string_lossy().to_string();
    let line = [
        "benchmark",
        "--all",
        "--quick",
        "--synthetic",
        "--resamples",
        "10",
        "--density",
        "mixture:1",
    ];
    Line::parse_from(line.into_iter().chain(["--out", &out])).args
}

fn sets() -> Vec<DataSet> {
    sets::synthetic(0, 4).unwrap()
}

/// The shipped network with the rows of the readings, on few windows.
fn small_job() -> Job {
    let mut job = jobs::plan(true)
        .into_iter()
        .find(|job| job.key == "readings")
        .unwrap();
    job.most = 100;
    job.rows
        .retain(|row| ["paper24", "paper24-common", "low-noise"].contains(&row.key));
    job
}

fn run_of<'a>(args: &BenchmarkArgs, sets: &'a [DataSet], density: &'a DensityConfig) -> Run<'a> {
    Run {
        sets,
        settings: Settings {
            density,
            resamples: args.resamples,
            quick: true,
            backend: args.backend,
            threads: 1,
        },
        store: Store::new(args.out.join("all"), &identity(args, sets), true).unwrap(),
        outcomes: BTreeMap::new(),
        clock: Clock::new(&[small_job()], true, sets.len()).unwrap(),
    }
}

fn found(run: &Run<'_>, key: &str) -> Found {
    match &run.outcomes[key] {
        Outcome::Found(found) => (**found).clone(),
        Outcome::NotRun(reason) => panic!("{key}: {reason}"),
    }
}

#[test]
fn a_job_is_measured_once_and_taken_up_afterwards() {
    let folder = tempfile::tempdir().unwrap();
    let (args, sets) = (args(folder.path()), sets());
    let density: DensityConfig = args.density.parse().unwrap();
    let mut first = run_of(&args, &sets, &density);
    first.job(&small_job()).unwrap();
    let measured = found(&first, "readings");
    // Three rows, two protocols, six pairs of sets.
    assert_eq!(measured.rows.len(), 6);
    assert!(measured.rows.iter().all(|row| row.cells.len() == 6));
    assert_eq!(measured.steps, (30, 10));
    let numbers = |found: &Found| -> Vec<f64> {
        let cells = found.rows.iter().flat_map(|row| &row.cells);
        cells.map(|cell| cell.auroc.value).collect()
    };
    // Half of the steps is another statistic.
    let of_row = |key: &str| {
        let row = measured.rows.iter().find(|row| row.row == key).unwrap();
        row.cells.iter().map(|c| c.auroc.value).collect::<Vec<_>>()
    };
    assert_ne!(of_row("paper24-common"), of_row("low-noise"));

    let mut second = run_of(&args, &sets, &density);
    second.job(&small_job()).unwrap();
    assert_eq!(found(&second, "readings").seconds, measured.seconds);
    assert_eq!(numbers(&found(&second, "readings")), numbers(&measured));

    // Other data is not taken up; the same numbers come again from the same data.
    std::fs::remove_dir_all(folder.path().join("all")).unwrap();
    let mut third = run_of(&args, &sets, &density);
    third.job(&small_job()).unwrap();
    assert_eq!(numbers(&found(&third, "readings")), numbers(&measured));
}

#[test]
fn a_network_that_is_missing_is_a_reason_and_stops_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (args, sets) = (args(folder.path()), sets());
    let density: DensityConfig = args.density.parse().unwrap();
    let mut run = run_of(&args, &sets, &density);
    let job = Job {
        network: "no-such-network",
        ..small_job()
    };
    run.job(&job).unwrap();
    let Outcome::NotRun(reason) = &run.outcomes["readings"] else {
        panic!("a network without weights was run")
    };
    assert!(
        reason.contains("no network is named no-such-network"),
        "{reason}"
    );
}

#[test]
fn prepared_sets_have_few_windows_and_test_logs() {
    let sets = sets();
    let model = networks::load(networks::KITTI).unwrap();
    let prepared = prepare(&sets, &model, 20, Change::None).unwrap();
    assert_eq!(prepared.len(), 3);
    for (set, stride) in &prepared {
        assert!(set.windows.len() <= 20 && stride % sets::STRIDE == 0);
        assert!(!set.test_logs.is_empty());
    }
}

#[test]
fn the_report_is_one_page_with_tables_and_numbers_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let document = folder.path().join("results.md");
    std::fs::write(&document, "# R\n<!-- all -->\n<!-- /all -->\n").unwrap();
    let mut args = args(folder.path());
    args.render = Some(document.clone());
    let mut findings = findings::tests::findings([made_up(
        "main-kitti",
        &[("paper24", crate::cells::Protocol::Paper, 0.75)],
    )]);
    findings
        .outcomes
        .insert("motion".into(), Outcome::NotRun("no weights".into()));
    let report = report::Report {
        source: Some("--data".into()),
        command: "benchmark --all".into(),
        commit: "c".into(),
        machine: "m".into(),
        seconds: 1.0,
        density: "mixture:1".into(),
        quick: false,
        training: Some(60.0),
        missing: vec!["figure roc: why".into()],
    };
    let figure = |key| figures::Figure {
        key,
        title: key.to_string(),
        caption: "shown".into(),
        svg: format!("<svg>{key}</svg>"),
    };
    let drawn = vec![figure("roc"), figure("trajectories")];
    report.write(&args, &findings, drawn).unwrap();

    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let html = read("all.html");
    assert!(html.contains("0.750") && html.contains("not run: no weights"));
    assert!(html.contains("<svg>roc</svg>") && html.contains("<svg>trajectories</svg>"));
    assert!(html.contains("Not drawn: figure roc: why."));
    let json: serde_json::Value = serde_json::from_str(&read("all.json")).unwrap();
    assert_eq!(json["jobs"][0]["key"], "main-kitti");
    assert_eq!(json["not_run"][0][0], "motion");
    let document = read("results.md");
    assert!(document.contains("| *paper, as printed* |"));
    assert!(document.contains("![roc](figures/roc.svg)"));
    // Paths of the data sets stay out of the repository.
    assert!(folder.path().join("figures/roc.svg").exists());
    assert!(!folder.path().join("figures/trajectories.svg").exists());
}
