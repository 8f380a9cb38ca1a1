//! What a results file says of where it comes from, and how it gets into a document.

use anyhow::{Context, Result, bail};
use dose3::atomic;
use std::path::Path;

/// The commit of the checkout, and whether it has changes.
pub fn commit() -> String {
    let git = |args: &[&str]| {
        let output = std::process::Command::new("git").args(args).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim().to_string())
    };
    match git(&["rev-parse", "--short=10", "HEAD"]) {
        Some(commit) => {
            let dirty = git(&["status", "--porcelain", "--untracked-files=no"]);
            let changed = dirty.is_some_and(|d| !d.is_empty());
            if changed {
                format!("{commit} with changes")
            } else {
                commit
            }
        }
        None => "unknown (no git checkout)".into(),
    }
}

/// Cores and processor.
pub fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    let model = std::fs::read_to_string(Path::new("/proc/cpuinfo"))
        .ok()
        .and_then(|text| {
            let line = text.lines().find(|l| l.starts_with("model name"))?;
            Some(line.split_once(':')?.1.trim().to_string())
        });
    format!(
        "{cores} cores, {}, {}",
        std::env::consts::ARCH,
        model.unwrap_or_else(|| "unknown CPU".into())
    )
}

/// Replaces what stands between `<!-- name -->` and `<!-- /name -->` in `path` by `markdown`.
///
/// # Errors
/// A document without the markers.
pub fn render_into(path: &Path, markdown: &str, name: &str) -> Result<()> {
    let (open, close) = (format!("<!-- {name} -->"), format!("<!-- /{name} -->"));
    let text =
        std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let (Some(start), Some(end)) = (text.find(&open), text.find(&close)) else {
        bail!(
            "{} has no lines {open} and {close} to put the tables between",
            path.display()
        );
    };
    if end < start {
        bail!("{}: {close} stands before {open}", path.display());
    }
    let (head, tail) = (&text[..start + open.len()], &text[end..]);
    atomic::write(
        path,
        format!("{head}\n{}\n{tail}", markdown.trim_end()).as_bytes(),
    )?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rendering_replaces_what_stands_between_the_markers() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.md");
        let text = "# T\n<!-- benchmark -->\nold\n<!-- /benchmark -->\nend\n";
        std::fs::write(&path, text).unwrap();
        render_into(&path, "new\n", "benchmark").unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(
            text,
            "# T\n<!-- benchmark -->\nnew\n<!-- /benchmark -->\nend\n"
        );
        assert!(render_into(&path, "new", "benchmark-synthetic").is_err());
    }
}
