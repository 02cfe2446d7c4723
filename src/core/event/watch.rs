//! What is watched of a motion: the forces of contact groups, supports and springs, and what probes see, as one list of numbers a state.

use std::sync::Arc;

use super::observer::Sample;
use crate::contact::{Bearings, Resultants, System};
use crate::fem::{Body, Loads, Probe, Quantity};

/// One of the numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Watched {
    /// `contact`, `support`, `spring` or `probe`.
    pub kind: &'static str,
    /// What it is: `force`, `support`, `spring`, or the quantity of a probe.
    pub quantity: &'static str,
    /// The axis, or the component of a stress; none of a force as a whole, and of rows whose direction nobody knows.
    pub component: Option<&'static str>,
    /// The group, the spring or the probe.
    pub name: String,
}

impl Watched {
    /// As columns of tables are called: `force_x[right]`.
    pub fn label(&self) -> String {
        label(self.quantity, self.component, &self.name)
    }
}

/// As columns of tables are called.
pub fn label(quantity: &str, component: Option<&str>, name: &str) -> String {
    match component {
        Some(component) => format!("{quantity}_{component}[{name}]"),
        None => format!("{quantity}[{name}]"),
    }
}

/// What is watched of the motions of a body.
#[derive(Debug, Clone)]
pub struct Watch {
    /// The body.
    pub body: Arc<Body>,
    /// The loads, for what of them goes straight into supports, and for what moves.
    pub loads: Arc<Loads>,
    /// What adds up the pressures of groups.
    pub resultants: Resultants,
    /// What adds up the forces of supports and springs.
    pub bearings: Arc<Bearings>,
    /// What is looked at besides.
    pub probes: Arc<[Probe]>,
}

impl Watch {
    /// Of a body under its loads, of the frequency that they have now.
    pub fn new(system: &System) -> Watch {
        Watch {
            body: system.body.clone(),
            loads: system.loads.clone(),
            resultants: Resultants::new(system),
            bearings: system.bearings.clone(),
            probes: system.probes.clone(),
        }
    }

    /// What the numbers are.
    pub fn all(&self) -> Vec<Watched> {
        let mut all = vec![];
        // rows of given matrices have directions of their own
        let of_rows = self.body.materials().is_empty();
        let forces = [
            ("contact", "force", &self.resultants.names, self.resultants.dim),
            ("support", "support", &self.bearings.supports, self.bearings.dim),
        ];
        for (kind, quantity, names, dim) in forces {
            for name in names {
                let of = |component| Watched { kind, quantity, component, name: name.clone() };
                let axes = ["x", "y", "z"].into_iter().take(dim);
                all.extend(axes.map(|axis| of((!of_rows).then_some(axis))));
                if dim > 1 {
                    all.push(of(None));
                }
            }
        }
        let spring = |name: &String| Watched {
            kind: "spring",
            quantity: "spring",
            component: None,
            name: name.clone(),
        };
        all.extend(self.bearings.springs.iter().map(spring));
        for (probe, quantity) in self.quantities() {
            let of = |component| Watched {
                kind: "probe",
                quantity: quantity.name(),
                component: Some(component),
                name: probe.name.clone(),
            };
            all.extend(probe.components(quantity).into_iter().map(of));
        }
        all
    }

    fn quantities(&self) -> impl Iterator<Item = (&Probe, Quantity)> {
        self.probes.iter().flat_map(|p| p.quantities.iter().map(move |q| (p, *q)))
    }

    /// Whether accelerations are of use.
    pub fn takes_accelerations(&self) -> bool {
        !self.bearings.supports.is_empty()
            || self.quantities().any(|(_, q)| q == Quantity::Acceleration)
    }

    /// The numbers at a state, in the order of [`Watch::all`]; not numbers where they need accelerations, and there are none.
    pub fn at(&self, s: &Sample) -> Vec<f64> {
        let [u, v, a] = s.at_rest(&self.loads);
        let mut all = vec![];
        let mut put = |forces: &[f64], dim: usize| {
            for force in forces.chunks_exact(dim.max(1)) {
                all.extend(force);
                if dim > 1 {
                    all.push(force.iter().fold(0.0f64, |m, x| m.hypot(*x)));
                }
            }
        };
        if !self.resultants.names.is_empty() {
            let [force, _] = self.resultants.of(s.pressure, s.traction, &u);
            put(&force, self.resultants.dim);
        }
        if !self.bearings.is_empty() {
            let borne = self.bearings.of(&self.body, (&self.loads, s.t), [&u, &v, &a]);
            put(&borne.supports, self.bearings.dim);
            put(&borne.springs, 1);
        }
        let moving = (&self.loads.carried, s.t);
        for (probe, quantity) in self.quantities() {
            all.extend(probe.of(quantity, [&u, &v, &a], moving));
        }
        all
    }
}
