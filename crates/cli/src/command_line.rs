//! The command that was given, as a shell takes it again.

use std::ffi::OsStr;

/// The command of this process, the program by its name.
pub fn own() -> String {
    let given: Vec<_> = std::env::args_os().skip(1).collect();
    let given = given.iter().map(|word| word.as_os_str());
    shell(std::iter::once(OsStr::new("dose3")).chain(given))
}

/// Words as a shell takes them, quoted where it would read something else.
pub fn shell<'a>(words: impl IntoIterator<Item = &'a OsStr>) -> String {
    let quoted = words.into_iter().map(|word| {
        let word = word.to_string_lossy();
        let plain = |c: char| c.is_ascii_alphanumeric() || "_./=:,@%+-".contains(c);
        match !word.is_empty() && word.chars().all(plain) {
            true => word.into_owned(),
            false => format!("'{}'", word.replace('\'', "'\\''")),
        }
    });
    quoted.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_come_back_from_a_shell() {
        let words = ["dose3", "a b", "it's", "", "x=1", "$HOME", "{}_run*"];
        let line = shell(words.map(OsStr::new));
        assert_eq!(line, r"dose3 'a b' 'it'\''s' '' x=1 '$HOME' '{}_run*'");
    }
}
