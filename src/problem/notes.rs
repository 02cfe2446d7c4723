//! What there is to say of a problem before it is solved: where places of the scene ended up, what of it has no effect.

use crate::contact::System;
use crate::fem::{Body, Material, Reduction, load};
use crate::mesh::{Element, Point, bounds};
use crate::scenario::{LoadKind, Scene};

use super::moving;
use super::places::{Placed, place};

/// What there is to say of a problem.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Notes {
    /// Nodes that places name.
    pub places: Vec<Placed>,
    /// What has no effect, or another one than its words.
    pub warnings: Vec<String>,
}

/// Elements of a wave that a mesh carries.
const RESOLVED: f64 = 6.0;

/// Below this share of what was asked for, what is left is rounding.
const NOTHING: f64 = 1e-12;

/// What of an initial state a reduction may cut off in silence, as a share of its energy.
const CUT: f64 = 1e-12;

fn largest(f: &[f64]) -> f64 {
    f.iter().fold(0.0f64, |m, f| m.max(f.abs()))
}

impl Notes {
    /// A load of which all that acts, or a component, acts on displacements that supports hold. `force` is what is left of it on the others, `of` its
    /// part of an amplitude.
    pub(super) fn held_load(
        &mut self,
        (i, kind): (usize, LoadKind),
        (amplitude, force): (&[f64], &[f64]),
        of: impl Fn(&[f64]) -> Vec<f64>,
    ) {
        let whole = largest(force);
        let parts: Vec<(usize, f64)> = (0..amplitude.len())
            .filter(|&c| amplitude[c] != 0.0)
            .map(|c| {
                let mut alone = vec![0.0; amplitude.len()];
                alone[c] = amplitude[c];
                (c, largest(&of(&alone)))
            })
            .collect();
        let most = parts.iter().fold(0.0f64, |m, p| m.max(p.1));
        if parts.is_empty() {
            return;
        }
        let where_to = "acts on displacements that supports hold, and has no effect";
        if whole <= NOTHING * most {
            self.warnings.push(format!("load[{i}] (\"{}\") {where_to}", kind.name()));
            return;
        }
        for (c, _) in parts.iter().filter(|p| p.1 <= NOTHING * most) {
            let axis = ["x", "y", "z"][*c];
            self.warnings.push(format!(
                "the {axis} component of load[{i}] (\"{}\") {where_to}",
                kind.name()
            ));
        }
    }

    /// A harmonic load whose waves are shorter than six of the mesh's elements (three of second order): it does not carry them.
    pub(super) fn unresolved(&mut self, key: &str, body: &Body, omega: f64) {
        // shear waves are the shortest; of a bar there are others only
        let speed = |m: &Material| match body.mesh.dim() {
            1 => m.wave_speed(),
            _ => (m.young / (2.0 * (1.0 + m.poisson)) / m.density).sqrt(),
        };
        let Some(slowest) = body.materials().iter().map(speed).reduce(f64::min) else { return };
        let length = std::f64::consts::TAU * slowest / omega;
        let size = |e: Element| {
            let [low, high] = bounds(e.nodes.iter().map(|&n| &body.mesh.nodes()[n]));
            let largest = (0..3).map(|c| high[c] - low[c]).fold(0.0, f64::max);
            if e.kind.is_quadratic() { 0.5 * largest } else { largest }
        };
        let largest = body.mesh.elements().map(size).fold(0.0, f64::max);
        if length < RESOLVED * largest {
            self.warnings.push(format!(
                "{key}: waves of this frequency are {:.1} elements long, and a mesh carries those of {RESOLVED} and more: refine it, or lower the frequency",
                length / largest
            ));
        }
    }

    /// An initial field over all nodes that differs from what supports hold: `order` 0 for displacements, 1 for velocities.
    pub(super) fn held_field(
        &mut self,
        (scene, system): (&Scene, &System),
        (key, order): (&str, usize),
        field: &[f64],
    ) {
        let body = &system.body;
        let dim = body.mesh.dim();
        let held = moving::held(scene, system, order);
        let mut worst: Option<(f64, Point, f64, f64)> = None;
        let mut size = largest(&held);
        for (n, &p) in body.mesh.nodes().iter().enumerate() {
            let own = &field[dim * n..dim * (n + 1)];
            size = size.max(largest(own));
            for (d, _) in body.dofs.directions(n).filter(|d| d.1.is_none()) {
                let along = |w: &[f64]| w.iter().zip(&d).map(|(w, d)| w * d).sum::<f64>();
                let (given, has) = (along(own), along(&held[dim * n..dim * (n + 1)]));
                let off = (given - has).abs();
                if worst.is_none_or(|w| off > w.0) {
                    worst = Some((off, p, given, has));
                }
            }
        }
        let Some((off, p, given, has)) = worst.filter(|w| w.0 > 1e-9 * size) else { return };
        self.warnings.push(format!(
            "{key} contradicts a support by up to {off:.3e}: at the node {} it gives {given:.6}, and the support holds {has:.6}; the support wins",
            place(p, scene.dim())
        ));
    }

    /// What a reduction cuts off an initial state of displacements and velocities, over their energy.
    pub(super) fn cut_off(&mut self, body: &Body, reduction: &Reduction, state: [&[f64]; 2]) {
        let n_o = body.dofs.n_o;
        let of =
            [(&body.stiffness, "elastic", "displacement"), (&body.mass, "kinetic", "velocity")];
        for (x, (matrix, energy, what)) in state.into_iter().zip(of) {
            let kept = reduction.expand(&reduction.project(x));
            let square = |x: Vec<f64>| {
                let mut full = x;
                full.resize(body.dofs.n(), 0.0);
                matrix.quadratic(&full)
            };
            let lost = square(x.iter().zip(&kept).map(|(x, k)| x - k).collect());
            let whole = square(x[..n_o].to_vec());
            if lost > CUT * whole {
                self.warnings.push(format!(
                    "[reduction] cuts {:.2e} of the {energy} energy off the initial {what}",
                    lost / whole
                ));
            }
        }
    }
}

/// The load of a kind that has one vector of components, for an amplitude.
pub(super) fn of_components(
    system: &System,
    (kind, group, node): (LoadKind, &str, usize),
    amplitude: &[f64],
) -> Option<Vec<f64>> {
    match kind {
        LoadKind::Gravity => Some(system.gravity(amplitude)),
        LoadKind::Traction => Some(load::traction(&system.body, group, amplitude)),
        LoadKind::Point => Some(load::point(&system.body, node, amplitude)),
        _ => None,
    }
}
