//! Families of orbits in files: what is asked for, what an earlier run left of it, what is missing, and where to go on.
//!
//! A family is opened ([`open`]) new or to go on with. What is [`Known`] of it are the points of an earlier run that stand: whole
//! steps without a hole. On a grid of frequencies the rest are [`Legs`], onwards from the last point that is known and back
//! from the first; along a branch the continuation goes on from the last place that was kept. [`sequence`] and [`follow`] compute
//! what is missing, by shooting or by harmonic balance, and hand it on point by point; [`check`] examines the points of another program,
//! [`bands`] differentiates the orbits of a family by numbers of its scene, [`conservative`] looks near those of a viscous family, [`damped`] goes from amplitude to amplitude, [`doubling`] beside the period doublings of a response.
//! [`basins`] tells from which states which attractor is reached. [`curves`] follows what is singled out of a response over a number of the scene. [`sweep`] lets a body settle at one frequency after the other, [`diagram`] at one value of a number after the other, [`phase_resonance`] steers its frequency there to a quarter period of lag, [`tori`] follows motions of two frequencies, [`through`] follows the branches through the orbits that it met. [`start`] says where they begin, [`single`] finds one orbit, [`parameters`] are the numbers of a scene that it is differentiated by, [`viscous`] how viscous they are, [`statement`] how far off their energies
//! may be.

pub mod bands;
pub mod bar;
pub mod basins;
pub mod check;
pub mod conservative;
pub mod curves;
pub mod damped;
pub mod diagram;
pub mod doubling;
pub mod follow;
mod known;
mod legs;
pub mod motions;
mod open;
pub mod parameters;
pub mod phase_resonance;
pub mod sequence;
pub mod single;
pub mod start;
pub mod statement;
mod summit;
pub mod sweep;
pub mod through;
pub mod tori;
pub mod viscous;

pub(crate) use known::Known;
pub(crate) use legs::Legs;
pub use open::open;
pub(crate) use open::{Asked, Opened};

use std::path::PathBuf;

use rand_chacha::rand_core::RngCore;
use thiserror::Error;

use crate::contact::{State, System};
use crate::hbm::HbmError;
use crate::orbit::OrbitError;
use crate::records::{BranchEnd, EndReason, OrbitRecord};
use crate::store::StoreError;

/// A family cannot be opened, or a branch of it not computed.
#[derive(Debug, Error)]
pub enum FamilyError {
    /// The file is that of a run that did not end.
    #[error("{} was begun by an earlier run that did not end: go on with --resume, or start anew with --force", .0.display())]
    Unfinished(PathBuf),
    /// What is there is another family.
    #[error("{} cannot be gone on with: {why}; give the same command again, or another -o", path.display())]
    Another {
        /// The file.
        path: PathBuf,
        /// What differs.
        why: String,
    },
    /// What is there does not fit the body.
    #[error("{}: {what}", path.display())]
    Misfit {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        what: String,
    },
    /// A place to go on from does not fit the body.
    #[error("the place that the earlier run left does not fit the body: damaged")]
    Place,
    /// The unknowns of harmonic balance by arclength do not hold a body that is free.
    #[error(
        "harmonic balance by arclength has the interface as its unknowns, which does not hold a body that can move rigidly: leave \
         --follow arclength out, or shoot"
    )]
    Free,
    /// So many attractors that there is a family of them.
    #[error(
        "more than {} attractors: a family of them, or a range in which the body does not settle; give a smaller box, or another frequency",
        .0 - 1
    )]
    Many(usize),
    /// No guess leads to an orbit.
    #[error("no orbit to start from: {0}")]
    NoStart(String),
    /// The file.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The orbits.
    #[error(transparent)]
    Orbit(#[from] OrbitError),
    /// The solutions of harmonic balance.
    #[error(transparent)]
    Hbm(#[from] HbmError),
}

/// The end of a branch.
fn ended(branch: usize, reason: EndReason, text: impl Into<String>, complete: bool) -> BranchEnd {
    BranchEnd { branch, reason, text: text.into(), complete, peaks: vec![] }
}

/// The state of an orbit as a family keeps it, in the coordinates of its body.
fn state_of(system: &System, orbit: &OrbitRecord) -> State {
    let n_o = system.body.nodal_dofs().n_o;
    let of = |x: &[f64]| system.body.coordinates(&x[..n_o]).into_owned();
    State { u: of(&orbit.u0), v: of(&orbit.v0) }
}

/// The next number from 0 to 1 of a generator, of 53 bits.
fn uniform(generator: &mut impl RngCore) -> f64 {
    (generator.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Numbers of so many things, as one.
fn digest<'x>(count: usize, numbers: impl Iterator<Item = &'x f64>) -> u64 {
    numbers
        .fold(count as u64, |h, x| (h.rotate_left(5) ^ x.to_bits()).wrapping_mul(0x0100_0000_01b3))
}
