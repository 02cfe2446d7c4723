//! `[[spring]]`, `[[damper]]`, `[[mass]]`, `[[slider]]`, `[[iwan]]`: elements at nodes, along the displacement of one end, or between two.

use schemars::JsonSchema;
use serde::Deserialize;

use super::number::{Check, finite, length, positive};
use super::side::{EdgeKey, side};
use super::{BodyKind, Contact, Issue, Scene};

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

impl std::fmt::Display for End<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            End::Group(group) => write!(f, "{group}"),
            End::At(at) => write!(f, "{at:?}"),
            End::Row(row) => write!(f, "row {row}"),
        }
    }
}

impl std::fmt::Display for Ends<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.to {
            Some(to) => write!(f, "{} to {to}", self.from),
            None => write!(f, "{}", self.from),
        }
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
            edge: Option<EdgeKey>,
            /// The physical group of a mesh, likewise.
            group: Option<String>,
            /// In their place: where; the element acts on the nearest node. A place further than half an element from the body is refused.
            #[schemars(extend("examples" = [[1.0, 0.25]]))]
            at: Option<Vec<f64>>,
            /// Bodies from matrices: the row, counted from 0.
            #[schemars(with = "Option<super::names::Row>")]
            row: Option<usize>,
            /// One at every node of the edge or group: values are per area.
            #[serde(default)]
            each: bool,
            /// The second end: an edge or group, by its mean displacement. Without a second end the element leads to the ground.
            to: Option<String>,
            /// The second end: a place.
            to_at: Option<Vec<f64>>,
            /// The second end: a row of the matrices.
            #[schemars(with = "Option<super::names::Row>")]
            to_row: Option<usize>,
            /// Direction, of any length; bars and matrices need none.
            #[schemars(extend("examples" = [[0.0, 1.0]]))]
            direction: Option<Vec<f64>>,
            $($(#[$of_key])* pub $key: $type,)*
        }

        impl $name {
            /// Where it is.
            pub fn ends(&self) -> Ends<'_> {
                let group = self.edge.as_ref().map(EdgeKey::name).or(self.group.as_deref());
                Ends {
                    from: End::of(group, &self.at, self.row).unwrap_or(End::Row(0)),
                    to: End::of(self.to.as_deref(), &self.to_at, self.to_row),
                    direction: self.direction.as_deref(),
                    each: self.each,
                }
            }

            /// The rows of given matrices that it names.
            fn rows_mut(&mut self) -> impl Iterator<Item = &mut usize> {
                [&mut self.row, &mut self.to_row].into_iter().flatten()
            }

            fn check_ends(&self, scene: &Scene, table: &str) -> Check {
                let Self { edge, group, at, row, to, to_at, to_row, .. } = self;
                let first = [edge.is_some() || group.is_some(), at.is_some(), row.is_some()];
                let second = [to.is_some(), to_at.is_some(), to_row.is_some()];
                scene.check_counts(table, first, second)?;
                if first[0] {
                    side(scene.body.kind, table, edge.as_ref(), group.as_ref(), "right")?;
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

table! {
    /// A slider: dry friction under a force that stays. It sticks while the force on it is less than its limit, and slides against that otherwise.
    Slider {
        /// The force at which it slides.
        limit: f64,
        /// Stiffness of a spring in series (a Jenkins element); absent: rigid, Coulomb's law.
        stiffness: Option<f64>,
        /// Force of that spring where nothing is displaced, pulling together; not above the limit.
        #[serde(default)]
        preload: f64,
    }
}

table! {
    /// Sliders in parallel, each with a spring in series: a table of them, or Segalman's four parameters.
    Iwan {
        /// `[limit, stiffness]` of each slider.
        #[schemars(extend("examples" = [[[1.0, 50.0], [2.0, 30.0]]]))]
        #[serde(default)]
        table: Vec<[f64; 2]>,
        /// In its place `F_S`: the force at which all of them slide.
        limit: Option<f64>,
        /// `K_T`: the stiffness while all of them stick.
        stiffness: Option<f64>,
        /// `χ`, more than −1: the loss of small amplitudes grows with their power `χ + 3`.
        chi: Option<f64>,
        /// `β`: the stiffness that is lost at once when all slide, over what was lost before.
        beta: Option<f64>,
        /// Number of sliders that stand for the four parameters.
        #[schemars(extend("default" = 20), range(min = 1))]
        sliders: Option<usize>,
    }
}

/// Most sliders of one element.
const MOST: usize = 1000;

impl Iwan {
    /// `[limit, stiffness]` of all its sliders.
    ///
    /// The four parameters are those of the density `ρ(φ) = R φ^χ (φ < φ_max) + S δ(φ − φ_max)` of springs that give way at the displacement `φ`, with `K_T = ∫ρ` and
    /// `F_S = ∫φρ` (Segalman 2005). Cells from `φ_max (m/N)²` to the next become a slider each that has the stiffness and the limit of the cell: the sums are exact.
    pub fn sliders(&self) -> Vec<[f64; 2]> {
        let (Some(limit), Some(stiffness), Some(chi), Some(beta)) =
            (self.limit, self.stiffness, self.chi, self.beta)
        else {
            return self.table.clone();
        };
        let share = beta + (chi + 1.0) / (chi + 2.0);
        let last = limit * (1.0 + beta) / (stiffness * share);
        let at_once = limit / last * beta / share;
        let density = limit * (chi + 1.0) / (last.powf(chi + 2.0) * share);
        let count = self.sliders.unwrap_or(20);
        let edge = |m: usize| last * (m as f64 / count as f64).powi(2);
        let moment = |m: usize, power: f64| {
            (edge(m + 1).powf(power) - edge(m).powf(power)) / power * density
        };
        let cells = (0..count).map(|m| [moment(m, chi + 2.0), moment(m, chi + 1.0)]);
        let end = Some([at_once * last, at_once]).filter(|_| at_once > 0.0);
        cells.chain(end).collect()
    }

    fn check(&self, table: &str) -> Check {
        let key = |name: &str| format!("{table}.{name}");
        let four = [self.limit, self.stiffness, self.chi, self.beta];
        let given = four.iter().flatten().count();
        let example = "table = [[1.0, 50.0], [2.0, 30.0]], or limit, stiffness, chi and beta";
        if !self.table.is_empty() && given + usize::from(self.sliders.is_some()) > 0 {
            return Err(Issue::new(table, "has a table and parameters", format!("give {example}")));
        }
        if self.table.is_empty() && given < 4 {
            let message = "needs a table, or all four parameters";
            return Err(Issue::new(table, message, format!("give {example}")));
        }
        if self.table.len() > MOST || self.sliders.is_some_and(|n| !(1..=MOST).contains(&n)) {
            let name = if self.table.is_empty() { "sliders" } else { "table" };
            let message = format!("1 to {MOST} sliders are known");
            return Err(Issue::new(key(name), message, "give fewer, or at least one"));
        }
        for x in self.table.iter().flatten() {
            positive(&key("table"), *x)?;
        }
        self.limit.map_or(Ok(()), |x| positive(&key("limit"), x))?;
        self.stiffness.map_or(Ok(()), |x| positive(&key("stiffness"), x))?;
        if self.chi.is_some_and(|chi| !(chi > -1.0 && chi <= 10.0)) {
            let help = "give a number more than -1 (and at most 10), for example -0.5";
            return Err(Issue::new(key("chi"), "does not lie between -1 and 10", help));
        }
        if self.beta.is_some_and(|beta| !(0.0..=1e6).contains(&beta)) {
            let help = "give a number from 0 to 1e6, for example 0.1";
            return Err(Issue::new(key("beta"), "does not lie between 0 and 1e6", help));
        }
        Ok(())
    }
}

/// A slider as a scene has it, in a table of its own or in one of several.
#[derive(Debug, Clone)]
pub struct Sliding<'s> {
    /// The table that it stands in.
    pub table: String,
    /// Where it is.
    pub ends: Ends<'s>,
    /// The force at which it slides.
    pub limit: f64,
    /// Stiffness of its spring, if any.
    pub stiffness: Option<f64>,
    /// Force of that spring where nothing is displaced.
    pub preload: f64,
}

impl Scene {
    /// All sliders, those of Iwan elements included.
    pub fn all_sliders(&self) -> Vec<Sliding<'_>> {
        let own = self.sliders.iter().enumerate().map(|(i, s)| Sliding {
            table: format!("slider[{i}]"),
            ends: s.ends(),
            limit: s.limit,
            stiffness: s.stiffness,
            preload: s.preload,
        });
        let of_iwan = self.iwans.iter().enumerate().flat_map(|(i, iwan)| {
            iwan.sliders().into_iter().map(move |[limit, stiffness]| Sliding {
                table: format!("iwan[{i}]"),
                ends: iwan.ends(),
                limit,
                stiffness: Some(stiffness),
                preload: 0.0,
            })
        });
        own.chain(of_iwan).collect()
    }

    /// The table by which messages call what damps.
    pub fn damping_key(&self) -> &'static str {
        match (&self.damping, self.dampers.is_empty()) {
            (None, false) => "damper[0]",
            _ => "damping",
        }
    }

    /// The key by which messages call what rubs: friction at an obstacle, or the first slider.
    pub fn friction_key(&self) -> String {
        match self.contact.as_ref().filter(|c| c.has_friction()) {
            Some(contact) => contact.friction_key(),
            None => self.all_sliders().first().map_or(String::new(), |s| s.table.clone()),
        }
    }

    /// Whether anything rubs, at an obstacle or over a slider.
    pub fn rubs(&self) -> bool {
        self.slides() || self.contact.as_ref().is_some_and(Contact::has_friction)
    }

    /// Whether there are any.
    pub fn slides(&self) -> bool {
        !(self.sliders.is_empty() && self.iwans.is_empty())
    }

    /// Whether there are elements at nodes.
    pub fn has_elements(&self) -> bool {
        self.all_ends().next().is_some()
    }

    /// Where all elements at nodes are, with the names of their tables.
    pub(crate) fn all_ends(&self) -> impl Iterator<Item = (String, Ends<'_>)> {
        let springs = self.springs.iter().enumerate();
        let springs = springs.map(|(i, e)| (format!("spring[{i}]"), e.ends()));
        let dampers = self.dampers.iter().enumerate();
        let dampers = dampers.map(|(i, e)| (format!("damper[{i}]"), e.ends()));
        let masses = self.masses.iter().enumerate();
        let masses = masses.map(|(i, e)| (format!("mass[{i}]"), e.ends()));
        let sliders = self.sliders.iter().enumerate();
        let sliders = sliders.map(|(i, e)| (format!("slider[{i}]"), e.ends()));
        let iwans = self.iwans.iter().enumerate();
        let iwans = iwans.map(|(i, e)| (format!("iwan[{i}]"), e.ends()));
        springs.chain(dampers).chain(masses).chain(sliders).chain(iwans)
    }

    /// Where an element is, in words: rows by their names, or their numbers in the files.
    pub(crate) fn ends_name(&self, ends: &Ends) -> String {
        let word = |end: &End| match end {
            // along the axis of its name
            End::Row(row) if self.rows.has_labels() => match self.rows.name(*row) {
                Some(name) => name.to_string(),
                None => self.rows.label(*row),
            },
            other => other.to_string(),
        };
        match &ends.to {
            Some(to) => format!("{} to {}", word(&ends.from), word(to)),
            None => word(&ends.from),
        }
    }

    /// The rows of given matrices at which all elements are.
    pub(super) fn rows_of_elements(&mut self) -> impl Iterator<Item = &mut usize> {
        let springs = self.springs.iter_mut().flat_map(Spring::rows_mut);
        let dampers = self.dampers.iter_mut().flat_map(Damper::rows_mut);
        let masses = self.masses.iter_mut().flat_map(Mass::rows_mut);
        let sliders = self.sliders.iter_mut().flat_map(Slider::rows_mut);
        let iwans = self.iwans.iter_mut().flat_map(Iwan::rows_mut);
        springs.chain(dampers).chain(masses).chain(sliders).chain(iwans)
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
        for (i, slider) in self.sliders.iter().enumerate() {
            let table = format!("slider[{i}]");
            slider.check_ends(self, &table)?;
            positive(&format!("{table}.limit"), slider.limit)?;
            slider.stiffness.map_or(Ok(()), |k| positive(&format!("{table}.stiffness"), k))?;
            let key = format!("{table}.preload");
            finite(&key, slider.preload)?;
            if slider.preload != 0.0 && slider.stiffness.is_none() {
                let message = "is the force of a spring in series, and a rigid slider has none";
                return Err(Issue::new(key, message, "give stiffness, or remove the key"));
            }
            if slider.preload.abs() > slider.limit {
                let message =
                    format!("is {:e}, beyond the limit {:e}", slider.preload, slider.limit);
                return Err(Issue::new(key, message, "give a force that the slider can hold"));
            }
        }
        for (i, iwan) in self.iwans.iter().enumerate() {
            let table = format!("iwan[{i}]");
            iwan.check_ends(self, &table)?;
            iwan.check(&table)?;
        }
        Ok(())
    }

    /// One first end, at the most one second.
    fn check_counts(&self, table: &str, first: [bool; 3], second: [bool; 3]) -> Check {
        let count = |of: [bool; 3]| of.into_iter().filter(|x| *x).count();
        let side = self.body.kind.side_key();
        let example = match self.body.kind {
            BodyKind::Matrices => "row = 0".to_owned(),
            _ => format!(
                "{side} = \"right\", or at = {}",
                self.example(["[1.0]", "[1.0, 0.0]", "[1.0, 0.0, 0.0]"])
            ),
        };
        match (count(first), count(second)) {
            (0, _) => Err(Issue::new(table, "does not say where it is", example)),
            (1, 0 | 1) => Ok(()),
            (1, _) => {
                let message = "has several second ends";
                Err(Issue::new(
                    table,
                    message,
                    "give one of to, to_at, to_row, or none: the ground",
                ))
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
                let example =
                    self.example(["", "direction = [0.0, 1.0]", "direction = [0.0, 0.0, 1.0]"]);
                Err(Issue::new(key("direction"), "is missing", example))
            }
        }
    }
}
