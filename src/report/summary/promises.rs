//! What the method of contact promises, and what is proved of the switches of a run.

use super::{mass_ratio, plural, significant};
use crate::contact::{March, System};
use crate::event::Report;

/// What is proved of the switches, and what is not (theory §12).
pub(super) fn certificate(report: &Report) -> String {
    // of a run that ended early only what it did is spoken of
    let until = match report.outcome.is_complete() {
        true => String::new(),
        false => format!(" up to t = {}, where the run ended", significant(report.t_end, 9)),
    };
    if report.proof.holds() {
        let known = match report.proof.state_error {
            0.0 => String::new(),
            e => format!("; these are known to {e:.0e} of their sizes at the end of a phase"),
        };
        return format!(
            "proved complete in every phase{until}, from bounds of gaps and pressures{known}"
        );
    }
    let mut but = vec![];
    let on_interpolants = report.proof.uncertified == report.phases;
    if report.proof.uncertified > 0 && !on_interpolants {
        let phases = plural(report.proof.uncertified, "phase", "phases");
        but.push(format!(
            "in {phases} on interpolants of steps or on modes that are not known well enough"
        ));
    }
    if report.proof.undecided > 0 {
        but.push(plural(report.proof.undecided, "undecided tangency", "undecided tangencies"));
    }
    if report.proof.missed > 0 {
        but.push(format!(
            "{} that the search missed",
            plural(report.proof.missed, "switch", "switches")
        ));
    }
    if report.proof.loosened > 0 {
        let monitors = plural(report.proof.loosened, "monitor", "monitors");
        but.push(format!("{monitors} further below zero than rounding explains"));
    }
    match (but.is_empty(), on_interpolants) {
        (true, true) => {
            format!(
                "complete on the interpolant of every step{until}, which is the motion to its tolerance: no proof"
            )
        }
        (true, false) => format!(
            "not proved complete{until}: the contact conditions are violated by {:.1e}",
            report.proof.violation
        ),
        (false, _) => format!("not proved complete{until}: {}", but.join("; ")),
    }
}

/// What the contact method promises: its conditions, its energy.
pub(super) fn promises(system: &System) -> [String; 2] {
    let promise = system.promise();
    let stress = match (promise.is_strong, promise.yields) {
        (true, _) => "gap and stress of the displacement field",
        (_, true) => "springs at points of the edge, which the body enters",
        _ => "gap and nodal reaction",
    };
    if let Some(law) = system.impact() {
        let conditions = "gaps and velocities; points stay while their reaction presses";
        if let Some(March::Waves(_)) = law.march {
            let conditions = "the continuum: displacements linear, velocities constant over each element at the start";
            return [conditions.to_owned(), "energy conserved".to_owned()];
        }
        if law.march.is_some() {
            let conditions = "velocities over a step; penetration stays until a point leaves";
            let energy = "impulses over steps: no pressure, no events";
            return [conditions.to_owned(), energy.to_owned()];
        }
        let energy = match law.restitution {
            1.0 => "energy conserved; rebounds chatter",
            0.0 => "every impact takes the energy of its point, O(h); pressures are impulses",
            _ => {
                "impacts take energy, rebounds accumulate: below a millionth of the velocities they come to rest"
            }
        };
        return [conditions.to_owned(), energy.to_owned()];
    }
    if system.tangents().is_some() {
        let law = system.law().name();
        let conditions = format!("{stress}; {law}");
        return [conditions, "energy exact but for what friction takes".to_owned()];
    }
    let energy = match (promise.conserves_energy, promise.is_lipschitz) {
        (false, true) => "the forces have no potential: the energy changes in contact".to_owned(),
        // stiffness-proportional damping that acts through the contact makes the acceleration jump
        (true, _) if system.is_lipschitz() => {
            "energy conserved, acceleration continuous".to_owned()
        }
        (true, _) => "energy conserved".to_owned(),
        _ => {
            let ratio = mass_ratio(system).map_or(String::new(), |mu| {
                let trust = match mu {
                    mu if mu < 3.5 => "tens of periods",
                    mu if mu < 10.0 => "a few periods",
                    _ => "an undamped motion gains energy within periods, inertia = \"constant\" conserves it",
                };
                format!(" (the mass jumps by μ = {}: {trust})", significant(mu, 3))
            });
            format!(
                "energy exact between switches, jumps at them{ratio}; the contact impulse is O(h) low"
            )
        }
    };
    [stress.to_owned(), energy]
}
