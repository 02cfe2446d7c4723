//! `signorini modes`

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use nalgebra::Complex;
use serde_json::json;

use signorini::contact::phase_modes;
use signorini::contact::{States, System};
use signorini::fem::eigen;
use signorini::flow::{ComplexMode, complex_modes};
use signorini::report::summary::{mesh_warning, significant};
use signorini::scenario::{Issue, Scene};

use super::{Answer, CliError, Global, load};

/// Growth over the size of an eigenvalue that is more than rounding.
const GROWS: f64 = 1e-9;

/// Arguments of `modes`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini modes scenarios/plate.toml --count 4\n  signorini modes scenarios/squeal-belt.toml --sliding"
)]
pub struct Arguments {
    /// The scene (TOML)
    scene: PathBuf,
    /// How many modes
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..))]
    count: u32,
    /// Complex modes of the body that slides steadily on a moving surface, those that grow fastest first: which of them squeal
    #[arg(long)]
    sliding: bool,
}

/// So many frequencies of the body with all its mass are told.
const MASSIVE: usize = 3;

/// Complex modes about steady sliding: the static balance in which every point that touches slips against its surface.
fn sliding(
    scene: &Scene,
    system: &System,
    count: usize,
    global: &Global,
) -> Result<Answer, CliError> {
    let moves = system.tangents().is_some_and(|t| t.iter().flatten().any(|t| t.surface != 0.0));
    if !moves {
        let message = "is missing: steady sliding is that on a surface which moves";
        let help =
            "give surface = [0.0, 0.05] beside friction, the velocity of the obstacle along itself";
        return Err(scene.error(Issue::new("contact.surface", message, help)).into());
    }
    let numerics = |e: &dyn std::fmt::Display| CliError::Numerics(e.to_string());
    let (set, _) = system.equilibrium().map_err(|e| numerics(&e))?;
    let all = complex_modes(system, &system.phase(&set)).map_err(|e| numerics(&e))?;
    let unstable = all.iter().filter(|m| m.lambda.re > GROWS * m.lambda.norm()).count();
    let shown = &all[..count.min(all.len())];
    Ok(global.answer(
        || {
            let part = |m: &ComplexMode, of: fn(&Complex<f64>) -> f64| {
                let x: Vec<f64> = m.shape.iter().map(of).collect();
                system.body.nodal_o(&x).to_vec()
            };
            let mode = |m: &ComplexMode| {
                json!({"growth": m.lambda.re, "omega": m.lambda.im, "real": part(m, |z| z.re), "imaginary": part(m, |z| z.im)})
            };
            let modes: Vec<_> = shown.iter().map(mode).collect();
            json!({"title": scene.title, "n_o": system.n_o(), "active": set.to_string(), "unstable": unstable, "sliding": modes})
        },
        || {
            let mut text = format!(
                "{}\n  steady sliding: {}\n  states of the contact points {set}\n  mode       growth rate            omega         period\n",
                scene.title,
                match unstable {
                    0 => "stable".to_owned(),
                    1 => "unstable, 1 mode grows".to_owned(),
                    k => format!("unstable, {k} modes grow"),
                }
            );
            for (k, m) in shown.iter().enumerate() {
                let period = match m.lambda.im > 0.0 {
                    true => significant(std::f64::consts::TAU / m.lambda.im, 7),
                    false => "none".into(),
                };
                let (growth, omega) = (significant(m.lambda.re, 10), significant(m.lambda.im, 10));
                let _ = writeln!(text, "  {:>4} {growth:>17} {omega:>16} {period:>14}", k + 1);
            }
            if unstable > 0 && system.damping.is_none_or(|d| d.beta == 0.0) {
                text.push_str("  WARNING       nothing damps in proportion to the stiffness: the finer the mesh, the more modes grow\n");
            }
            text
        },
    ))
}

