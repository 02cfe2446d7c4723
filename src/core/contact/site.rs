//! Places before an obstacle at which displacements have inertia: points of quadrature on an edge, nodes, displacements of given matrices.

use super::boundary;
use crate::fem::{Body, ContactPoint, ContactRows};
use crate::mesh::Point;

/// A place where the obstacle can push.
#[derive(Debug, Clone, PartialEq)]
pub struct Site {
    /// Which of the groups before obstacles it belongs to.
    pub group: usize,
    /// The node that it is; points of quadrature are none.
    pub node: Option<usize>,
    /// Place on the undeformed body.
    pub place: Point,
    /// Direction of the displacement that the obstacle limits.
    pub normal: Point,
    /// Area.
    pub weight: f64,
    /// `E′/h`; one where stiffnesses are absolute.
    pub unit: f64,
    /// `n`: displacement along the normal, entries over the displacements `u_O` of the body.
    pub displacement: Vec<(usize, f64)>,
    /// `s`: normal stress, likewise.
    pub stress: Vec<(usize, f64)>,
    /// The obstacle behind: the terms of the stress alone are those of the point in front.
    is_behind: bool,
}

impl Site {
    /// Whether it belongs to the obstacle behind.
    pub fn is_behind(&self) -> bool {
        self.is_behind
    }

    /// A point on the other side: the obstacle behind.
    pub fn behind(&self) -> Site {
        let turned = |row: &[(usize, f64)]| row.iter().map(|&(j, v)| (j, -v)).collect();
        Site {
            normal: self.normal.map(|x| -x),
            displacement: turned(&self.displacement),
            stress: turned(&self.stress),
            is_behind: true,
            ..self.clone()
        }
    }
}

/// The points of quadrature before obstacles, of a body whose contact displacements move by themselves.
pub fn on_sides(body: &Body) -> Vec<Site> {
    let dofs = &body.dofs;
    let spring = |point: boundary::EdgePoint| {
        let normal = point.direction(dofs);
        Site {
            group: point.group,
            node: None,
            place: point.place,
            normal,
            weight: point.weight,
            unit: point.material.axial_stiffness() / point.size,
            displacement: point.displacement(dofs, normal),
            stress: point.stress(dofs, normal),
            is_behind: false,
        }
    };
    let mut points: Vec<Site> = boundary::quadrature(body).into_iter().map(spring).collect();
    // the obstacle cannot push at what a support holds
    points.retain(|p| !p.displacement.is_empty());
    points
}

/// Springs at displacements of a body of given matrices: stiffnesses are absolute, and a pressure is a force.
pub fn at_displacements(body: &Body, rows: &ContactRows) -> Vec<Site> {
    let at = |(k, &row): (usize, &usize)| Site {
        group: rows.groups.get(k).copied().unwrap_or(0),
        node: Some(row),
        place: body.mesh.nodes()[row],
        normal: [1.0, 0.0, 0.0],
        weight: 1.0,
        unit: 1.0,
        displacement: vec![(body.dofs.row(row), 1.0)],
        stress: vec![],
        is_behind: false,
    };
    rows.facing.iter().enumerate().map(at).collect()
}

/// The contact nodes of a body whose contact displacements move by themselves, with these areas.
pub(super) fn at_nodes(body: &Body, area: &[f64]) -> Vec<Site> {
    let dofs = &body.dofs;
    let at = |k: usize| {
        let ContactPoint { node, direction, group, .. } = dofs.contact[k];
        Site {
            group,
            node: Some(node),
            place: body.mesh.nodes()[node],
            normal: direction,
            weight: area[k],
            unit: 1.0,
            displacement: vec![dofs.contact_place(k)],
            stress: vec![],
            is_behind: false,
        }
    };
    (0..dofs.contact.len()).map(at).collect()
}

/// `x + c y` of rows.
pub(super) fn combine(x: &[(usize, f64)], y: &[(usize, f64)], c: f64) -> Vec<(usize, f64)> {
    let mut sum = x.to_vec();
    for &(j, y) in y.iter().filter(|_| c != 0.0) {
        match sum.iter_mut().find(|e| e.0 == j) {
            Some(e) => e.1 += c * y,
            None => sum.push((j, c * y)),
        }
    }
    sum
}
