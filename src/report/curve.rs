//! Smooth curves through stored states: between two of them the cubic Hermite interpolant of displacement and velocity, so that a curve has
//! no corners but where the motion has.

/// Points of a whole curve, about.
const POINTS: usize = 2400;

/// A time with displacement and velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Knot {
    /// Time.
    pub t: f64,
    /// Displacement.
    pub x: f64,
    /// Velocity.
    pub v: f64,
}

/// The curve through the knots, refined; both ends are knots. `jumps` tells of the knots that begin with a jump of the velocity: before such a
/// one the velocity is that of the parabola through what is known.
pub fn through(knots: &[Knot], jumps: impl Fn(usize) -> bool) -> Vec<Knot> {
    let points = (POINTS / knots.len().max(1)).clamp(2, 24);
    let mut curve: Vec<Knot> = knots.iter().take(1).copied().collect();
    for (k, pair) in knots.windows(2).enumerate() {
        let (a, mut b) = (pair[0], pair[1]);
        let h = b.t - a.t;
        if h <= 0.0 {
            curve.push(b);
            continue;
        }
        if jumps(k + 1) {
            b.v = 2.0 * (b.x - a.x) / h - a.v;
        }
        curve.extend((1..=points).map(|j| between(a, b, j as f64 / points as f64)));
        if jumps(k + 1) {
            curve.push(pair[1]);
        }
    }
    curve
}

/// The Hermite interpolant and its derivative at a fraction `s` of the way.
fn between(a: Knot, b: Knot, s: f64) -> Knot {
    let h = b.t - a.t;
    let (slope, [p, q]) = ((b.x - a.x) / h, [a.v, b.v]);
    let bend = p + q - 2.0 * slope;
    let x = a.x + h * s * (p + s * (3.0 * slope - 2.0 * p - q + s * bend));
    let v = p + s * (2.0 * (3.0 * slope - 2.0 * p - q) + 3.0 * s * bend);
    Knot { t: a.t + s * h, x, v }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_its_own_interpolant() {
        let at = |t: f64| Knot { t, x: t * t * t - 2.0 * t, v: 3.0 * t * t - 2.0 };
        for k in through(&[at(0.0), at(0.7), at(2.0)], |_| false) {
            let exact = at(k.t);
            assert!((k.x - exact.x).abs() < 1e-14 && (k.v - exact.v).abs() < 1e-14);
        }
    }

    #[test]
    fn a_jump_of_the_velocity_is_not_smoothed() {
        // a fall that ends at rest: the stored velocity at the end is that after it
        let fall = |t: f64| Knot { t, x: -0.5 * t * t, v: -t };
        let end = Knot { v: 0.0, ..fall(1.0) };
        let curve = through(&[fall(0.0), end], |k| k == 1);
        let last = curve[curve.len() - 2];
        assert!((last.v + 1.0).abs() < 1e-14 && curve[curve.len() - 1] == end);
        assert!(curve[..curve.len() - 1].iter().all(|k| (k.x - fall(k.t).x).abs() < 1e-15));
    }
}
