//! `[[load]]`

use schemars::JsonSchema;
use serde::Deserialize;

use super::number::{Check, count_from_one, finite, length, positive};
use super::side::{EdgeKey, side};
use super::{Amplitude, BodyKind, Issue, Scene};

/// `[[load]]`
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// What it is.
    pub kind: LoadKind,
    /// Kind `mode`: which, from 1.
    pub mode: Option<usize>,
    /// Kinds `traction`, `base`: the edge of a bar or plate.
    edge: Option<EdgeKey>,
    /// Kinds `traction`, `base`: the physical group of a mesh. Kind `base` of bodies from matrices: the set that a support holds; absent: all supports move.
    group: Option<String>,
    /// Kind `point`: where; the load acts on the nearest node. A place further than half an element from the body is refused.
    #[schemars(extend("examples" = [[1.0, 0.25]]))]
    pub at: Option<Vec<f64>>,
    /// Kind `force`: the row of the matrices, counted from 0; absent: the amplitude has one number a row.
    #[schemars(with = "Option<super::names::Row>")]
    pub displacement: Option<usize>,
    /// A number for `mode` and for bars, a vector for the other kinds in the plane and in space.
    #[schemars(extend("examples" = [0.1, [0.0, -9.81]]))]
    pub amplitude: Option<Amplitude>,
    /// In place of the amplitude of a harmonic load of kind `mode`: the linear response of that mode at its natural frequency, over the amplitude that grazes the obstacle (the very peak, a little below that frequency, is higher by `1/√(1 − ξ²)`).
    pub peak: Option<f64>,
    /// Circular frequency of `cos(ωt + phase)`; absent: a constant load.
    pub omega: Option<f64>,
    /// Phase, in radians.
    #[serde(default)]
    pub phase: f64,
    /// In place of `omega`: a CSV file of time and value, relative to the scene; the load is the amplitude times its C² spline (`run`, Runge–Kutta), or with `run.quasistatic` the straight lines between its points.
    pub table: Option<String>,
}

/// Kinds of load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum LoadKind {
    /// `M φ_k`: in the shape of a mode of the open body.
    Mode,
    /// An acceleration that acts on all mass; of bodies from matrices with names of rows along x, y and z (mass that couples to what their program holds is not in the matrices, and does not pull).
    Gravity,
    /// Force per area on an edge or group. On the contact edge the nbm's contact stress leaves it out (an error of the order of h): `stress = "reaction"` and mass redistribution have it.
    Traction,
    /// A force at a node.
    Point,
    /// The supports on an edge or group move by the amplitude; those of bodies from matrices, where the scene holds their rows, by x, y and z.
    Base,
    /// Forces on the displacements of a body from matrices.
    Force,
}

impl Scene {
    pub(super) fn check_loads(&self) -> Check {
        (0..self.loads.len()).try_for_each(|i| {
            self.loads[i].check_keys(i)?;
            self.check_place(i)?;
            self.loads[i].check_harmonic(i)?;
            self.check_amplitude(i)
        })
    }

    /// Mode, edge or point.
    fn check_place(&self, i: usize) -> Check {
        let l = &self.loads[i];
        if let Some(m) = l.mode {
            count_from_one(&key(i, "mode"), m)?;
        }
        let of_matrices = self.body.kind == BodyKind::Matrices;
        if l.kind == LoadKind::Base && of_matrices {
            self.check_base_of_rows(i)?;
        } else if matches!(l.kind, LoadKind::Traction | LoadKind::Base) {
            side(
                self.body.kind,
                &format!("load[{i}]"),
                l.edge.as_ref(),
                l.group.as_ref(),
                "right",
            )?;
        }
        if l.kind == LoadKind::Force && self.body.kind != BodyKind::Matrices {
            let message = "\"force\" acts on rows of matrices, and this body has elements";
            let help = "give kind = \"point\", \"traction\" or \"gravity\"";
            return Err(Issue::new(key(i, "kind"), message, help));
        }
        if let Some(at) = &l.at {
            length(
                &key(i, "at"),
                at.len(),
                self.dim(),
                self.example(["[1.0]", "[1.0, 0.0]", "[1.0, 0.0, 0.0]"]),
            )?;
            for (v, size) in at.iter().zip(&self.body.size) {
                if !(*v >= 0.0 && v <= size) {
                    let message = format!("{v} is outside the body");
                    return Err(Issue::new(key(i, "at"), message, format!("give 0 to {size}")));
                }
            }
        }
        Ok(())
    }

