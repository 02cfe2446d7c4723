//! The numerics of **signorini**: vibration of elastic bodies in unilateral contact, from a mesh to harmonic balance, without files, words or a command line.
//!
//! A finite-element body with displacements `u = (u_O, u_C) ∈ ℝᴺ` stands before a rigid obstacle (frictionless here; with Coulomb friction: [`contact::Tangent`]);
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
//! [`model`] is the front door. An oscillator of two bar elements:
//!
#![doc = concat!("```\n", include_str!("examples/oscillator.rs"), "\n```")]
//!
//! Matrices of one's own:
//!
#![doc = concat!("```no_run\n", include_str!("examples/matrices.rs"), "\n```")]
//!
//! A contact law of one's own ([`contact::Law`]):
//!
#![doc = concat!("```no_run\n", include_str!("examples/own_law.rs"), "\n```")]
//!
//! A flow by itself ([`flow::Flow`]):
//!
#![doc = concat!("```no_run\n", include_str!("examples/flow.rs"), "\n```")]
//!
//! The modules stand in the order of the data; each uses only what stands before it:
//! [`mesh`], [`fem`], [`contact`], [`flow`], [`event`], [`schemes`], [`records`], [`continuation`], [`orbit`], [`hbm`]; last the front door, [`model`]. What only the
//! program `signorini` asks for (records of its files, its searches and families) is public and not on these pages: it may change with any version.

pub mod contact;
pub mod continuation;
pub mod event;
pub mod fem;
pub mod flow;
pub mod hbm;
pub mod mesh;
pub mod model;
pub mod orbit;
#[doc(hidden)]
pub mod records;
pub mod schemes;
