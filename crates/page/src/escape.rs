//! Text of users within HTML and scripts.

use serde::Serialize;
use std::fmt;

/// Text that may hold anything, as HTML shows it: between tags and within quoted attributes.
pub struct Text<T>(pub T);

impl<T: fmt::Display> fmt::Display for Text<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for c in self.0.to_string().chars() {
            match c {
                '&' => f.write_str("&amp;")?,
                '<' => f.write_str("&lt;")?,
                '>' => f.write_str("&gt;")?,
                '"' => f.write_str("&quot;")?,
                '\'' => f.write_str("&#39;")?,
                c => write!(f, "{c}")?,
            }
        }
        Ok(())
    }
}

/// JSON for a `<script type="application/json">`: nothing in it can end the element or begin a comment.
pub fn json(value: &impl Serialize) -> String {
    let text = serde_json::to_string(value).unwrap_or_else(|_| "null".to_owned());
    // Within JSON these characters stand in strings only, where the escape is the same character.
    text.replace('<', "\\u003c")
        .replace('>', "\\u003e")
        .replace('&', "\\u0026")
}

/// `template` with every `{{name}}` replaced, in one pass: a value is never searched for names.
pub fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let mut out = String::with_capacity(template.len());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        out.push_str(before);
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        let value = values.iter().find(|(known, _)| *known == name);
        debug_assert!(value.is_some(), "a template names `{name}`");
        out.push_str(value.map_or("", |(_, value)| value));
        rest = after;
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_of_a_user_becomes_markup() {
        let name = "<script>alert('a')</script>\"&";
        let shown = Text(name).to_string();
        assert!(!shown.contains(['<', '>', '"', '\'']), "{shown}");
        let embedded = json(&[name, "</script><!--"]);
        assert!(!embedded.contains(['<', '>', '&']), "{embedded}");
        let back: Vec<String> = serde_json::from_str(&embedded).unwrap();
        assert_eq!(back, [name, "</script><!--"]);
    }

    #[test]
    fn values_are_not_searched_for_names() {
        let filled = fill("a{{x}}b{{y}}c", &[("x", "{{y}}"), ("y", "2")]);
        assert_eq!(filled, "a{{y}}b2c");
    }
}
