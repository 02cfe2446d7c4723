//! What rubs from switch to switch along a series, and the play of a slider with a spring.
//!
//! A slider of limit `L` with a spring `k` pushes with `F = k(W − z)` while `|F| ≤ L`; where that would be exceeded `F = ±L` until `W` turns, and there `z ← W ∓ L/k`. With a
//! periodic `W` all is periodic after one period at the latest.

use super::HbmError;
use super::crossing::SWITCHES;
use super::series::Polynomial;
use crate::contact::{PointState, System};

/// What a slider's spring remembers: `z`, and where on the series it was set (nowhere: it never slipped).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Memory {
    pub z: f64,
    pub set_at: Option<f64>,
}

/// A stretch of the series in one state.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    pub begin: f64,
    pub end: f64,
    pub state: PointState,
    pub memory: Memory,
    /// Which phase of the contact it is in.
    pub phase: usize,
}

/// A walk from switch to switch of one thing that rubs.
#[derive(Debug)]
pub(super) struct Walk {
    pub pieces: Vec<Piece>,
    pub undecided: usize,
    most: usize,
}

/// Slack of a monitor that has left zero a moment ago, over its size.
const SLACK: f64 = 1e-13;

impl Walk {
    /// Along a series of so many harmonics.
    pub fn new(n_h: usize) -> Walk {
        Walk { pieces: vec![], undecided: 0, most: SWITCHES * (n_h + 1) }
    }

    /// Where the first of some monitors falls below zero, and which.
    pub fn next(&mut self, monitors: &[Polynomial], (a, b): (f64, f64)) -> Option<(f64, usize)> {
        let mut first: Option<(f64, usize)> = None;
        for (k, h) in monitors.iter().enumerate() {
            let end = first.map_or(b, |f| f.0);
            let found = h.first_crossing(a, end, SLACK * h.size, &mut self.undecided);
            if let Some(t) = found.filter(|t| *t < end) {
                first = Some((t.max(a), k));
            }
        }
        first
    }

    /// Go on with a piece.
    pub fn push(&mut self, piece: Piece) -> Result<(), HbmError> {
        if self.pieces.len() > self.most {
            return Err(HbmError::Switches(self.most));
        }
        self.pieces.push(piece);
        Ok(())
    }

    /// The piece at a phase angle.
    pub fn at(&self, theta: f64) -> &Piece {
        let place = self.pieces.partition_point(|p| p.end <= theta);
        &self.pieces[place.min(self.pieces.len() - 1)]
    }
}

/// A slider with a spring.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jenkins {
    /// `L`
    pub limit: f64,
    /// `k`
    pub stiffness: f64,
}

impl Jenkins {
    /// That of a contact point which is a slider with a spring, and the entry of `u_O` that is `z`.
    pub fn of(system: &System, point: usize) -> Option<(Jenkins, usize)> {
        let slider = system.slider(point)?;
        let spring = slider.elastic?;
        Some((Jenkins { limit: slider.limit, stiffness: spring.stiffness }, spring.memory))
    }

    /// What it does along a periodic displacement, once that is the same in every period; it begins without a force at `W = 0`.
    pub fn play(&self, w: &Polynomial, end: f64) -> Result<Walk, HbmError> {
        let first = w.at(0.0).0;
        let reach = self.limit / self.stiffness;
        let beyond = first.abs() > reach;
        let z = if beyond { first - reach.copysign(first) } else { 0.0 };
        let memory = Memory { z, set_at: beyond.then_some(0.0) };
        let (_, later) = self.period(w, end, (PointState::Stick, memory))?;
        Ok(self.period(w, end, later)?.0)
    }

    /// One period from a state and what is remembered there; and how it ends.
    fn period(
        &self,
        w: &Polynomial,
        end: f64,
        start: (PointState, Memory),
    ) -> Result<(Walk, (PointState, Memory)), HbmError> {
        let &Jenkins { limit, stiffness } = self;
        let (mut state, mut memory) = start;
        let rate = w.derivative();
        let mut walk = Walk::new(w.harmonics());
        let mut theta = 0.0;
        loop {
            let found = match state.slip() {
                // L ∓ k(W − z)
                None => {
                    let of = |sign: f64| {
                        w.affine(-sign * stiffness, limit + sign * stiffness * memory.z)
                    };
                    walk.next(&[of(1.0), of(-1.0)], (theta, end))
                }
                Some(sigma) => walk.next(&[rate.affine(sigma, 0.0)], (theta, end)),
            };
            let until = found.map_or(end, |f| f.0);
            walk.push(Piece { begin: theta, end: until, state, memory, phase: 0 })?;
            let Some((there, monitor)) = found else { return Ok((walk, (state, memory))) };
            state = match state.slip() {
                None => PointState::of_slip(if monitor == 0 { 1.0 } else { -1.0 }),
                Some(sigma) => {
                    let z = w.at(there).0 - sigma * limit / stiffness;
                    memory = Memory { z, set_at: Some(there) };
                    PointState::Stick
                }
            };
            theta = there;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hbm::Basis;

    /// The work of a cycle is `4 L (X − L/k)`, whatever the state at its start.
    #[test]
    fn a_cycle_takes_what_the_closed_form_says() {
        let jenkins = Jenkins { limit: 0.3, stiffness: 2.0 };
        for phase in [0.0f64, 0.4, 1.9, 3.3, 5.0] {
            let (size, mean) = (1.1, 0.7);
            let w =
                Polynomial::new(Basis::Full, 1, &[mean, size * phase.cos(), size * phase.sin()]);
            let walk = jenkins.play(&w, std::f64::consts::TAU).unwrap();
            assert_eq!(walk.undecided, 0);
            let mut work = 0.0;
            for p in &walk.pieces {
                let (a, b) = (w.at(p.begin).0, w.at(p.end).0);
                work += match p.state.slip() {
                    Some(sigma) => sigma * jenkins.limit * (b - a),
                    None => {
                        let force = |w: f64| jenkins.stiffness * (w - p.memory.z);
                        0.5 * (force(a) + force(b)) * (b - a)
                    }
                };
            }
            let closed = 4.0 * jenkins.limit * (size - jenkins.limit / jenkins.stiffness);
            assert!((work - closed).abs() < 1e-13, "{phase}: {work} {closed}");
        }
    }

    /// Below its limit a slider never slips.
    #[test]
    fn a_small_motion_is_elastic() {
        let jenkins = Jenkins { limit: 0.3, stiffness: 2.0 };
        let w = Polynomial::new(Basis::Full, 2, &[0.0, 0.1, 0.02, 0.01, -0.02]);
        let walk = jenkins.play(&w, std::f64::consts::TAU).unwrap();
        assert_eq!(walk.pieces.len(), 1);
        assert_eq!(walk.pieces[0].memory, Memory::default());
    }
}
