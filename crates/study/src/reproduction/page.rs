//! The report: one HTML file that opens from disk and asks for nothing else.

use super::figures::Figure;
use super::table::{Table, escaped, inline};
use std::fmt::Write as _;

/// A part of the report.
pub struct Section {
    /// Heading.
    pub title: &'static str,
    /// Its place in links.
    pub anchor: &'static str,
    /// Its tables.
    pub tables: Vec<Table>,
    /// Its figures.
    pub figures: Vec<Figure>,
}

const STYLE: &str = "
:root{--ink:#1d2733;--soft:#5b6b7c;--line:#dde3ea;--accent:#0072b2}
*{box-sizing:border-box}
body{font:16px/1.5 system-ui,-apple-system,'Segoe UI',sans-serif;color:var(--ink);margin:0;background:#fff}
main{max-width:1080px;margin:0 auto;padding:24px}
h1{font-size:28px;margin:8px 0}h2{font-size:22px;margin:48px 0 8px;border-bottom:2px solid var(--line);padding-bottom:4px}
h3{font-size:17px;margin:28px 0 4px}
p{margin:6px 0 10px;max-width:80ch}
nav{position:sticky;top:0;background:#fffffff2;border-bottom:1px solid var(--line);padding:8px 24px}
nav a{margin-right:16px;color:var(--accent);text-decoration:none;font-size:14px;white-space:nowrap}
.scroll{overflow-x:auto}
table{border-collapse:collapse;font-size:13.5px;font-variant-numeric:tabular-nums}
th,td{padding:5px 9px;border-bottom:1px solid var(--line);text-align:left;vertical-align:top}
thead th{border-bottom:2px solid var(--soft);white-space:nowrap}
tbody th{font-weight:500;max-width:360px}
td.number{white-space:nowrap}
tr.printed th,tr.printed td{color:var(--soft);font-style:italic;padding-top:1px}
.note,figcaption{color:var(--soft);font-size:13.5px;max-width:90ch}
figure{margin:20px 0}figure svg{max-width:100%;height:auto}
code{font:0.92em ui-monospace,'SF Mono',Menlo,monospace;background:#f2f5f8;padding:1px 4px;border-radius:3px}
.warning{border-left:4px solid #d55e00;padding:8px 14px;background:#fdf3ec}
.facts{color:var(--soft);font-size:14px}
@media print{nav{display:none}h2{break-before:page}}
";

/// The page.
pub fn page(title: &str, warning: Option<&str>, facts: &[String], sections: &[Section]) -> String {
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n\
         <title>{title}</title><style>{STYLE}</style></head><body>\n<nav>",
        title = escaped(title)
    );
    for section in sections {
        let _ = write!(
            out,
            "<a href=\"#{}\">{}</a>",
            section.anchor,
            escaped(section.title)
        );
    }
    let _ = writeln!(out, "</nav><main><h1>{}</h1>", escaped(title));
    if let Some(warning) = warning {
        let _ = writeln!(out, "<p class=\"warning\">{}</p>", inline(warning));
    }
    for fact in facts {
        let _ = writeln!(out, "<p class=\"facts\">{}</p>", inline(fact));
    }
    for section in sections {
        let _ = writeln!(
            out,
            "<h2 id=\"{}\">{}</h2>",
            section.anchor,
            escaped(section.title)
        );
        for table in &section.tables {
            out += &table.html();
        }
        for (i, figure) in section.figures.iter().enumerate() {
            let _ = write!(
                out,
                "<figure><h3>{}</h3>\n{}\n<figcaption>{}</figcaption></figure>\n",
                escaped(&figure.title),
                own_names(&figure.svg, &format!("{}{i}", section.anchor)),
                inline(&figure.caption)
            );
        }
    }
    out + "</main></body></html>\n"
}

/// The drawing without its XML declaration; ids get a prefix, since all drawings share one document.
fn own_names(svg: &str, prefix: &str) -> String {
    let start = svg.find("<svg").unwrap_or(0);
    svg[start..]
        .replace(" id=\"", &format!(" id=\"{prefix}-"))
        .replace("url(#", &format!("url(#{prefix}-"))
        .replace("href=\"#", &format!("href=\"#{prefix}-"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_needs_nothing_from_outside() {
        let figure = Figure {
            key: "f",
            title: "A & B".into(),
            caption: "from `x`".into(),
            svg: "<?xml version=\"1.0\"?>\n<svg><g id=\"a\"/><use href=\"#a\"/></svg>".into(),
        };
        let sections = [Section {
            title: "Figures",
            anchor: "figures",
            tables: Vec::new(),
            figures: vec![figure],
        }];
        let html = page("T", Some("careful"), &["fact".into()], &sections);
        assert!(html.contains("<a href=\"#figures\">Figures</a>"));
        assert!(html.contains("A &amp; B") && html.contains("<code>x</code>"));
        assert!(html.contains("<g id=\"figures0-a\"/><use href=\"#figures0-a\"/>"));
        assert!(html.contains("class=\"warning\">careful"));
        for outside in [
            "<?xml", "http://", "https://", "<script", "<link", "@import",
        ] {
            assert!(!html.contains(outside), "{outside}");
        }
    }
}
