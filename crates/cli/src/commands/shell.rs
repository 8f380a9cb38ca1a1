//! `dose3 completions` and `dose3 man`

use crate::args::{Args, Completions, Man};
use crate::output_file::{Kind, OutputFile};
use crate::terminal::{count, print, say};
use anyhow::Result;
use clap::CommandFactory;

/// Pages of an earlier version.
const PAGE: Kind = Kind {
    name: "manual page",
    begins: |start| start.starts_with(b".ie") || start.starts_with(b".TH"),
};

pub fn completions(args: &Completions) -> Result<()> {
    let mut bytes = Vec::new();
    clap_complete::generate(args.shell, &mut Args::command(), "dose3", &mut bytes);
    print(&String::from_utf8(bytes)?)
}

pub fn man(args: &Man) -> Result<()> {
    let pages = pages()?;
    let file = |(name, page): (String, Vec<u8>)| {
        let path = args.folder.join(format!("{name}.1"));
        Ok((OutputFile::new(&path, PAGE, args.force)?, page))
    };
    let files: Vec<(OutputFile, Vec<u8>)> = pages.into_iter().map(file).collect::<Result<_>>()?;
    for (file, page) in &files {
        file.save(page)?;
    }
    say(&format!(
        "wrote {} to {}",
        count(files.len(), "page"),
        args.folder.display()
    ));
    Ok(())
}

/// A page for the program and one for each subcommand, with its name.
fn pages() -> Result<Vec<(String, Vec<u8>)>> {
    let mut command = Args::command();
    // Only then subcommands know their full names.
    command.build();
    let subcommands = command
        .get_subcommands()
        .filter(|sub| sub.get_name() != "help");
    std::iter::once(&command)
        .chain(subcommands)
        .map(|command| {
            let name = command
                .get_display_name()
                .unwrap_or_else(|| command.get_name())
                .to_owned();
            let mut page = Vec::new();
            clap_mangen::Man::new(command.clone()).render(&mut page)?;
            Ok((name, page))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::ValueEnum;
    use clap_complete::Shell;

    #[test]
    fn every_subcommand_has_a_page_with_its_flags_and_examples() {
        let pages = pages().unwrap();
        let names: Vec<&str> = pages.iter().map(|(name, _)| name.as_str()).collect();
        for name in ["dose3", "dose3-fit", "dose3-score", "dose3-man"] {
            assert!(names.contains(&name), "{names:?}");
        }
        let page = pages
            .iter()
            .find(|(name, _)| name == "dose3-score")
            .unwrap();
        let text = String::from_utf8(page.1.clone()).unwrap();
        assert!((PAGE.begins)(&page.1), "{}", &text[..60]);
        for part in [".SH NAME", "detector", "junit", "trusted.dose3 drive.txt"] {
            assert!(text.contains(part), "{part}\n{text}");
        }
    }

    #[test]
    fn every_shell_is_told_of_the_subcommands() {
        for shell in Shell::value_variants() {
            let mut bytes = Vec::new();
            clap_complete::generate(*shell, &mut Args::command(), "dose3", &mut bytes);
            let text = String::from_utf8(bytes).unwrap();
            assert!(
                text.contains("score") && text.contains("detector"),
                "{shell}"
            );
        }
    }
}
