//! Directions at nodes: what supports hold, what obstacles limit, and the local bases that keep both apart.
//!
//! At a node the displacements are counted along the rows of a basis `W`, `û = W u`: the contact directions `m_k`, the held directions, and what
//! completes them orthonormally. `W` is orthonormal but for a node with two contact directions; there the basis is oblique, and forces are
//! `f̂ = W⁻ᵀ f`. The axes themselves are the basis of every other node.

use std::collections::BTreeMap;
use std::sync::Arc;

use thiserror::Error;

use super::normals::{GroupNode, nodes_of};
use super::pair::{Against, Meeting, Sides};
use crate::mesh::point::{dot, norm, unit};
use crate::mesh::{Mesh, Point};

/// What a support holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fix {
    /// The displacement along an axis.
    Axis(usize),
    /// The displacement along the normal of a flat group: a plane of symmetry.
    Normal,
}

/// A support: displacements of a group that stay zero.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Held {
    /// Group of sides.
    pub group: String,
    /// What it holds.
    pub fix: Fix,
}

impl Held {
    /// Along an axis.
    pub fn along(group: &str, axis: usize) -> Held {
        Held { group: group.to_owned(), fix: Fix::Axis(axis) }
    }
}

/// A group of sides before an obstacle, or before another surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Facing {
    /// Group of sides.
    pub group: String,
    /// Outward normal of the body towards a rigid plane; none: contact is along the normals of the nodes.
    pub direction: Option<Point>,
    /// The surface that moves before it, of which the group is the slave; none: a rigid obstacle.
    pub meeting: Option<Arc<Meeting>>,
    /// In the plane: displacements along the obstacle give up their inertia, too.
    pub is_massless: bool,
}

impl Facing {
    /// Along the normals of the nodes.
    pub fn surface(group: &str) -> Facing {
        Facing { group: group.to_owned(), direction: None, meeting: None, is_massless: false }
    }

    /// Towards a rigid plane, where there is one.
    pub fn plane(group: &str, direction: Option<Point>) -> Facing {
        Facing { direction, ..Facing::surface(group) }
    }

    /// Before another surface.
    pub fn pair(meeting: Meeting) -> Facing {
        let group = meeting.pair.slave.clone();
        Facing { meeting: Some(Arc::new(meeting)), ..Facing::surface(&group) }
    }
}

/// A node that an obstacle faces in a direction, or that a slave meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPoint {
    /// The node.
    pub node: usize,
    /// `m`: the contact displacement is `m·u`.
    pub direction: Point,
    /// `n`: outward normal of the group at the node; of a master that of its own surface.
    pub normal: Point,
    /// Which of the groups before obstacles it belongs to (the first, where two are one); a master to that of its slave.
    pub group: usize,
}

/// Why directions do not go together.
#[derive(Debug, Clone, Error, PartialEq)]
pub enum FrameError {
    /// A held normal needs a flat group.
    #[error("the group \"{group}\" is not flat: its normals turn by {degrees:.3}°")]
    NotFlat {
        /// The group.
        group: String,
        /// Angle between its normals.
        degrees: f64,
    },
    /// An obstacle that does not face the group.
    #[error(
        "at node {node} the obstacle lies {degrees:.1}° off the normal of the group \"{group}\""
    )]
    Turned {
        /// Node.
        node: usize,
        /// The group.
        group: String,
        /// Angle between the direction of the contact and the normal of a side.
        degrees: f64,
    },
    /// Two directions that are neither one nor two.
    #[error("node {node} meets obstacles in two directions {degrees:.1}° apart")]
    Crossing {
        /// Node.
        node: usize,
        /// Angle between them.
        degrees: f64,
    },
    /// More directions than dimensions, or directions in one plane.
    #[error("the directions in which node {node} meets obstacles depend on each other")]
    TooMany {
        /// Node.
        node: usize,
    },
    /// A node of two pairs in one direction.
    #[error("node {node} meets two surfaces in one direction")]
    TwoMasters {
        /// Node.
        node: usize,
    },
    /// Pairs that refer to each other.
    #[error("the pair of \"{group}\" refers to itself: its masters are counted against its slaves")]
    Circle {
        /// Group of a slave.
        group: String,
    },
    /// A group that turns at a node by so much that it is two.
    #[error("the group \"{group}\" turns by {degrees:.1}° at node {node}")]
    Corner {
        /// Node.
        node: usize,
        /// The group.
        group: String,
        /// Angle between the normals of its sides there.
        degrees: f64,
    },
    /// A support holds a part of a contact displacement.
    #[error(
        "a support holds a part of the contact displacement of node {node}: {degrees:.1}° lie between the two directions"
    )]
    PartlyHeld {
        /// Node.
        node: usize,
        /// Angle between the held direction and that of the contact.
        degrees: f64,
        /// From this angle on the support turns the direction of the contact.
        least: f64,
    },
}

