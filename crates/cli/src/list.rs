//! Lists of logs: a csv file with the columns `path` and, where wanted, `group`.

use anyhow::{Context, Result, anyhow, bail};
use dose3::Trajectory;
use dose3::logs::{self, ReadOptions};
use std::path::{Path, PathBuf};

/// Reads every log of the list; paths count from the list's own folder. Logs of a row with a group belong to it.
///
/// # Errors
/// A list without the column `path`, without a row, with an empty path; a log that cannot be read.
pub fn read(list: &Path, options: &ReadOptions) -> Result<Vec<Trajectory>> {
    let context = || format!("cannot read the list {}", list.display());
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_path(list)
        .with_context(context)?;
    let header = reader.headers().with_context(context)?.clone();
    let column = |name: &str| header.iter().position(|h| h.eq_ignore_ascii_case(name));
    let found: Vec<&str> = header.iter().collect();
    let path = column("path").ok_or_else(|| {
        anyhow!(
            "{}:1: expected a column `path`, found {}",
            list.display(),
            found.join(", ")
        )
    })?;
    let group = column("group");
    let folder = list.parent().unwrap_or(Path::new(""));
    let mut all = Vec::new();
    for record in reader.records() {
        let record = record.with_context(context)?;
        let line = record.position().map_or(0, csv::Position::line);
        let file = record.get(path).unwrap_or_default();
        if file.is_empty() {
            bail!("{}:{line}: the path is empty", list.display());
        }
        let paths: [PathBuf; 1] = [folder.join(file)];
        let mut logs =
            logs::read(&paths, options).with_context(|| format!("{}:{line}", list.display()))?;
        let group = group.and_then(|g| record.get(g)).filter(|g| !g.is_empty());
        if let Some(group) = group {
            logs.iter_mut().for_each(|log| log.group = group.to_owned());
        }
        all.extend(logs);
    }
    if all.is_empty() {
        bail!("{}: the list names no log", list.display());
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
        for (text, expected) in [
            ("file\na.txt\n", "column `path`, found file"),
            ("path\n", "names no log"),
            ("path,group\n,x\n", ":2: the path is empty"),
        ] {
            write("bad.csv", text);
            let error = read(&folder.path().join("bad.csv"), &options).unwrap_err();
            assert!(error.to_string().contains(expected), "{error:#}");
        }
    }
}
