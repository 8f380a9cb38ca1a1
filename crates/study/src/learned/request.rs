//! Asking for scores, whether or not burn is in this build.

use super::{Baseline, LearnedScores};
use crate::sets::DataSet;
use anyhow::Result;
use clap::Args;
use dose3_datasets::Kind;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Which scores.
#[derive(Clone, Debug, PartialEq, Args)]
pub struct Request {
    /// How poses become numbers: paper or motion
    #[arg(long, default_value_t = Kind::Paper)]
    pub representation: Kind,
    /// Seed of the training run
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Most windows a set: their stride is the smallest multiple of 32 poses that leaves so many
    #[arg(long, default_value_t = 700)]
    pub most: usize,
    /// Folder with kitti/poses, robotcar and iros20 (default: $DOSE3_DATA, else data/)
    #[arg(long, value_name = "DIR", conflicts_with = "synthetic")]
    pub data: Option<PathBuf>,
    /// Train on the synthetic vehicle now and score the synthetic sets
    #[arg(long)]
    pub synthetic: bool,
    /// Fewer synthetic logs and training steps
    #[arg(long)]
    pub quick: bool,
    /// Training steps on synthetic data (default: 300, with --quick 60)
    #[arg(long, requires = "synthetic")]
    pub train_steps: Option<usize>,
    /// Threads (0: all cores)
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
}

/// Scores of both baselines for the windows of `sets`, which must be those that the request names:
/// for `motion` at 10 Hz. Without the feature `baselines`, by an xtask that cargo builds with it.
///
/// # Errors
/// Weights that are missing, sets that are not those of the request, a build that fails.
#[cfg(feature = "baselines")]
pub fn request(request: &Request, sets: &[DataSet]) -> Result<BTreeMap<Baseline, LearnedScores>> {
    super::scoring::answer(request, sets)
}

/// Scores of both baselines for the windows of `sets`, which must be those that the request names:
/// for `motion` at 10 Hz. Without the feature `baselines`, by an xtask that cargo builds with it.
///
/// # Errors
/// Weights that are missing, sets that are not those of the request, a build that fails.
#[cfg(not(feature = "baselines"))]
pub fn request(request: &Request, sets: &[DataSet]) -> Result<BTreeMap<Baseline, LearnedScores>> {
    spawn::run(request)?.for_sets(sets)
}

/// An xtask of its own.
#[cfg(any(test, not(feature = "baselines")))]
mod spawn {
    use super::Request;
    use std::ffi::OsString;
    use std::path::Path;

    /// The command line after `xtask`.
    pub fn arguments(request: &Request, out: &Path) -> Vec<OsString> {
        let mut all = vec![OsString::from("baseline-scores")];
        let mut named = |name: &str, value: OsString| all.extend([name.into(), value]);
        named("--representation", request.representation.name().into());
        named("--seed", request.seed.to_string().into());
        named("--most", request.most.to_string().into());
        named("--threads", request.threads.to_string().into());
        named("--out", out.into());
        if let Some(data) = &request.data {
            named("--data", data.into());
        }
        if let Some(steps) = request.train_steps {
            named("--train-steps", steps.to_string().into());
        }
        let flags = [
            (request.synthetic, "--synthetic"),
            (request.quick, "--quick"),
        ];
        let set = flags.into_iter().filter(|(set, _)| *set);
        all.extend(set.map(|(_, flag)| flag.into()));
        all
    }

    #[cfg(not(feature = "baselines"))]
    pub fn run(request: &Request) -> anyhow::Result<crate::learned::Answer> {
        use anyhow::{Context, ensure};
        let folder = tempfile::tempdir()?;
        let out = folder.path().join("scores.json");
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let status = std::process::Command::new(cargo)
            .args(["run", "--release", "--quiet", "--package", "xtask"])
            .args(["--features", "baselines", "--manifest-path"])
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml"))
            .arg("--")
            .args(arguments(request, &out))
            .status()
            .context("cannot start cargo for the learned baselines")?;
        ensure!(status.success(), "the learned baselines: {status}");
        let text = std::fs::read(&out)?;
        serde_json::from_slice(&text).context("scores of the learned baselines")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learned::ScoresArgs;
    use clap::Parser;
    use std::path::Path;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: ScoresArgs,
    }

    #[test]
    fn a_request_passes_the_command_line_whole() {
        let real = Request {
            representation: Kind::Motion,
            seed: 2,
            most: 48,
            data: Some("some/folder".into()),
            synthetic: false,
            quick: true,
            train_steps: None,
            threads: 3,
        };
        let synthetic = Request {
            representation: Kind::Paper,
            data: None,
            synthetic: true,
            quick: false,
            train_steps: Some(5),
            ..real.clone()
        };
        for request in [real, synthetic] {
            let out = Path::new("scores.json");
            let read = Line::parse_from(spawn::arguments(&request, out)).args;
            assert_eq!(read.request, request);
            assert_eq!(read.out, out);
        }
    }
}