/// Cosine of the largest angle between the direction of a contact and a side's normal: 60°.
const FACES: f64 = 0.5;
/// Directions closer than this are one.
const ONE: f64 = 10.0;
/// Supports may turn the direction of a pair by this much.
const TURNED: f64 = 30.0;
/// Directions further apart than this are two (and closer than 180° minus it).
const TWO: f64 = 30.0;
/// Sides of one group that turn by more are no curved surface (a circle of eight sides turns by 45°).
const CORNER: f64 = 50.0;
/// Volume that three unit directions span at the least; two that are 30° apart span a half.
const LEAST: f64 = 0.1;
/// Flat means: normals within this, as a sine.
const FLAT: f64 = 1e-6;

/// `a + c b`
fn sum(a: &Point, c: f64, b: &Point) -> Point {
    std::array::from_fn(|k| a[k] + c * b[k])
}

fn degrees(a: &Point, b: &Point) -> f64 {
    dot(a, b).clamp(-1.0, 1.0).acos().to_degrees()
}

/// A basis `W` at a node and `W⁻¹`; rows are directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    pub rows: [Point; 3],
    pub inverse: [Point; 3],
    pub is_orthonormal: bool,
}

impl Frame {
    /// From directions with their slots; what is missing is completed. None where they depend on each other.
    fn new(dim: usize, directions: &[(usize, Point)]) -> Option<Frame> {
        let mut rows = [[0.0; 3]; 3];
        let mut given = vec![];
        for &(slot, d) in directions {
            rows[slot] = d;
            given.push(slot);
        }
        for slot in (0..3).filter(|s| !directions.iter().any(|d| d.0 == *s)) {
            // the axis of the slot, orthogonal to what is there; the first axis that is not spanned where that fails
            let candidates = std::iter::once(slot).chain(0..dim.max(slot + 1));
            for axis in candidates {
                let mut d = [0.0; 3];
                d[axis] = 1.0;
                let mut basis: Vec<Point> = vec![];
                for &g in &given {
                    let r = rows[g];
                    let rest = basis.iter().fold(r, |x: Point, b| sum(&x, -dot(&x, b), b));
                    basis.push(unit(rest));
                }
                let rest = basis.iter().fold(d, |x, b| sum(&x, -dot(&x, b), b));
                if norm(&rest) > 0.3 {
                    rows[slot] = unit(rest);
                    given.push(slot);
                    break;
                }
            }
        }
        let off = (0..3).flat_map(|a| (0..a).map(move |b| (a, b)));
        let largest = off.map(|(a, b)| dot(&rows[a], &rows[b]).abs()).fold(0.0, f64::max);
        let is_orthonormal = largest < 1e-12;
        let w = nalgebra::Matrix3::from_fn(|i, j| rows[i][j]);
        let inverse = match is_orthonormal {
            true => w.transpose(),
            false if w.determinant().abs() < LEAST => return None,
            false => w.try_inverse()?,
        };
        let inverse = std::array::from_fn(|i| std::array::from_fn(|j| inverse[(i, j)]));
        Some(Frame { rows, inverse, is_orthonormal })
    }

