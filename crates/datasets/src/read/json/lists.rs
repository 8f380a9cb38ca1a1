//! Lists of records in a JSON document.

use serde_json::{Map, Value};

use crate::read::records::{Cell, List, MOST, Part};

/// Lists lie no deeper than this below objects.
const DEEPEST: usize = 5;

/// All lists that a document holds: arrays of objects or arrays, objects of objects, arrays of one length side by side.
pub(super) fn find(document: &Value) -> Vec<List<'_>> {
    let mut lists = Vec::new();
    search(document, String::new(), 0, &mut lists);
    lists
}

/// The list of some values.
pub(super) fn of_values(values: Vec<&Value>) -> List<'_> {
    List {
        name: String::new(),
        length: values.len(),
        record: Box::new(move |index| {
            let mut parts = Vec::new();
            gather(values[index], String::new(), &mut parts);
            parts
        }),
        stamps: None,
        unit: None,
    }
}

fn search<'a>(value: &'a Value, name: String, depth: usize, lists: &mut Vec<List<'a>>) {
    let found = match value {
        Value::Array(items) if items.len() == 1 && depth < DEEPEST => {
            return search(&items[0], name, depth + 1, lists);
        }
        Value::Array(items) if items.len() > 1 && items.iter().all(is_compound) => {
            Some(of_values(items.iter().collect()))
        }
        Value::Object(entries) => side_by_side(entries).or_else(|| numbered(entries)),
        _ => None,
    };
    if let Some(list) = found {
        lists.push(List { name, ..list });
    } else if let Value::Object(entries) = value
        && depth < DEEPEST
    {
        for (key, value) in entries {
            search(value, below(&name, key), depth + 1, lists);
        }
    }
}

fn is_compound(value: &Value) -> bool {
    value.is_object() || value.is_array()
}

/// The name of an entry below a name.
fn below(name: &str, key: &str) -> String {
    match name {
        "" => key.to_owned(),
        name => format!("{name}.{key}"),
    }
}

/// Arrays of one length, without objects in them: `{"t": [...], "position": [[...], ...], ...}`.
fn side_by_side(entries: &Map<String, Value>) -> Option<List<'_>> {
    let arrays = || {
        let arrays = entries
            .iter()
            .filter_map(|(key, value)| Some((key.as_str(), value.as_array()?)));
        arrays.filter(|(_, array)| !array.iter().any(Value::is_object))
    };
    let length = arrays().map(|(_, array)| array.len()).max()?;
    let columns: Vec<(&str, &Vec<Value>)> = arrays()
        .filter(|(_, array)| array.len() == length)
        .collect();
    (length > 1 && columns.len() > 1).then(|| List {
        name: String::new(),
        length,
        record: Box::new(move |index| {
            let mut parts = Vec::new();
            for (key, array) in &columns {
                gather(&array[index], (*key).to_owned(), &mut parts);
            }
            parts
        }),
        stamps: None,
        unit: None,
    })
}

/// Records under numbers, in the order of these, which are stamps where they do not count: `{"0": {...}, "1": {...}}`.
fn numbered(entries: &Map<String, Value>) -> Option<List<'_>> {
    let mut records: Vec<(f64, &str, &Value)> = Vec::new();
    for (key, value) in entries {
        let number = key
            .parse::<f64>()
            .ok()
            .filter(|number| number.is_finite())?;
        if !is_compound(value) {
            return None;
        }
        records.push((number, key, value));
    }
    if records.len() < 2 {
        return None;
    }
    records.sort_by(|a, b| a.0.total_cmp(&b.0));
    let counts = |(number, ..): &(f64, &str, &Value)| number.fract() == 0.0 && *number < 1e6;
    let stamps = match records.iter().all(counts) {
        true => None,
        false => Some(records.iter().map(|(_, key, _)| *key).collect()),
    };
    let list = of_values(records.into_iter().map(|(.., value)| value).collect());
    Some(List { stamps, ..list })
}

/// Adds the values below a name.
fn gather<'a>(value: &'a Value, name: String, parts: &mut Vec<Part<'a>>) {
    if parts.len() >= MOST {
        return;
    }
    match value {
        Value::Object(entries) => {
            for (key, value) in entries {
                gather(value, below(&name, key), parts);
            }
        }
        // A list of one object, as BOP has one for each object in sight.
        Value::Array(items) if items.len() == 1 && items[0].is_object() => {
            gather(&items[0], name, parts);
        }
        Value::Array(_) => {
            let mut cells = Vec::new();
            if flat(value, &mut cells) && !cells.is_empty() {
                parts.push(Part {
                    name,
                    cells,
                    is_pose: false,
                });
            }
        }
        scalar => parts.push(Part {
            name,
            cells: vec![cell(scalar)],
            is_pose: false,
        }),
    }
}

fn cell(value: &Value) -> Cell<'_> {
    match value {
        Value::Number(number) => match (number.as_i64(), number.as_f64()) {
            (Some(whole), _) => Cell::Whole(whole),
            (None, Some(number)) => Cell::Number(number),
            (None, None) => Cell::Nothing,
        },
        Value::String(word) => Cell::Word(word),
        _ => Cell::Nothing,
    }
}

/// Numbers of lists within lists, in their order; false where there is something else, or too much.
fn flat<'a>(value: &'a Value, cells: &mut Vec<Cell<'a>>) -> bool {
    match value {
        Value::Array(items) => items.iter().all(|item| flat(item, cells)),
        Value::Object(_) => false,
        other => {
            cells.push(cell(other));
            cells.len() <= MOST
        }
    }
}
