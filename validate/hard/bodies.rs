//! Random small bodies and random states of theirs, by number: the same number gives the same body and the same state.
//!
//! Bars and plates of all scales, clamped or on rollers, contact on any edge, gaps that are positive, zero or negative, level or tilted, mass and
//! boundary mass consistent or lumped, `n_O ≤ 20`. A state is the equilibrium plus a random motion of some modes about it, scaled by where
//! that motion would first leave its phase: three in four go well beyond, every fourth only to within 10⁻¹ … 10⁻⁹ of
//! it, above or below, so that the first contact is as brief as one likes (or does not happen).

use signorini::contact::State;
use signorini::problem::Problem;

use super::super::scene;
use super::random;
use super::witness::{Motion, Phase, Witness};

/// Most displacements besides those of the contact nodes.
const LARGEST: usize = 20;

/// A body with its witness.
pub struct RandomBody {
    /// Operators.
    pub problem: Problem,
    /// The same body by its matrices.
    pub witness: Witness,
    /// End time of its motions.
    pub until: f64,
    number: u64,
}

impl RandomBody {
    /// The body of a number.
    pub fn new(number: u64) -> Result<RandomBody, String> {
        // a draw with too many displacements is drawn again
        for attempt in 0..100 {
            let draw = random(14, (1 << 40) + 100 * number + attempt);
            let text = described(number, &draw);
            let problem = Problem::new(&scene(&text, None)?, None)
                .map_err(|e| format!("body {number}: {e}"))?;
            if problem.system.n_o() <= LARGEST {
                let witness = Witness::new(&problem.system)?;
                let until = witness.period * (1.5 + 0.5 * draw[12]);
                return Ok(RandomBody { problem, witness, until, number });
            }
        }
        Err(format!("body {number}: too many displacements in a hundred draws"))
    }

    /// A state of this body.
    pub fn state(&self, number: u64) -> State {
        let phase = self.witness.resting();
        let mut modes: Vec<usize> = (0..phase.omega.len()).collect();
        if is_mirror(self.number) {
            modes.retain(|&k| phase.is_even(k));
        }
        let draw = random(2 * modes.len() + 4, (1 << 50) + (self.number << 20) + number);
        let (weights, rest) = draw.split_at(2 * modes.len());
        let unit = |k: usize| 0.5 * (1.0 + rest[k]);
        // a motion that leaves the contact alone says nothing; without a gap it would go along the border of its phase for ever
        let leverage = |k: &usize| phase.leverage(*k);
        let largest = modes.iter().map(leverage).fold(0.0, f64::max);
        let inside = phase.at_rest.iter().all(|h| *h > 0.0);
        let first = modes.iter().map(leverage).position(|x| x > 1e-3 * largest);
        let least = first.filter(|_| inside).map_or(modes.len(), |k| k + 1);
        let excited = least.max(1 + (unit(0) * modes.len() as f64) as usize);
        let mut amplitudes = vec![(0.0, 0.0); phase.omega.len()];
        for (k, &mode) in modes.iter().enumerate().take(excited) {
            let size = 1.0 / (1.0 + k as f64);
            amplitudes[mode] = (size * weights[2 * k], size * weights[2 * k + 1]);
        }
        let excess = match (number.is_multiple_of(4), unit(1) < 0.8) {
            (true, true) => 10f64.powf(-1.0 - 8.0 * unit(2)),
            (true, false) => -10f64.powf(-1.0 - 8.0 * unit(2)),
            (false, _) => 10f64.powf(-1.5 + 2.0 * unit(2)),
        };
        let level = leaves(phase, &amplitudes, 0.6 * self.until);
        let scale = level.map_or(1.0, |level| (1.0 + excess) / level);
        amplitudes.iter_mut().for_each(|(a, b)| (*a, *b) = (scale * *a, scale * *b));
        let (u, v) = Motion::new(phase, amplitudes).state(0.0);
        State { u: u.as_slice().to_vec(), v: v.as_slice().to_vec() }
    }
}

/// Every fourth body is a bar.
fn is_bar(number: u64) -> bool {
    number.is_multiple_of(4)
}

/// Every tenth body and its states are mirrored about the middle: nodes switch in pairs.
fn is_mirror(number: u64) -> bool {
    number % 10 == 1
}

