//! The program `signorini`; see the library for what it computes.

fn main() -> std::process::ExitCode {
    signorini::cli::main()
}