    fn is_identity(&self) -> bool {
        (0..3).all(|i| (0..3).all(|j| self.rows[i][j] == f64::from(u8::from(i == j))))
    }
}

/// What a slot of a node's basis is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Slot {
    Free,
    Held,
    /// Contact point of this number.
    Contact(usize),
}

/// All directions of a mesh.
#[derive(Debug, Clone, Default)]
pub(super) struct Frames {
    /// Bases other than the axes.
    pub of_node: BTreeMap<usize, Frame>,
    /// `dim` slots a node.
    pub slots: Vec<Slot>,
    /// Those that face something, then the nodes of masters that give up their inertia, then displacements along obstacles.
    pub contact: Vec<ContactPoint>,
    /// Number of those that face something.
    pub n_facing: usize,
    /// The displacements along obstacles, and the contact points that they are of.
    pub tangents: Vec<(usize, usize)>,
    /// `P_ij` of the nodes against whose displacements a contact point's is counted.
    pub against: Vec<Vec<(usize, f64)>>,
    /// Contact point of a node in a group.
    pub in_group: BTreeMap<(usize, usize), usize>,
}

impl Frames {
    /// Contact directions point outwards where their displacements stand `apart`; among all others they point along the axes like these.
    pub fn new(
        mesh: &Mesh,
        held: &[Held],
        facing: &[Facing],
        apart: bool,
    ) -> Result<Frames, FrameError> {
        let dim = mesh.dim();
        let held = held_directions(mesh, held)?;
        let mut frames =
            Frames { slots: vec![Slot::Free; dim * mesh.n_nodes()], ..Frames::default() };
        let wanted = contact_directions(mesh, &held, facing, &mut frames)?;
        let mut framed: Vec<usize> = held.keys().chain(wanted.keys()).copied().collect();
        framed.sort_unstable();
        framed.dedup();
        for node in framed {
            let none = vec![];
            let own = held.get(&node).unwrap_or(&none);
            let of_contact = wanted.get(&node).into_iter().flatten();
            let all = of_contact
                .map(|&i| (frames.contact[i].direction, Slot::Contact(i)))
                .chain(own.iter().map(|&d| (d, Slot::Held)));
            let mut placed: Vec<(usize, Point)> = vec![];
            for (direction, what) in all {
                let free = (0..dim).filter(|s| !placed.iter().any(|p| p.0 == *s));
                let best = free.max_by(|&a, &b| {
                    // the first of equals
                    direction[a].abs().total_cmp(&direction[b].abs()).then(b.cmp(&a))
                });
                let Some(slot) = best else { continue };
                let turned = !apart && direction[slot] < 0.0;
                placed.push((slot, if turned { direction.map(|x| -x) } else { direction }));
                frames.slots[dim * node + slot] = what;
            }
            let frame = Frame::new(dim, &placed).ok_or(FrameError::TooMany { node })?;
            if !frame.is_identity() {
                frames.of_node.insert(node, frame);
            }
        }
        Ok(frames)
    }
}

/// Orthonormal held directions of every node that a support holds.
fn held_directions(mesh: &Mesh, held: &[Held]) -> Result<BTreeMap<usize, Vec<Point>>, FrameError> {
    let mut all: BTreeMap<usize, Vec<Point>> = BTreeMap::new();
    for Held { group, fix } in held {
        let direction = match fix {
            Fix::Axis(axis) => std::array::from_fn(|c| f64::from(u8::from(c == *axis))),
            Fix::Normal => flat_normal(mesh, group)?,
        };
        for node in mesh.group_nodes(group) {
            let own = all.entry(node).or_default();
            let rest = own.iter().fold(direction, |x, h| sum(&x, -dot(&x, h), h));
            if norm(&rest) > FLAT {
                own.push(unit(rest));
            }
        }
    }
    Ok(all)
}

