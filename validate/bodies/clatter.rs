//! Two cantilevers above each other that a force on the lower one makes clatter (Q9, 24 fixed-interface modes, `C = .2 K`): half strokes of the tip by an independent program.

use signorini::mesh::{ElementKind, Facet};
use signorini::orbit::Propagator;
use signorini::orbit::settle::{Settled, settle};
use signorini::problem::Problem;
use signorini::simulate::simulate;

use super::super::rectangle::rectangle;
use super::super::{Check, Trajectory, scene};
use super::meshes::Folder;
use super::plane;

/// Frequency, half stroke of the lower tip; upwards from the first: from rest the tip keeps to smaller motions at some of them.
const ROWS: [(f64, f64); 5] = [
    (0.095, 0.010_226),
    (0.100, 0.021_466),
    (0.102_5, 0.024_029),
    (0.105, 0.026_604),
    (0.107_5, 0.009_180),
];

/// Instants of a period.
const SAMPLES: usize = 2000;

/// A cantilever of eight elements; contact over the last two of one side.
fn cantilever(height: f64, side: &str) -> signorini::mesh::Mesh {
    let mesh = rectangle(ElementKind::Quad9, [0.0, 1.0], height, (8, 1), 0.0);
    let at_tip = |facet: &Facet| mesh.side_nodes(*facet).iter().all(|&n| mesh.nodes()[n][0] > 0.74);
    let tip: Vec<Facet> = mesh.group(side).iter().copied().filter(at_tip).collect();
    let left = mesh.group("left").to_vec();
    mesh.clone().with_groups([("left".to_owned(), left), (side.to_owned(), tip)])
}

pub(super) fn run(folder: &Folder, checks: &mut Vec<Check>) -> Result<(), String> {
    folder.put("below", &cantilever(0.1, "top"))?;
    folder.put("above", &cantilever(0.12, "bottom"))?;
    let text = |omega: f64| {
        plane(folder, "below", "")
            + &plane(folder, "above", "move = [0.0, 0.12]\n")
            + "[[support]]\ngroup = \"below:left\"\nfix = [\"x\", \"y\"]\n[[support]]\ngroup = \"above:left\"\nfix = [\"x\", \"y\"]\n\
               [[contact]]\nslave = \"below:top\"\nmaster = \"above:bottom\"\n\
               [damping]\nrayleigh = [0.0, 0.2]\n[reduction]\nkind = \"fixed-interface\"\nmodes = 24\n"
            + &format!(
                "[[load]]\nkind = \"point\"\nat = [1.0, 0.0]\namplitude = [0.0, 3.124e-7]\nomega = {omega:?}\n\
                 [run]\nperiods = 1\nsamples = {SAMPLES}\nintegrator = \"modal\"\n"
            )
    };
    let mut from: Option<Vec<f64>> = None;
    for (omega, expected) in ROWS {
        let scene = scene(&text(omega), None)?;
        let mut problem = Problem::new(&scene, None).map_err(|e| e.to_string())?;
        let other = Problem::new(&scene, None).map_err(|e| e.to_string())?;
        let mut body = Propagator::new(other.system).map_err(|e| e.to_string())?;
        let start = from.take().unwrap_or_else(|| body.frame(&problem.initial));
        let settled = settle(&mut body, &start, omega).map_err(|e| e.to_string())?;
        let Settled::Orbit(orbit) = settled.to else {
            return Err(format!("clatter at {omega}: no orbit attracts"));
        };
        problem.initial = orbit.state.clone();
        from = Some(orbit.z.clone());
        let mut seen = Trajectory::default();
        simulate(&scene, &problem, false, &mut seen).map_err(|e| e.to_string())?;
        let body = &problem.system.body;
        let node = body.mesh.nearest_node([1.0, 0.0, 0.0]);
        let height = |u: &Vec<f64>| {
            let nodal = body.nodal(u);
            body.nodal_dofs().terms(node, 1).map(|(i, c)| c * nodal[i]).sum::<f64>()
        };
        let heights: Vec<f64> = seen.u.iter().map(height).collect();
        let least = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let most = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let name = format!("clatter at {omega}");
        // printed with six places
        let off = 1e-6 / expected;
        checks.push(Check::near(
            format!("{name}: half stroke"),
            0.5 * (most - least),
            expected,
            off,
        ));
        if omega == 0.1025 {
            checks.push(Check::near(format!("{name}: start"), heights[0], 0.014_431_36, 4e-7));
        }
    }
    Ok(())
}
