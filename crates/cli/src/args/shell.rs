//! Arguments of `dose3 completions` and `dose3 man`.

use clap::Args as ClapArgs;
use clap_complete::Shell;
use std::path::PathBuf;

#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:\n  \
    dose3 completions bash > ~/.local/share/bash-completion/completions/dose3\n  \
    dose3 completions zsh > ~/.zfunc/_dose3\n  \
    dose3 completions fish > ~/.config/fish/completions/dose3.fish\n  \
    dose3 completions powershell > dose3.ps1")]
pub struct Completions {
    /// The shell
    #[arg(value_enum, value_name = "SHELL")]
    pub shell: Shell,
}

#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:\n  dose3 man ~/.local/share/man/man1")]
pub struct Man {
    /// Folder for the pages: dose3.1, and one for each subcommand
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Replace what lies there, whatever it is
    #[arg(long)]
    pub force: bool,
}
