//! Probes of a scene on its body.

use super::ProblemError;
use super::places::place;
use crate::fem::formats::DofName;
use crate::fem::{Body, Nowhere, Probe, Spot};
use crate::mesh::{Point, bounds};
use crate::scenario::{BodyKind, Issue, Scene};

/// All probes; those that lie nowhere are refused.
pub(super) fn probes(scene: &Scene, body: &Body) -> Result<Vec<Probe>, ProblemError> {
    let mut all = vec![];
    for (i, probe) in scene.probes.iter().enumerate() {
        let key = |name: &str| format!("probe[{i}].{name}");
        let fail = |name: &str, message: String, help: String| {
            Err(scene.error(Issue::new(key(name), message, help)).into())
        };
        let of_rows = scene.body.kind == BodyKind::Matrices;
        let count = if of_rows { body.dofs.n_rows() } else { body.mesh.n_nodes() };
        let spot = match (&probe.at, probe.group(), probe.node) {
            (Some(at), _, _) => {
                let mut p = Point::default();
                p.iter_mut().zip(at).for_each(|(x, at)| *x = *at);
                Spot::Place(p)
            }
            (_, Some(group), _) => Spot::Group(group.to_owned()),
            (_, _, node) => {
                let node = node.unwrap_or_default();
                if node >= count {
                    let what = if of_rows { "rows" } else { "nodes" };
                    let message = format!("{node}: the {what} count from 0 to {}", count - 1);
                    return fail("node", message, format!("give a number below {count}"));
                }
                match (of_rows, scene.rows.called_oblique(&key("node"))) {
                    (true, true) => Spot::Rows(vec![(node, 1.0)]),
                    (true, false) => Spot::Rows(scene.rows.terms(node)),
                    (false, _) => Spot::Node(node),
                }
            }
        };
        let dim = body.mesh.dim();
        match Probe::new(body, &probe.name, &spot, &probe.quantity) {
            Ok(mut new) => {
                // rows with names say along what they are
                let oblique = scene.rows.called_oblique(&key("node"));
                new.axis = probe.node.and_then(|row| match oblique {
                    true => scene.rows.suffix(row),
                    false => scene.rows.name(row).map(DofName::along),
                });
                all.push(new);
            }
            Err(why) => {
                let Spot::Place(p) = spot else { continue };
                let [low, high] = bounds(body.mesh.nodes());
                let axes = ["x", "y", "z"];
                let range = |c: usize| format!("{} from {} to {}", axes[c], low[c], high[c]);
                let ranges: Vec<String> = (0..dim).map(range).collect();
                let (message, help) = match why {
                    Nowhere::Outside => (
                        format!("{} lies in no element", place(p, dim)),
                        format!("give a place in the body: {}", ranges.join(", ")),
                    ),
                    Nowhere::Between => (
                        format!("{} lies where two surfaces touch", place(p, dim)),
                        "give a place inside one of them, or node = one of their nodes".to_owned(),
                    ),
                };
                return fail("at", message, help);
            }
        }
    }
    Ok(all)
}
