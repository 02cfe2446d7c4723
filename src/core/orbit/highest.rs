//! The largest energy of a motion: between its stored states, and on either side of every switch.
//!
//! Within a phase `H` is smooth; at a switch of the nodal boundary method it jumps, so that its largest value often stands at the end of a phase. The states of a
//! run give brackets of the maxima, the motion in closed form the maxima themselves.

use crate::records::crest;

/// Maxima nearer to the largest than this, relative, may be the largest themselves; at most so many are looked at.
const RIVAL: f64 = 0.01;
const RIVALS: usize = 6;
/// `H` that changes by less than this over a bracket, relative, has no other maximum in it.
const EVEN: f64 = 1e-10;
/// Steps of the golden section: `H` to the square of `0.618²⁶ = 4e-6` of a bracket.
const STEPS: usize = 26;

/// Where `H` may be largest.
#[derive(Debug, Default)]
pub struct Highest {
    /// The states of the present phase: the first two, the last two.
    phase: Vec<(f64, f64)>,
    /// The largest value at a state or at the end of a phase.
    largest: f64,
    /// Values that parabolas have between the states, with the times around.
    crests: Vec<(f64, [f64; 2])>,
}

impl Highest {
    /// A state.
    pub fn note(&mut self, t: f64, energy: f64) {
        self.largest = self.largest.max(energy);
        self.phase.push((t, energy));
        if let [.., a, b, c] = self.phase[..]
            && b.1 >= a.1.max(c.1)
            && b.1 - a.1.min(c.1) > EVEN * b.1
        {
            self.crests.push((crest([a.0, b.0, c.0], [a.1, b.1, c.1]), [a.0, c.0]));
        }
        if self.phase.len() > 4 {
            self.phase.remove(2);
        }
    }

    /// A switch: the energy just before it.
    pub fn switch(&mut self, t: f64, before: f64) {
        self.note(t, before);
        self.end_phase();
    }

    /// The last state of a phase is noted: a maximum may lie in its first or its last step.
    pub(crate) fn end_phase(&mut self) {
        for ends in [self.phase.first_chunk::<2>(), self.phase.last_chunk::<2>()] {
            if let Some([a, b]) = ends
                && (a.1 - b.1).abs() > EVEN * a.1.max(b.1)
            {
                self.crests.push((a.1.max(b.1), [a.0, b.0]));
            }
        }
        self.phase.clear();
    }

    /// The largest energy, after the last phase, whether its end was told or not; `energy`: as a function of time, if it is known. Without it the tops of the parabolas stand for the maxima.
    pub fn of(mut self, energy: Option<&dyn Fn(f64) -> f64>) -> f64 {
        self.end_phase();
        let near = |value: &f64| *value > (1.0 - RIVAL) * self.largest;
        let mut crests: Vec<_> = self.crests.iter().filter(|c| near(&c.0)).collect();
        crests.sort_by(|a, b| b.0.total_cmp(&a.0));
        let Some(energy) = energy else {
            return crests.first().map_or(self.largest, |c| c.0.max(self.largest));
        };
        let tops = crests.iter().take(RIVALS).map(|(_, span)| top(*span, energy));
        tops.fold(self.largest, f64::max)
    }
}

/// The largest value of a function with one maximum in a bracket, by golden section.
fn top([mut a, mut b]: [f64; 2], f: &dyn Fn(f64) -> f64) -> f64 {
    let golden = 0.5 * (5.0f64.sqrt() - 1.0);
    let (mut x, mut y) = (b - golden * (b - a), a + golden * (b - a));
    let (mut of_x, mut of_y) = (f(x), f(y));
    let mut largest = of_x.max(of_y);
    for _ in 0..STEPS {
        if of_x > of_y {
            (b, y, of_y) = (y, x, of_x);
            x = b - golden * (b - a);
            of_x = f(x);
        } else {
            (a, x, of_x) = (x, y, of_y);
            y = a + golden * (b - a);
            of_y = f(y);
        }
        largest = largest.max(of_x).max(of_y);
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_top_of_a_bracket_is_found() {
        let found = top([0.3, 1.9], &|t| 2.0 - (t - 1.234_f64).powi(2) + 0.1 * (t - 1.234).powi(3));
        assert!((found - 2.0).abs() < 1e-12, "{found}");
        // the end of a phase
        assert!((top([0.0, 1.0], &|t| t) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn a_jump_parts_the_maxima() {
        let mut all = Highest::default();
        for k in 0..4 {
            all.note(f64::from(k), f64::from(k));
        }
        all.switch(3.5, 3.6);
        for k in 0..4 {
            all.note(3.5 + f64::from(k), [1.0, 1.2, 1.0, 0.9][k as usize]);
        }
        assert_eq!(all.largest, 3.6);
        let brackets: Vec<[f64; 2]> = all.crests.iter().map(|c| c.1).collect();
        assert_eq!(brackets, [[0.0, 1.0], [3.0, 3.5], [3.5, 5.5]]);
    }
}
