//! The contact nodes in their order along the edge: where they lie, how they move, which of them are drawn and in which
//! colours.

use plotters::prelude::RGBColor;

use super::figure::{Bar, LINES, viridis};
use crate::mesh::Point;
use crate::store::Stored;

/// At most this many nodes are drawn where nobody chooses.
const SHOWN: usize = 12;

/// The contact nodes of a stored motion.
pub(super) struct Edge<'s> {
    stored: &'s Stored,
    /// Coordinate along the edge: that of an axis, or the length along the edges, one behind the other.
    pub position: Vec<f64>,
    /// Its name.
    pub axis: &'static str,
    /// The points before obstacles that are not behind another: one a displacement.
    pub fronts: Vec<usize>,
    /// Of each point that behind it, on the other side of the same displacement.
    behind: Vec<Option<usize>>,
}

impl<'s> Edge<'s> {
    pub fn of(stored: &'s Stored) -> Self {
        let places: Vec<Point> = (0..stored.gap.len()).map(|i| stored.contact_place(i)).collect();
        let normal = |i: usize| stored.contact_normal(i);
        let is_behind = |i: usize| {
            let (p, n) = (places[i], normal(i));
            (0..i).find(|&j| places[j] == p && normal(j) == n.map(|x| -x))
        };
        let mut behind = vec![None; places.len()];
        let mut fronts = vec![];
        for i in 0..stored.facing() {
            match is_behind(i) {
                Some(front) => behind[front] = Some(i),
                None => fronts.push(i),
            }
        }
        // points of a face are in no order along it
        if stored.is_solid() {
            let position = (0..places.len()).map(|i| i as f64).collect();
            return Edge { stored, position, axis: "number", fronts, behind };
        }
        // one straight edge along an axis
        for (axis, name) in [(1, "y"), (0, "x")] {
            let straight = places.iter().all(|p| p[1 - axis] == places[0][1 - axis]);
            let rising = fronts.windows(2).all(|p| places[p[0]][axis] < places[p[1]][axis]);
            if straight && (rising || fronts.len() < 2) && !stored.contact_groups.contains(&1) {
                let position = places.iter().map(|p| p[axis]).collect();
                return Edge { stored, position, axis: name, fronts, behind };
            }
        }
        let position = vec![0.0; places.len()];
        let mut edge = Edge { stored, position, axis: "s", fronts, behind };
        let mut s = 0.0;
        let fronts = edge.fronts.clone();
        let mut parts = edge.parts();
        parts.retain(|p| fronts.contains(&p[0]));
        let count = parts.len();
        let total: f64 = parts.iter().map(|p| length(&places, p)).sum();
        for part in parts {
            for (k, &i) in part.iter().enumerate() {
                if k > 0 {
                    s += distance(places[part[k - 1]], places[i]);
                }
                edge.position[i] = s;
            }
            // from one edge to the next
            s += 0.05 * total / count as f64;
        }
        for front in &fronts {
            if let Some(i) = edge.behind[*front] {
                edge.position[i] = edge.position[*front];
            }
        }
        edge
    }

    /// Whether a run of neighbours comes back to its start.
    pub(crate) fn is_closed(&self, part: &[usize]) -> bool {
        let place = |k: usize| self.stored.contact_place(part[k]);
        let last = part.len() - 1;
        part.len() > 3 && distance(place(0), place(last)) < 2.0 * distance(place(0), place(1))
    }

    /// The contact points of each obstacle in runs of neighbours.
    pub fn parts(&self) -> Vec<Vec<usize>> {
        let stored = self.stored;
        let mut parts: Vec<Vec<usize>> = vec![];
        for i in 0..stored.facing() {
            let belongs = |part: &Vec<usize>| {
                let last = part[part.len() - 1];
                let same = stored.contact_groups[last] == stored.contact_groups[i];
                let normal =
                    |c: usize| stored.contact_normals[(last, c)] * stored.contact_normals[(i, c)];
                let step = distance(stored.contact_place(last), stored.contact_place(i));
                let usual = part.len() < 2
                    || step
                        < 4.0
                            * distance(
                                stored.contact_place(part[part.len() - 2]),
                                stored.contact_place(last),
                            );
                // points on the other side of the body come later: an obstacle behind
                same && usual && normal(0) + normal(1) > -0.5
            };
            match parts.last_mut().filter(|p| belongs(p)) {
                Some(part) => part.push(i),
                None => parts.push(vec![i]),
            }
        }
        parts
    }