    /// Supports of given matrices that move: those on a set of the deck, or all of them.
    fn check_base_of_rows(&self, i: usize) -> Check {
        let l = &self.loads[i];
        let supports = &self.rows.supports;
        let help = "hold them in the scene: [[support]] nodes = \"BASE\" (a set of body.deck, or numbers), fix = [\"x\", \"y\", \"z\"], of matrices that have these rows";
        if self.rows.missing.is_some() {
            return Ok(());
        }
        if supports.iter().all(|s| s.1.is_empty()) {
            let message =
                "moves supports, and what the program of the matrices holds is no row of them";
            return Err(Issue::new(key(i, "kind"), message, help));
        }
        if self.rows.superelement.is_some() {
            let message = "moves supports, whose rows the free-interface form does not have";
            return Err(Issue::new(key(i, "kind"), message, "leave [reduction] out"));
        }
        if l.edge.is_some() {
            let message = "a body from matrices has no edges";
            return Err(Issue::new(
                key(i, "edge"),
                message,
                "group = \"BASE\", a set that a support holds; absent: all supports",
            ));
        }
        match &l.group {
            Some(group) if !(0..supports.len()).any(|k| self.rows.is_support(k, group)) => {
                let all: Vec<&str> = supports.iter().map(|s| &s.0[..]).collect();
                let help =
                    format!("give one of {}, or leave it out: all supports move", all.join(", "));
                Err(Issue::new(key(i, "group"), format!("\"{group}\" is held by no support"), help))
            }
            _ => Ok(()),
        }
    }

    /// One number or a vector, as the kind needs.
    fn check_amplitude(&self, i: usize) -> Check {
        let kind = self.loads[i].kind;
        let key = key(i, "amplitude");
        let Some(amplitude) = self.amplitude_of(i)? else { return Ok(()) };
        match (amplitude, kind) {
            (Amplitude::Scalar(a), LoadKind::Force) => match self.loads[i].displacement {
                Some(_) => finite(&key, *a),
                None => Err(Issue::new(
                    key,
                    "is one number, and no displacement is named",
                    "add displacement = 0, or give amplitude = [0.0, 1.0]: one number a row",
                )),
            },
            (Amplitude::Vector(v), LoadKind::Force) => match self.loads[i].displacement {
                Some(_) => Err(Issue::new(key, "is a list beside displacement", "give one number")),
                None => v.iter().try_for_each(|&a| finite(&key, a)),
            },
            // along the axes of the rows' names
            (amplitude, LoadKind::Base | LoadKind::Gravity)
                if self.body.kind == BodyKind::Matrices =>
            {
                let example = match kind {
                    LoadKind::Base => "[0.0, 0.0, 1e-3]",
                    _ => "[0.0, 0.0, -9810.0]",
                };
                let Amplitude::Vector(v) = amplitude else {
                    let message = "needs the x, y and z components";
                    return Err(Issue::new(key, message, format!("amplitude = {example}")));
                };
                length(&key, v.len(), 3, example)?;
                v.iter().try_for_each(|&a| finite(&key, a))
            }
            (Amplitude::Scalar(a), _) if kind == LoadKind::Mode || self.dim() == 1 => {
                finite(&key, *a)
            }
            (Amplitude::Vector(v), k) if k != LoadKind::Mode => {
                length(
                    &key,
                    v.len(),
                    self.dim(),
                    self.example(["[-9.81]", "[0.0, -9.81]", "[0.0, 0.0, -9.81]"]),
                )?;
                v.iter().try_for_each(|&a| finite(&key, a))
            }
            (_, LoadKind::Mode) => {
                Err(Issue::new(key, "a mode has one amplitude", "amplitude = 0.1"))
            }
            _ if self.dim() == 3 => Err(Issue::new(
                key,
                "needs the x, y and z components",
                "amplitude = [0.0, 0.0, -9.81]",
            )),
            _ => Err(Issue::new(key, "needs the x and y components", "amplitude = [0.0, -9.81]")),
        }
    }

