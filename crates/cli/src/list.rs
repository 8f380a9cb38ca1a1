//! Lists of logs: a csv file with the columns `path` and, where wanted, `group`, or one path a line.

use anyhow::{Context, Result, bail};
use dose3::Trajectory;
use dose3::logs::{self, ReadOptions};
use std::io::Read;
use std::path::{Path, PathBuf};

/// A log of a list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Line of the list.
    pub line: u64,
    /// Where the log is.
    pub path: PathBuf,
    /// The group that the list names.
    pub group: Option<String>,
}

/// The logs that a list names; paths count from the list's own folder, of a list on standard input (`-`) from the
/// current one. A list is a csv file with a column `path`, or has one path a line.
///
/// # Errors
/// A list that cannot be read, without a row, with an empty path; a first line that is neither a header with the column
/// `path` nor the path of something that is there.
pub fn rows(list: &Path) -> Result<Vec<Row>> {
    let shown = list.display();
    let context = || format!("cannot read the list {shown}");
    let mut text = String::new();
    let (read, folder) = match list == Path::new("-") {
        true => (
            std::io::stdin().lock().read_to_string(&mut text),
            Path::new(""),
        ),
        false => {
            let folder = list.parent().unwrap_or(Path::new(""));
            let file = std::fs::File::open(list);
            (
                file.and_then(|mut file| file.read_to_string(&mut text)),
                folder,
            )
        }
    };
    read.with_context(context)?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let header = reader.headers().with_context(context)?.clone();
    let column = |name: &str| header.iter().position(|h| h.eq_ignore_ascii_case(name));
    let Some(path) = column("path") else {
        return plain(list, text, folder);
    };
    let group = column("group");
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.with_context(context)?;
        let line = record.position().map_or(0, csv::Position::line);
        let file = record.get(path).unwrap_or_default();
        if file.is_empty() {
            bail!("{shown}:{line}: the path is empty");
        }
        let group = group.and_then(|g| record.get(g)).filter(|g| !g.is_empty());
        rows.push(Row {
            line,
            path: folder.join(file),
            group: group.map(str::to_owned),
        });
    }
    if rows.is_empty() {
        bail!("{shown}: the list names no log");
    }
    Ok(rows)
}

/// A list with one path a line.
fn plain(list: &Path, text: &str, folder: &Path) -> Result<Vec<Row>> {
    let lines = (1..).zip(text.lines().map(str::trim));
    let rows: Vec<Row> = lines
        .filter(|(_, file)| !file.is_empty())
        .map(|(line, file)| Row {
            line,
            path: folder.join(file),
            group: None,
        })
        .collect();
    let Some(first) = rows.first() else {
        bail!("{}: the list names no log", list.display());
    };
    // A log that is gone is an error of its own; where none is there this is no list.
    if !rows.iter().any(|row| row.path.exists()) {
        let found = text.lines().find(|line| !line.trim().is_empty());
        bail!(
            "{}:{}: expected a column `path` or the path of a log, found {}",
            list.display(),
            first.line,
            found.unwrap_or_default()
        );
    }
    Ok(rows)
}

/// Reads every log of the list. Logs of a row with a group belong to it.
///
/// # Errors
/// As [`rows`]; a log that cannot be read.
pub fn read(list: &Path, options: &ReadOptions) -> Result<Vec<Trajectory>> {
    let mut all = Vec::new();
    for row in rows(list)? {
        let mut logs = logs::read(std::slice::from_ref(&row.path), options)
            .with_context(|| format!("{}:{}", list.display(), row.line))?;
        if let Some(group) = &row.group {
            logs.iter_mut().for_each(|log| log.group.clone_from(group));
        }
        all.extend(logs);
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::read;
    use dose3::logs::ReadOptions;

    #[test]
    fn a_list_names_logs_and_their_groups() {
        let folder = tempfile::tempdir().unwrap();
        let write =
            |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        for name in ["a.txt", "b.txt"] {
            let rows: Vec<String> = (0..20)
                .map(|i| format!("{}.{} {} 0 0 0 0 0 1\n", i / 10, i % 10, f64::from(i) * 0.1))
                .collect();
            write(name, &rows.concat());
        }
        write("list.csv", "group, path\nhall, a.txt\n,b.txt\n");
        let options = ReadOptions::default();
        let logs = read(&folder.path().join("list.csv"), &options).unwrap();
        assert_eq!(logs.len(), 2);
        assert_eq!(
            (logs[0].group.as_str(), logs[1].group.as_str()),
            ("hall", "b")
        );
        write("plain.txt", "\n a.txt\nb.txt\n\n");
        let rows = super::rows(&folder.path().join("plain.txt")).unwrap();
        let lines: Vec<_> = rows
            .iter()
            .map(|row| (row.line, row.path.clone()))
            .collect();
        assert_eq!(
            lines,
            [
                (2, folder.path().join("a.txt")),
                (3, folder.path().join("b.txt"))
            ]
        );
        for (text, expected) in [
            (
                "file\nc.txt\n",
                "column `path` or the path of a log, found file",
            ),
            ("path\n", "names no log"),
            ("path,group\n,x\n", ":2: the path is empty"),
        ] {
            write("bad.csv", text);
            let error = read(&folder.path().join("bad.csv"), &options).unwrap_err();
            assert!(error.to_string().contains(expected), "{error:#}");
        }
    }
}
