//! The checkpoint of a run: a small file beside the HDF5 file, replaced at every flush.
//!
//! It says how many rows of each table belong to it; what the file holds beyond them is computed again when the run goes on.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::StoreError;
use super::output::{beside, checksum, replace};
use crate::contact::States;
use crate::event::{Checkpoint, Evidence, Proof};
use crate::records::bits;

/// A checkpoint as it is kept.
#[derive(Debug, Serialize, Deserialize)]
struct Record {
    problem: u64,
    #[serde(with = "bits::one")]
    t: f64,
    #[serde(with = "bits::many")]
    y: Vec<f64>,
    #[serde(alias = "active")]
    states: States,
    held: Vec<usize>,
    armed: Vec<bool>,
    #[serde(with = "bits::many")]
    recent_t: Vec<f64>,
    recent_node: Vec<usize>,
    #[serde(with = "bits::many")]
    ledger: Vec<f64>,
    #[serde(with = "bits::many")]
    extremes: Vec<f64>,
    #[serde(with = "bits::many")]
    flow: Vec<f64>,
    counts: [usize; 6],
    rows: [usize; 3],
}

/// The name of the checkpoint of a file.
pub(super) fn name_of(path: &Path) -> PathBuf {
    beside(path, ".checkpoint")
}

/// Numbers in the order of the file.
fn extremes(c: &Checkpoint) -> [f64; 10] {
    let s = &c.seen;
    [
        s.largest_u,
        c.potential_start,
        c.last_stored,
        s.gap_error,
        s.max_tension,
        s.proof.violation,
        s.entered,
        s.blows,
        s.largest_v,
        s.proof.state_error,
    ]
}

fn counts(c: &Checkpoint) -> [usize; 6] {
    let p = &c.seen.proof;
    [c.next_sample, c.phases, p.missed, p.uncertified, p.undecided, p.loosened]
}

/// Replace the checkpoint of the file `path`; `problem` is the fingerprint of what is integrated.
pub(super) fn write(path: &Path, problem: u64, c: &Checkpoint) -> Result<(), StoreError> {
    let record = Record {
        problem,
        t: c.t,
        y: c.y.clone(),
        states: c.states.clone(),
        held: c.held.clone(),
        armed: c.armed.clone(),
        recent_t: c.recent.iter().map(|r| r.0).collect(),
        recent_node: c.recent.iter().map(|r| r.1).collect(),
        ledger: c.ledger.to_vec(),
        extremes: extremes(c).to_vec(),
        flow: c.flow.clone(),
        counts: counts(c),
        rows: c.rows,
    };
    let name = name_of(path);
    let text = serde_json::to_string(&record)
        .map_err(|e| StoreError::write(&name, std::io::Error::other(e)))?;
    replace(&name, format!("{:08x} {text}\n", checksum(0, &text)).as_bytes())
}

/// The checkpoint of the file `path` and the fingerprint of its problem.
pub(super) fn read(path: &Path) -> Result<(Checkpoint, u64), StoreError> {
    let name = name_of(path);
    let text = std::fs::read_to_string(&name).map_err(|e| StoreError::unusable(&name, e))?;
    let damaged = || StoreError::unusable(&name, "damaged; start the run anew with --force");
    let (sum, text) = text.trim_end().split_once(' ').ok_or_else(damaged)?;
    if u32::from_str_radix(sum, 16) != Ok(checksum(0, text)) {
        return Err(damaged());
    }
    let r: Record = serde_json::from_str(text).map_err(|_| damaged())?;
    let [next_sample, phases, missed, uncertified, undecided, loosened] = r.counts;
    let [
        largest_u,
        potential_start,
        last_stored,
        gap_error,
        max_tension,
        violation,
        entered,
        blows,
        largest_v,
        state_error,
    ] = r.extremes.try_into().map_err(|_| damaged())?;
    let proof = Proof { missed, uncertified, undecided, loosened, violation, state_error };
    let seen = Evidence { proof, largest_u, largest_v, gap_error, max_tension, entered, blows };
    let checkpoint = Checkpoint {
        t: r.t,
        y: r.y,
        states: r.states,
        held: r.held,
        armed: r.armed,
        recent: r.recent_t.into_iter().zip(r.recent_node).collect(),
        ledger: r.ledger.try_into().map_err(|_| damaged())?,
        seen,
        potential_start,
        last_stored,
        next_sample,
        phases,
        flow: r.flow,
        rows: r.rows,
    };
    Ok((checkpoint, r.problem))
}
