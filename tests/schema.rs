//! What the program writes for programs is as docs/schema says.

mod common;

use common::{dose3, stderr, stdout, write_logs};
use dose3_datasets::synthetic::Platform;
use serde_json::Value;
use std::path::Path;

/// Keywords that say nothing of what is valid.
const WORDS: [&str; 6] = [
    "$schema",
    "$defs",
    "title",
    "description",
    "default",
    "format",
];

/// What is wrong with `value` by `schema`, of which `root` has the definitions; a keyword that is not known here is wrong
/// too, so that nothing passes unseen.
fn check(value: &Value, schema: &Value, root: &Value, at: &str) -> Result<(), String> {
    let Some(rules) = schema.as_object() else {
        return if schema == &Value::Bool(true) {
            Ok(())
        } else {
            Err(format!("{at}: nothing is valid"))
        };
    };
    let one = |of: &Value| -> Vec<bool> {
        let of = of.as_array().expect("schemas");
        of.iter()
            .map(|schema| check(value, schema, root, at).is_ok())
            .collect()
    };
    for (keyword, rule) in rules {
        let right = match keyword.as_str() {
            word if WORDS.contains(&word) => true,
            "$ref" => {
                let name = rule
                    .as_str()
                    .and_then(|to| to.strip_prefix("#/$defs/"))
                    .expect("a definition");
                check(value, &root["$defs"][name], root, at)?;
                true
            }
            "type" => match rule {
                Value::Array(types) => types.iter().any(|of| is(value, of)),
                of => is(value, of),
            },
            "const" => value == rule,
            "enum" => rule.as_array().expect("values").contains(value),
            "minimum" => value
                .as_f64()
                .is_none_or(|x| x >= rule.as_f64().expect("a number")),
            "maximum" => value
                .as_f64()
                .is_none_or(|x| x <= rule.as_f64().expect("a number")),
            "minItems" => value
                .as_array()
                .is_none_or(|items| items.len() as u64 >= rule.as_u64().expect("a number")),
            "maxItems" => value
                .as_array()
                .is_none_or(|items| items.len() as u64 <= rule.as_u64().expect("a number")),
            "anyOf" => one(rule).contains(&true),
            "oneOf" => one(rule).iter().filter(|valid| **valid).count() == 1,
            "required" => {
                let names = rule.as_array().expect("names");
                let missing = names
                    .iter()
                    .filter_map(Value::as_str)
                    .find(|name| value.get(name).is_none());
                if let (Some(missing), true) = (missing, value.is_object()) {
                    return Err(format!("{at}: {missing} is missing"));
                }
                true
            }
            "items" => {
                for (index, item) in value.as_array().into_iter().flatten().enumerate() {
                    check(item, rule, root, &format!("{at}[{index}]"))?;
                }
                true
            }
            "prefixItems" => {
                let items = value.as_array().into_iter().flatten();
                for (index, (item, of)) in items.zip(rule.as_array().expect("schemas")).enumerate()
                {
                    check(item, of, root, &format!("{at}[{index}]"))?;
                }
                true
            }
            "properties" => {
                for (name, of) in rule.as_object().expect("properties") {
                    if let Some(value) = value.get(name) {
                        check(value, of, root, &format!("{at}.{name}"))?;
                    }
                }
                true
            }
            "additionalProperties" => {
                let known = |name: &str| {
                    rules
                        .get("properties")
                        .is_some_and(|known| known.get(name).is_some())
                };
                for (name, value) in value
                    .as_object()
                    .into_iter()
                    .flatten()
                    .filter(|(name, _)| !known(name))
                {
                    check(value, rule, root, &format!("{at}.{name}"))?;
                }
                true
            }
            other => return Err(format!("{at}: the keyword {other} is not known")),
        };
        if !right {
            return Err(format!("{at}: {value} is not as {keyword} says: {rule}"));
        }
    }
    Ok(())
}

fn is(value: &Value, of: &Value) -> bool {
    match of.as_str().expect("a type") {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        other => panic!("type {other}"),
    }
}

fn schema(name: &str) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../docs/schema")
        .join(name);
    serde_json::from_str(&std::fs::read_to_string(path).expect(name)).expect("JSON")
}

/// Checks `value`, and that the schema finds fault with it when a field that it must have is gone.
fn valid(value: &Value, schema: &Value, required: &[&str]) {
    check(value, schema, schema, "$").unwrap_or_else(|error| panic!("{error}"));
    for name in required {
        let mut without = value.clone();
        without
            .as_object_mut()
            .expect("an object")
            .remove(*name)
            .expect(name);
        assert!(check(&without, schema, schema, "$").is_err(), "{name}");
    }
}

#[test]
fn outputs_are_as_the_schemas_say() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).display().to_string();
    write_logs(&folder.path().join("trusted"), Platform::Vehicle, 6, 700);
    write_logs(&folder.path().join("other"), Platform::Handheld, 1, 700);
    std::fs::write(folder.path().join("broken.txt"), "1.0 2.0\n").expect("written");
    std::fs::write(folder.path().join("other/notes.md"), "no log\n").expect("written");
    let (detector, trusted, other, broken) =
        (at("d.dose3"), at("trusted"), at("other"), at("broken.txt"));
    common::expect_code(
        &dose3(["fit", "--trusted", &trusted, "--out", &detector]),
        0,
    );
    let run = |args: &[&str]| {
        let output = dose3(args);
        let text = stdout(&output);
        assert!(!text.is_empty(), "{}", stderr(&output));
        text
    };
    let json = |text: &str| serde_json::from_str::<Value>(text).expect("JSON");

    let document = json(&run(&[
        "score",
        "--detector",
        &detector,
        "--json",
        &trusted,
        &other,
        &broken,
    ]));
    assert_eq!(document["logs"].as_array().map(Vec::len), Some(7));
    assert_eq!(document["errors"].as_array().map(Vec::len), Some(1));
    valid(
        &document,
        &schema("score.json"),
        &["detector", "logs", "errors", "summary"],
    );

    let lines = run(&[
        "score",
        "--detector",
        &detector,
        "--output",
        "jsonl",
        &trusted,
        &other,
        &broken,
    ]);
    let of_line = schema("score-line.json");
    for line in lines.lines() {
        valid(&json(line), &of_line, &["path"]);
    }

    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../dose3/weights/motion.dose3");
    let listed = json(&run(&["inspect", "--json", &trusted, &detector, model]));
    valid(&listed, &schema("inspect.json"), &[]);
    assert!(listed[0]["detector"]["ranges"][0]["quantity"].is_string());
    assert_eq!(listed[1]["model"]["pair"]["representation"], "motion");
    assert!(
        check(
            &Value::Array(vec![Value::Null]),
            &schema("inspect.json"),
            &schema("inspect.json"),
            "$"
        )
        .is_err()
    );

    let measured = json(&run(&[
        "eval",
        "--detector",
        &detector,
        "--id",
        &trusted,
        "--ood",
        &other,
        "--json",
    ]));
    valid(&measured, &schema("eval.json"), &["windows", "leaked"]);
}
