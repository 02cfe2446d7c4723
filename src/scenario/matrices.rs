//! What goes with a body whose matrices come from files.

use super::names::NAME_THEM;
use super::number::Check;
use super::{BoundaryMass, Issue, LoadKind, MassKind, Scene};

impl Scene {
    /// A body whose matrices come from files.
    pub(super) fn check_matrices(&self) -> Check {
        self.check_no_elements()?;
        let b = &self.body;
        for (key, file) in
            [("mass_matrix", &b.mass_matrix), ("stiffness_matrix", &b.stiffness_matrix)]
        {
            if file.is_none() {
                let help = format!("{key} = \"M.mtx\" (Matrix Market), or \"FILE.h5:/dataset\"");
                return Err(Issue::new(format!("body.{key}"), "is missing", help));
            }
        }
        self.check_no_mesh()?;
        if b.damping_matrix.is_some() && self.damping.is_some() {
            let message = "stands beside body.damping_matrix";
            return Err(Issue::new("damping", message, "one of them is enough"));
        }
        Ok(())
    }

    /// Keys of bodies of elements.
    fn check_no_elements(&self) -> Check {
        let b = &self.body;
        for (key, given) in [
            ("size", !b.size.is_empty()),
            ("elements", !b.elements.is_empty()),
            ("young", b.young.is_some()),
            ("density", b.density.is_some()),
            ("poisson", b.poisson.is_some()),
            ("thickness", b.thickness.is_some()),
            ("area", b.area.is_some()),
            ("file", b.file.is_some()),
            ("state", b.state.is_some()),
            ("scale", b.scale.is_some()),
        ] {
            if given {
                let message = "belongs to a body of elements, this one comes from files";
                return Err(Issue::new(
                    format!("body.{key}"),
                    message,
                    "remove the key or change body.kind",
                ));
            }
        }
        let lumped = [
            ("body.mass", b.mass != MassKind::Consistent),
            (
                "contact.boundary_mass",
                self.contact.as_ref().is_some_and(|c| c.boundary_mass == BoundaryMass::Lumped),
            ),
        ];
        if let Some((key, _)) = lumped.iter().find(|l| l.1) {
            let message = "there are no elements to lump: the matrices are what they are";
            return Err(Issue::new(*key, message, "remove the key"));
        }
        Ok(())
    }

    /// Tables that need a mesh.
    fn check_no_mesh(&self) -> Check {
        for (i, l) in self.loads.iter().enumerate() {
            let fail = |message: &str, help: &str| {
                Err(Issue::new(format!("load[{i}].kind"), message, help))
            };
            match l.kind {
                LoadKind::Traction | LoadKind::Point => {
                    return fail(
                        "needs a mesh, and this body comes from files",
                        "give kind = \"force\", \"mode\", \"base\" or \"gravity\"",
                    );
                }
                LoadKind::Gravity if self.rows.superelement.is_some() => {
                    return fail(
                        "acts on rows whose directions are known, and modes have none",
                        "leave [reduction] out",
                    );
                }
                LoadKind::Gravity if self.rows.names.is_empty() && self.rows.missing.is_none() => {
                    return fail(
                        "acts along axes, and nobody says along what the rows count",
                        NAME_THEM,
                    );
                }
                _ => {}
            }
        }
        if self.initial.displacement.is_some() || self.initial.velocity.is_some() {
            let message = "expressions of x and y need a mesh";
            return Err(Issue::new("initial", message, "give mode and amplitude, or file"));
        }
        Ok(())
    }
}
