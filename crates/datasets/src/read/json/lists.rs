//! Lists of records in a JSON document.

use serde_json::Value;

/// Lists lie no deeper than this below objects.
const DEEPEST: usize = 5;

/// The parts of a record with their names; a record that is one value has one part without a name.
pub(super) type Record<'a> = Vec<(&'a str, &'a Value)>;

/// A list whose records may be poses.
pub(super) struct List<'a> {
    /// Its place in the document, names joined by points; empty at the top.
    pub name: String,
    pub records: Vec<Record<'a>>,
    /// Stamps under which the records stand.
    pub stamps: Option<Vec<&'a str>>,
}

/// All lists that a document holds: arrays of objects or arrays, objects of objects, arrays of one length side by side.
pub(super) fn find(document: &Value) -> Vec<List<'_>> {
    let mut lists = Vec::new();
    search(document, String::new(), 0, &mut lists);
    lists
}

fn search<'a>(value: &'a Value, name: String, depth: usize, lists: &mut Vec<List<'a>>) {
    let compound = |value: &Value| value.is_object() || value.is_array();
    match value {
        Value::Array(items) if items.len() > 1 && items.iter().all(compound) => {
            lists.push(List {
                name,
                records: items.iter().map(|item| vec![("", item)]).collect(),
                stamps: None,
            });
        }
        Value::Array(items) if items.len() == 1 && depth < DEEPEST => {
            search(&items[0], name, depth + 1, lists);
        }
        Value::Object(entries) => {
            if let Some(records) = side_by_side(entries) {
                lists.push(List {
                    name,
                    records,
                    stamps: None,
                });
                return;
            }
            if entries.len() > 1
                && let Some((records, stamps)) = numbered(entries)
            {
                lists.push(List {
                    name,
                    records,
                    stamps,
                });
                return;
            }
            if depth < DEEPEST {
                for (key, value) in entries {
                    let name = match name.as_str() {
                        "" => key.clone(),
                        name => format!("{name}.{key}"),
                    };
                    search(value, name, depth + 1, lists);
                }
            }
        }
        _ => {}
    }
}

/// Arrays of one length, of which some hold numbers: `{"t": [...], "position": [[...], ...], ...}`.
fn side_by_side(entries: &serde_json::Map<String, Value>) -> Option<Vec<Record<'_>>> {
    let arrays = || {
        entries
            .iter()
            .filter_map(|(key, value)| Some((key.as_str(), value.as_array()?)))
    };
    let simple = |value: &Value| !value.is_object();
    let rows = |(_, array): &(&str, &Vec<Value>)| array.iter().all(simple);
    let length = arrays().filter(rows).map(|(_, array)| array.len()).max()?;
    let columns: Vec<(&str, &Vec<Value>)> = arrays()
        .filter(rows)
        .filter(|(_, array)| array.len() == length)
        .collect();
    (length > 1 && columns.len() > 1).then(|| {
        let record = |index| {
            columns
                .iter()
                .map(move |(key, array)| (*key, &array[index]))
        };
        (0..length).map(|index| record(index).collect()).collect()
    })
}

/// Records under numbers, in the order of these, which are stamps where they do not count: `{"0": {...}, "1": {...}}`.
fn numbered(
    entries: &serde_json::Map<String, Value>,
) -> Option<(Vec<Record<'_>>, Option<Vec<&str>>)> {
    let mut records: Vec<(f64, &str, &Value)> = Vec::new();
    for (key, value) in entries {
        let number = key
            .parse::<f64>()
            .ok()
            .filter(|number| number.is_finite())?;
        if !(value.is_object() || value.is_array()) {
            return None;
        }
        records.push((number, key, value));
    }
    records.sort_by(|a, b| a.0.total_cmp(&b.0));
    let counts = |(number, ..): &(f64, &str, &Value)| number.fract() == 0.0 && *number < 1e6;
    let stamps = match records.iter().all(counts) {
        true => None,
        false => Some(records.iter().map(|(_, key, _)| *key).collect()),
    };
    let records = records.into_iter().map(|(.., value)| vec![("", value)]);
    Some((records.collect(), stamps))
}
