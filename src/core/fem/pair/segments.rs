//! Segments of lines that face each other: between the places of the slave at which the ends of the master's lines are seen, along normals that turn with the slave's
//! functions. On each segment all functions are smooth.

use super::super::shape;
use super::against::{FACES, PairError};
use super::overlap::{Meet, POINTS, Patch, Spot};
use crate::mesh::Point;
use crate::mesh::point::{dot, minus, norm};

/// Segments shorter than this, in the slave's own coordinates, are none.
const SHORT: f64 = 1e-10;

/// `a × b` in the plane.
fn cross(a: &Point, b: &Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// A line of the slave with the normals of its nodes.
struct Seen<'a> {
    patch: &'a Patch,
    normals: &'a [Point],
}

impl Seen<'_> {
    /// A place with its normal.
    fn at(&self, s: f64) -> (Spot, Point) {
        let spot = self.patch.at([s, 0.0]);
        let add = |sum: Point, (v, n): (&f64, &Point)| std::array::from_fn(|c| sum[c] + v * n[c]);
        let normal = spot.values.iter().zip(self.normals).fold([0.0; 3], add);
        (spot, normal)
    }

    /// How far ahead along the line a point stands of the normal at a place: falls as the place goes on.
    fn ahead(&self, s: f64, x: &Point) -> f64 {
        let (spot, normal) = self.at(s);
        cross(&minus(x, &spot.place), &normal) / cross(&spot.tangents[0], &normal)
    }

    /// The place whose normal meets a point; the nearer end where none does.
    fn sees(&self, x: &Point) -> f64 {
        let (mut low, mut high) = (-1.0, 1.0);
        if self.ahead(low, x) <= 0.0 {
            return low;
        }
        if self.ahead(high, x) >= 0.0 {
            return high;
        }
        // secants within the bracket, halved where they are slow
        let (mut before, mut after) = (self.ahead(low, x), self.ahead(high, x));
        for k in 0..200 {
            let secant = (low * after - high * before) / (after - before);
            let middle = if k % 3 == 2 { 0.5 * (low + high) } else { secant };
            let value = self.ahead(middle, x);
            match value > 0.0 {
                true => (low, before) = (middle, value),
                false => (high, after) = (middle, value),
            }
            if value == 0.0 || high - low < 4.0 * f64::EPSILON {
                return middle;
            }
        }
        0.5 * (low + high)
    }
}

/// The place of a line of the master on a normal.
fn hit(patch: &Patch, from: &Point, normal: &Point) -> f64 {
    let off = |r: f64| {
        let spot = patch.at([r, 0.0]);
        (cross(&minus(&spot.place, from), normal), cross(&spot.tangents[0], normal))
    };
    let [a, b] = [off(-1.0).0, off(1.0).0];
    let mut r = (a + b) / (a - b);
    for _ in 0..if patch.nodes.len() == 2 { 1 } else { 20 } {
        let (value, slope) = off(r);
        let step = value / slope;
        if !step.is_finite() || step.abs() < 1e-16 {
            break;
        }
        r -= step;
    }
    r.clamp(-1.0, 1.0)
}

/// All points at which the lines of two surfaces are integrated.
pub fn of(
    slave: &[Patch],
    master: &[Patch],
    normal_of: &dyn Fn(usize) -> Point,
) -> Result<Vec<Meet>, PairError> {
    let rule = shape::gauss(POINTS);
    let mut meets = vec![];
    for (own, patch) in slave.iter().enumerate() {
        let normals: Vec<Point> = patch.nodes.iter().map(|&n| normal_of(n)).collect();
        let seen = Seen { patch, normals: &normals };
        let mut candidates: Vec<([f64; 2], usize)> = vec![];
        for (k, other) in master.iter().enumerate() {
            if dot(&patch.normal, &other.normal) >= 0.0 {
                continue;
            }
            let mut ends = [seen.sees(&other.x[0]), seen.sees(&other.x[1])];
            ends.sort_by(f64::total_cmp);
            if ends[1] - ends[0] > SHORT {
                candidates.push((ends, k));
            }
        }
        let mut cuts: Vec<f64> = candidates.iter().flat_map(|c| c.0).collect();
        cuts.sort_by(f64::total_cmp);
        for piece in cuts.windows(2).filter(|p| p[1] - p[0] > SHORT) {
            let (low, high) = (piece[0], piece[1]);
            let (spot, normal) = seen.at(0.5 * (low + high));
            // the nearest of those that are seen there
            let distance = |k: usize| {
                let other = &master[k];
                let there = other.at([hit(other, &spot.place, &normal), 0.0]);
                norm(&minus(&there.place, &spot.place))
            };
            let covers = |c: &&([f64; 2], usize)| c.0[0] <= low && high <= c.0[1];
            let over = candidates.iter().filter(covers).map(|c| (distance(c.1), c.1));
            let Some((_, k)) = over.min_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
            let cosine = dot(&normal, &master[k].normal) / norm(&normal);
            if cosine > FACES {
                let degrees = cosine.clamp(-1.0, 1.0).acos().to_degrees();
                return Err(PairError::Turned { node: patch.nodes[0], degrees });
            }
            for &(at, weight) in &rule {
                let s = 0.5 * (low + high) + 0.5 * (high - low) * at;
                let (spot, normal) = seen.at(s);
                let there = master[k].at([hit(&master[k], &spot.place, &normal), 0.0]);
                meets.push(Meet {
                    slave: own,
                    master: k,
                    weight: 0.5 * (high - low) * weight * spot.stretch(patch),
                    place: spot.place,
                    own: spot.values,
                    theirs: there.values,
                });
            }
        }
    }
    Ok(meets)
}
