//! JUnit's XML, which continuous integration shows: a test for each log. Out of distribution is a failure, a log that
//! cannot be judged an error.

use super::super::judge::Judged;
use super::super::sink::{Sink, Target};
use super::super::summary::Summary;
use super::Head;
use super::line::headline;
use anyhow::Result;
use std::fmt::Write as _;

/// What is kept of a log until all are judged: how many fail stands before the tests.
struct Test {
    /// The log's name; the path of one that could not be judged.
    name: String,
    path: String,
    outcome: Outcome,
}

enum Outcome {
    Judged {
        /// Whether the log is called by its own verdict.
        ood: bool,
        headline: String,
        details: String,
    },
    Error(String),
}

pub struct Junit {
    to: Target,
    detector: String,
    tests: Vec<Test>,
}

impl Junit {
    pub fn new(to: Target, head: &Head) -> Self {
        Self {
            to,
            detector: head.detector.clone(),
            tests: Vec::new(),
        }
    }
}

impl Sink for Junit {
    fn log(&mut self, judged: &Judged, _: bool) -> Result<()> {
        let outcome = match &judged.outcome {
            Ok((_, report)) => Outcome::Judged {
                ood: report.is_ood(),
                headline: headline(report),
                details: report.to_string(),
            },
            Err(error) => Outcome::Error(error.clone()),
        };
        self.tests.push(Test {
            name: judged.name(),
            path: judged.path.display().to_string(),
            outcome,
        });
        Ok(())
    }

    fn end(mut self: Box<Self>, summary: &Summary) -> Result<()> {
        let (mut body, mut failures, mut errors, mut judged) = (String::new(), 0, 0, 0);
        for test in &self.tests {
            let (name, path) = (escape(&test.name), escape(&test.path));
            // Writing to a String cannot fail.
            let _ = writeln!(
                body,
                r#"    <testcase classname="dose3" name="{name}" file="{path}">"#
            );
            let _ = match &test.outcome {
                Outcome::Error(error) => {
                    errors += 1;
                    writeln!(
                        body,
                        r#"      <error type="error" message="{}"/>"#,
                        escape(error)
                    )
                }
                Outcome::Judged {
                    ood,
                    headline,
                    details,
                } => {
                    let called = summary.calls(judged, *ood);
                    judged += 1;
                    failures += usize::from(called);
                    let (headline, details) = (escape(headline), escape(details));
                    match called {
                        true => writeln!(
                            body,
                            "      <failure type=\"out-of-distribution\" message=\"{headline}\">{details}</failure>"
                        ),
                        false => writeln!(body, "      <system-out>{details}</system-out>"),
                    }
                }
            };
            body.push_str("    </testcase>\n");
        }
        let (tests, detector) = (self.tests.len(), escape(&self.detector));
        let counts = format!(r#"tests="{tests}" failures="{failures}" errors="{errors}""#);
        self.to.write(&format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"dose3\" {counts}>\n  \
             <testsuite name=\"{detector}\" {counts} skipped=\"0\">\n{body}  </testsuite>\n</testsuites>\n"
        ))?;
        self.to.end()
    }
}

/// Text for XML 1.0, which cannot hold control characters at all. Line breaks in attributes become blanks.
fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\t' => out.push(c),
            '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::escape;

    #[test]
    fn markup_and_control_characters_cannot_break_the_document() {
        assert_eq!(
            escape("a<b>&\"c\"\u{1b}\0"),
            "a&lt;b&gt;&amp;&quot;c&quot;\u{fffd}\u{fffd}"
        );
    }
}
