//! Tables as data, written as Markdown and as HTML.

use std::fmt::Write as _;

/// One table.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Heading.
    pub title: String,
    /// What it shows; a paragraph of Markdown without markup but backticks.
    pub text: String,
    /// Heads of the columns, the first of the labels.
    pub head: Vec<String>,
    /// Rows.
    pub rows: Vec<Line>,
    /// Remarks below.
    pub notes: Vec<String>,
}

/// One row of a table.
#[derive(Clone, Debug)]
pub struct Line {
    /// What the row is.
    pub label: String,
    /// Its cells.
    pub cells: Vec<Entry>,
    /// Numbers that others printed, not found here.
    pub printed: bool,
}

/// One cell.
#[derive(Clone, Debug, Default)]
pub struct Entry {
    /// As it is shown.
    pub text: String,
    /// An AUROC, for its shade.
    pub auroc: Option<f64>,
}

impl From<String> for Entry {
    fn from(text: String) -> Self {
        Self { text, auroc: None }
    }
}

impl Line {
    /// A row found here.
    pub fn new(label: impl Into<String>, cells: Vec<Entry>) -> Self {
        Self {
            label: label.into(),
            cells,
            printed: false,
        }
    }
}

impl Table {
    /// The table as Markdown, under a heading of third rank.
    pub fn markdown(&self) -> String {
        let mut out = format!("### {}\n\n{}\n\n", self.title, self.text);
        let cells = |cells: Vec<&str>| format!("| {} |\n", cells.join(" | "));
        out += &cells(self.head.iter().map(String::as_str).collect());
        out += &format!("|{}\n", "---|".repeat(self.head.len()));
        for row in &self.rows {
            let texts = std::iter::once(&row.label).chain(row.cells.iter().map(|c| &c.text));
            let texts: Vec<String> = texts
                .map(|t| match row.printed {
                    true => format!("*{t}*"),
                    false => t.clone(),
                })
                .collect();
            out += &cells(texts.iter().map(String::as_str).collect());
        }
        for note in &self.notes {
            let _ = write!(out, "\n{note}\n");
        }
        out + "\n"
    }

    /// The table as HTML.
    pub fn html(&self) -> String {
        let mut out = format!(
            "<h3>{}</h3>\n<p>{}</p>\n",
            inline(&self.title),
            inline(&self.text)
        );
        out += "<div class=\"scroll\"><table><thead><tr>";
        for head in &self.head {
            let _ = write!(out, "<th>{}</th>", inline(head));
        }
        out += "</tr></thead><tbody>\n";
        for row in &self.rows {
            let class = if row.printed {
                " class=\"printed\""
            } else {
                ""
            };
            let _ = write!(out, "<tr{class}><th>{}</th>", inline(&row.label));
            // A row of one cell says why there are no others.
            let span = match row.cells.len() {
                1 => format!(" colspan=\"{}\"", self.head.len() - 1),
                _ => String::new(),
            };
            for cell in &row.cells {
                let shade = match cell.auroc {
                    Some(value) if !row.printed => {
                        format!(" class=\"number\" style=\"background:{}\"", shade(value))
                    }
                    _ => String::new(),
                };
                let _ = write!(out, "<td{span}{shade}>{}</td>", inline(&cell.text));
            }
            out += "</tr>\n";
        }
        out += "</tbody></table></div>\n";
        for note in &self.notes {
            let _ = writeln!(out, "<p class=\"note\">{}</p>", inline(note));
        }
        out
    }
}

/// Blue above one half, orange below, white at one half.
fn shade(auroc: f64) -> String {
    let (r, g, b) = if auroc >= 0.5 {
        (86.0, 180.0, 233.0)
    } else {
        (230.0, 159.0, 0.0)
    };
    let strength = ((auroc - 0.5).abs() * 2.0).clamp(0.0, 1.0).powi(2) * 0.55;
    let mix = |c: f64| (255.0 + (c - 255.0) * strength).round();
    format!("rgb({},{},{})", mix(r), mix(g), mix(b))
}

/// Text safe between tags.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// As [`escaped`], with `code` between backticks.
pub fn inline(text: &str) -> String {
    let mut out = String::new();
    for (i, part) in escaped(text).split('`').enumerate() {
        match i % 2 {
            0 => out += part,
            _ => {
                let _ = write!(out, "<code>{part}</code>");
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let cell = Entry {
            text: "0.9 < 1".into(),
            auroc: Some(0.9),
        };
        let text = |t: &str| Entry::from(t.to_string());
        let mut printed = Line::new("paper", vec![text("0.8"), text("1")]);
        printed.printed = true;
        Table {
            title: "T".into(),
            text: "of `x`".into(),
            head: ["row", "O/K", "K/O"].map(String::from).to_vec(),
            rows: vec![
                Line::new("ours", vec![cell, text("0")]),
                printed,
                Line::new("other", vec![text("not run")]),
            ],
            notes: vec!["n".into()],
        }
    }

    #[test]
    fn markdown_of_a_small_table() {
        let expected = "### T\n\nof `x`\n\n| row | O/K | K/O |\n|---|---|---|\n| ours | 0.9 < 1 | 0 |\n| *paper* | *0.8* | *1* |\n| other | not run |\n\nn\n\n";
        assert_eq!(table().markdown(), expected);
    }

    #[test]
    fn html_is_escaped_and_shaded() {
        let html = table().html();
        assert!(html.contains("<code>x</code>"));
        assert!(html.contains(">0.9 &lt; 1</td>"), "{html}");
        assert!(html.contains("<tr class=\"printed\"><th>paper</th><td>0.8</td><td>1</td></tr>"));
        assert!(html.contains("<td colspan=\"2\">not run</td>"));
        assert_eq!(shade(0.5), "rgb(255,255,255)");
        assert_ne!(shade(1.0), shade(0.0));
    }
}
