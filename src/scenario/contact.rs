//! `[contact]`: the obstacle, the contact method and its parameters.

use serde::de::{self, Deserializer, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};

use super::check::{Check, finite, positive};
use super::{BodyKind, Edge, Field, Issue, MassKind, Scene};

/// `[contact]`: a rigid, frictionless obstacle before an edge.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// The edge (not for kind `matrices`).
    pub edge: Option<Edge>,
    /// Distance to the obstacle along the outward normal.
    pub gap: Option<Field>,
    /// The same, one number a contact displacement (kind `matrices`).
    pub gaps: Option<Vec<f64>>,
    /// The contact displacements, as rows of the matrices counted from 0, positive towards the obstacle (kind `matrices`).
    pub displacements: Option<Vec<usize>>,
    /// File of `N_C` (kind `matrices`), `n_C × n_C` in the order of `displacements`.
    pub n_c: Option<String>,
    /// File of `N_O`, `n_C × n_O`, the other displacements in their order.
    pub n_o: Option<String>,
    /// `G`: consistent or lumped.
    #[serde(default)]
    pub boundary_mass: MassKind,
    /// How contact is modelled.
    #[serde(default)]
    pub method: ContactMethod,
    /// `nbm`: where the pressure comes from.
    pub stress: Option<StressKey>,
    /// `nbm`: the mass of the phases.
    pub inertia: Option<Inertia>,
    /// `mass-redistribution`: which mass.
    pub mass: Option<RedistributedMass>,
    /// `penalty`: stiffness over `E′/h` (1 by default); of kind `matrices` that of a spring at each contact displacement.
    pub stiffness: Option<f64>,
    /// `nitsche`: stiffness over `E′/h`, 2 by default.
    pub gamma: Option<f64>,
    /// `nitsche`: 1 (symmetric), 0 or −1.
    pub theta: Option<f64>,
    /// `impact`, `moreau-jean`: `e` in `[0, 1]`, 0 by default.
    pub restitution: Option<f64>,
    /// `moreau-jean`: time step, a tenth of the time of a wave over an element by default.
    pub step: Option<f64>,
    /// `waves`: when contact is decided.
    pub instants: Option<Instants>,
    /// `moreau-jean`: which points are pushed over a step.
    pub activation: Option<Activation>,
    /// `penalty`, `nitsche`: distance to a second obstacle behind, against the outward normal.
    pub gap_behind: Option<Field>,
    /// The obstacle moves: `amplitude cos(ωt + phase)` is added to the gap.
    pub motion: Option<Motion>,
}

/// The harmonic part of a gap.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// Amplitude along the outward normal: away from the body.
    pub amplitude: f64,
    /// Circular frequency.
    pub omega: f64,
    /// Phase.
    #[serde(default)]
    pub phase: f64,
}

/// Contact methods.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ContactMethod {
    /// The nodal boundary method.
    #[default]
    #[serde(rename = "nbm")]
    NodalBoundary,
    /// No inertia at the contact points: `nbm` with nodal reactions and a constant mass.
    MassRedistribution,
    /// Springs at the contact points.
    Penalty,
    /// Nitsche's method.
    Nitsche,
    /// Newton's law of impact.
    Impact,
    /// The time-stepping scheme of Moreau and Jean.
    MoreauJean,
    /// Waves along the characteristics of a uniform bar.
    Waves,
}

impl ContactMethod {
    /// All methods.
    pub const ALL: [ContactMethod; 7] = [
        ContactMethod::NodalBoundary,
        ContactMethod::MassRedistribution,
        ContactMethod::Penalty,
        ContactMethod::Nitsche,
        ContactMethod::Impact,
        ContactMethod::MoreauJean,
        ContactMethod::Waves,
    ];

    /// Whether a key of `[contact]` is read by this method; what is no key of a method is read by all.
    pub fn reads(self, key: &str) -> bool {
        METHOD_KEYS.iter().all(|(name, by)| *name != key || by.contains(&self))
    }

    /// Name in a scene.
    pub fn name(self) -> &'static str {
        match self {
            ContactMethod::NodalBoundary => "nbm",
            ContactMethod::MassRedistribution => "mass-redistribution",
            ContactMethod::Penalty => "penalty",
            ContactMethod::Nitsche => "nitsche",
            ContactMethod::Impact => "impact",
            ContactMethod::MoreauJean => "moreau-jean",
            ContactMethod::Waves => "waves",
        }
    }
}

/// Keys of `[contact]` that some methods read and others do not.
pub const METHOD_KEYS: [(&str, &[ContactMethod]); 12] = {
    use ContactMethod::{
        Impact, MassRedistribution, MoreauJean, Nitsche, NodalBoundary, Penalty, Waves,
    };
    [
        ("stress", &[NodalBoundary]),
        ("inertia", &[NodalBoundary]),
        ("boundary_mass", &[NodalBoundary]),
        ("mass", &[MassRedistribution]),
        ("stiffness", &[Penalty]),
        ("gamma", &[Nitsche]),
        ("theta", &[Nitsche]),
        ("restitution", &[Impact, MoreauJean]),
        ("step", &[MoreauJean]),
        ("instants", &[Waves]),
        ("activation", &[MoreauJean]),
        ("gap_behind", &[Penalty, Nitsche]),
    ]
};

