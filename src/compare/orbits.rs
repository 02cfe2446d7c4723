//! Orbits at given frequencies with each variant on each mesh: conservative or forced ones, or viscous nonlinear modes. The search is that of `orbit`.

use std::time::Instant;

use super::plan::{Plan, Task};
use super::{CompareError, SetUp, Take};
use crate::contact::State;
use crate::families::single::search;
use crate::families::start;
use crate::families::viscous::Viscosity;
use crate::hbm::bem::BarBalance;
use crate::orbit::search::Verdict;
use crate::orbit::{Closure, OrbitError, Propagator};
use crate::records::{Compared, Quantity, Row};
use crate::scenario::{Beta, Scene};

/// What is compared, in words.
pub(super) fn title(plan: &Plan) -> String {
    let omega: Vec<String> = plan.omega.iter().map(f64::to_string).collect();
    let omega = omega.join(", ");
    match plan.compared {
        Compared::Viscous => format!(
            "viscous nonlinear modes at omega = {omega}, beta = {}",
            plan.beta.unwrap_or(f64::NAN)
        ),
        _ => format!("orbits at omega = {omega}"),
    }
}

/// The viscosity of all rows: what is given, the scene's, or what the coarsest mesh resolves.
pub fn common_beta(plan: &Plan, set_up: SetUp) -> Result<f64, String> {
    let of_scene = plan.scene.orbit.as_ref().and_then(|o| o.beta);
    let given = plan.beta.or(match of_scene {
        Some(Beta::Number(beta)) => Some(beta),
        _ => None,
    });
    if let Some(beta) = given {
        return Ok(beta);
    }
    let resolved = |task: &Task| -> Result<f64, String> {
        let scene = task.scene(&plan.scene).map_err(|e| e.to_string())?;
        let body = Propagator::new(set_up(&scene)?.system).map_err(|e| e.to_string())?;
        let viscosity = Viscosity::of_scene(&scene, &body, None).map_err(|e| e.to_string())?;
        Ok(viscosity.pin.beta)
    };
    let mut why = String::new();
    for task in plan.series.iter().filter_map(|s| s.first()) {
        match resolved(task) {
            Ok(beta) => return Ok(beta),
            Err(e) => why = e,
        }
    }
    Err(why)
}

/// A body that is made ready for orbits of any frequency.
struct Ready {
    body: Propagator,
    closure: Closure,
    h: f64,
    scene: Scene,
    initial: State,
    exact: Option<BarBalance>,
    /// Fronts are sharper than the mesh: the orbit is the mesh's.
    unresolved: bool,
}

fn ready(plan: &Plan, task: &Task, set_up: SetUp) -> Result<Ready, String> {
    let scene = task.scene(&plan.scene).map_err(|e| e.to_string())?;
    let problem = set_up(&scene)?;
    let viscous = plan.compared == Compared::Viscous;
    let mut closure = match viscous {
        true => Closure::Autonomous,
        false => start::closure(&scene, &problem).map_err(|e| e.to_string())?,
    };
    let (initial, h) = (problem.initial.clone(), problem.system.body.size_at_contact());
    let exact = BarBalance::of(&problem.system).filter(|_| closure == Closure::Reversible);
    let body = Propagator::new(problem.system).map_err(|e| e.to_string())?;
    let mut unresolved = false;
    if viscous {
        let viscosity = Viscosity::of_scene(&scene, &body, plan.beta).map_err(|e| e.to_string())?;
        unresolved = viscosity.is_unresolved();
        closure = Closure::Viscous(viscosity.pin);
    }
    Ok(Ready { body, closure, h: h.unwrap_or(1.0), scene, initial, exact, unresolved })
}

