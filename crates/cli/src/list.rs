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
    let mut bytes = Vec::new();
    let (read, folder) = match list == Path::new("-") {
        true => (
            std::io::stdin().lock().read_to_end(&mut bytes),
            Path::new(""),
        ),
        false => {
            let folder = list.parent().unwrap_or(Path::new(""));
            let file = std::fs::File::open(list);
            (
                file.and_then(|mut file| file.read_to_end(&mut bytes)),
                folder,
            )
        }
    };
    read.with_context(|| format!("cannot read the list {}", list.display()))?;
    parse(list, &bytes, folder, Path::exists)
}

/// The logs that the content of a list names, their paths behind `folder`; `is_there` says whether a path is that of
/// something. Paths need not be text: where the system takes any bytes for a name, so does a list.
///
/// # Errors
/// As [`rows`], but for reading it.
pub fn parse(
    list: &Path,
    bytes: &[u8],
    folder: &Path,
    is_there: impl Fn(&Path) -> bool,
) -> Result<Vec<Row>> {
    let shown = list.display();
    let context = || format!("cannot read the list {shown}");
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(bytes);
    let header = reader.byte_headers().with_context(context)?.clone();
    let column = |name: &str| {
        let mut names = header.iter();
        names.position(|h| h.eq_ignore_ascii_case(name.as_bytes()))
    };
    let Some(path) = column("path") else {
        return plain(list, bytes, folder, is_there);
    };
    let group = column("group");
    let mut rows = Vec::new();
    for record in reader.byte_records() {
        let record = record.with_context(context)?;
        let line = record.position().map_or(0, csv::Position::line);
        let file = record.get(path).unwrap_or_default();
        if file.is_empty() {
            bail!("{shown}:{line}: the path is empty");
        }
        let group = group.and_then(|g| record.get(g)).filter(|g| !g.is_empty());
        rows.push(Row {
            line,
            path: folder.join(of_bytes(file)),
            group: group.map(|g| String::from_utf8_lossy(g).into_owned()),
        });
    }
    if rows.is_empty() {
        bail!("{shown}: the list names no log");
    }
    Ok(rows)
}

/// A list with one path a line.
fn plain(
    list: &Path,
    bytes: &[u8],
    folder: &Path,
    is_there: impl Fn(&Path) -> bool,
) -> Result<Vec<Row>> {
    let lines = (1..).zip(bytes.split(|byte| *byte == b'\n'));
    let rows: Vec<Row> = lines
        .map(|(line, file)| (line, file.trim_ascii()))
        .filter(|(_, file)| !file.is_empty())
        .map(|(line, file)| Row {
            line,
            path: folder.join(of_bytes(file)),
            group: None,
        })
        .collect();
    let Some(first) = rows.first() else {
        bail!("{}: the list names no log", list.display());
    };
    // A log that is gone is an error of its own; where none is there this is no list.
    if !rows.iter().any(|row| is_there(&row.path)) {
        let line = bytes
            .split(|byte| *byte == b'\n')
            .nth(first.line as usize - 1);
        bail!(
            "{}:{}: expected a column `path` or the path of a log, found {}",
            list.display(),
            first.line,
            String::from_utf8_lossy(line.unwrap_or_default().trim_ascii())
        );
    }
    Ok(rows)
}

#[cfg(unix)]
fn of_bytes(path: &[u8]) -> PathBuf {
    use std::os::unix::ffi::OsStrExt;
    std::ffi::OsStr::from_bytes(path).into()
}

/// Where names are text.
#[cfg(not(unix))]
fn of_bytes(path: &[u8]) -> PathBuf {
    String::from_utf8_lossy(path).into_owned().into()
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
        #[cfg(unix)]
        for list in [&b"\xff.txt\n"[..], b"path\n\xff.txt\n"] {
            use std::os::unix::ffi::OsStrExt;
            let rows = super::parse("list".as_ref(), list, "".as_ref(), |_| true).unwrap();
            assert_eq!(rows[0].path.as_os_str().as_bytes(), b"\xff.txt");
        }
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
