//! The same body in another finite element program: what both make of one mesh and its data.

use std::convert::Infallible;
use std::path::Path;
use std::time::Instant;

use serde_json::{Value, json};

use signorini::event::{self, Observer, Options, Sample};
use signorini::fem::{MassForm, StressState, eigen, shape};
use signorini::report::precision::Elsewhere;
use signorini::scenario::Integrator;
use signorini::simulate::by_name;

use super::TIGHT;
use super::bench::Bench;
use super::peer::Peer;
use crate::cli::CliError;

/// How many frequencies are compared.
const FREQUENCIES: usize = 5;
/// Samples of the contact force, besides those at switches.
const SAMPLES: usize = 2000;

/// What another program and signorini find for a scene.
pub(super) fn compare(peer: Peer, bench: &Bench) -> Result<Elsewhere, CliError> {
    let name = peer.name();
    let file = std::env::temp_dir().join(format!("signorini-{name}-{}.json", std::process::id()));
    write(&file, &body(peer, bench)?)?;
    let answer = peer.ask(&file, 1)?;
    let line = answer.lines().last().unwrap_or_default();
    let theirs: Value = serde_json::from_str(line)
        .map_err(|e| CliError::Other(format!("the peer {name} answered {line}: {e}")))?;
    let number = |key: &str| theirs[key].as_f64();
    let frequencies: Vec<f64> =
        theirs["frequencies"].as_array().into_iter().flatten().filter_map(Value::as_f64).collect();
    let begun = Instant::now();
    let own = frequencies_of(bench)?;
    let contact = contact_of(bench)?;
    let both = |own: Option<f64>, key: &str| own.zip(number(key)).map(|(a, b)| [a, b]);
    Ok(Elsewhere {
        program: if peer == Peer::Calculix { "CalculiX" } else { "GetFEM" }.into(),
        frequencies: own.into_iter().zip(frequencies).map(|(a, b)| [a, b]).collect(),
        touch: both(contact.ends.map(|e| e[0]), "touch"),
        contact_time: contact
            .ends
            .zip(number("touch").zip(number("release")))
            .map(|(own, (touch, release))| [own[1] - own[0], release - touch]),
        impulse: both(Some(contact.impulse), "impulse"),
        force: both(Some(contact.force), "force"),
        energy: both(Some(contact.energy), "energy"),
        steps: theirs["steps"].as_u64().unwrap_or(0),
        wall_s: [begun.elapsed().as_secs_f64(), number("wall_s").unwrap_or(f64::NAN)],
    })
}

fn write(path: &Path, body: &Value) -> Result<(), CliError> {
    std::fs::write(path, body.to_string())
        .map_err(|e| CliError::Other(format!("{}: {e}", path.display())))
}

/// The mesh and the data, as `validate/peers/getfem_peer.py` and `calculix_peer.py` read them.
fn body(peer: Peer, bench: &Bench) -> Result<Value, CliError> {
    let system = &bench.problem.system;
    let body = &system.body;
    let (mesh, dofs) = (&body.mesh, body.nodal_dofs());
    let refuse = |what: &str| CliError::Input(format!("the peer {} takes {what}", peer.name()));
    let material = match body.materials() {
        [one] if mesh.dim() > 1 => *one,
        _ => return Err(refuse("bodies of one material in the plane, around an axis or in space")),
    };
    if body.reduction().is_some() || system.promise().yields || system.loads.constant.is_some() {
        return Err(refuse("whole bodies without loads, whose contact does not yield"));
    }
    if body.mass_form == MassForm::ScaledDiagonal {
        return Err(refuse("a consistent or a lumped mass"));
    }
    let (state, thickness) = match material.state {
        StressState::PlaneStress { thickness } => ("plane stress", thickness),
        StressState::PlaneStrain { thickness } => ("plane strain", thickness),
        StressState::Axisymmetric => ("axisymmetric", 1.0),
        StressState::Solid => ("solid", 1.0),
        StressState::Uniaxial { .. } => return Err(refuse("bodies in the plane or in space")),
    };
    let mut held = vec![];
    for node in 0..mesh.n_nodes() {
        for (along, _) in dofs.directions(node).filter(|(_, place)| place.is_none()) {
            held.push(json!({"node": node, "along": &along[..mesh.dim()]}));
        }
    }
    if system.gaps().len() != system.constraints.len() {
        return Err(refuse("obstacles on one side"));
    }
    let contact: Vec<Value> = system
        .constraints
        .iter()
        .zip(system.gaps())
        .map(|(c, gap)| json!({"node": c.node, "normal": &c.normal[..mesh.dim()], "gap": gap}))
        .collect();
    let blocks: Vec<Value> = mesh
        .blocks()
        .iter()
        .map(|b| {
            let places: Vec<_> = shape::places(b.kind).iter().map(|p| &p[..mesh.dim()]).collect();
            let elements: Vec<_> = b.connectivity.chunks_exact(b.kind.nodes()).collect();
            json!({"kind": b.kind.name(), "places": places, "elements": elements})
        })
        .collect();
    let size = mesh.elements().map(|e| smallest(e.nodes, mesh.nodes(), e.kind.corners()));
    let initial = &bench.problem.initial;
    let (u, v) = initial.full(system).map_err(|e| CliError::Numerics(e.to_string()))?;
    Ok(json!({
        "dim": mesh.dim(), "nodes": mesh.nodes().iter().map(|p| &p[..mesh.dim()]).collect::<Vec<_>>(),
        "blocks": blocks, "state": state, "thickness": thickness,
        "young": material.young, "poisson": material.poisson, "density": material.density,
        "lumped": body.mass_form == MassForm::Lumped, "held": held, "contact": contact,
        "u0": dofs.scatter(&u), "v0": dofs.scatter(&v), "until": bench.options.until,
        "unit": bench.omega, "size": size.fold(f64::INFINITY, f64::min),
        "wave_speed": material.wave_speed(),
    }))
}