impl Ready {
    /// The orbit of a row, and the time that finding it took.
    ///
    /// There are several conservative orbits at a frequency, and which of them a guess leads to is chance. The scene's guess and the first mode at several
    /// amplitudes are tried; of what they lead to that is taken which is nearest in energy to the closed form, where there is one, else the orbit with the fewest
    /// switches, and of these the one of lowest energy.
    fn search(
        &mut self,
        guesses: &[Vec<f64>],
        omega: f64,
        exact: Option<f64>,
    ) -> Result<(Verdict, f64), OrbitError> {
        let timed = |body: &mut Propagator, closure, guesses: &[Vec<f64>]| {
            let start = Instant::now();
            let verdict = search(body, closure, guesses, omega)?;
            Ok::<_, OrbitError>((verdict, start.elapsed().as_secs_f64()))
        };
        let mut best = timed(&mut self.body, self.closure, guesses)?;
        if self.closure != Closure::Reversible {
            return Ok(best);
        }
        let rank = |v: &Verdict| match (v.orbit(), exact) {
            (None, _) => (f64::INFINITY, 0.0),
            (Some(o), Some(exact)) => ((o.energy / exact).ln().abs(), 0.0),
            (Some(o), None) => (o.switches.len() as f64, o.energy),
        };
        for guess in start::of_first_mode(&self.body, guesses[0].len()) {
            let found = timed(&mut self.body, self.closure, &[guess])?;
            if rank(&found.0) < rank(&best.0) {
                best = found;
            }
        }
        Ok(best)
    }

    /// The row of an orbit.
    fn row(&mut self, task: &Task, omega: f64) -> Result<Row, String> {
        let mut row = Row { h: self.h, ..task.row() };
        row.values.insert(Quantity::Omega, omega);
        self.body.system.loads_mut().set_frequency(omega);
        let guesses = start::guesses(&self.scene, &self.initial, &self.body, self.closure, omega);
        if guesses.is_empty() {
            row.note = "there is no guess to start from".into();
            return Ok(row);
        }
        let exact = self.exact.as_ref().and_then(|bar| bar.closed_form_energy(omega));
        let (verdict, wall) = self.search(&guesses, omega, exact).map_err(|e| e.to_string())?;
        let Verdict::Orbit(orbit) = &verdict else {
            row.note = verdict.to_string();
            return Ok(row);
        };
        let length = self.body.system.units.length;
        for (quantity, value) in [
            (Quantity::Unknowns, Some(self.body.n() as f64)),
            (Quantity::Energy, Some(orbit.energy)),
            (Quantity::EnergyError, exact.map(|e| orbit.energy / e - 1.0)),
            (Quantity::Alpha, orbit.viscous.as_ref().map(|v| v.alpha)),
            (Quantity::ContactTime, Some(orbit.contact_time)),
            (Quantity::Multiplier, orbit.stability.as_ref().map(|s| s.largest)),
            (Quantity::Penetration, Some(orbit.penetration * length)),
            (Quantity::Switches, Some(orbit.switches.len() as f64)),
            (Quantity::Residual, Some(orbit.residual)),
            (Quantity::Iterations, Some(orbit.iterations as f64)),
            (Quantity::Wall, Some(wall)),
        ] {
            if let Some(value) = value.filter(|v| v.is_finite()) {
                row.values.insert(quantity, value);
            }
        }
        if orbit.contact_time == 0.0 {
            row.note = "no contact: the motion of the linear body".into();
        }
        if self.unresolved {
            row.note = "beta asks for sharper fronts than this mesh resolves".into();
        }
        Ok(row)
    }
}

/// All rows.
pub(super) fn rows(
    plan: &Plan,
    set_up: SetUp,
    known: &[Row],
    take: Take,
) -> Result<(), CompareError> {
    let count = (plan.tasks().count() * plan.omega.len()).max(1) as f64;
    let mut done = 0;
    for task in plan.tasks() {
        let is_known =
            |omega: f64| known.iter().any(|r| task.is_of(r) && r.get(Quantity::Omega) == omega);
        let mut prepared: Option<Result<Ready, String>> = None;
        for &omega in &plan.omega {
            done += 1;
            if is_known(omega) {
                continue;
            }
            if take(None, (done - 1) as f64 / count, &format!("{}, omega = {omega}", task.title()))
                .is_break()
            {
                return Ok(());
            }
            let row = match prepared.get_or_insert_with(|| ready(plan, task, set_up)) {
                Ok(ready) => ready.row(task, omega),
                Err(why) => Err(why.clone()),
            };
            let row = row.unwrap_or_else(|why| {
                let values = [(Quantity::Omega, omega)].into();
                Row { values, note: why, ..task.row() }
            });
            if take(Some(row), done as f64 / count, &task.title()).is_break() {
                return Ok(());
            }
        }
    }
    Ok(())
}