/// The normal of a flat group.
fn flat_normal(mesh: &Mesh, group: &str) -> Result<Point, FrameError> {
    let nodes = nodes_of(mesh, group);
    let sides = || nodes.iter().flat_map(|n| &n.sides);
    let mean = unit(sides().fold([0.0; 3], |m, n| sum(&m, 1.0, n)));
    let off = sides().map(|n| degrees(n, &mean)).fold(0.0, f64::max);
    let sine = sides().map(|n| norm(&sum(n, -dot(n, &mean), &mean))).fold(0.0, f64::max);
    match sine <= FLAT {
        true => Ok(mean),
        false => Err(FrameError::NotFlat { group: group.to_owned(), degrees: 2.0 * off }),
    }
}

/// The contact points, and which of them each node has.
fn contact_directions(
    mesh: &Mesh,
    held: &BTreeMap<usize, Vec<Point>>,
    facing: &[Facing],
    frames: &mut Frames,
) -> Result<BTreeMap<usize, Vec<usize>>, FrameError> {
    let mut wanted: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (group, of) in facing.iter().enumerate() {
        let of_pair = |a: &Against| (a.node, a.masters.clone());
        let mut seen: Option<BTreeMap<usize, Vec<(usize, f64)>>> =
            of.meeting.as_ref().map(|m| m.nodes.iter().map(of_pair).collect());
        for GroupNode { node, normal, sides } in nodes_of(mesh, &of.group) {
            let masters = match &mut seen {
                None => vec![],
                Some(seen) => match seen.remove(&node) {
                    Some(masters) => masters,
                    None => continue,
                },
            };
            let mut direction = of.direction.unwrap_or(normal);
            let least = sides.iter().map(|n| dot(n, &direction)).fold(1.0, f64::min);
            if least < FACES || least.is_nan() {
                let degrees = least.clamp(-1.0, 1.0).acos().to_degrees();
                return Err(FrameError::Turned { node, group: of.group.clone(), degrees });
            }
            // one displacement cannot stand for two walls
            let turn = sides.iter().flat_map(|a| sides.iter().map(|b| degrees(a, b)));
            let turn = turn.fold(0.0, f64::max);
            if of.direction.is_none() && turn > CORNER {
                return Err(FrameError::Corner { node, group: of.group.clone(), degrees: turn });
            }
            if let Some(own) = held.get(&node) {
                let most = if of.meeting.is_some() { TURNED } else { ONE };
                match beside(&direction, own, most) {
                    Ok(Some(rest)) => direction = rest,
                    Ok(None) => continue,
                    Err(degrees) => {
                        let least = 90.0 - most;
                        return Err(FrameError::PartlyHeld { node, degrees, least });
                    }
                }
            }
            let known = wanted.entry(node).or_default();
            let apart = |c: &ContactPoint| degrees(&direction, &c.direction);
            if let Some(&other) = known.iter().find(|&&k| apart(&frames.contact[k]) < ONE) {
                if !masters.is_empty() || !frames.against[other].is_empty() {
                    return Err(FrameError::TwoMasters { node });
                }
                // one direction: between the two
                let both = &mut frames.contact[other];
                both.direction = unit(sum(&both.direction, 1.0, &direction));
                both.normal = unit(sum(&both.normal, 1.0, &normal));
                frames.in_group.insert((group, node), other);
                continue;
            }
            let mut angles = known.iter().map(|&k| apart(&frames.contact[k]));
            if let Some(degrees) = angles.find(|a| !(TWO..=180.0 - TWO).contains(a)) {
                return Err(FrameError::Crossing { node, degrees });
            }
            let taken = known.len() + held.get(&node).map_or(0, Vec::len);
            if taken == mesh.dim() {
                return Err(FrameError::TooMany { node });
            }
            known.push(frames.contact.len());
            frames.in_group.insert((group, node), frames.contact.len());
            frames.contact.push(ContactPoint { node, direction, normal, group });
            frames.against.push(masters);
        }
    }
    frames.n_facing = frames.contact.len();
    master_directions(mesh, held, facing, (frames, &mut wanted))?;
    tangent_directions(mesh, held, facing, (frames, &mut wanted));
    Ok(wanted)
}

