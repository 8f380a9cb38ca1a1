//! Many logs in one call: a line each, forms of results, standard input and lists, the share of false alarms.

mod common;

use common::{expect_code, stderr, stdout, write_logs};
use dose3_datasets::synthetic::Platform;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::{Field, ListAccessor, Row, RowAccessor};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

fn text(path: &Path) -> String {
    path.display().to_string()
}

/// A detector of vehicle logs in a folder with `sound/` (three), `other/` (a hand-held object) and `broken.txt`.
struct Place {
    folder: tempfile::TempDir,
    detector: String,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let logs = write_logs(&at("trusted"), Platform::Vehicle, 15, 700);
        std::fs::create_dir_all(at("sound")).expect("made");
        for path in &logs[12..] {
            std::fs::rename(path, at("sound").join(path.file_name().expect("a name")))
                .expect("moved");
        }
        write_logs(&at("other"), Platform::Handheld, 1, 700);
        std::fs::write(at("broken.txt"), "1.0 2.0\n").expect("written");
        let detector = text(&at("d.dose3"));
        expect_code(
            &common::dose3([
                "fit",
                "--trusted",
                &text(&at("trusted")),
                "--out",
                &detector,
            ]),
            0,
        );
        Self { folder, detector }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `dose3 score` with these arguments, in the folder.
    fn score(&self, args: &[&str]) -> Output {
        self.with(args, &[], None)
    }

    fn with(&self, args: &[&str], variables: &[(&str, &str)], input: Option<&[u8]>) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dose3"));
        command
            .args(["score", "--detector", &self.detector])
            .args(args);
        command
            .current_dir(self.folder.path())
            .env_remove("COLUMNS")
            .envs(variables.iter().copied());
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = command.spawn().expect("the program starts");
        let mut pipe = child.stdin.take().expect("a pipe");
        // A program that does not read its input closes it.
        let _ = pipe.write_all(input.unwrap_or_default());
        drop(pipe);
        child.wait_with_output().expect("it ends")
    }
}

const ALL: [&str; 3] = ["sound", "broken.txt", "other"];

#[test]
fn many_logs_are_a_line_each_and_details_on_demand() {
    let place = Place::new();
    let run = place.score(&ALL);
    expect_code(&run, 2);
    let said = stdout(&run);
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(lines.len(), 5, "{said}");
    assert!(
        lines[0].starts_with("verdict") && lines[1].starts_with("in distribution"),
        "{said}"
    );
    assert!(
        lines[4].starts_with("OUT OF DISTRIBUTION") && lines[4].contains("handheld_0   "),
        "{said}"
    );
    assert!(lines[4].contains(" lines "), "{said}");
    let words = stderr(&run);
    assert!(words.contains("error: broken.txt"), "{words}");
    assert!(
        words.contains(
            "1 of 4 logs out of distribution at alpha 0.05, 1 at FDR 5 %, 1 could not be judged"
        ),
        "{words}"
    );
    // Every log is interpolated from 20 Hz: said once.
    assert_eq!(words.matches("interpolated").count(), 1, "{words}");
    assert!(words.contains("note: every log: interpolated"), "{words}");

    let verbose = place.score(&["-v", "sound", "other"]);
    expect_code(&verbose, 1);
    assert_eq!(stdout(&verbose).matches("decided by").count(), 4);
    let quiet = place.score(&["--quiet", "sound", "other"]);
    expect_code(&quiet, 1);
    assert_eq!(stdout(&quiet).lines().count(), 1, "{}", stdout(&quiet));
    assert_eq!(stderr(&quiet), "");
    let sound = place.score(&["-q", "sound"]);
    expect_code(&sound, 0);
    assert_eq!(
        (stdout(&sound), stderr(&sound)),
        (String::new(), String::new())
    );
}

