//! KITTI odometry ground truth poses: download, unpack, verify.

use dose3_study::say;
use std::fs::{self, File};
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use dose3::atomic::Unfinished;
use zip::ZipArchive;
use zip::result::ZipError;

use super::checksums::{self, PoseFile};
use super::download::{self, Transport};

/// The authors' archive of the poses of sequences 00 to 10 (about 4 MB).
pub const ARCHIVE: &str = "https://s3.eu-central-1.amazonaws.com/avg-kitti/data_odometry_poses.zip";

/// Folder of the pose files in the archive.
const MEMBERS: &str = "dataset/poses";

/// Largest pose file that is unpacked; the largest real one has 0.75 MB.
const MEMBER_CEILING: u64 = 16 << 20;

const LICENCE: &str = "\
Licence:  Creative Commons Attribution-NonCommercial-ShareAlike 3.0 (CC BY-NC-SA 3.0)
Citation: A. Geiger, P. Lenz, R. Urtasun: Are we ready for Autonomous Driving? The KITTI Vision
          Benchmark Suite. CVPR 2012. https://www.cvlibs.net/datasets/kitti/";

/// What [`fetch`] did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Every file was there and right; nothing was requested.
    AlreadyPresent,
    /// The archive was downloaded and this many missing files were written.
    Downloaded(usize),
}

/// The task: [`fetch`] with the pinned checksums, told on stdout.
///
/// # Errors
/// As [`fetch`].
pub fn run(out: &Path, url: &str) -> Result<()> {
    let files = checksums::KITTI;
    let folder = pose_folder(out);
    match fetch(out, url, &files, &Transport::default())? {
        Outcome::AlreadyPresent => say!(
            "{}: all {} pose files are there and match their checksums, nothing to download",
            folder.display(),
            files.len()
        ),
        Outcome::Downloaded(written) => say!(
            "{}: {written} of {} pose files written; all match their checksums",
            folder.display(),
            files.len()
        ),
    }
    say!("{LICENCE}");
    Ok(())
}

/// Brings `files` into `<out>/kitti/poses`, from the archive at `url` where one is missing.
///
/// Everything is verified before anything is written, and each file appears whole under its name.
///
/// # Errors
/// A file that is there with other content (it is left alone, nothing is requested), a failed
/// download, an archive that is no zip, has a member outside its folder, or lacks a file, and a
/// checksum that does not match (file, expected and found are named).
pub fn fetch(
    out: &Path,
    url: &str,
    files: &[PoseFile<'_>],
    transport: &Transport,
) -> Result<Outcome> {
    let folder = pose_folder(out);
    let absent = missing(&folder, files)?;
    if absent.is_empty() {
        return Ok(Outcome::AlreadyPresent);
    }
    // The way out stands at the end, behind the cause.
    let archive = download::to_temporary(url, transport).map_err(|error| {
        anyhow!(
            "could not download {url}: {error:#}\n\
             By hand: unpack that archive and put its {MEMBERS}/*.txt into {}, then run this again \
             to verify them.",
            folder.display()
        )
    })?;
    let contents =
        unpack(archive, files).with_context(|| format!("{url}: refused, nothing was written"))?;
    let chosen: Vec<_> = contents
        .iter()
        .filter(|(file, _)| absent.contains(file))
        .collect();
    store(&folder, &chosen)?;
    // What counts is what the disk gives back.
    if let Some(file) = missing(&folder, files)?.first() {
        bail!(
            "{} is not there after it was written",
            folder.join(file.name).display()
        );
    }
    Ok(Outcome::Downloaded(chosen.len()))
}

fn pose_folder(out: &Path) -> PathBuf {
    out.join("kitti").join("poses")
}

/// The files that are not in `folder`; a file with other content is an error.
fn missing<'a>(folder: &Path, files: &[PoseFile<'a>]) -> Result<Vec<PoseFile<'a>>> {
    let mut absent = Vec::new();
    let mut wrong = String::new();
    for file in files {
        let path = folder.join(file.name);
        match fs::read(&path) {
            Ok(content) => {
                let found = checksums::sha256(&content);
                if found != file.sha256 {
                    wrong += &format!("\n{}: {}", path.display(), mismatch(file.sha256, &found));
                }
            }
            Err(error) if error.kind() == ErrorKind::NotFound => absent.push(*file),
            Err(error) => {
                return Err(error).with_context(|| format!("cannot read {}", path.display()));
            }
        }
    }
    if !wrong.is_empty() {
        bail!("not the official poses; move these files away and run this again{wrong}");
    }
    Ok(absent)
}

fn mismatch(expected: &str, found: &str) -> String {
    format!("SHA-256 expected {expected}, found {found}")
}

/// Reads and verifies `files` from the archive, in memory.
fn unpack<'a>(archive: File, files: &[PoseFile<'a>]) -> Result<Vec<(PoseFile<'a>, Vec<u8>)>> {
    let mut archive = ZipArchive::new(archive)
        .context("this is no whole zip archive; the address may have answered with a web page")?;
    for index in 0..archive.len() {
        let member = archive
            .by_index_raw(index)
            .context("the archive is damaged")?;
        // Names of members never become paths here. Such a name still tells that this archive is
        // made to harm whoever unpacks it.
        let name = String::from_utf8_lossy(member.name_raw());
        if !is_inside(&name) || member.is_symlink() {
            bail!("member {name:?} of the archive points outside its folder");
        }
    }
    let mut contents = Vec::new();
    for file in files {
        let name = format!("{MEMBERS}/{}", file.name);
        let member = match archive.by_name(&name) {
            Ok(member) => member,
            Err(ZipError::FileNotFound) => bail!("{name} is not in the archive"),
            Err(error) => return Err(error).with_context(|| format!("{name} is damaged")),
        };
        let mut content = Vec::new();
        // The size in the header may lie, so the bytes themselves are counted.
        member
            .take(MEMBER_CEILING + 1)
            .read_to_end(&mut content)
            .with_context(|| format!("{name} is damaged"))?;
        if content.len() as u64 > MEMBER_CEILING {
            bail!("{name} is larger than the ceiling of {MEMBER_CEILING} bytes");
        }
        let found = checksums::sha256(&content);
        if found != file.sha256 {
            bail!("{name}: {}", mismatch(file.sha256, &found));
        }
        contents.push((*file, content));
    }
    Ok(contents)
}

/// True for a relative path that stays in its folder on every system. Stricter than the zip crate's
/// `enclosed_name`, which makes absolute paths relative and lets `a/../b` pass.
fn is_inside(member: &str) -> bool {
    !member.starts_with('/')
        && !member.contains(['\\', ':', '\0'])
        && member.split('/').all(|part| part != "..")
}

/// Writes all files beside their places first and renames them only when all are on disk.
fn store(folder: &Path, contents: &[&(PoseFile<'_>, Vec<u8>)]) -> Result<()> {
    let mut staged = Vec::new();
    for (file, content) in contents {
        let mut staging = Unfinished::begin(&folder.join(file.name))?;
        staging.write_all(content)?;
        staged.push(staging);
    }
    for staging in &staged {
        staging.sync()?;
    }
    for staging in staged {
        staging.end()?;
    }
    Ok(())
}