/// Circular frequencies of the body with the mass that its contact displacements have in it, where the method leaves them none: the difference is the method's, and vanishes with the mesh size.
fn with_all_mass(system: &System, count: usize) -> Option<Vec<f64>> {
    let body = &system.body;
    let is_whole = system.n_contact() > 0 && !system.contact_has_inertia();
    let is_body = body.mass.n_rows() == system.n() && system.n_remembered() == 0;
    if !(is_whole && is_body) {
        return None;
    }
    // a mass that no motion lacks
    let modes = eigen::lowest(&body.stiffness, &body.mass, count, system.units.frequency).ok()?;
    modes.omega.iter().all(|w| w.is_finite()).then_some(modes.omega)
}

/// Natural frequencies of the open and of the closed phase.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let mut scene = global.scene(&arguments.scene)?;
    // an amplitude is chosen by what this command shows
    (scene.initial.mode, scene.initial.amplitude) = (None, None);
    let problem = load::of_scene(&scene)?;
    let system = &problem.system;
    let count = arguments.count as usize;
    if arguments.sliding {
        return sliding(&scene, system, count, global);
    }
    let modes = |set: States| {
        let phase = system.phase(&set);
        phase_modes(system, &phase, count).map_err(|e| CliError::Numerics(e.to_string()))
    };
    let open = modes(States::open(system.n_contact()))?;
    let closed = match system.n_contact() {
        0 => None,
        // forces without a potential have no natural modes
        _ if !system.has_potential() && system.tangents().is_none() => None,
        _ => Some(modes(system.closed_states())?),
    };
    let massive = with_all_mass(system, count.min(MASSIVE));
    // around the equilibrium, where the scene asks for it
    let at_rest = match system.rest() {
        Some(rest) => Some((rest.set.to_string(), modes(rest.set.clone())?)),
        None => None,
    };
    Ok(global.answer(
        || {
            let object = |m: &signorini::fem::Modes| {
                let shapes: Vec<_> = m.shapes.iter().map(|x| system.body.nodal_o(x)).collect();
                json!({"omega": m.omega, "shapes": shapes})
            };
            json!({"title": scene.title, "n_o": system.n_o(), "open": object(&open), "closed": closed.as_ref().map(object),
                "rest": at_rest.as_ref().map(|(set, m)| {
                    let mut rest = object(m);
                    rest["active"] = set.as_str().into();
                    rest
                }),
                "with_contact_mass": massive, "warning": mesh_warning(system), "warnings": problem.notes.warnings})
        },
        || {
            let mut text = format!("{}\n  mode        open body: omega         period        closed body: omega         period\n", scene.title);
            let entry = |w: Option<&f64>| match w {
                Some(&w) if w > 0.0 => {
                    let period = significant(std::f64::consts::TAU / w, 7);
                    format!("{:>16} {period:>14}", significant(w, 10))
                }
                Some(_) => format!("{:>16} {:>14}", 0, "rigid"),
                None => String::new(),
            };
            for k in 0..open.omega.len() {
                let right = closed.as_ref().and_then(|m| m.omega.get(k));
                let _ = writeln!(text, "  {:>4} {}   {}", k + 1, entry(open.omega.get(k)), entry(right));
            }
            if let Some(all) = &massive {
                let all: Vec<String> = all.iter().map(|w| significant(*w, 5)).collect();
                let _ = writeln!(
                    text,
                    "  note          the contact displacements have no mass of their own (method); with it: {}",
                    all.join(", ")
                );
            }
            if let Some((set, m)) = &at_rest {
                let _ = writeln!(text, "  at rest, states of the contact points {set}");
                for (k, w) in m.omega.iter().enumerate() {
                    let _ = writeln!(text, "  {:>4} {}", k + 1, entry(Some(w)));
                }
            }
            for warning in mesh_warning(system).iter().chain(&problem.notes.warnings) {
                let _ = writeln!(text, "  WARNING       {warning}");
            }
            text
        },
    ))
}
