//! What every benchmark is told.

use crate::data::DataRoot;
use crate::sets::{self, DataSet};
use anyhow::{Result, bail};
use dose3::backend::Computing;
use std::path::PathBuf;

/// What every benchmark is told.
#[derive(Clone, Debug)]
pub struct Options {
    /// Folder with `kitti/poses`, `robotcar` and `iros20`.
    pub data: Option<PathBuf>,
    /// Generated data sets, even where real data is at hand.
    pub synthetic: bool,
    /// Less of everything.
    pub quick: bool,
    /// Density over the statistics.
    pub density: String,
    /// Bootstrap resamples of the intervals.
    pub resamples: usize,
    /// Folder of results.
    pub out: PathBuf,
    /// Folder of documents that the tables go into, too.
    pub render: Option<PathBuf>,
    /// Where the networks run.
    pub computing: Computing,
    /// The arguments that a reader repeats it with.
    pub command: String,
}

impl Options {
    /// The data sets, with where real ones came from. Fewer than two real sets make no table: found in
    /// `data/` the benchmark goes on with synthetic ones, in a folder that was named that is an error.
    ///
    /// # Errors
    /// Data that cannot be read, or too little of it.
    pub fn load(&self) -> Result<(Option<String>, Vec<DataSet>)> {
        let root = match self.synthetic {
            true => None,
            false => DataRoot::find_optional(self.data.as_deref())?,
        };
        if let Some(root) = &root {
            let sets = sets::real(root)?;
            let found: Vec<&str> = sets.iter().map(|s| s.name).collect();
            let found = match found.is_empty() {
                true => "no data set".into(),
                false => found.join(", "),
            };
            say!(
                "real data from {} ({}): {found}",
                root.path.display(),
                root.source
            );
            if sets.len() >= 2 {
                return Ok((Some(root.source.to_string()), sets));
            }
            if root.source != DataRoot::DEFAULT {
                bail!(
                    "{} holds {found}; two of kitti/poses, robotcar and iros20 are needed for a table",
                    root.path.display()
                );
            }
        }
        say!(
            "no table of real data can be made (--data, $DOSE3_DATA, data/): SYNTHETIC data sets, \
             generated here. These numbers say nothing about the paper's."
        );
        let logs = sets::synthetic_logs(self.quick);
        Ok((None, sets::synthetic(0, logs)?))
    }
}