/// The scene of a body from numbers in [−1, 1).
fn described(number: u64, draw: &[f64]) -> String {
    let unit = |k: usize| 0.5 * (1.0 + draw[k]);
    let pick = |k: usize, n: usize| ((unit(k) * n as f64) as usize).min(n - 1);
    let power = |k: usize, decades: f64| 10f64.powf(decades * draw[k]);
    let kind = |k: usize| ["consistent", "lumped"][pick(k, 2)];
    let (length, young, density) = (power(0, 1.0), power(1, 3.0), power(2, 3.0));
    let level = match pick(3, 12) {
        0 => 0.0,
        1 | 2 => -0.5 * length * unit(4),
        _ => length * (0.02 + unit(4)),
    };
    let material = format!("young = {young:e}\ndensity = {density:e}\nmass = '{}'", kind(5));
    if is_bar(number) {
        let elements = 2 + pick(6, LARGEST);
        return format!(
            "[body]\nkind = 'bar'\nsize = [{length:e}]\nelements = [{elements}]\n{material}\n\
             [[support]]\nedge = 'left'\nfix = ['x']\n[contact]\nedge = 'right'\ngap = '{level:e}'\n",
        );
    }
    let (nx, ny, height) = (1 + pick(6, 5), 1 + pick(7, 5), length * power(8, 0.7));
    let mirror = is_mirror(number);
    let tilt = if mirror { 0.0 } else { 0.3 * draw[9] * level / (length + height) };
    let poisson = 0.1 + 0.35 * draw[10];
    // clamped opposite the contact, clamped on a side, or on two rollers
    let (supports, contact): (&[_], _) = match pick(11, if mirror { 2 } else { 8 }) {
        0 => (&[("left", "'x', 'y'")], "right"),
        1 => (&[("right", "'x', 'y'")], "left"),
        2 => (&[("bottom", "'x', 'y'")], "top"),
        3 => (&[("top", "'x', 'y'")], "bottom"),
        4 => (&[("left", "'x', 'y'")], "top"),
        5 => (&[("right", "'x', 'y'")], "bottom"),
        6 => (&[("left", "'x'"), ("bottom", "'y'")], "right"),
        _ => (&[("bottom", "'y'"), ("right", "'x'")], "top"),
    };
    let support = |(edge, fix): &_| format!("[[support]]\nedge = '{edge}'\nfix = [{fix}]\n");
    let supports: String = supports.iter().map(support).collect();
    let boundary = kind(13);
    format!(
        "[body]\nkind = 'plate'\nsize = [{length:e}, {height:e}]\nelements = [{nx}, {ny}]\n\
         poisson = {poisson}\n{material}\n{supports}[contact]\nedge = '{contact}'\n\
         gap = '{level:e} + {tilt:e}*(x - y)'\nboundary_mass = '{boundary}'\n",
    )
}

/// The most that any monitor falls until `end`, over its value in equilibrium: what the amplitudes must be divided by to graze.
/// None where the equilibrium lies on the border of its phase.
fn leaves(phase: &Phase, amplitudes: &[(f64, f64)], end: f64) -> Option<f64> {
    if phase.at_rest.iter().any(|h| *h <= 0.0) {
        return None;
    }
    let motion = Motion::new(phase, amplitudes.to_vec());
    let excited = phase.omega.iter().zip(amplitudes).filter(|(_, a)| **a != (0.0, 0.0));
    let fastest = excited.map(|(w, _)| *w).fold(0.0, f64::max);
    let count = (2.0 * end * fastest).ceil();
    let mut now = vec![(0.0, 0.0); phase.at_rest.len()];
    let (mut level, mut node, mut place) = (0.0, 0, 0.0);
    for step in 0..=count as usize {
        let t = end * step as f64 / count;
        motion.monitors(t, &mut now);
        for (i, ((h, _), rest)) in now.iter().zip(&phase.at_rest).enumerate() {
            if (rest - h) / rest > level {
                (level, node, place) = ((rest - h) / rest, i, t);
            }
        }
    }
    // the lowest point near the lowest sample
    let (mut a, mut b) = ((place - end / count).max(0.0), (place + end / count).min(end));
    for _ in 0..50 {
        let t = 0.5 * (a + b);
        motion.monitors(t, &mut now);
        if now[node].1 < 0.0 { a = t } else { b = t }
    }
    motion.monitors(b, &mut now);
    level = level.max(1.0 - now[node].0 / phase.at_rest[node]);
    (level > 0.0).then_some(level)
}
