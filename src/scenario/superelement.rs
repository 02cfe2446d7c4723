//! `[reduction] kind = "free-interface"` beside matrices: the displacements that the scene names, and modes in place of all others.

use super::turned::Turned;
use super::{Amplitude, BodyKind, Inertia, Issue, LoadKind, ReductionKind, Scene, StressKey};

/// What stays of given matrices: displacements without mass, then so many modes of the free body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Superelement {
    /// Rows of the files, ascending.
    pub rows: Vec<usize>,
    /// Number of modes.
    pub modes: usize,
}

impl Scene {
    /// Take the reduction of given matrices out of the scene. Its rows are from here on those that stay, counted from 0.
    pub(super) fn take_superelement(&mut self) -> Result<(), Issue> {
        let Some(asked) = self.reduction.filter(|_| self.body.kind == BodyKind::Matrices) else {
            return Ok(());
        };
        self.check_superelement()?;
        let mut rows: Vec<usize> = vec![];
        self.each_row(&mut |row| rows.push(*row));
        // a displacement along an axis is one of all that its node was turned to
        let of_axes: Vec<usize> = self
            .named_rows()
            .into_iter()
            .filter(|n| !n.0.starts_with("contact"))
            .map(|n| n.1)
            .collect();
        let named = |t: &&Turned| t.rows().iter().any(|row| of_axes.contains(row));
        rows.extend(self.rows.turned.iter().filter(named).flat_map(Turned::rows));
        rows.sort_unstable();
        rows.dedup();
        let place = |row: usize| rows.binary_search(&row).unwrap_or(0);
        self.each_row(&mut |row| *row = place(*row));
        let places = std::mem::take(&mut self.rows.places);
        let kept = places.into_iter().filter(|(row, _)| rows.contains(row));
        self.rows.places = kept.map(|(row, at)| (place(row), at)).collect();
        self.reduction = None;
        self.rows.superelement = Some(Superelement { rows, modes: asked.modes.unwrap_or(0) });
        Ok(())
    }

    fn check_superelement(&self) -> Result<(), Issue> {
        let Some(asked) = &self.reduction else { return Ok(()) };
        let issue = |key: &str, message: &str, help: &str| Err(Issue::new(key, message, help));
        if asked.kind == ReductionKind::FixedInterface {
            return issue(
                "reduction.kind",
                "holds the contact of a body of elements, and this one comes from files",
                "kind = \"free-interface\" and modes = 12; or take the body as a mesh (decks .inp are meshes)",
            );
        }
        match (asked.modes, asked.cutoff) {
            (Some(modes), None) if modes > 0 => {}
            (_, Some(_)) => {
                return issue("reduction.cutoff", "is not read beside matrices", "modes = 12");
            }
            _ => return issue("reduction.modes", "needs at least one", "modes = 12"),
        }
        if self.body.damping_matrix.is_some() {
            let message = "is over all rows, and modes stand for most of them";
            return issue("body.damping_matrix", message, "give [damping]");
        }
        let without_mass = [
            ("damper[0]", !self.dampers.is_empty()),
            ("slider[0]", !self.sliders.is_empty()),
            ("iwan[0]", !self.iwans.is_empty()),
        ];
        if let Some((key, _)) = without_mass.iter().find(|k| k.1) {
            let message = "acts on a row that has no mass in free-interface form, as all rows that the scene names";
            return issue(key, message, "leave [reduction] out, or the element");
        }
        let list = |l: &super::Load| {
            l.kind == LoadKind::Force && matches!(l.amplitude, Some(Amplitude::Vector(_)))
        };
        if let Some(i) = self.loads.iter().position(list) {
            let message = "is over all rows, and modes stand for most of them";
            let help = "give a [[load]] for each row, with displacement";
            return issue(&format!("load[{i}].amplitude"), message, help);
        }
        let Some(c) = &self.contact else { return Ok(()) };
        let of_tables = c.obstacles.iter().enumerate().flat_map(|(k, o)| {
            let against = [
                ("against", o.given.against.is_some()),
                ("tangents_against", o.given.tangents_against.is_some()),
            ];
            against.map(|(key, given)| (k, key, given))
        });
        let shared = [
            (0, "n_c", c.n_c.is_some()),
            (0, "n_o", c.n_o.is_some()),
            (0, "stress", matches!(c.stress, Some(StressKey::Terms(_)))),
        ];
        if let Some((k, key, _)) = of_tables.chain(shared).find(|key| key.2) {
            let message = "is not read beside a reduction of matrices";
            return issue(&c.key(k, key), message, "leave [reduction] out, or remove the key");
        }
        if c.inertia == Some(Inertia::Paper) {
            let message = "is that of phases whose contact has mass, and a free-interface form has none there";
            return issue(&c.key(0, "inertia"), message, "inertia = \"constant\"");
        }
        if c.has_springs() {
            let message =
                "gives contact displacements their mass, and a free-interface form has none there";
            let help = "remove method, or leave [reduction] out";
            return issue(&c.key(0, "method"), message, help);
        }
        Ok(())
    }

    /// All rows of given matrices that it names.
    fn each_row(&mut self, with: &mut dyn FnMut(&mut usize)) {
        if let Some(c) = &mut self.contact {
            for given in c.obstacles.iter_mut().map(|o| &mut o.given) {
                given.displacements.iter_mut().flatten().for_each(&mut *with);
                given.tangents.iter_mut().flatten().for_each(&mut *with);
            }
        }
        self.loads.iter_mut().filter_map(|l| l.displacement.as_mut()).for_each(&mut *with);
        self.probes.iter_mut().filter_map(|p| p.node.as_mut()).for_each(&mut *with);
        self.rows_of_elements().for_each(with);
    }
}