#[test]
fn lines_keep_to_a_narrow_terminal_and_have_no_colours_in_a_pipe() {
    let place = Place::new();
    let run = place.with(&["sound", "other"], &[("COLUMNS", "60")], None);
    for line in stdout(&run).lines() {
        assert!(line.chars().count() <= 60, "{line}");
    }
    let one = place.with(&["other"], &[("COLUMNS", "60")], None);
    for line in stdout(&one).lines() {
        assert!(line.chars().count() <= 60, "{line}");
    }
    assert!(!stdout(&one).contains('\u{1b}') && !stderr(&one).contains('\u{1b}'));
}

#[test]
fn forms_for_programs_hold_every_log_in_order() {
    let place = Place::new();
    let names = ["vehicle_12", "vehicle_13", "vehicle_14", "handheld_0"];

    let run = place.score(&["--output", "json", "sound", "broken.txt", "other"]);
    expect_code(&run, 2);
    let json: serde_json::Value = serde_json::from_str(&stdout(&run)).expect("JSON");
    let found: Vec<&str> = json["logs"]
        .as_array()
        .expect("logs")
        .iter()
        .filter_map(|log| log["log"]["name"].as_str())
        .collect();
    assert_eq!(found, names);
    assert_eq!(json["summary"]["out_of_distribution"], 1);
    assert_eq!(json["summary"]["fdr"]["called"][0], "handheld_0");
    assert_eq!(json["errors"][0]["path"], "broken.txt");
    // The older flag is the same.
    assert_eq!(
        stdout(&place.score(&["--json", "sound", "broken.txt", "other"])),
        stdout(&run)
    );

    let run = place.score(&["--output", "jsonl", "sound", "broken.txt", "other"]);
    let lines: Vec<serde_json::Value> = stdout(&run)
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    assert_eq!(lines.len(), 5);
    assert_eq!(lines[0]["verdict"], "in-distribution");
    assert_eq!(lines[3]["path"], "broken.txt");
    assert!(lines[3]["error"].is_string() && lines[3]["verdict"].is_null());
    assert_eq!(lines[4]["log"], json["logs"][3]["log"]);

    let run = place.score(&["--output", "csv", "sound", "broken.txt", "other"]);
    let text = stdout(&run);
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let header = reader.headers().expect("a header").clone();
    let rows: Vec<csv::StringRecord> = reader.records().map(|row| row.expect("a row")).collect();
    let cell = |row: usize, name: &str| {
        rows[row]
            .get(header.iter().position(|h| h == name).expect(name))
            .expect("a cell")
            .to_owned()
    };
    let verdicts: Vec<String> = (0..5).map(|row| cell(row, "verdict")).collect();
    assert_eq!(
        verdicts,
        [
            "in-distribution",
            "in-distribution",
            "in-distribution",
            "error",
            "out-of-distribution"
        ]
    );
    assert!(cell(4, "chance").parse::<f64>().expect("a chance") <= 0.05);
    assert!(cell(3, "error").contains("broken.txt"));

    let run = place.score(&["--output", "junit", "sound", "broken.txt", "other"]);
    let text = stdout(&run);
    let document = roxmltree::Document::parse(&text).expect("XML");
    let count = |name: &str| {
        document
            .descendants()
            .filter(|node| node.has_tag_name(name))
            .count()
    };
    assert_eq!(
        (count("testcase"), count("failure"), count("error")),
        (5, 1, 1)
    );
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let place = Place::new();
    for form in ["table", "json", "jsonl", "csv", "junit"] {
        let of = |threads: &str| {
            let run = place.score(&[
                "--output",
                form,
                "--threads",
                threads,
                "sound",
                "broken.txt",
                "other",
            ]);
            (stdout(&run), stderr(&run))
        };
        assert_eq!(of("1"), of("4"), "{form}");
    }
}

