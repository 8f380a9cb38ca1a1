//! A page as text: what it holds, and that nothing of a user becomes markup. `tests/page` of the workspace looks at pages
//! in a browser.

use dose3::datasets::faults::Fault;
use dose3::datasets::synthetic::{Platform, suite, trajectory};
use dose3::{Detector, Report, Trajectory};
use dose3_page::{BEGINS, Entry, Page, Told, list};
use serde_json::Value;
use std::sync::OnceLock;

const ODD: &str = "<script>alert(\"x\")</script>&'";

/// A detector, a log of an odd name with a fault and a gap, and what is said of it.
fn judged() -> &'static (Detector, Trajectory, Report) {
    static JUDGED: OnceLock<(Detector, Trajectory, Report)> = OnceLock::new();
    JUDGED.get_or_init(|| {
        let detector = Detector::fit(&suite(Platform::Vehicle, 5, 1)).expect("fitted");
        let fault: Fault = "slip:2.0m/s".parse().expect("a fault");
        let log = trajectory(Platform::Vehicle, 9, 2000, 20.0);
        let mut log = fault
            .inject(&log, 600..900, 1)
            .expect("injected")
            .trajectory;
        // Five seconds without a pose.
        log.stamps[1500..]
            .iter_mut()
            .for_each(|stamp| *stamp += 5_000_000_000);
        log.name = ODD.to_owned();
        let report = detector.judge(&log).expect("judged");
        (detector, log, report)
    })
}

fn told() -> Told {
    Told {
        detector: Some(ODD.to_owned()),
        command: Some(format!("dose3 score '{ODD}'")),
        list: Some("../all.html".to_owned()),
    }
}

fn html(report: &Report) -> String {
    let (detector, log, _) = judged();
    Page::new(detector, log, report, told())
        .expect("a page")
        .html()
}

/// What the scripts are given.
fn data(html: &str) -> Value {
    let (_, after) = html.split_once("id=\"data\">").expect("data");
    let (data, _) = after.split_once("</script>").expect("an end");
    assert!(!data.contains(['<', '>', '&']));
    serde_json::from_str(data).expect("JSON")
}

fn numbers(value: &Value) -> Vec<Option<f64>> {
    value
        .as_array()
        .expect("a list")
        .iter()
        .map(Value::as_f64)
        .collect()
}

#[test]
fn nothing_of_a_user_is_markup() {
    let (_, _, report) = judged();
    let page = html(report);
    assert!(page.starts_with(BEGINS));
    assert!(!page.contains("<script>alert") && page.contains("&lt;script&gt;alert"));
    let entry = Entry::new(report, "all/a%20b.html".to_owned());
    let failed = [(ODD.to_owned(), ODD.to_owned())];
    let all = list(&[entry], &failed, &told());
    assert!(all.starts_with(BEGINS) && all.contains("href=\"all/a%20b.html\""));
    assert!(!all.contains("<script>alert") && all.contains("&lt;script&gt;alert"));
}

#[test]
fn every_element_is_closed() {
    let (_, _, report) = judged();
    let page = html(report);
    let (before, _) = page.split_once("<script type").expect("scripts");
    for element in [
        "section", "table", "tr", "td", "ul", "ol", "li", "div", "p", "details", "button", "svg",
        "figure", "header",
    ] {
        let opened = before.matches(&format!("<{element}>")).count()
            + before.matches(&format!("<{element} ")).count();
        let closed = before.matches(&format!("</{element}>")).count();
        assert_eq!(opened, closed, "{element}");
    }
}

#[test]
fn the_charts_have_what_they_draw() {
    let (detector, log, report) = judged();
    assert!(report.is_ood());
    let data = data(&html(report));
    let path = &data["path"];
    let t = numbers(&path["t"]);
    for list in ["along", "across", "up", "score"] {
        assert_eq!(numbers(&path[list]).len(), t.len(), "{list}");
    }
    assert!(t.windows(2).all(|pair| pair[0] < pair[1]));
    // One gap: two pieces of the path, and one place in the charts.
    assert_eq!(path["breaks"].as_array().expect("a list").len(), 1);
    let gap = numbers(&data["gaps"][0]);
    assert!(
        (gap[1].expect("an end") - gap[0].expect("a start") - 5.05).abs() < 0.2,
        "{gap:?}"
    );
    let duration = data["duration"].as_f64().expect("seconds");
    assert!((duration - log.duration()).abs() < 0.2);
    let of = data["quantities"]["of"].as_array().expect("quantities");
    assert!(of.len() >= 6 && of[0]["drives"] == true);
    let cells = numbers(&data["quantities"]["t"]);
    for quantity in of {
        assert_eq!(numbers(&quantity["v"]).len(), cells.len());
        let band = numbers(&quantity["band"]);
        assert!(band[0] <= band[1], "{quantity}");
    }
    // No extreme is lost: the fastest pose is drawn.
    let series = detector.series(log, report).expect("series");
    let speed = dose3::series::Quantity::Velocity(dose3::series::Axis::Forward);
    let values = &series.column(speed).expect("a column").values;
    let highest = values.iter().flatten().copied().fold(f64::MIN, f64::max);
    let shown = of
        .iter()
        .find(|q| q["name"] == "forward speed")
        .expect("drawn");
    let drawn = numbers(&shown["v"])
        .into_iter()
        .flatten()
        .fold(f64::MIN, f64::max);
    assert!(
        (drawn - highest).abs() < 1e-2 * highest,
        "{drawn} {highest}"
    );
    assert_eq!(
        data["stretches"].as_array().expect("stretches").len(),
        report.segments.len()
    );
}

#[test]
fn a_report_read_back_has_a_page_without_scores_of_poses() {
    let (_, _, report) = judged();
    let json = serde_json::to_string(report).expect("JSON");
    let back: Report = serde_json::from_str(&json).expect("a report");
    let (with, without) = (data(&html(report)), data(&html(&back)));
    assert!(with["poses"].is_object() && without["poses"].is_null());
    assert_eq!(with["windows"], without["windows"]);
}
