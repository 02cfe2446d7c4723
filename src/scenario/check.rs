//! Checks that need nothing but the scene itself: the order of the tables.

use super::number::Check;
use super::{Components, Contact, Field, Issue, Scene, Swings};

impl Scene {
    /// Space dimension of the displacement.
    pub fn dim(&self) -> usize {
        self.parts.first().unwrap_or(&self.body).dim()
    }

    /// The example for a bar, a body in the plane or one in space.
    pub(super) fn example(&self, all: [&'static str; 3]) -> &'static str {
        all[self.dim() - 1]
    }

    /// Expressions of `z` belong to bodies in space.
    fn check_expressions(&self) -> Check {
        let listed = |key: &str, components: &Option<Components>| {
            let lists = components.iter().flat_map(Components::lists);
            let is_used = lists.flat_map(|l| l.1).any(Field::is_in_space);
            is_used.then(|| key.to_owned())
        };
        let of_obstacle = |c: &Contact, k: usize| {
            let o = &c.obstacles[k];
            let used = |field: &Option<Field>| field.as_ref().is_some_and(Field::is_in_space);
            let in_front = used(&o.gap) || o.swings.as_ref().is_some_and(Swings::is_in_space);
            let name = if in_front { "gap" } else { "gap_behind" };
            (in_front || used(&o.gap_behind)).then(|| c.key(k, name))
        };
        let contact = self.contact.as_ref();
        let obstacles =
            contact.and_then(|c| (0..c.obstacles.len()).find_map(|k| of_obstacle(c, k)));
        let found = listed("initial.displacement", &self.initial.displacement)
            .or_else(|| listed("initial.velocity", &self.initial.velocity))
            .or(obstacles);
        // the places of a deck are in space
        let in_space = self.dim() == 3 || self.body.deck.is_some();
        match found {
            Some(key) if !in_space => Err(Issue::new(
                key,
                "is an expression of z, and the body lies in the plane of x and y",
                "give an expression of x and y",
            )),
            _ => Ok(()),
        }
    }

    /// What displacements without mass along obstacles do not go with.
    fn check_massless_along(&self) -> Check {
        let Some(contact) = self.contact.as_ref().filter(|c| c.is_massless_along()) else {
            return Ok(());
        };
        let is_static = self.run.as_ref().is_some_and(|r| r.quasistatic);
        let others = [
            (self.dim() == 3, "bodies in space"),
            (self.slides(), "sliders"),
            (self.reduction.is_some(), "a [reduction]"),
            (is_static, "a run without inertia, which knows no masses: both are the same there"),
            (self.initial.equilibrium, "a start at an equilibrium"),
        ];
        match others.iter().find(|o| o.0) {
            None => Ok(()),
            Some((_, what)) => {
                let message = format!("\"massless\" does not go with {what}");
                let help =
                    "give tangent = \"inertia\": displacements along the obstacle keep their mass";
                Err(Issue::new(contact.key(0, "tangent"), message, help))
            }
        }
    }

    pub(super) fn check(&self) -> Check {
        self.check_expressions()?;
        self.check_body()?;
        self.check_materials()?;
        self.check_supports()?;
        self.check_contact()?;
        self.check_massless_along()?;
        self.check_elements()?;
        self.check_damping()?;
        self.check_loads()?;
        self.check_probes()?;
        self.check_initial()?;
        self.check_orbit()?;
        self.check_reduction()?;
        self.check_run()
    }
}
