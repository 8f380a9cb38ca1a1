//! Where results go. A form of results is a [`Sink`], in a file of its own under `output`; a new one joins [`form_of`].

use super::judge::Judged;
#[cfg(feature = "parquet")]
use super::output::Parquet;
use super::output::{Csv, Head, Json, Jsonl, Junit, Pages, Recordings, Table};
use super::summary::Summary;
use crate::args::{OutputName, Score};
use crate::output_file::{Kind, OutputFile, Writing};
use crate::terminal::print;
use anyhow::{Result, bail};
use dose3::Detector;
use std::path::Path;

/// Takes the logs in order, as they are judged.
pub trait Sink {
    /// The next log; `many` where it is not the only one.
    ///
    /// # Errors
    /// Where it cannot be written.
    fn log(&mut self, judged: &Judged, many: bool) -> Result<()>;

    /// All logs are judged.
    ///
    /// # Errors
    /// Where it cannot be written.
    fn end(self: Box<Self>, summary: &Summary) -> Result<()>;
}

/// Standard output, or a file that is there when all is written.
pub enum Target {
    StandardOutput,
    File(Writing),
}

impl Target {
    /// # Errors
    /// Where it cannot be written.
    pub fn write(&mut self, text: &str) -> Result<()> {
        match self {
            Self::StandardOutput => print(text),
            Self::File(file) => file.write(text.as_bytes()),
        }
    }

    /// # Errors
    /// Where it cannot be written.
    pub fn end(self) -> Result<()> {
        match self {
            Self::StandardOutput => Ok(()),
            Self::File(file) => file.end(),
        }
    }
}

/// The sinks that were asked for: standard output, and the files.
///
/// # Errors
/// A file that cannot be written or must not be replaced; an ending that says no form.
pub fn all<'a>(
    args: &Score,
    head: &Head,
    detector: &'a Detector,
) -> Result<Vec<Box<dyn Sink + 'a>>> {
    let mut sinks: Vec<Box<dyn Sink + 'a>> = vec![sink(
        args.showing.form(),
        Target::StandardOutput,
        args,
        head,
    )?];
    for path in &args.showing.out {
        let form = form_of(path)?;
        let file = OutputFile::new(path, results(form), args.showing.force)?;
        sinks.push(sink(form, Target::File(file.begin()?), args, head)?);
    }
    if let Some(path) = &args.showing.html {
        sinks.push(Box::new(Pages::new(path, args, detector)?));
    }
    if let Some(path) = &args.showing.mcap {
        sinks.push(Box::new(Recordings::new(path, args, detector)?));
    }
    Ok(sinks)
}

fn sink(form: OutputName, to: Target, args: &Score, head: &Head) -> Result<Box<dyn Sink>> {
    Ok(match form {
        OutputName::Table => Box::new(Table::new(to, &args.showing)),
        OutputName::Json => Box::new(Json::new(to, head)?),
        OutputName::Jsonl => Box::new(Jsonl::new(to)),
        OutputName::Csv => Box::new(Csv::new(to)?),
        OutputName::Junit => Box::new(Junit::new(to, head)),
        #[cfg(feature = "parquet")]
        OutputName::Parquet => Box::new(Parquet::new(to, head)?),
        #[cfg(not(feature = "parquet"))]
        OutputName::Parquet => {
            bail!("this build writes no Parquet files; hint: rebuild with `--features parquet`")
        }
    })
}

/// The form that a file's ending says.
fn form_of(path: &Path) -> Result<OutputName> {
    Ok(match path.extension().and_then(|end| end.to_str()) {
        Some("json") => OutputName::Json,
        Some("jsonl" | "ndjson") => OutputName::Jsonl,
        Some("csv") => OutputName::Csv,
        Some("xml") => OutputName::Junit,
        Some("txt") => OutputName::Table,
        Some("parquet") => OutputName::Parquet,
        _ => bail!(
            "--out {}: expected a name that ends with .json, .jsonl, .csv, .xml (JUnit), .parquet or .txt",
            path.display()
        ),
    })
}

/// Earlier results are replaced, anything else is not: a pose log may end with .csv or .txt, too.
fn results(form: OutputName) -> Kind {
    Kind {
        name: "results of an earlier run",
        begins: match form {
            OutputName::Json => |start| start.starts_with(b"{\n  \"detector\":"),
            OutputName::Jsonl => |start| start.starts_with(b"{\"path\":"),
            OutputName::Csv => |start| start.starts_with(b"log,path,verdict,"),
            OutputName::Junit => |start| {
                let mark = b"<testsuites name=\"dose3\"";
                start.windows(mark.len()).any(|part| part == mark)
            },
            OutputName::Parquet => |start| start.starts_with(b"PAR1"),
            // Nothing tells a table from other text.
            OutputName::Table => |_| false,
        },
    }
}
