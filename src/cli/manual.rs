//! `signorini completions`, `signorini man`: what shells and `man` want to know, from the definition of the commands.

use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;
use serde_json::json;

use signorini::store::replace;

use super::{Answer, CliError, Global};

/// Arguments of `completions`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini completions bash > ~/.local/share/bash-completion/completions/signorini\n  signorini completions zsh > ~/.zfunc/_signorini\n  signorini completions fish > ~/.config/fish/completions/signorini.fish"
)]
pub struct Completions {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini man | man -l -\n  signorini man --to ~/.local/share/man/man1"
)]
pub struct Manual {
    /// Write the pages of all commands into a folder, in place of the first page on standard output
    #[arg(long, value_name = "FOLDER")]
    to: Option<PathBuf>,
    /// As Markdown, one page of all commands
    #[arg(long, conflicts_with = "to")]
    markdown: bool,
}

/// Print the completions of a shell.
pub fn completions(arguments: &Completions, mut command: clap::Command) -> Answer {
    let mut out = vec![];
    clap_complete::generate(arguments.shell, &mut command, "signorini", &mut out);
    Answer::text(String::from_utf8_lossy(&out).into_owned())
}

/// Print the first page, or write all.
pub fn manual(
    arguments: &Manual,
    mut command: clap::Command,
    global: &Global,
) -> Result<Answer, CliError> {
    command.build();
    if arguments.markdown {
        return Ok(Answer::text(markdown(&command)));
    }
    let Some(folder) = &arguments.to else {
        let mut out = vec![];
        render(command, "signorini", &mut out)?;
        return Ok(Answer::text(String::from_utf8_lossy(&out).into_owned()));
    };
    let wrong = |e: std::io::Error| CliError::Other(format!("{}: {e}", folder.display()));
    std::fs::create_dir_all(folder).map_err(wrong)?;
    let mut written = vec![];
    for (name, command) in all(&command) {
        let name = name.replace(' ', "-");
        let path = folder.join(format!("{name}.1"));
        let mut out = vec![];
        render(command, &name, &mut out)?;
        replace(&path, &out)?;
        written.push(path.display().to_string());
    }
    Ok(global.answer(|| json!({"written": written}), || written.join("\n") + "\n"))
}

fn render(command: clap::Command, name: &str, out: &mut Vec<u8>) -> Result<(), CliError> {
    clap_mangen::Man::new(command)
        .title(name)
        .render(out)
        .map_err(|e| CliError::Other(e.to_string()))
}

/// A command and those below it, by their whole names.
fn all(command: &clap::Command) -> Vec<(String, clap::Command)> {
    let mut found = vec![(command.get_name().to_owned(), command.clone())];
    for below in command.get_subcommands().filter(|c| c.get_name() != "help") {
        for (name, deeper) in all(below) {
            found.push((format!("{} {name}", command.get_name()), deeper));
        }
    }
    found
}

/// All commands on one page: what `--help` says of each.
fn markdown(command: &clap::Command) -> String {
    let mut out = String::from("# Commands\n");
    for (name, command) in all(command) {
        // as wide as a page
        let mut command = command.bin_name(name.clone()).term_width(100);
        let help = command.render_long_help().to_string();
        let lines: Vec<&str> = help.lines().map(str::trim_end).collect();
        out += &format!("\n## {name}\n\n```text\n{}\n```\n", lines.join("\n").trim());
    }
    out
}
