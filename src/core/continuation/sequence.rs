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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_drawn_through_the_last_two_points_and_not_too_far() {
        let known =
            |last: f64| vec![(0.0, vec![9.0]), (1.0, vec![1.0, 4.0]), (last, vec![2.0, 2.0])];
        let at = |last: f64, lambda: f64| guesses(&known(last), lambda);
        let secant = |x: [f64; 2]| (Guess::Secant, x.to_vec());
        let previous = (Guess::Previous, vec![2.0, 2.0]);
        assert_eq!(at(1.5, 2.0), [secant([3.0, 0.0]), previous.clone()]);
        assert_eq!(at(1.5, 1.75), [secant([2.5, 1.0]), previous.clone()]);
        assert_eq!(at(1.5, 2.5), [secant([4.0, -2.0]), previous.clone()]);
        assert_eq!(at(1.5, 0.5), [secant([0.0, 6.0]), previous.clone()]);
        assert_eq!(at(1.5, 2.6), std::slice::from_ref(&previous));
        assert_eq!(at(1.5, 0.4), std::slice::from_ref(&previous));
        // the same parameter again, and points of different lengths
        assert_eq!(at(1.0, 1.5), [previous]);
        assert_eq!(guesses(&known(1.5)[..2], 2.0), [(Guess::Previous, vec![1.0, 4.0])]);
        assert_eq!(guesses(&[], 2.0), []);
    }
}
