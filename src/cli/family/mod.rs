//! What `orbit`, `backbone`, `response` and `crosscheck` share: where results go, frequencies and ranges; branches computed side
//! by side into one file; the summary of a family.

mod jobs;
mod plan;
mod statement;
mod summary;

pub(crate) use jobs::{Carried, Job, carry_out, conclude, run_jobs};
pub(crate) use plan::{
    OF_RESPONSE, at_least_one, check_forced, check_frequency, check_full, check_settle_at,
    check_settles, key, propagator, reduce_if_large, round_number, writer_options,
};
pub use plan::{Output, omega, range};
pub(crate) use statement::state;
pub(crate) use summary::answer;
