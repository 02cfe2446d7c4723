//! The program `signorini`; see the library for what it computes.

mod cli;
#[path = "../validate/mod.rs"]
mod validate;

fn main() -> std::process::ExitCode {
    cli::main()
}
