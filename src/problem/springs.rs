//! Laws at displacements that have inertia: penalty, Nitsche's method, stops.

use std::sync::Arc;

use super::ProblemError;
use super::body::assemble;
use super::gaps::{gaps_at, gaps_to};
use super::given::given_matrices;
use crate::contact::{
    ContactError, Law, Nitsche, Penalty, Site, Stop, System, at_displacements, on_sides,
};
use crate::scenario::{BodyKind, Contact, ContactMethod, Issue, Scene};

/// The law; none for methods whose conditions hold at nodes.
pub(super) fn law(contact: &Contact) -> Option<Arc<dyn Law>> {
    match contact.method {
        ContactMethod::Penalty => {
            Some(Arc::new(Penalty { stiffness: contact.stiffness.unwrap_or(1.0) }))
        }
        ContactMethod::Nitsche => Some(Arc::new(Nitsche {
            gamma: contact.gamma.unwrap_or(2.0),
            theta: contact.theta.unwrap_or(1.0),
        })),
        ContactMethod::Stop => Some(Arc::new(Stop {
            stiffness: contact.stiffness.unwrap_or(1.0),
            preload: contact.preload.unwrap_or(0.0),
        })),
        _ => None,
    }
}

/// The body with its obstacles.
pub(super) fn system(
    scene: &Scene,
    contact: &Contact,
    law: Arc<dyn Law>,
) -> Result<System, ProblemError> {
    let (body, mut points, mut gap) = match scene.body.kind {
        BodyKind::Matrices => {
            let (body, rows, gap) = given_matrices(scene, false)?;
            let points = at_displacements(&body, &rows);
            (body, points, gap)
        }
        _ => {
            let body = assemble(scene)?;
            let points = on_sides(&body);
            let mut gap = vec![];
            for k in 0..contact.obstacles.len() {
                let own = points.iter().filter(|p| p.group == k).map(|p| p.place);
                gap.extend(gaps_to(scene, k, own)?);
            }
            (body, points, gap)
        }
    };
    for (k, obstacle) in contact.obstacles.iter().enumerate() {
        let Some(field) = &obstacle.gap_behind else { continue };
        let front = points.iter().filter(|p| p.group == k && !p.is_behind());
        let behind: Vec<Site> = front.map(Site::behind).collect();
        let places = behind.iter().map(|p| p.place);
        gap.extend(gaps_at(scene, &contact.key(k, "gap_behind"), field, places)?);
        points.extend(behind);
    }
    System::with_law(body, points, gap, law).map_err(|e| match e {
        ContactError::NotCoercive { bound, .. } => {
            let message = e.to_string();
            let enough = [2.0, (1.2 * bound).ceil()].into_iter().fold(0.0, f64::max);
            let help = format!("give gamma = {enough:?}, or another number above {bound:.6}");
            scene.error(Issue::new("contact.gamma", message, help)).into()
        }
        ContactError::TooStiff { .. } => {
            let key = if contact.method == ContactMethod::Nitsche { "gamma" } else { "stiffness" };
            let issue =
                Issue::new(format!("contact.{key}"), e.to_string(), "give a smaller number");
            scene.error(issue).into()
        }
        other => other.into(),
    })
}
