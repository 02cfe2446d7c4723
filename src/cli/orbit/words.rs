//! What there is to say of an orbit, and of one that was not found.

use std::fmt::Write as _;

use serde_json::{Value, json};

use signorini::orbit::credentials::MULTIPLIER_LIMIT;
use signorini::orbit::search::Verdict;
use signorini::orbit::{Orbit, Propagator, Spent, Stability};
use signorini::report::summary::significant;

use crate::cli::viscous::{AROUND, MEANING};

/// Why there is no orbit.
pub(super) fn failure_json(verdict: &Verdict, omega: Option<f64>, spent: Spent) -> Value {
    let mut json = json!({
        "status": "failed", "converged": false, "omega": omega, "verdict": verdict.word(), "message": verdict.to_string(),
        "spent": spent_json(spent),
    });
    match verdict {
        Verdict::Fold { omega, energy, switches, singular_value } => {
            json["fold"] = json!({"omega": omega, "energy": energy, "switches": switches, "singular_value": singular_value});
        }
        Verdict::Grazing { omega, what } => json["grazing"] = json!({"omega": omega, "what": what}),
        Verdict::NotFound { residual, .. } => json["residual"] = json!(residual),
        _ => {}
    }
    json
}

/// What a search took, counted: the same on any number of threads.
pub(super) fn spent_json(spent: Spent) -> Value {
    json!({"motions": spent.motions, "derivatives": spent.derivatives})
}

/// An orbit as a JSON object.
pub(super) fn orbit_json(body: &Propagator, o: &Orbit) -> Value {
    let switches: Vec<Value> = o
        .switches
        .iter()
        .map(|s| json!({"t": s.t, "node": s.node, "kind": s.kind.name(), "energy_jump": s.energy_jump}))
        .collect();
    let stability = o.stability.as_ref();
    // of a viscous orbit they are those of the self-excited system: no statement about the body
    let of_body = stability.filter(|_| o.viscous.is_none());
    let mut json = json!({
        "converged": true, "admissible": o.is_admissible(), "period": o.period, "forcing_periods": o.closure.is_forced().then_some(o.closure.periods()), "omega": o.omega(), "energy": o.energy,
        "amplitude": o.amplitude, "residual": o.residual, "newton_iterations": o.iterations, "switches": switches,
        "contact_time": o.contact_time, "penetration": o.penetration, "tension": o.tension, "energy_balance": o.balance,
        "grazing_distance": o.grazing, "n_o": body.n(),
        "multipliers": stability.map(Stability::pairs),
        "trivial_multipliers": stability.map(|s| s.trivial), "largest_multiplier": stability.map(|s| s.largest),
        "stable": of_body.map(|s| s.is_stable()), "stability_lost_by": of_body.and_then(|s| s.lost_by()),
        "u0": body.system.body.nodal_o(&o.state.u), "v0": body.system.body.nodal_o(&o.state.v),
    });
    if let Some(rubbed) = &o.rubbed {
        json["friction_work"] = rubbed.work().into();
        json["belt_work"] = rubbed.belt.into();
        json["family_dimension"] = json!(o.residual_positions());
        json["shakedown"] = json!(shakedown(o));
        json["drift"] = json!(o.drift);
    }
    if let Some(v) = &o.viscous {
        json["alpha"] = v.alpha.into();
        json["beta"] = v.beta.into();
        json["energy_start"] = o.energy.into();
        json["energy_turned_over"] = v.turned_over.into();
        json["multipliers_under_load"] = json!(v.under_load.as_ref().map(Stability::pairs));
        json["largest_multiplier_under_load"] = json!(v.under_load.as_ref().map(|s| s.largest));
    }
    json
}

/// Whether an orbit is stable, and how it is not.
fn stability_text(o: &Orbit) -> String {
    let Some(s) = &o.stability else {
        return format!("not computed above {MULTIPLIER_LIMIT} displacements");
    };
    let size = significant(s.largest, 8);
    let trivial = match s.trivial {
        0 => "",
        1 => " besides the one at +1",
        _ => " besides the two at +1 that every orbit of a family has",
    };
    match s.lost_by() {
        None => format!("stable: all multipliers within the unit circle (largest {size}{trivial})"),
        Some(by) => {
            let [above, below, complex] = s.outside;
            format!(
                "unstable by {by}: largest multiplier {size}{trivial}; outside the unit circle {above} real above +1, {below} real below -1, {complex} complex"
            )
        }
    }
}