/// `inertia`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Inertia {
    /// The paper's mass, which jumps at switches.
    Paper,
    /// The open phase's mass in every phase.
    Constant,
}

/// `instants` of `waves`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Instants {
    /// Where contact closes and opens.
    Exact,
    /// Once an element's travel time: the wave finite element method.
    Step,
}

/// `activation` of `moreau-jean`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Activation {
    /// Those whose gap closes within half a step.
    HalfStep,
    /// Those that come closer and whose gap closes within the step.
    FullStep,
}

/// `mass` of mass redistribution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RedistributedMass {
    /// `A_∅ᵀ M A_∅`.
    Condensed,
    /// Nearest to `M` with all moments kept.
    Optimal,
}

/// `stress`: a name, or (kind `matrices`) the terms `[displacement, coefficient]` of each contact stress.
#[derive(Debug, Clone, PartialEq)]
pub enum StressKey {
    /// The stress of the displacement field.
    Projection,
    /// The mean of the stresses in the elements at a node.
    NodalMean,
    /// The nodal reaction.
    Reaction,
    /// A nodal operator.
    Terms(Vec<Vec<(usize, f64)>>),
}

impl<'de> Deserialize<'de> for StressKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Words;
        impl<'de> Visitor<'de> for Words {
            type Value = StressKey;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("\"projection\", \"nodal-mean\", \"reaction\", or lists of [displacement, coefficient]")
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<StressKey, E> {
                match word {
                    "projection" => Ok(StressKey::Projection),
                    "nodal-mean" => Ok(StressKey::NodalMean),
                    "reaction" => Ok(StressKey::Reaction),
                    _ => Err(E::unknown_variant(word, &["projection", "nodal-mean", "reaction"])),
                }
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<StressKey, A::Error> {
                let mut all = vec![];
                while let Some(terms) = seq.next_element()? {
                    all.push(terms);
                }
                Ok(StressKey::Terms(all))
            }
        }
        deserializer.deserialize_any(Words)
    }
}

impl Contact {
    /// Whether the pressure is the nodal reaction.
    pub fn is_reaction(&self) -> bool {
        self.method == ContactMethod::MassRedistribution || self.stress == Some(StressKey::Reaction)
    }

    /// The keys that a method does not read.
    fn check_method(&self) -> Check {
        let is_lumped = self.boundary_mass == MassKind::Lumped;
        let has = |key: &str| match key {
            "stress" => self.stress.is_some(),
            "inertia" => self.inertia.is_some(),
            "boundary_mass" => is_lumped,
            "mass" => self.mass.is_some(),
            "stiffness" => self.stiffness.is_some(),
            "gamma" => self.gamma.is_some(),
            "theta" => self.theta.is_some(),
            "restitution" => self.restitution.is_some(),
            "step" => self.step.is_some(),
            "instants" => self.instants.is_some(),
            "activation" => self.activation.is_some(),
            _ => self.gap_behind.is_some(),
        };
        let unread = |k: &&(&str, &[ContactMethod])| has(k.0) && !k.1.contains(&self.method);
        if let Some((key, by)) = METHOD_KEYS.iter().find(unread) {
            let names: Vec<_> = by.iter().map(|m| format!("\"{}\"", m.name())).collect();
            let (name, names) = (self.method.name(), names.join(" and "));
            let message = format!("is not read by method = \"{name}\"; it belongs to {names}");
            return Err(Issue::new(format!("contact.{key}"), message, "remove the key"));
        }
        let is_mean = self.stress == Some(StressKey::NodalMean);
        if (self.is_reaction() || is_mean) && is_lumped {
            let message = "is not read: nodal reactions and means need no boundary mass";
            return Err(Issue::new("contact.boundary_mass", message, "remove the key"));
        }
        self.stiffness.map_or(Ok(()), |k| positive("contact.stiffness", k))?;
        self.gamma.map_or(Ok(()), |k| positive("contact.gamma", k))?;
        self.step.map_or(Ok(()), |k| positive("contact.step", k))?;
        if let Some(e) = self.restitution.filter(|e| !(0.0..=1.0).contains(e)) {
            let message = format!("is {e}");
            return Err(Issue::new("contact.restitution", message, "give a number from 0 to 1"));
        }
        match self.theta {
            None | Some(1.0 | 0.0 | -1.0) => Ok(()),
            Some(theta) => {
                let message = format!("is {theta}");
                Err(Issue::new("contact.theta", message, "give 1 (symmetric), 0 or -1"))
            }
        }
    }

    /// Whether contact displacements are among those that move by themselves.
    pub fn moves_contact(&self) -> bool {
        self.has_springs() || self.has_impacts()
    }

    /// Whether velocities jump by a law of impact.
    pub fn has_impacts(&self) -> bool {
        use ContactMethod::{Impact, MoreauJean, Waves};
        matches!(self.method, Impact | MoreauJean | Waves)
    }

