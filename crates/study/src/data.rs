//! Where the real data lies: `--data`, else `$DOSE3_DATA`, else `data/`.

use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};

/// A folder with `kitti/poses`, `robotcar` and `iros20` in it, or some of them.
#[derive(Clone, Debug)]
pub struct DataRoot {
    /// The folder.
    pub path: PathBuf,
    /// How it was found, for the user.
    pub source: &'static str,
}

impl DataRoot {
    /// `source` of the folder that is looked for where none is named.
    pub const DEFAULT: &str = "data/";

    /// The first of `--data`, `$DOSE3_DATA` and `data/` that is given or there.
    ///
    /// # Errors
    /// A folder that was named but is not there.
    pub fn find_optional(flag: Option<&Path>) -> Result<Option<Self>> {
        let named = match flag {
            Some(path) => Some((path.to_path_buf(), "--data")),
            None => std::env::var_os("DOSE3_DATA")
                .filter(|v| !v.is_empty())
                .map(|v| (PathBuf::from(v), "$DOSE3_DATA")),
        };
        if let Some((path, source)) = named {
            if !path.is_dir() {
                bail!("{source} names {}, which is no folder", path.display());
            }
            return Ok(Some(Self { path, source }));
        }
        let path = PathBuf::from("data");
        Ok(path.is_dir().then_some(Self {
            path,
            source: Self::DEFAULT,
        }))
    }

    /// As [`DataRoot::find_optional`], where the data must be there.
    ///
    /// # Errors
    /// No data, with what to do about it.
    pub fn find(flag: Option<&Path>) -> Result<Self> {
        Self::find_optional(flag)?.context(
            "no real data: name its folder with --data or $DOSE3_DATA, or put it into data/ \
             (`cargo xtask fetch-data kitti`)",
        )
    }

    /// The KITTI pose folder.
    ///
    /// # Errors
    /// Where it is missing.
    pub fn kitti(&self) -> Result<PathBuf> {
        let path = self.path.join("kitti").join("poses");
        if !path.is_dir() {
            bail!(
                "{} is missing; `cargo xtask fetch-data kitti` fetches it",
                path.display()
            );
        }
        Ok(path)
    }
}
