//! Inputs that broke something once: `regressions/TARGET-WHAT`.

use dose3_fuzz::{check, targets};
use std::fs;

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