/// Displacements along obstacles that give up their inertia: the outward normal turned by +90°, where that is free.
fn tangent_directions(
    mesh: &Mesh,
    held: &BTreeMap<usize, Vec<Point>>,
    facing: &[Facing],
    (frames, wanted): (&mut Frames, &mut BTreeMap<usize, Vec<usize>>),
) {
    for point in 0..frames.n_facing {
        let ContactPoint { node, direction: [nx, ny, _], group, .. } = frames.contact[point];
        let known = wanted.entry(node).or_default();
        let taken = known.len() + held.get(&node).map_or(0, Vec::len);
        if !facing[group].is_massless || taken == mesh.dim() {
            continue;
        }
        let direction = [-ny, nx, 0.0];
        known.push(frames.contact.len());
        frames.tangents.push((frames.contact.len(), point));
        frames.contact.push(ContactPoint { node, direction, normal: direction, group });
        frames.against.push(vec![]);
    }
}

/// The normal displacements of masters that give up their inertia: contact displacements that face nothing.
fn master_directions(
    mesh: &Mesh,
    held: &BTreeMap<usize, Vec<Point>>,
    facing: &[Facing],
    (frames, wanted): (&mut Frames, &mut BTreeMap<usize, Vec<usize>>),
) -> Result<(), FrameError> {
    for (group, of) in facing.iter().enumerate() {
        let both = of.meeting.iter().filter(|m| m.pair.sides == Sides::Both);
        for (node, normal) in both.flat_map(|m| m.masters()) {
            let mut direction = unit(normal);
            if let Some(own) = held.get(&node) {
                match beside(&direction, own, TURNED) {
                    Ok(Some(rest)) => direction = rest,
                    Ok(None) => continue,
                    Err(degrees) => {
                        let least = 90.0 - TURNED;
                        return Err(FrameError::PartlyHeld { node, degrees, least });
                    }
                }
            }
            let known = wanted.entry(node).or_default();
            // whether it faces something itself, or is met from another side, it gives up its inertia once
            let apart = |k: &usize| {
                let angle = degrees(&direction, &frames.contact[*k].direction);
                angle.min(180.0 - angle)
            };
            if known.iter().any(|k| apart(k) < ONE) {
                continue;
            }
            if let Some(degrees) = known.iter().map(apart).find(|a| *a < TWO) {
                return Err(FrameError::Crossing { node, degrees });
            }
            if known.len() + held.get(&node).map_or(0, Vec::len) == mesh.dim() {
                return Err(FrameError::TooMany { node });
            }
            known.push(frames.contact.len());
            frames.in_group.insert((facing.len() + group, node), frames.contact.len());
            let normal = direction.map(|x| -x);
            frames.contact.push(ContactPoint { node, direction, normal, group });
            frames.against.push(vec![]);
        }
    }
    Ok(())
}

/// A contact direction beside held ones: itself or, near it, what they leave of it (a node on a plane of symmetry has the normal of the whole
/// body); none where it is held altogether; the angle between the two where it is neither. `most` is what may be taken from it, in degrees.
fn beside(direction: &Point, held: &[Point], most: f64) -> Result<Option<Point>, f64> {
    let rest = held.iter().fold(*direction, |x, h| sum(&x, -dot(&x, h), h));
    let share = norm(&rest);
    if share <= FLAT {
        return Ok(None);
    }
    let taken = norm(&sum(direction, -1.0, &rest));
    match taken {
        0.0 => Ok(Some(*direction)),
        t if t <= most.to_radians().sin() => Ok(Some(unit(rest))),
        t => Err(t.min(1.0).acos().to_degrees()),
    }
}