    /// Whether the obstacle pushes like springs at points of the edge.
    pub fn has_springs(&self) -> bool {
        matches!(self.method, ContactMethod::Penalty | ContactMethod::Nitsche)
    }
}

impl Scene {
    pub(super) fn check_contact(&self) -> Check {
        let Some(c) = &self.contact else { return Ok(()) };
        c.check_method()?;
        if self.body.kind == BodyKind::Matrices {
            return self.check_given_contact();
        }
        for (key, given) in [
            ("gaps", c.gaps.is_some()),
            ("displacements", c.displacements.is_some()),
            ("n_c", c.n_c.is_some()),
            ("n_o", c.n_o.is_some()),
            ("stress", matches!(c.stress, Some(StressKey::Terms(_)))),
        ] {
            if given {
                let message = "belongs to body.kind = \"matrices\"";
                return Err(Issue::new(format!("contact.{key}"), message, "give edge and gap"));
            }
        }
        if c.gap.is_none() {
            return Err(Issue::new(
                "contact.gap",
                "is missing",
                "gap = 1.0, or an expression of x and y",
            ));
        }
        if let Some(m) = &c.motion {
            finite("contact.motion.amplitude", m.amplitude)?;
            positive("contact.motion.omega", m.omega)?;
            finite("contact.motion.phase", m.phase)?;
        }
        match c.edge {
            Some(edge) => self.check_edge("contact.edge", edge),
            None => Err(Issue::new("contact.edge", "is missing", "edge = \"right\"")),
        }
    }

    fn check_given_contact(&self) -> Check {
        let Some(c) = &self.contact else { return Ok(()) };
        let issue = |key: &str, message: &str, help: &str| {
            Err(Issue::new(format!("contact.{key}"), message, help))
        };
        if c.motion.is_some() {
            return issue(
                "motion",
                "needs a body of elements: what moves with the obstacle follows from its shape",
                "remove it",
            );
        }
        if c.edge.is_some() {
            return issue(
                "edge",
                "there are no edges: the body comes from files",
                "give displacements = [66, 67]",
            );
        }
        if c.displacements.as_ref().is_none_or(Vec::is_empty) {
            return issue(
                "displacements",
                "is missing",
                "displacements = [66, 67], rows of the matrices counted from 0",
            );
        }
        match (&c.gap, &c.gaps) {
            (Some(Field::Constant(_)), None) | (None, Some(_)) => {}
            _ => {
                return issue(
                    "gap",
                    "give a number gap, or a list gaps, and no expression",
                    "gap = 1.0",
                );
            }
        }
        if c.has_springs() {
            return self.check_given_springs(c);
        }
        if c.has_impacts() {
            let message = "needs elements, and this body comes from files";
            return issue("method", message, "give method = \"penalty\" and a stiffness");
        }
        if c.mass == Some(RedistributedMass::Optimal) {
            let message = "needs a mesh: positions decide which moments are kept";
            return issue("mass", message, "give mass = \"condensed\"");
        }
        match (&c.n_c, &c.n_o, &c.stress, c.is_reaction()) {
            (None, None, None | Some(StressKey::Reaction), true) => Ok(()),
            (Some(_), _, _, true) | (_, Some(_), _, true) => issue(
                if c.n_c.is_some() { "n_c" } else { "n_o" },
                "is not read: with nodal reactions the operator is rows of the stiffness matrix",
                "remove n_c and n_o",
            ),
            (Some(_), Some(_), None, _) | (None, None, Some(StressKey::Terms(_)), _) => Ok(()),
            (_, _, Some(StressKey::Projection | StressKey::NodalMean), _) => issue(
                "stress",
                "a stress of the displacement field needs elements, and this body comes from files",
                "give stress = \"reaction\", or n_c and n_o, or lists of [displacement, coefficient]",
            ),
            _ => issue(
                "n_c",
                "the boundary operator is n_c and n_o, or a nodal one as stress",
                "n_c = \"N_C.mtx\", n_o = \"N_O.mtx\", or stress = \"reaction\"",
            ),
        }
    }

    /// Springs at displacements of a body of matrices.
    fn check_given_springs(&self, c: &Contact) -> Check {
        let issue = |key: &str, message: &str, help: &str| {
            Err(Issue::new(format!("contact.{key}"), message, help))
        };
        if c.method == ContactMethod::Nitsche {
            let message =
                "\"nitsche\" needs elements, whose stress it reads, and this body comes from files";
            return issue("method", message, "give method = \"penalty\" and a stiffness");
        }
        if c.stiffness.is_none() {
            let message =
                "is missing: force over penetration of the spring at each contact displacement";
            return issue("stiffness", message, "stiffness = 100.0");
        }
        if matches!(c.gap_behind, Some(Field::Expression { .. })) {
            return issue("gap_behind", "give a number, and no expression", "gap_behind = 1.0");
        }
        for (key, given) in [("n_c", c.n_c.is_some()), ("n_o", c.n_o.is_some())] {
            if given {
                return issue(key, "is not read: springs push at displacements", "remove it");
            }
        }
        Ok(())
    }
}