#[test]
fn files_of_results_are_written_beside_the_table_and_replace_only_their_kind() {
    let place = Place::new();
    let args = [
        "sound",
        "other",
        "--out",
        "r.json",
        "--out",
        "r.xml",
        "--out",
        "deep/r.csv",
        "--out",
        "r.jsonl",
    ];
    for _ in 0..2 {
        let run = place.score(&args);
        expect_code(&run, 1);
        assert_eq!(stdout(&run).lines().count(), 5);
    }
    for (name, form) in [
        ("r.json", "json"),
        ("r.xml", "junit"),
        ("deep/r.csv", "csv"),
        ("r.jsonl", "jsonl"),
    ] {
        let direct = stdout(&place.score(&["sound", "other", "--output", form]));
        assert_eq!(
            std::fs::read_to_string(place.at(name)).expect(name),
            direct,
            "{name}"
        );
    }
    // A log that ends with .csv is not replaced, and nothing is written when something is in the way.
    std::fs::write(place.at("log.csv"), "t,x,y,z\n0,1,2,3\n").expect("written");
    let run = place.score(&["sound", "--out", "new.json", "--out", "log.csv"]);
    expect_code(&run, 2);
    assert!(
        stderr(&run).contains("no results of an earlier run"),
        "{}",
        stderr(&run)
    );
    assert!(!place.at("new.json").exists());
    let run = place.score(&["sound", "--out", "log.pdf"]);
    expect_code(&run, 2);
    assert!(stderr(&run).contains(".jsonl"), "{}", stderr(&run));
    expect_code(&place.score(&["sound", "--out", "log.csv", "--force"]), 0);
}

#[test]
fn a_parquet_file_has_a_row_for_each_log() {
    let place = Place::new();
    let logs = ["sound", "broken.txt", "other"];
    let run = place.score(&[&logs[..], &["--json", "--out", "deep/r.parquet"]].concat());
    expect_code(&run, 2);
    let json: serde_json::Value = serde_json::from_str(&stdout(&run)).expect("JSON");
    let file = std::fs::File::open(place.at("deep/r.parquet")).expect("a file");
    let reader = SerializedFileReader::new(file).expect("Parquet");
    let rows = reader.get_row_iter(None).expect("rows");
    let rows: Vec<Row> = rows.map(|row| row.expect("a row")).collect();
    let column = |row: &Row, name: &str| {
        let place = row.get_column_iter().position(|(found, _)| found == name);
        place.expect("a column")
    };
    let text_of =
        |row: &Row, name: &str| row.get_string(column(row, name)).expect("a text").clone();
    let number_of = |row: &Row, name: &str| row.get_double(column(row, name)).expect("a number");

    assert_eq!(rows.len(), 5);
    let (broken, judged): (Vec<&Row>, Vec<&Row>) = rows
        .iter()
        .partition(|row| text_of(row, "verdict") == "error");
    let at = rows.iter().position(|row| std::ptr::eq(row, broken[0]));
    assert_eq!((broken.len(), at), (1, Some(3)));
    assert_eq!(text_of(broken[0], "path"), "broken.txt");
    assert_eq!(json["errors"][0]["error"], text_of(broken[0], "error"));
    for name in ["log", "chance", "score", "windows"] {
        assert!(
            broken[0]
                .get_column_iter()
                .any(|(n, field)| n == name && *field == Field::Null)
        );
    }
    for (row, log) in judged.iter().zip(json["logs"].as_array().expect("logs")) {
        let evidence = &log["evidence"];
        assert_eq!(log["log"]["name"], text_of(row, "log"));
        assert_eq!(log["log"]["path"], text_of(row, "path"));
        assert_eq!(log["verdict"], text_of(row, "verdict"));
        assert_eq!(evidence["p_value"], number_of(row, "chance"));
        assert_eq!(evidence["mean_score"], number_of(row, "score"));
        assert_eq!(evidence["threshold"], number_of(row, "threshold"));
        let windows = row.get_long(column(row, "windows")).expect("a count");
        assert_eq!(
            log["windows"].as_array().map(Vec::len),
            usize::try_from(windows).ok()
        );
        assert_eq!(text_of(row, "dose3_version"), env!("CARGO_PKG_VERSION"));
        let stretches = row.get_list(column(row, "stretches")).expect("a list");
        let segments = log["segments"].as_array().expect("segments");
        assert_eq!(stretches.len(), segments.len());
        for (i, segment) in segments.iter().enumerate() {
            let stretch = stretches.get_group(i).expect("a stretch");
            assert_eq!(segment["first_row"], stretch.get_long(0).expect("a row"));
            assert_eq!(segment["last_row"], stretch.get_long(1).expect("a row"));
            assert_eq!(
                segment["worst_score"],
                stretch.get_double(4).expect("a score")
            );
        }
        let reasons = row.get_list(column(row, "reasons")).expect("a list");
        assert_eq!(log["reasons"].as_array().map(Vec::len), Some(reasons.len()));
    }
    let called = judged.last().expect("a log");
    assert_eq!(text_of(called, "verdict"), "out-of-distribution");
    let stretches = called.get_list(column(called, "stretches"));
    assert!(stretches.expect("a list").len() > 0);
}

