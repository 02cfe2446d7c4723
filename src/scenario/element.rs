//! `[[spring]]`, `[[damper]]`, `[[mass]]`: elements at nodes, along the displacement of one end, or between two.

use schemars::JsonSchema;
use serde::Deserialize;

use super::number::{Check, finite, length, positive};
use super::side::side;
use super::{BodyKind, Edge, Issue, Scene};

/// One end of an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum End<'s> {
    /// The mean displacement `∫u/|Γ|` of a group of sides, or each of its nodes.
    Group(&'s str),
    /// The node nearest to a place.
    At(&'s [f64]),
    /// A row of given matrices.
    Row(usize),
}

impl<'s> End<'s> {
    fn of(group: Option<&'s str>, at: &'s Option<Vec<f64>>, row: Option<usize>) -> Option<End<'s>> {
        group.map(End::Group).or(at.as_deref().map(End::At)).or(row.map(End::Row))
    }
}

/// Where an element is: its ends, and the direction along which it acts.
#[derive(Debug, Clone, Copy)]
pub struct Ends<'s> {
    /// The first end.
    pub from: End<'s>,
    /// The second; the ground if there is none.
    pub to: Option<End<'s>>,
    /// The direction, of any length; none on bars and matrices.
    pub direction: Option<&'s [f64]>,
    /// One at every node of the group, values per area.
    pub each: bool,
}

