//! `[run]`: how long, and by which integrator.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::number::{Check, positive};
use super::{BodyKind, Edge, Issue, LoadKind, Scene};

/// `[run]`
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// The end of the run, a time.
    pub until: Option<f64>,
    /// Or: number of periods of the load, of the obstacle's motion, or of `[orbit]`.
    pub periods: Option<f64>,
    /// No inertia: a balance at every instant, from that under the loads of the start on. Loads are constant, or go along straight lines between the points of their tables; all switches are exact.
    #[serde(default)]
    pub quasistatic: bool,
    /// The flow of a smooth phase.
    #[serde(default)]
    pub integrator: Integrator,
    /// Runge–Kutta: error of a step, over the largest displacement and velocity so far.
    #[serde(default = "default_rtol")]
    pub rtol: f64,
    /// The same over the scales of the problem (largest gap; gap × frequency): without units.
    #[serde(default = "default_atol")]
    pub atol: f64,
    /// Stored states after the first, evenly spaced; every switch is stored besides.
    #[serde(default = "default_samples")]
    #[schemars(range(min = 1))]
    pub samples: usize,
    /// Whose displacements a stored state holds.
    #[serde(default)]
    #[schemars(extend("default" = "all"))]
    pub store: Store,
    /// Digits in which they are stored.
    #[serde(default)]
    pub precision: Precision,
    /// Most switches a contact node may make within ten shortest natural periods before the run is ended as an accumulation.
    #[serde(default = "default_switch_limit")]
    pub switch_limit: f64,
}

fn default_rtol() -> f64 {
    1e-9
}
fn default_atol() -> f64 {
    1e-12
}
fn default_samples() -> usize {
    400
}
fn default_switch_limit() -> f64 {
    40.0
}

/// Flows of one smooth phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Integrator {
    /// Adaptive Runge–Kutta: Dormand–Prince 5(4).
    Dopri5,
    /// Adaptive Runge–Kutta: Dormand–Prince 8(5,3).
    Dop853,
    /// Exact, by the modes of each active set.
    Modal,
    /// Exact without modes, by Chebyshev series, for large bodies.
    Chebyshev,
    /// Exact where that costs less; the summary tells what it chose.
    #[default]
    Auto,
}

impl Integrator {
    /// The name in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Integrator::Dopri5 => "dopri5",
            Integrator::Dop853 => "dop853",
            Integrator::Modal => "modal",
            Integrator::Chebyshev => "chebyshev",
            Integrator::Auto => "auto",
        }
    }
}

/// Whose displacements a stored state holds.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Store {
    /// The whole body's.
    #[default]
    All,
    /// The contact's.
    Contact,
    /// The contact's and those of groups of sides.
    Groups(Vec<String>),
}

impl JsonSchema for Store {
    fn schema_name() -> Cow<'static, str> {
        "Store".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"anyOf": [
            {"const": "all", "description": "The whole body's."},
            {"const": "contact", "description": "The contact's; large undamped bodies with lumped mass then know energies at some states only."},
            {"type": "array", "items": {"type": "string"}, "description": "The contact's and those of edges or groups."},
        ]})
    }
}

impl<'de> Deserialize<'de> for Store {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Store, D::Error> {
        struct Words;
        const EXPECTED: &str = "\"all\", \"contact\" or a list of groups";
        impl<'de> Visitor<'de> for Words {
            type Value = Store;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str(EXPECTED)
            }
            fn visit_str<E: Error>(self, word: &str) -> Result<Store, E> {
                match word {
                    "all" => Ok(Store::All),
                    "contact" => Ok(Store::Contact),
                    other => {
                        Err(E::unknown_variant(other, &["all", "contact", "a list of groups"]))
                    }
                }
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Store, A::Error> {
                let mut groups = vec![];
                while let Some(name) = list.next_element()? {
                    groups.push(name);
                }
                Ok(Store::Groups(groups))
            }
        }
        deserializer.deserialize_any(Words)
    }
}

/// Digits of stored displacements, velocities and pressures; times, energies and switches have all of theirs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase", expecting = "\"double\" or \"single\"")]
pub enum Precision {
    /// All.
    #[default]
    Double,
    /// Seven.
    Single,
}

impl Scene {
    /// Groups whose displacements are stored, with the key that names each.
    pub(crate) fn stored_groups(&self) -> impl Iterator<Item = (String, &str)> {
        let store = self.run.as_ref().map(|r| &r.store);
        let groups = if let Some(Store::Groups(groups)) = store { &groups[..] } else { &[] };
        groups.iter().enumerate().map(|(i, g)| (format!("run.store[{i}]"), g.as_str()))
    }