    /// The amplitude of a load, or none where the peak of a resonance stands for it.
    fn amplitude_of(&self, i: usize) -> Result<Option<&Amplitude>, Issue> {
        let l = &self.loads[i];
        let key = key(i, "peak");
        let example = "peak = 3.0 with kind = \"mode\", omega and [damping], or amplitude = 0.1";
        let fail = |message: &str| Err(Issue::new(key.clone(), message, example));
        match (&l.amplitude, l.peak) {
            (Some(_), Some(_)) => fail("stands beside amplitude: one of them is enough"),
            (Some(a), None) => Ok(Some(a)),
            (None, None) => Err(Issue::new(self::key(i, "amplitude"), "is missing", example)),
            (None, Some(_)) if l.kind != LoadKind::Mode => fail("goes with kind = \"mode\" only"),
            (None, Some(_)) if l.omega.is_none() => {
                fail("is that of a harmonic load: omega is missing")
            }
            (None, Some(_)) if self.damping.is_none() || self.contact.is_none() => {
                fail("needs [damping] and [contact]: without them no peak and no grazing amplitude")
            }
            (None, Some(p)) => positive(&key, p).map(|()| None),
        }
    }
}

/// A key of the `i`-th load.
fn key(i: usize, name: &str) -> String {
    format!("load[{i}].{name}")
}

impl LoadKind {
    /// As it is written in a scene.
    pub fn name(self) -> String {
        format!("{self:?}").to_lowercase()
    }
}

impl Load {
    /// The group of sides that it acts on (kinds `traction`, `base`).
    pub fn group(&self) -> &str {
        self.edge.as_ref().map(EdgeKey::name).or(self.group.as_deref()).unwrap_or_default()
    }

    /// Keys that belong to one kind.
    fn check_keys(&self, i: usize) -> Check {
        if let (true, LoadKind::Mode | LoadKind::Gravity | LoadKind::Point | LoadKind::Force) =
            (self.edge.is_some() || self.group.is_some(), self.kind)
        {
            let name = if self.edge.is_some() { "edge" } else { "group" };
            let message = "goes with kind = \"traction\" or \"base\" only";
            return Err(Issue::new(key(i, name), message, "remove it or change the kind"));
        }
        if self.displacement.is_some() && self.kind != LoadKind::Force {
            let message = "goes with kind = \"force\" only";
            return Err(Issue::new(
                key(i, "displacement"),
                message,
                "remove it or change the kind",
            ));
        }
        for (name, given, kinds) in [
            ("mode", self.mode.is_some(), &[LoadKind::Mode][..]),
            ("at", self.at.is_some(), &[LoadKind::Point][..]),
        ] {
            if given && !kinds.contains(&self.kind) {
                let names: Vec<String> =
                    kinds.iter().map(|k| format!("\"{}\"", k.name())).collect();
                let message = format!("goes with kind = {} only", names.join(" or "));
                return Err(Issue::new(key(i, name), message, "remove it or change the kind"));
            }
            if !given && kinds.contains(&self.kind) {
                let message = format!("is missing: kind = \"{}\" needs it", self.kind.name());
                let help = match self.kind {
                    LoadKind::Mode => "mode = 1",
                    _ => "at = [1.0, 0.0]",
                };
                return Err(Issue::new(key(i, name), message, help));
            }
        }
        Ok(())
    }

    /// Frequency and phase.
    fn check_harmonic(&self, i: usize) -> Check {
        match (self.omega, &self.table) {
            (Some(_), Some(_)) => {
                let message = "stands beside omega: a load is measured or harmonic";
                return Err(Issue::new(key(i, "table"), message, "remove one of them"));
            }
            (Some(w), None) => positive(&key(i, "omega"), w)?,
            (None, _) if self.phase != 0.0 => {
                let message = "belongs to a harmonic load";
                return Err(Issue::new(key(i, "phase"), message, "remove it, or give omega"));
            }
            (None, _) => {}
        }
        finite(&key(i, "phase"), self.phase)
    }
}