/// A table of elements at nodes: the keys of its ends, and its own.
macro_rules! table {
    ($(#[$doc:meta])* $name:ident { $($(#[$of_key:meta])* $key:ident: $type:ty,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// The edge of a bar or plate: the element acts on its mean displacement.
            edge: Option<Edge>,
            /// The physical group of a mesh, likewise.
            group: Option<String>,
            /// In their place: where; the element acts on the nearest node. A place further than half an element from the body is refused.
            #[schemars(extend("examples" = [[1.0, 0.25]]))]
            at: Option<Vec<f64>>,
            /// Bodies from matrices: the row, counted from 0.
            row: Option<usize>,
            /// One at every node of the edge or group: values are per area.
            #[serde(default)]
            each: bool,
            /// The second end: an edge or group, by its mean displacement. Without a second end the element leads to the ground.
            to: Option<String>,
            /// The second end: a place.
            to_at: Option<Vec<f64>>,
            /// The second end: a row of the matrices.
            to_row: Option<usize>,
            /// Direction, of any length; bars and matrices need none.
            #[schemars(extend("examples" = [[0.0, 1.0]]))]
            direction: Option<Vec<f64>>,
            $($(#[$of_key])* pub $key: $type,)*
        }

        impl $name {
            /// Where it is.
            pub fn ends(&self) -> Ends<'_> {
                let group = self.edge.map(Edge::name).or(self.group.as_deref());
                Ends {
                    from: End::of(group, &self.at, self.row).unwrap_or(End::Row(0)),
                    to: End::of(self.to.as_deref(), &self.to_at, self.to_row),
                    direction: self.direction.as_deref(),
                    each: self.each,
                }
            }

            fn check_ends(&self, scene: &Scene, table: &str) -> Check {
                let Self { edge, group, at, row, to, to_at, to_row, .. } = self;
                let first = [edge.is_some() || group.is_some(), at.is_some(), row.is_some()];
                let second = [to.is_some(), to_at.is_some(), to_row.is_some()];
                scene.check_counts(table, first, second)?;
                if first[0] {
                    side(scene.body.kind, table, *edge, group.as_ref(), "right")?;
                }
                scene.check_ends(table, &self.ends())
            }
        }
    };
}

table! {
    /// A spring along the displacement `w` of an end, or the difference of two: the force `preload + stiffness·w` against it.
    Spring {
        /// Force over displacement.
        stiffness: f64,
        /// Force at rest, pulling together.
        #[serde(default)]
        preload: f64,
    }
}

table! {
    /// A viscous damper, likewise: the force `viscosity·ẇ` against the displacement.
    Damper {
        /// Force over velocity.
        viscosity: f64,
    }
}

table! {
    /// A mass that moves with the displacement of an end; between two, an inerter: the force `mass·ẅ`.
    Mass {
        /// Mass.
        mass: f64,
    }
}

impl Scene {
    /// Whether there are elements at nodes.
    pub fn has_elements(&self) -> bool {
        !(self.springs.is_empty() && self.dampers.is_empty() && self.masses.is_empty())
    }

    /// Where all elements at nodes are, with the names of their tables.
    pub(crate) fn all_ends(&self) -> impl Iterator<Item = (String, Ends<'_>)> {
        let springs = self.springs.iter().enumerate();
        let springs = springs.map(|(i, e)| (format!("spring[{i}]"), e.ends()));
        let dampers = self.dampers.iter().enumerate();
        let dampers = dampers.map(|(i, e)| (format!("damper[{i}]"), e.ends()));
        let masses = self.masses.iter().enumerate();
        let masses = masses.map(|(i, e)| (format!("mass[{i}]"), e.ends()));
        springs.chain(dampers).chain(masses)
    }

    pub(super) fn check_elements(&self) -> Check {
        for (i, spring) in self.springs.iter().enumerate() {
            let table = format!("spring[{i}]");
            spring.check_ends(self, &table)?;
            positive(&format!("{table}.stiffness"), spring.stiffness)?;
            finite(&format!("{table}.preload"), spring.preload)?;
        }
        for (i, damper) in self.dampers.iter().enumerate() {
            let table = format!("damper[{i}]");
            damper.check_ends(self, &table)?;
            positive(&format!("{table}.viscosity"), damper.viscosity)?;
        }
        for (i, mass) in self.masses.iter().enumerate() {
            let table = format!("mass[{i}]");
            mass.check_ends(self, &table)?;
            positive(&format!("{table}.mass"), mass.mass)?;
        }
        Ok(())
    }

    /// One first end, at the most one second.
    fn check_counts(&self, table: &str, first: [bool; 3], second: [bool; 3]) -> Check {
        let count = |of: [bool; 3]| of.into_iter().filter(|x| *x).count();
        let side = self.body.kind.side_key();
        let example = match self.body.kind {
            BodyKind::Matrices => "row = 0".to_owned(),
            _ => format!("{side} = \"right\", or at = {}", self.example(["[1.0]", "[1.0, 0.0]", "[1.0, 0.0, 0.0]"])),
        };
        match (count(first), count(second)) {
            (0, _) => Err(Issue::new(table, "does not say where it is", example)),
            (1, 0 | 1) => Ok(()),
            (1, _) => {
                let message = "has several second ends";
                Err(Issue::new(table, message, "give one of to, to_at, to_row, or none: the ground"))
            }
            _ => Err(Issue::new(table, "has several first ends", format!("give one: {example}"))),
        }
    }

    fn check_ends(&self, table: &str, ends: &Ends) -> Check {
        let key = |name: &str| format!("{table}.{name}");
        let of_matrices = self.body.kind == BodyKind::Matrices;
        for (end, prefix) in [(Some(ends.from), ""), (ends.to, "to_")] {
            match end {
                Some(End::Row(_)) if !of_matrices => {
                    let message = "is one of matrices, and this body has nodes";
                    let help = "give edge, group or at";
                    return Err(Issue::new(key(&format!("{prefix}row")), message, help));
                }
                Some(End::Group(_)) if of_matrices => {
                    let message = "is a group of sides, and this body comes from matrices";
                    return Err(Issue::new(key("to"), message, "give to_row"));
                }
                Some(End::At(_)) if of_matrices => {
                    let message = "is a place, and this body comes from matrices";
                    let help = format!("give {prefix}row");
                    return Err(Issue::new(key(&format!("{prefix}at")), message, help));
                }
                Some(End::At(at)) => {
                    let example = self.example(["[1.0]", "[1.0, 0.0]", "[1.0, 0.0, 0.0]"]);
                    length(&key(&format!("{prefix}at")), at.len(), self.dim(), example)?;
                    at.iter().try_for_each(|x| finite(&key(&format!("{prefix}at")), *x))?;
                }
                _ => {}
            }
        }
        if ends.each && !matches!((ends.from, ends.to), (End::Group(_), None)) {
            let message = "is one element at every node of an edge or group, each to the ground";
            return Err(Issue::new(key("each"), message, "give edge or group, and no second end"));
        }
        match ends.direction {
            Some(_) if of_matrices => {
                let message = "belongs to a body of elements: a row has its own";
                Err(Issue::new(key("direction"), message, "remove it"))
            }
            Some(d) => {
                let example = self.example(["[1.0]", "[0.0, 1.0]", "[0.0, 0.0, 1.0]"]);
                length(&key("direction"), d.len(), self.dim(), example)?;
                d.iter().try_for_each(|x| finite(&key("direction"), *x))?;
                let size = d.iter().fold(0.0f64, |m, x| m.hypot(*x));
                positive(&key("direction"), size)
            }
            None if of_matrices || self.dim() == 1 => Ok(()),
            None => {
                let example = self.example(["", "direction = [0.0, 1.0]", "direction = [0.0, 0.0, 1.0]"]);
                Err(Issue::new(key("direction"), "is missing", example))
            }
        }
    }
}
