//! Contact of bodies from matrices: the rows that face the obstacle of each table.

use super::counted::Counted;
use super::nodes::{DirectionKey, NodesKey};
use super::number::Check;
use super::{Contact, ContactMethod, Field, Issue, Obstacle, RedistributedMass, Scene, StressKey};

/// What faces an obstacle of a body of matrices.
#[derive(Debug, Clone, Default)]
pub struct Given {
    /// The contact displacements, as rows of the matrices counted from 0, positive towards the obstacle.
    pub displacements: Option<Vec<usize>>,
    /// In their place nodes, and the direction of the obstacle from them.
    pub(super) nodes: Option<NodesKey>,
    pub(super) direction: Option<DirectionKey>,
    /// Gaps, one number a contact displacement.
    pub gaps: Option<Vec<f64>>,
    /// What each contact displacement is counted against, where bodies meet.
    pub against: Option<Vec<Counted>>,
    /// The displacements along the obstacle, as rows of the matrices, one a contact displacement.
    pub tangents: Option<Vec<usize>>,
    /// What these are counted against.
    pub tangents_against: Option<Vec<Counted>>,
}

impl Given {
    /// Its contact displacements.
    pub fn rows(&self) -> &[usize] {
        self.displacements.as_deref().unwrap_or_default()
    }

    /// The key that names them.
    pub(crate) fn key(&self) -> &'static str {
        if self.by_nodes() { "nodes" } else { "displacements" }
    }

    /// Whether these were given by nodes.
    pub(crate) fn by_nodes(&self) -> bool {
        self.nodes.is_some()
    }

    /// Its first key.
    pub(super) fn first(&self) -> Option<&'static str> {
        let all = [
            ("gaps", self.gaps.is_some()),
            ("displacements", self.displacements.is_some()),
            ("direction", self.direction.is_some()),
            ("against", self.against.is_some()),
            ("tangents", self.tangents.is_some()),
            ("tangents_against", self.tangents_against.is_some()),
        ];
        all.into_iter().find(|key| key.1).map(|key| key.0)
    }
}

impl Contact {
    /// The contact displacements of a body of matrices: those of the first table, then of the next.
    pub fn displacements(&self) -> Vec<usize> {
        self.obstacles.iter().flat_map(|o| o.given.rows()).copied().collect()
    }

    /// The displacements of a body of matrices along rough obstacles, likewise.
    pub fn tangents(&self) -> Vec<usize> {
        let rough = self.obstacles.iter().filter(|o| o.coefficient().is_some());
        rough.filter_map(|o| o.given.tangents.as_ref()).flatten().copied().collect()
    }

    /// Whether contact displacements of matrices were given by nodes.
    pub fn by_nodes(&self) -> bool {
        self.obstacles.iter().any(|o| o.given.by_nodes())
    }
}

impl Scene {
    /// Contact of a body from matrices.
    pub(super) fn check_given_contact(&self) -> Check {
        let Some(c) = &self.contact else { return Ok(()) };
        for (k, obstacle) in c.obstacles.iter().enumerate() {
            self.check_given_obstacle(c, (k, obstacle))?;
        }
        let issue =
            |key: &str, message: &str, help: &str| Err(Issue::new(c.key(0, key), message, help));
        if c.motion.is_some() {
            return issue(
                "motion",
                "needs a body of elements: what moves with the obstacle follows from its shape",
                "remove it",
            );
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
        if c.has_pairs() && !c.is_reaction() {
            let message = "bodies that meet take nodal reactions";
            let help = "remove stress, n_c and n_o, or give stress = \"reaction\"";
            return issue(if c.stress.is_some() { "stress" } else { "n_c" }, message, help);
        }
        if !self.rows.turned.iter().all(|t| t.is_flip()) && !c.is_reaction() {
            let message = "a stress by rows of the files does not know displacements that were turned to an oblique direction";
            let help = "remove stress, n_c and n_o, or give stress = \"reaction\"";
            return issue(if c.stress.is_some() { "stress" } else { "n_c" }, message, help);
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

    /// One table of it.
    fn check_given_obstacle(&self, c: &Contact, (k, o): (usize, &Obstacle)) -> Check {
        let issue =
            |key: &str, message: &str, help: &str| Err(Issue::new(c.key(k, key), message, help));
        if o.plane.is_some() {
            return issue("plane", "needs a body of elements", "give gap, or gaps");
        }
        if let Some((_, portion)) = &o.portion {
            portion.check(self, &|name| c.key(k, name))?;
        }
        let given = &o.given;
        let count = given.rows().len();
        if count == 0 {
            return issue(
                "displacements",
                "is missing",
                "displacements = [66, 67], rows of the matrices counted from 0; or nodes and direction",
            );
        }
        match (&o.gap, &given.gaps) {
            (Some(Field::Constant(_)), None) | (None, Some(_)) => {}
            (Some(Field::Expression { .. }), None) if o.swings.is_some() => {
                let message = "moves in time, which is for bodies of elements";
                return issue("gap", message, "give a number, and [[load]] on the contact rows");
            }
            (Some(Field::Expression { .. }), None) if self.body.deck.is_some() => {}
            (given, list) => {
                let example = format!(
                    "gap = 1.0 for all, or gaps = [{}]: one number a contact displacement",
                    vec!["1.0"; count.min(4)].join(", ") + if count > 4 { ", …" } else { "" }
                );
                let message = match (given, list) {
                    (Some(_), Some(_)) => "stands beside gaps: one of them is enough",
                    (Some(_), None) => {
                        "is an expression, and a body from matrices has no places without body.deck"
                    }
                    _ => "is missing",
                };
                return issue("gap", message, &example);
            }
        }
        if matches!(o.gap_behind, Some(Field::Expression { .. })) {
            return issue("gap_behind", "give a number, and no expression", "gap_behind = 1.0");
        }
        let Some(against) = &given.against else { return Ok(()) };
        if against.len() != count {
            let message = format!("{} entries for {count} contact displacements", against.len());
            let help = "give a row, or a list of [row, weight], for each";
            return issue("against", &message, help);
        }
        if o.gap_behind.is_some() {
            let message = "is that of a rigid obstacle, and these displacements meet others";
            return issue("gap_behind", message, "remove it");
        }
        Ok(())
    }

    /// Springs at displacements of a body of matrices.
    fn check_given_springs(&self, c: &Contact) -> Check {
        let issue =
            |key: &str, message: &str, help: &str| Err(Issue::new(c.key(0, key), message, help));
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
        for (key, given) in [("n_c", c.n_c.is_some()), ("n_o", c.n_o.is_some())] {
            if given {
                return issue(key, "is not read: springs push at displacements", "remove it");
            }
        }
        Ok(())
    }
}
