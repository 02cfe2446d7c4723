//! How the computation of a file ended.

use std::fmt::{Display, Formatter, Result};

use serde::{Deserialize, Serialize};

/// The attribute `status` of a file; its words are written by [`Display`] and read by [`Status::of_name`].
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum Status {
    /// It has not ended, or was killed.
    #[default]
    Running,
    /// Everything that was asked for is there.
    Complete,
    /// A signal ended it.
    Interrupted,
    /// It failed, and why.
    Failed(String),
    /// Words of another version, or of a damaged file.
    Other(String),
}

impl Status {
    /// The status that is written so.
    pub fn of_name(name: &str) -> Status {
        match name {
            "running" => Status::Running,
            "complete" => Status::Complete,
            "interrupted" => Status::Interrupted,
            _ => match name.strip_prefix("failed: ") {
                Some(why) => Status::Failed(why.to_owned()),
                None => Status::Other(name.to_owned()),
            },
        }
    }
}

impl Display for Status {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Status::Running => f.write_str("running"),
            Status::Complete => f.write_str("complete"),
            Status::Interrupted => f.write_str("interrupted"),
            Status::Failed(why) => write!(f, "failed: {why}"),
            Status::Other(name) => f.write_str(name),
        }
    }
}

impl From<String> for Status {
    fn from(name: String) -> Self {
        Status::of_name(&name)
    }
}

impl From<Status> for String {
    fn from(status: Status) -> Self {
        status.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_status_is_read_as_it_was_written() {
        for status in [
            Status::Running,
            Status::Complete,
            Status::Interrupted,
            Status::Failed("no orbit: none".into()),
            Status::Other("".into()),
        ] {
            assert_eq!(Status::of_name(&status.to_string()), status);
        }
        assert_eq!(serde_json::to_string(&Status::Complete).unwrap(), "\"complete\"");
    }
}
