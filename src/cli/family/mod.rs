//! What `orbit`, `backbone`, `response` and `crosscheck` share: where results go, frequencies and ranges; branches computed side
//! by side into one file; the summary of a family.

mod jobs;
mod plan;
mod summary;

pub use jobs::{Job, carry_out, conclude, run_jobs};
pub use plan::{
    Output, at_least_one, check_frequency, check_full, omega, propagator, range, round_number,
    writer_options,
};
pub use summary::answer;
