//! Inputs that broke something once: `regressions/TARGET-WHAT`.

use dose3::Model;
use dose3_fuzz::seeds;
use dose3_fuzz::{check, targets};
use std::fs;

#[test]
fn seeds_are_accepted() {
    for state in seeds::streams::states() {
        let state = serde_json::from_slice(&state).unwrap();
        assert!(seeds::streams::MONITOR.resume(state).is_ok());
    }
    let files = seeds::models::files();
    assert!(Model::from_bytes(&files[0]).is_ok() && Model::from_bytes(&files[2]).is_ok());
    assert!(dose3::joint::JointModel::from_bytes(&files[1]).is_ok());
}

#[test]
fn what_broke_once_holds() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/regressions");
    let mut tried = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let of_name = targets::ALL
            .iter()
            .filter(|target| name.starts_with(&format!("{}-", target.name)));
        // `detector-header-x` belongs to the longer name.
        let target = of_name.max_by_key(|target| target.name.len()).unwrap();
        check(target, &fs::read(&path).unwrap());
        tried += 1;
    }
    assert!(tried > 0, "no regressions in {folder}");
}
