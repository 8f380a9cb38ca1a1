//! The schemas in docs/schema, held to the types that are written.

use crate::commands::{inspect, score::output};
use dose3::evaluate::Evaluation;
use schemars::{Schema, schema_for};
use std::path::Path;

/// Set to write the schemas instead of comparing them.
const WRITE: &str = "DOSE3_WRITE_SCHEMA";

/// Every schema with its file.
fn schemas() -> Vec<(&'static str, Schema)> {
    let others = [
        ("inspect.json", inspect::schema()),
        ("eval.json", schema_for!(Evaluation)),
    ];
    output::schema::schemas()
        .into_iter()
        .chain(others)
        .collect()
}

#[test]
fn the_schemas_in_docs_are_those_of_the_types() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/schema");
    for (name, schema) in schemas() {
        let text = format!("{}\n", serde_json::to_string_pretty(&schema).unwrap());
        let path = folder.join(name);
        if std::env::var_os(WRITE).is_some() {
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(&path, &text).unwrap();
        }
        let there = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(
            there == text,
            "{name} is not of today: {WRITE}=1 cargo test --release -p dose3-cli schemas"
        );
    }
}