/// What there is to say of the feedback of a viscous orbit, with labels.
fn viscous_text(o: &Orbit) -> Vec<(&'static str, String)> {
    let Some(v) = &o.viscous else { return vec![] };
    let feedback = format!(
        "alpha = {}, beta = {}; handed round a period: {}, {} of the energy",
        significant(v.alpha, 10),
        significant(v.beta, 6),
        significant(v.turned_over, 6),
        significant(v.turned_over / o.energy, 3)
    );
    let mut lines = vec![("viscous", MEANING.to_owned()), ("", feedback)];
    if let (Some(own), Some(load)) = (&o.stability, &v.under_load) {
        let text = format!(
            "largest {} of the self-excited system (besides the one at +1; no statement about the body), {} of the damped body with alpha M v(t) as a load",
            significant(own.largest, 8),
            significant(load.largest, 8)
        );
        lines.push(("multipliers", text));
    }
    lines
}

/// A body that walks less in a period, over its amplitude, stays where it is.
const STANDS: f64 = 1e-9;

/// What friction takes in a period, over the energy, where it is rounding.
const NOTHING: f64 = 1e-10;

/// Whether friction takes nothing although something touches: all points stick throughout (`within`), or some slip for an instant (`limit`).
fn shakedown(o: &Orbit) -> Option<&'static str> {
    let rubbed = o.rubbed.as_ref()?;
    let is_held = o.residual_positions().is_some_and(|k| k > 0);
    let takes_nothing = rubbed.work().abs() <= NOTHING * o.energy.abs();
    let word = if o.switches.is_empty() { "within" } else { "limit" };
    (is_held && takes_nothing).then_some(word)
}

/// What there is to say of friction.
fn friction_text(o: &Orbit) -> Option<String> {
    let rubbed = o.rubbed.as_ref()?;
    let mut text = format!("takes {} a period", significant(rubbed.work(), 10));
    match shakedown(o) {
        Some("within") => text += ": it has shaken down, all that touches sticks throughout",
        Some(_) => text += ", no more than rounding: it is at the limit of shaking down",
        None => {}
    }
    if rubbed.belt != 0.0 {
        let _ = write!(text, ", the surface that moves gives {}", significant(rubbed.belt, 10));
    }
    if let Some(drift) = o.drift.filter(|d| d.abs() > STANDS * o.amplitude) {
        let drift = significant(drift, 6);
        let _ = write!(text, "; the body walks by {drift} a period, and comes back but for that");
    }
    if let Some(k) = o.residual_positions().filter(|k| *k > 0) {
        let s = if k == 1 { "" } else { "s" };
        let _ = write!(
            text,
            "; one of a family with {k} parameter{s}: friction holds the body in any of its residual positions, this one asked for the least change"
        );
    }
    Some(text)
}

/// An orbit in words.
pub(super) fn orbit_text(o: &Orbit, is_around_equilibrium: bool) -> String {
    let mut out = String::new();
    let mut line = |label: &str, text: String| {
        let _ = writeln!(out, "  {label:<14}{text}");
    };
    line(
        "orbit",
        match o.closure.periods() {
            1 => format!(
                "omega = {}, period {}",
                significant(o.omega(), 10),
                significant(o.period, 10)
            ),
            k => format!(
                "omega = {}, period {}: {k} of the loads",
                significant(o.omega(), 10),
                significant(o.period, 10)
            ),
        },
    );
    let when = if o.viscous.is_some() { "at t = 0" } else { "at most" };
    line(
        "energy",
        format!(
            "{} {when}; largest contact displacement {}",
            significant(o.energy, 10),
            significant(o.amplitude, 7)
        ),
    );
    if is_around_equilibrium {
        line("", AROUND.into());
    }
    line(
        "residual",
        format!(
            "{:.1e} after a period of the event-driven integrator, {} Newton steps",
            o.residual, o.iterations
        ),
    );
    let switches = format!("{} switches", o.switches.len());
    line(
        "contact",
        match o.grazing.is_finite() {
            true => format!(
                "{switches}; touches during {} of the period; {:.1e} from grazing",
                significant(o.contact_time / o.period, 4),
                o.grazing
            ),
            false => switches,
        },
    );
    line(
        "admissible",
        format!(
            "penetration {:.1e}, tension {:.1e}, every switch proved",
            o.penetration, o.tension
        ),
    );
    line(
        "balance",
        format!(
            "{:.1e} of the energy is not accounted for; the jumps add up to {:.1e}",
            o.balance,
            o.jumps.abs()
        ),
    );
    if let Some(text) = friction_text(o) {
        line("friction", text);
    }
    if o.viscous.is_some() {
        viscous_text(o).into_iter().for_each(|(label, text)| line(label, text));
        return out;
    }
    line("stability", stability_text(o));
    out
}
