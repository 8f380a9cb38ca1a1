//! `fetch-data kitti` against a server on loopback, with an archive made from synthetic files.

// A test that did not run says so.
#![allow(clippy::print_stderr)]

mod support;

use std::collections::BTreeMap;
use std::fs;
use std::io::{Cursor, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use support::{Reply, Server};
use tempfile::TempDir;
use xtask::fetch::checksums::{self, PoseFile};
use xtask::fetch::download::Transport;
use xtask::fetch::kitti::{self, Outcome};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

const NAMES: [&str; 3] = ["00.txt", "01.txt", "02.txt"];

/// Poses that no data set has.
fn content(name: &str) -> Vec<u8> {
    let number: f64 = name[..2].parse().unwrap();
    let line = |step: i32| format!("1 0 0 {number} 0 1 0 0 0 0 1 {step}\n");
    (0..200).map(line).collect::<String>().into_bytes()
}

fn archive(members: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    zip.add_directory("dataset/poses/", options).unwrap();
    for (name, bytes) in members {
        zip.start_file(*name, options).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// The archive as it should be, with `more` at its end.
fn good_archive(more: &[(&str, &[u8])]) -> Vec<u8> {
    let own: Vec<(String, Vec<u8>)> = NAMES
        .iter()
        .map(|name| (format!("dataset/poses/{name}"), content(name)))
        .collect();
    let mut members: Vec<(&str, &[u8])> = own
        .iter()
        .map(|(name, bytes)| (name.as_str(), bytes.as_slice()))
        .collect();
    members.extend_from_slice(more);
    archive(&members)
}

/// A folder for the data and the checksums expected in it.
struct Case {
    root: TempDir,
    digests: Vec<String>,
}

impl Case {
    fn new() -> Self {
        let digests = NAMES
            .iter()
            .map(|name| checksums::sha256(&content(name)))
            .collect();
        Self {
            root: tempfile::tempdir().unwrap(),
            digests,
        }
    }

    fn out(&self) -> PathBuf {
        self.root.path().join("data")
    }

    fn file(&self, name: &str) -> PathBuf {
        self.out().join("kitti").join("poses").join(name)
    }

    fn put(&self, name: &str, bytes: &[u8]) {
        fs::create_dir_all(self.file(name).parent().unwrap()).unwrap();
        fs::write(self.file(name), bytes).unwrap();
    }

    fn fetch(&self, url: &str, transport: &Transport) -> anyhow::Result<Outcome> {
        let files: Vec<PoseFile<'_>> = NAMES
            .iter()
            .zip(&self.digests)
            .map(|(name, sha256)| PoseFile { name, sha256 })
            .collect();
        kitti::fetch(&self.out(), url, &files, transport)
    }

    /// Fetches and returns the whole chain of the error, having checked that nothing changed on disk.
    fn refused(&self, url: &str, transport: &Transport) -> String {
        let before = snapshot(self.root.path());
        let error = self.fetch(url, transport).unwrap_err();
        assert_eq!(snapshot(self.root.path()), before, "something was written");
        format!("{error:#}")
    }
}

/// Every file under a folder with its content; folders with an empty one.
fn snapshot(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(snapshot(&path));
            found.insert(path, Vec::new());
        } else {
            let bytes = fs::read(&path).unwrap();
            found.insert(path, bytes);
        }
    }
    found
}

/// No proxy: the server is on this machine, whatever the environment says.
fn transport() -> Transport {
    Transport {
        proxy: false,
        progress: false,
        ..Transport::default()
    }
}

fn impatient(milliseconds: u64) -> Transport {
    Transport {
        stall: Duration::from_millis(milliseconds),
        ..transport()
    }
}

#[track_caller]
fn assert_says(message: &str, words: &[&str]) {
    for word in words {
        assert!(message.contains(word), "no `{word}` in: {message}");
    }
}

#[test]
fn good_archive_is_unpacked_and_nothing_else() {
    let server = Server::start(Reply::ok(&good_archive(&[(
        "dataset/poses/readme.txt",
        b"x",
    )])));
    let case = Case::new();
    let outcome = case.fetch(&server.url(), &transport()).unwrap();
    assert_eq!(outcome, Outcome::Downloaded(3));
    assert_eq!(server.requests(), 1);
    let files: BTreeMap<_, _> = NAMES
        .iter()
        .map(|name| (case.file(name), content(name)))
        .collect();
    assert_eq!(snapshot(case.file("00.txt").parent().unwrap()), files);
}

#[test]
fn body_without_announced_length_is_taken() {
    let server = Server::start(Reply::unannounced(&good_archive(&[])));
    let outcome = Case::new().fetch(&server.url(), &transport()).unwrap();
    assert_eq!(outcome, Outcome::Downloaded(3));
}

#[test]
fn present_files_make_no_request() {
    let server = Server::start(Reply::ok(&good_archive(&[])));
    let case = Case::new();
    NAMES.iter().for_each(|name| case.put(name, &content(name)));
    let outcome = case.fetch(&server.url(), &transport()).unwrap();
    assert_eq!(outcome, Outcome::AlreadyPresent);
    assert_eq!(server.requests(), 0);
}

#[test]
fn only_missing_files_are_written() {
    let server = Server::start(Reply::ok(&good_archive(&[])));
    let case = Case::new();
    case.put("01.txt", &content("01.txt"));
    let outcome = case.fetch(&server.url(), &transport()).unwrap();
    assert_eq!(outcome, Outcome::Downloaded(2));
    assert_eq!(
        case.fetch(&server.url(), &transport()).unwrap(),
        Outcome::AlreadyPresent
    );
    assert_eq!(server.requests(), 1);
}

#[test]
fn other_content_in_the_folder_is_left_alone() {
    let server = Server::start(Reply::ok(&good_archive(&[])));
    let case = Case::new();
    case.put("01.txt", b"my own poses\n");
    let message = case.refused(&server.url(), &transport());
    let found = checksums::sha256(b"my own poses\n");
    assert_says(
        &message,
        &["01.txt", &case.digests[1], &found, "move these files away"],
    );
    assert_eq!(server.requests(), 0);
}

#[test]
fn http_errors_are_told_with_a_way_out() {
    for status in [
        "404 Not Found",
        "403 Forbidden",
        "503 Service Unavailable",
        "204 No Content",
    ] {
        let server = Server::start(Reply::status(status));
        let case = Case::new();
        let message = case.refused(&server.url(), &transport());
        assert_says(&message, &[&server.url(), status, "By hand"]);
    }
}

#[test]
fn truncated_bodies_are_refused() {
    let whole = good_archive(&[]);
    let half = &whole[..whole.len() / 2];
    let server = Server::start(Reply::announcing(whole.len(), half));
    let message = Case::new().refused(&server.url(), &transport());
    let of = format!("{} of {} bytes", half.len(), whole.len());
    assert_says(&message, &["closed after", &of]);
    // Without an announced length only the archive itself can tell.
    let server = Server::start(Reply::unannounced(half));
    assert_says(
        &Case::new().refused(&server.url(), &transport()),
        &["no whole zip archive"],
    );
}

#[test]
fn checksum_mismatch_leaves_the_target_untouched() {
    let mut changed = content("01.txt");
    changed[0] ^= 1;
    let (first, last) = (content("00.txt"), content("02.txt"));
    let bytes = archive(&[
        ("dataset/poses/00.txt", &first),
        ("dataset/poses/01.txt", &changed),
        ("dataset/poses/02.txt", &last),
    ]);
    let server = Server::start(Reply::ok(&bytes));
    let case = Case::new();
    case.put("02.txt", &last);
    case.put("notes.md", b"kept");
    let message = case.refused(&server.url(), &transport());
    let found = checksums::sha256(&changed);
    assert_says(
        &message,
        &[
            "dataset/poses/01.txt",
            &case.digests[1],
            &found,
            "nothing was written",
        ],
    );
}

#[test]
fn missing_member_is_named() {
    let bytes = archive(&[("dataset/poses/00.txt", &content("00.txt"))]);
    let server = Server::start(Reply::ok(&bytes));
    let message = Case::new().refused(&server.url(), &transport());
    assert_says(&message, &["dataset/poses/01.txt is not in the archive"]);
}

#[test]
fn members_outside_their_folder_are_refused() {
    let names = [
        "../../evil.txt",
        "dataset/poses/../../../evil.txt",
        "/evil.txt",
        "..\\..\\evil.txt",
        "C:\\evil.txt",
    ];
    for name in names {
        let bytes = good_archive(&[(name, b"evil")]);
        assert!(
            bytes
                .windows(name.len())
                .any(|window| window == name.as_bytes()),
            "{name}"
        );
        let server = Server::start(Reply::ok(&bytes));
        let message = Case::new().refused(&server.url(), &transport());
        assert_says(&message, &["points outside its folder", "evil.txt"]);
    }
}

#[test]
fn link_in_place_of_a_file_is_refused() {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default();
    zip.add_symlink("dataset/poses/00.txt", "../../../secret", options)
        .unwrap();
    let server = Server::start(Reply::ok(&zip.finish().unwrap().into_inner()));
    let message = Case::new().refused(&server.url(), &transport());
    assert_says(&message, &["00.txt", "points outside its folder"]);
}

#[test]
fn damaged_member_is_refused() {
    let mut bytes = good_archive(&[]);
    let name = b"dataset/poses/01.txt";
    let header = bytes
        .windows(name.len())
        .position(|window| window == name)
        .unwrap();
    // Some bytes into the compressed content behind the local header's name.
    for byte in &mut bytes[header + name.len() + 40..][..8] {
        *byte ^= 0xff;
    }
    let server = Server::start(Reply::ok(&bytes));
    let message = Case::new().refused(&server.url(), &transport());
    assert_says(&message, &["dataset/poses/01.txt"]);
}

#[test]
fn member_that_swells_is_refused() {
    let zeros = vec![0; (16 << 20) + 1];
    let bytes = archive(&[("dataset/poses/00.txt", &zeros)]);
    assert!(bytes.len() < 1 << 20);
    let server = Server::start(Reply::ok(&bytes));
    let message = Case::new().refused(&server.url(), &transport());
    assert_says(
        &message,
        &["dataset/poses/00.txt", "larger than the ceiling"],
    );
}

#[test]
fn web_page_in_place_of_the_archive_is_refused() {
    for page in [b"<html>Please log in</html>".as_slice(), b""] {
        let server = Server::start(Reply::ok(page));
        let message = Case::new().refused(&server.url(), &transport());
        assert_says(&message, &["no whole zip archive", "nothing was written"]);
    }
}

#[test]
fn size_ceiling_holds_with_and_without_an_announcement() {
    let bytes = good_archive(&[]);
    let small = Transport {
        ceiling: bytes.len() as u64 - 1,
        ..transport()
    };
    for reply in [Reply::ok(&bytes), Reply::unannounced(&bytes)] {
        let server = Server::start(reply);
        assert_says(&Case::new().refused(&server.url(), &small), &["ceiling"]);
    }
    let exact = Transport {
        ceiling: bytes.len() as u64,
        ..transport()
    };
    let server = Server::start(Reply::ok(&bytes));
    assert_eq!(
        Case::new().fetch(&server.url(), &exact).unwrap(),
        Outcome::Downloaded(3)
    );
}

#[test]
fn silent_server_is_given_up() {
    let silent = Reply {
        bytes: Vec::new(),
        stall: true,
    };
    let server = Server::start(silent);
    let message = Case::new().refused(&server.url(), &impatient(300));
    assert_says(&message, &["no answer within the time limit", "By hand"]);
}

#[test]
fn server_that_falls_silent_is_given_up() {
    let whole = good_archive(&[]);
    let half = Reply::announcing(whole.len(), &whole[..100]).then_stall();
    let server = Server::start(half);
    // Long enough that a busy machine still gets the first bytes through.
    let message = Case::new().refused(&server.url(), &impatient(1500));
    let of = format!("stopped after 100 of {} bytes", whole.len());
    assert_says(&message, &[&of, "no answer within the time limit"]);
}

#[test]
fn closed_port_and_bad_address_are_told() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}/", listener.local_addr().unwrap());
    drop(listener);
    let message = Case::new().refused(&url, &transport());
    assert_says(&message, &[&url, "refused", "By hand"]);
    assert_says(
        &Case::new().refused("no address", &transport()),
        &["no address"],
    );
}