    /// On a bar or a plate groups are edges; a body from matrices has none.
    fn check_store(&self) -> Check {
        let known: &[Edge] = match self.body.kind {
            BodyKind::Mesh | BodyKind::Parts => return Ok(()),
            BodyKind::Matrices => &[],
            BodyKind::Bar => &[Edge::Left, Edge::Right],
            BodyKind::Plate => &Edge::ALL,
        };
        let is_known = |group: &str| known.iter().any(|e| e.name() == group);
        let Some((key, group)) = self.stored_groups().find(|(_, g)| !is_known(g)) else {
            return Ok(());
        };
        let names: Vec<String> = known.iter().map(|e| format!("\"{}\"", e.name())).collect();
        let help = match names.is_empty() {
            true => "give store = \"all\" or \"contact\"".to_owned(),
            false => format!("give some of {}", names.join(", ")),
        };
        Err(Issue::new(key, format!("the body has no edge \"{group}\""), help))
    }

    /// What has no meaning without inertia, or is no straight line.
    fn check_quasistatic(&self, r: &Run) -> Check {
        if !r.quasistatic {
            return Ok(());
        }
        let refuse = |key: String, message: &str, help: &str| {
            let message = format!("{message}: [run] quasistatic = true");
            Err(Issue::new(key, message, help))
        };
        if let Some(i) = self.loads.iter().position(|l| l.omega.is_some()) {
            let key = format!("load[{i}].omega");
            let help = "give table = \"path.csv\" with the corners of the path, or a constant load";
            return refuse(key, "loads go along straight lines", help);
        }
        if let Some(i) = self.loads.iter().position(|l| l.kind == LoadKind::Base) {
            let key = format!("load[{i}].kind");
            return refuse(key, "supports stay where they are", "give forces");
        }
        if let Some(c) = self.contact.as_ref().filter(|c| c.moves()) {
            let key = if c.swings() { c.key(0, "gap") } else { "contact.motion".to_owned() };
            let help = "give surface = [0.0, 0.05] with friction, or loads in place of the motion";
            return refuse(key, "obstacles stay where they are", help);
        }
        if self.contact.as_ref().is_some_and(|c| !c.is_reaction()) {
            let message = "balances without a jump are those of nodal reactions";
            let help = "give method = \"mass-redistribution\"";
            return refuse("contact.method".into(), message, help);
        }
        let s = &self.initial;
        let given = s.mode.is_some() || s.displacement.is_some() || s.velocity.is_some();
        if given || s.file.is_some() {
            let help = "remove [initial], or give equilibrium = true";
            return refuse(
                "initial".into(),
                "it begins in balance with the loads of the start",
                help,
            );
        }
        Ok(())
    }

    pub(super) fn check_run(&self) -> Check {
        let Some(r) = &self.run else { return Ok(()) };
        match (r.until, r.periods) {
            (Some(t), None) => positive("run.until", t)?,
            (None, Some(n)) => {
                positive("run.periods", n)?;
                if self.period().is_none() {
                    return Err(Issue::new(
                        "run.periods",
                        "counts periods, and the scene has none",
                        "give until = …, or a load with omega, or [orbit] omega or period",
                    ));
                }
            }
            _ => {
                return Err(Issue::new(
                    "run",
                    "give exactly one of until, periods",
                    "until = 3.36",
                ));
            }
        }
        for (key, v) in [("run.rtol", r.rtol), ("run.atol", r.atol)] {
            positive(key, v)?;
            if v >= 0.1 {
                return Err(Issue::new(key, format!("{v} is no tolerance"), "give 1e-13 to 1e-3"));
            }
        }
        if r.rtol < 1e-14 {
            return Err(Issue::new(
                "run.rtol",
                format!("{} is below rounding error", r.rtol),
                "give at least 1e-14",
            ));
        }
        if r.samples < 1 {
            return Err(Issue::new(
                "run.samples",
                "needs at least one stored state",
                "samples = 400",
            ));
        }
        let measured = self.loads.iter().position(|l| l.table.is_some());
        let exact = matches!(r.integrator, Integrator::Chebyshev | Integrator::Modal);
        if let Some(i) = measured.filter(|_| exact) {
            return Err(Issue::new(
                "run.integrator",
                format!(
                    "{} has no closed form for the measured load[{i}].table",
                    r.integrator.name()
                ),
                "give \"dop853\", \"dopri5\" or \"auto\"",
            ));
        }
        self.check_quasistatic(r)?;
        self.check_store()?;
        positive("run.switch_limit", r.switch_limit)
    }
}
