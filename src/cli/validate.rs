//! `signorini validate`
use super::{CliError, Global};
use clap::Args;
/// Arguments of `validate`.
#[derive(Debug, Args)]
pub struct Arguments {}
/// x
pub fn run(_: &Arguments, _: &Global) -> Result<(), CliError> {
    Ok(())
}