#[test]
fn command_line_ends_with_one_where_the_download_fails() {
    let server = Server::start(Reply::status("404 Not Found"));
    let case = Case::new();
    let output = Command::new(env!("CARGO_BIN_EXE_xtask"))
        .args(["fetch-data", "kitti", "--url", &server.url(), "--out"])
        .arg(case.out())
        .env("NO_PROXY", "127.0.0.1")
        .env("no_proxy", "127.0.0.1")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert_says(
        &String::from_utf8(output.stderr).unwrap(),
        &["404 Not Found", "By hand"],
    );
    assert_eq!(server.requests(), 1);
    assert!(!case.out().exists());
}

#[test]
fn real_poses_match_the_pinned_checksums() {
    let Some(data) = std::env::var_os("DOSE3_DATA") else {
        eprintln!("not run: DOSE3_DATA is not set");
        return;
    };
    let data = Path::new(&data);
    let own: Vec<(String, Vec<u8>)> = checksums::KITTI
        .iter()
        .map(|file| {
            let content = fs::read(data.join("kitti/poses").join(file.name)).unwrap();
            (format!("dataset/poses/{}", file.name), content)
        })
        .collect();
    let members: Vec<(&str, &[u8])> = own
        .iter()
        .map(|(name, bytes)| (name.as_str(), bytes.as_slice()))
        .collect();
    let server = Server::start(Reply::ok(&archive(&members)));
    let fetch = |out| kitti::fetch(out, &server.url(), &checksums::KITTI, &transport()).unwrap();
    assert_eq!(fetch(data), Outcome::AlreadyPresent);
    assert_eq!(server.requests(), 0);
    let root = tempfile::tempdir().unwrap();
    assert_eq!(fetch(root.path()), Outcome::Downloaded(11));
    assert_eq!(fetch(root.path()), Outcome::AlreadyPresent);
    assert_eq!(server.requests(), 1);
}
