//! **signorini**: reference solutions for the vibration of elastic bodies in unilateral contact.
//!
//! A finite-element body with displacements `u = (u_O, u_C) ∈ ℝᴺ` stands before a rigid obstacle;
//! `u_C ∈ ℝ^{n_C}` are the displacements of the contact nodes along the outward normal, `u_O ∈ ℝ^{n_O}` all others, `g ∈ ℝ^{n_C}` the gaps:
//!
//! ```text
//! M ü + C u̇ + K u = f(t) + Gᵀ λ            M, C, K ∈ ℝ^{N×N}, λ ∈ ℝ^{n_C} contact stress (< 0 in compression)
//! λ + max(0, u_C − g − λ) = 0              0 ≤ g − u_C  ⟂  −λ ≥ 0
//! λ = N_C u_C + N_O u_O                    nodal boundary method (NBM)
//! ```
//!
//! The last two give `u_C` from `u_O` through a linear complementarity problem with one solution, piecewise
//! affine: `u_C = A_α u_O + d_α` for the active set α. With `A* = [I; A_α]`, `d* = [0; d_α]` what remains is the nonsmooth
//! ordinary differential equation
//!
//! ```text
//! A*ᵀ ( M A* ü_O + C A* u̇_O + K (A* u_O + d*) − f(t) ) = 0
//! ```
//!
//! with `u_O`, `u̇_O` continuous. Other discretisations of the same contact (nodal reactions for the stress, one mass in every phase: [`contact`]) keep this
//! form: a method is a map from an active set to the data of a linear phase. This crate integrates it from switch to switch of the active set. Source: Urman and
//! Legrand, *Nodal-Boundary Finite-Element Method for the Signorini Problem in Two Dimensions*, IDETC-CIE 2021 (its
//! printed eq. 4 has the sign inside the max reversed).
//!
//! The numerics are a crate of their own, [`signorini_core`]: [`mesh`], [`fem`], [`contact`], [`flow`], [`event`], [`schemes`], [`continuation`], [`orbit`],
//! [`hbm`]. What stands here is the program around them. Its modules stand in the order of the data; each uses only what stands before it:
//! [`scenario`], [`matrices`], [`problem`], [`simulate`], [`records`], [`store`], [`report`], [`families`], [`compare`], [`study`]; last [`cli`], the commands.
//!
//! ```
//! use signorini::{event::Silent, problem::Problem, scenario::Scene, simulate::simulate};
//!
//! let text = std::fs::read_to_string("scenarios/oscillator.toml")?;
//! let scene = Scene::parse(&text, "scenarios/oscillator.toml".as_ref())?;
//! let problem = Problem::new(&scene, None)?;
//! let report = simulate(&scene, &problem, false, &mut Silent)?;
//! assert!(report.outcome.is_complete() && report.energy_drift < 1e-11);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// the command line and the validation cases name the library as its users do
extern crate self as signorini;

pub mod cli;
pub mod compare;
pub mod families;
pub mod matrices;
pub mod problem;
pub mod records;
pub mod report;
pub mod scenario;
pub mod simulate;
pub mod store;
pub mod study;

pub use signorini_core::{contact, continuation, event, fem, flow, hbm, mesh, orbit, schemes};