    /// What an axis along it is called.
    pub(crate) fn label(&self) -> String {
        match self.stored.is_solid() {
            true => "number of the contact node".into(),
            false => format!("{} on the contact edge", self.axis),
        }
    }

    /// From the first to the last node.
    pub(crate) fn span(&self) -> std::ops::Range<f64> {
        let last = self.fronts.last().map_or(0.0, |&last| self.position[last]);
        self.position.first().copied().unwrap_or(0.0)..last
    }

    /// Contact displacement along the outward normal, and its velocity.
    pub fn motion(&self, row: usize, i: usize) -> (f64, f64) {
        (self.stored.contact_displacement(row, i), self.stored.contact_velocity(row, i))
    }

    /// How many nodes have curves where nobody chooses.
    pub fn curves(&self) -> usize {
        self.fronts.len().min(SHOWN)
    }

    /// The nodes that are drawn where nobody chooses: all, or so many as a picture bears. First that of the largest pressure, then, one after the other,
    /// that of the largest pressure at the time when those drawn fall shortest of it: the largest pressure of all times shows. The rest evenly along the edge.
    pub fn shown(&self) -> Vec<usize> {
        let count = self.curves();
        if count == self.fronts.len() {
            return self.fronts.clone();
        }
        let mut chosen = self.hardest(count);
        let rest: Vec<usize> =
            self.fronts.iter().copied().filter(|i| !chosen.contains(i)).collect();
        let missing = count - chosen.len();
        chosen.extend((0..missing).map(|k| rest[k * (rest.len() - 1) / (missing - 1).max(1)]));
        self.fronts.iter().copied().filter(|i| chosen.contains(i)).collect()
    }

    /// At most `count` nodes whose pressures come near the largest of all nodes at every time.
    fn hardest(&self, count: usize) -> Vec<usize> {
        let rows = self.stored.pressure.nrows();
        let pressure = |r: usize, i: usize| {
            let of = |i: usize| self.stored.pressure[(r, i)];
            self.behind(i).map_or(of(i), |j| of(i).max(of(j)))
        };
        let hardest = |r: usize| {
            let largest = self
                .fronts
                .iter()
                .copied()
                .max_by(|&i, &j| pressure(r, i).total_cmp(&pressure(r, j)));
            largest.map(|i| (i, pressure(r, i)))
        };
        let all: Vec<(usize, f64)> = (0..rows).filter_map(hardest).collect();
        let negligible = 0.01 * all.iter().fold(0.0f64, |m, (_, p)| m.max(*p));
        let mut drawn = vec![0.0f64; all.len()];
        let mut chosen: Vec<usize> = vec![];
        while chosen.len() < count {
            let short = |r: &usize| all[*r].1 - drawn[*r];
            let worst = (0..all.len()).max_by(|a, b| short(a).total_cmp(&short(b)));
            let Some(worst) = worst.filter(|r| short(r) > negligible) else { break };
            let node = all[worst].0;
            drawn.iter_mut().enumerate().for_each(|(r, d)| *d = d.max(pressure(r, node)));
            chosen.push(node);
        }
        chosen
    }

    /// Colour of a node.
    pub fn colour(&self, i: usize) -> RGBColor {
        let span = self.span();
        match self.fronts.len() {
            1 => LINES[0],
            _ => viridis(0.92 * (self.position[i] - span.start) / (span.end - span.start)),
        }
    }

    /// The point on the other side of the same displacement.
    pub fn behind(&self, i: usize) -> Option<usize> {
        self.behind[i]
    }

    /// Where obstacles limit displacements: in front, and behind with a minus, each if all nodes have the same.
    pub(crate) fn even_limits(&self) -> Vec<f64> {
        let even = |gaps: Vec<f64>| {
            let first = gaps.first().copied()?;
            gaps.iter().all(|g| *g == first).then_some(first)
        };
        let gap = &self.stored.gap;
        let front = even(self.fronts.iter().map(|&i| gap[i]).collect());
        let behind = even(self.behind.iter().flatten().map(|&i| -gap[i]).collect());
        front.into_iter().chain(behind).collect()
    }

    /// The bar of the nodes' colours, where there are several.
    pub fn bar(&self) -> Option<Bar> {
        let (range, label) = (self.span(), format!("node {}", self.axis));
        let bar = Bar { range, label, colour: |s| viridis(0.92 * s), white: None };
        (self.fronts.len() > 1).then_some(bar)
    }
}

fn distance(a: Point, b: Point) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1]).hypot(a[2] - b[2])
}

fn length(places: &[Point], part: &[usize]) -> f64 {
    part.windows(2).map(|p| distance(places[p[0]], places[p[1]])).sum()
}
