//! Sequential continuation: the next point from the last ones, at parameters given beforehand.

/// Where a guess comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Guess {
    /// The straight line through the last two points.
    Secant,
    /// The last point.
    Previous,
}

/// Guesses at `λ` from the points found so far (`(λ, x)`, in the order found), best first.
pub fn guesses(known: &[(f64, Vec<f64>)], lambda: f64) -> Vec<(Guess, Vec<f64>)> {
    let mut list = vec![];
    if let [.., (l0, x0), (l1, x1)] = known {
        let s = (lambda - l1) / (l1 - l0);
        // a line that is drawn too far leads nowhere
        if x0.len() == x1.len() && s.is_finite() && s.abs() <= 2.0 {
            list.push((Guess::Secant, x1.iter().zip(x0).map(|(b, a)| b + s * (b - a)).collect()));
        }
    }
    if let Some((_, x)) = known.last() {
        list.push((Guess::Previous, x.clone()));
    }
    list
}
