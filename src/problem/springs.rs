//! Obstacles that push like springs: penalty, Nitsche's method.

use super::ProblemError;
use super::body::{assemble, check_edge_moves, empty, gaps_at};
use super::given::given_matrices;
use crate::contact::{ContactError, Law, SpringPoint, System, at_displacements, on_edge};
use crate::scenario::{BodyKind, Contact, ContactMethod, Issue, Scene};

/// What pushes; none for methods whose conditions hold at nodes.
pub(super) fn law(contact: &Contact) -> Option<Law> {
    match contact.method {
        ContactMethod::Penalty => {
            Some(Law::Penalty { stiffness: contact.stiffness.unwrap_or(1.0) })
        }
        ContactMethod::Nitsche => Some(Law::Nitsche {
            gamma: contact.gamma.unwrap_or(2.0),
            theta: contact.theta.unwrap_or(1.0),
        }),
        _ => None,
    }
}

/// The body with its springs.
pub(super) fn system(scene: &Scene, contact: &Contact, law: Law) -> Result<System, ProblemError> {
    let (body, mut points, mut gap) = match scene.body.kind {
        BodyKind::Matrices => {
            let (body, rows, gap) = given_matrices(scene, false)?;
            let points = at_displacements(&body, &rows);
            (body, points, gap)
        }
        _ => {
            let body = assemble(scene);
            if let Some(issue) = empty(scene, &body) {
                return Err(scene.error(issue).into());
            }
            let mut points = vec![];
            if let Some(edge) = contact.edge {
                check_edge_moves(scene, &body, edge)?;
                points = on_edge(&body, edge);
            }
            let mut gap = vec![];
            if let Some(field) = &contact.gap {
                gap = gaps_at(scene, "contact.gap", field, points.iter().map(|p| p.place))?;
            }
            (body, points, gap)
        }
    };
    if let Some(field) = &contact.gap_behind {
        let places = points.iter().map(|p| p.place);
        gap.extend(gaps_at(scene, "contact.gap_behind", field, places)?);
        let behind: Vec<SpringPoint> = points.iter().map(SpringPoint::behind).collect();
        points.extend(behind);
    }
    System::with_springs(body, points, gap, law).map_err(|e| match e {
        ContactError::NotCoercive { bound, .. } => {
            let message = e.to_string();
            let help = format!("give gamma = 2.0, or another number above {bound:.6}");
            scene.error(Issue::new("contact.gamma", message, help)).into()
        }
        ContactError::TooStiff { .. } => {
            let key = if matches!(law, Law::Penalty { .. }) { "stiffness" } else { "gamma" };
            let issue =
                Issue::new(format!("contact.{key}"), e.to_string(), "give a smaller number");
            scene.error(issue).into()
        }
        other => other.into(),
    })
}