/// The smallest distance between two corners of an element.
fn smallest(nodes: &[usize], places: &[[f64; 3]], corners: usize) -> f64 {
    let own = &nodes[..corners];
    let pairs = own.iter().enumerate().flat_map(|(k, a)| own[..k].iter().map(move |b| (*a, *b)));
    let distance = |(a, b): (usize, usize)| {
        (0..3).map(|c| (places[a][c] - places[b][c]).powi(2)).sum::<f64>().sqrt()
    };
    pairs.map(distance).fold(f64::INFINITY, f64::min)
}

/// The lowest frequencies of the body without contact, rigid motions left out.
fn frequencies_of(bench: &Bench) -> Result<Vec<f64>, CliError> {
    let body = &bench.problem.system.body;
    let modes = eigen::lowest(&body.stiffness, &body.mass, FREQUENCIES + 6, bench.omega)
        .map_err(|e| CliError::Numerics(e.to_string()))?;
    let elastic = modes.omega.into_iter().filter(|w| *w > 1e-2 * bench.omega);
    Ok(elastic.take(FREQUENCIES).collect())
}

/// Times and forces of the contact.
#[derive(Default)]
struct Contact<'a> {
    areas: Vec<&'a f64>,
    last: Option<(f64, f64)>,
    impulse: f64,
    force: f64,
    /// Largest change of the energy, over that at the start.
    energy: f64,
    start: Option<f64>,
    ends: Option<[f64; 2]>,
}

impl Observer for Contact<'_> {
    type Error = Infallible;
    fn sample(&mut self, s: &Sample) -> Result<(), Infallible> {
        let force: f64 = s.pressure.iter().zip(&self.areas).map(|(p, a)| p * *a).sum();
        if let Some((t, before)) = self.last {
            self.impulse += 0.5 * (s.t - t) * (force + before);
        }
        self.force = self.force.max(force);
        if let Some(e) = &s.energies {
            let now = e.kinetic + e.elastic;
            let start = *self.start.get_or_insert(now);
            self.energy = self.energy.max((now / start - 1.0).abs());
        }
        self.last = Some((s.t, force));
        Ok(())
    }
}

fn contact_of<'a>(bench: &Bench<'a>) -> Result<Contact<'a>, CliError> {
    let problem = bench.problem;
    let areas = problem.system.constraints.iter().map(|c| &c.area).collect();
    let mut contact = Contact { areas, ..Contact::default() };
    let mut flow = by_name(Integrator::Auto, &problem.system, TIGHT);
    let options = Options { samples: SAMPLES, ..bench.options };
    let report =
        event::run(&problem.system, &problem.initial, &options, flow.as_mut(), &mut contact)
            .map_err(|e| CliError::Numerics(e.to_string()))?;
    let ends = report.switches.first().zip(report.switches.last());
    contact.ends = ends.map(|(first, last)| [first.t, last.t]);
    Ok(contact)
}