#[test]
fn logs_and_lists_come_from_standard_input_too() {
    let place = Place::new();
    let log = std::fs::read(place.at("other/handheld_0.txt")).expect("a log");
    let run = place.with(&["-", "--format", "tum"], &[], Some(&log));
    expect_code(&run, 1);
    assert!(stdout(&run).starts_with("stdin "), "{}", stdout(&run));
    let run = place.with(
        &["--list", "-"],
        &[],
        Some(b"other/handheld_0.txt\nsound/vehicle_13.txt\n"),
    );
    expect_code(&run, 1);
    assert_eq!(stdout(&run).lines().count(), 3, "{}", stdout(&run));
    std::fs::write(
        place.at("list.csv"),
        "path,group\nsound/vehicle_12.txt,a\nsound/gone.txt,b\n",
    )
    .expect("written");
    let run = place.score(&["--list", "list.csv", "sound/vehicle_14.txt"]);
    expect_code(&run, 2);
    assert!(stderr(&run).contains("gone.txt"), "{}", stderr(&run));
    assert_eq!(stdout(&run).lines().count(), 3, "{}", stdout(&run));
    let run = place.score(&["-", "--list", "-"]);
    expect_code(&run, 2);
    assert!(stderr(&run).contains("read once"), "{}", stderr(&run));
}

/// One log of many that alpha calls is no call with all others, where its chance is not small enough for so many.
#[test]
fn a_share_of_false_alarms_decides_exit_code_and_junit() {
    let place = Place::new();
    let run = place.score(&["--json", "other"]);
    let json: serde_json::Value = serde_json::from_str(&stdout(&run)).expect("JSON");
    let chance = json["logs"][0]["evidence"]["p_value"]
        .as_f64()
        .expect("a chance");
    // Just above its chance the log alone is called; of four, only at four times that.
    let level = format!("{}", 1.01 * chance);
    let by_alpha = place.score(&["sound", "other", "--alpha", &level, "--output", "junit"]);
    expect_code(&by_alpha, 1);
    assert!(
        stdout(&by_alpha).contains("failures=\"1\""),
        "{}",
        stdout(&by_alpha)
    );
    let by_fdr = place.score(&[
        "sound", "other", "--alpha", &level, "--fdr", &level, "--output", "junit",
    ]);
    expect_code(&by_fdr, 0);
    assert!(
        stdout(&by_fdr).contains("failures=\"0\""),
        "{}",
        stdout(&by_fdr)
    );
    let run = place.score(&["sound", "other", "--fdr", "0.05"]);
    expect_code(&run, 1);
    assert!(
        stderr(&run).contains("called: handheld_0"),
        "{}",
        stderr(&run)
    );
}
