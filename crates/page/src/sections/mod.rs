//! The parts of a page that are text and tables.

pub mod body;
pub mod places;
pub mod reading;
pub mod reasons;
pub mod repeat;
pub mod trusted;
pub mod verdict;

use crate::escape::Text;
use crate::words;
use dose3::Report;
use dose3::report::Place;
use std::fmt::{Display, Write as _};

/// A section with a heading; nothing without content.
fn section(id: &str, heading: &str, content: &str) -> String {
    match content.is_empty() {
        true => String::new(),
        false => format!("<section id=\"{id}\"><h2>{heading}</h2>{content}</section>"),
    }
}

/// A table; cells are HTML, the first of each row its name.
fn table(heads: &[&str], rows: &[Vec<String>]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let mut out = String::from("<div class=\"scroll\"><table><thead><tr>");
    for head in heads {
        let _ = write!(out, "<th scope=\"col\">{head}</th>");
    }
    out.push_str("</tr></thead><tbody>");
    for row in rows {
        out.push_str("<tr>");
        for (i, cell) in row.iter().enumerate() {
            let _ = match i {
                0 => write!(out, "<th scope=\"row\">{cell}</th>"),
                _ => write!(out, "<td>{cell}</td>"),
            };
        }
        out.push_str("</tr>");
    }
    out.push_str("</tbody></table></div>");
    out
}

/// A place as a button that looks at it in the charts.
fn place_button(report: &Report, place: &Place) -> String {
    format!(
        "<button type=\"button\" class=\"place\" data-from=\"{:.3}\" data-to=\"{:.3}\">{}</button>",
        place.start_s,
        place.end_s,
        Text(words::rows(report, place))
    )
}

/// A list of sentences, escaped.
fn list<T: Display>(sentences: impl IntoIterator<Item = T>) -> String {
    let mut out = String::new();
    for sentence in sentences {
        let _ = write!(out, "<li>{}</li>", Text(sentence));
    }
    match out.is_empty() {
        true => out,
        false => format!("<ul>{out}</ul>"),
    }
}
