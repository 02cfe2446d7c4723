//! A test of phase resonance as plain data: the frequencies at which a body vibrates a quarter of a period behind its loads, value by value of a number of the scene.

use std::f64::consts::PI;

/// A mean of several readings with its standard error; of one reading the error is zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Mean.
    pub mean: f64,
    /// Standard error.
    pub error: f64,
}

/// Periods of which a standard error is made hang together: it is that of means of so many blocks.
const BLOCKS: usize = 10;

impl Reading {
    /// What is not known.
    pub const NONE: Reading = Reading { mean: f64::NAN, error: f64::NAN };

    /// Of readings one after the other.
    pub fn of(values: &[f64]) -> Reading {
        if values.len() < 2 * BLOCKS {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            return Reading { mean, error: 0.0 };
        }
        let mean = |block: &[f64]| block.iter().sum::<f64>() / block.len() as f64;
        let blocks: Vec<f64> = values.chunks_exact(values.len() / BLOCKS).map(mean).collect();
        Reading { mean: mean(values), error: super::mean_with_error(&blocks).1 }
    }
}

/// What is read at an orbit at phase resonance, or how it changes with a number of the scene while the frequency follows the phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resonance {
    /// Circular frequency.
    pub omega: f64,
    /// Largest displacement of a contact point in magnitude, beside the equilibrium where there is one.
    pub amplitude: f64,
    /// Work of the loads in a period.
    pub work: f64,
}

impl Resonance {
    /// What is not known.
    pub const NONE: Resonance = Resonance { omega: f64::NAN, amplitude: f64::NAN, work: f64::NAN };
    /// Names of its numbers.
    pub const NAMES: [&str; 3] = ["omega", "amplitude", "work"];

    /// These, in the order of their names.
    pub fn numbers(&self) -> [f64; 3] {
        [self.omega, self.amplitude, self.work]
    }
}

/// What a test finds at a value.
#[derive(Debug, Clone, PartialEq)]
pub struct ResonanceRow {
    /// The number of the scene.
    pub value: f64,
    /// Whether the loop came to rest.
    pub is_locked: bool,
    /// Periods of the loads until it did.
    pub periods: usize,
    /// Circular frequency.
    pub omega: Reading,
    /// Lag of the displacement that the loads work on, in radians.
    pub lag: Reading,
    /// Largest displacement of a contact point in magnitude.
    pub amplitude: Reading,
    /// Largest force of all contact points together.
    pub force: Reading,
    /// Work of the loads in a period.
    pub work: Reading,
    /// Largest energy.
    pub energy: f64,
    /// Largest kinetic energy.
    pub kinetic: f64,
    /// A state at phase zero of the loads, in the frame of the body at the scene's own value; empty where the loop did not come to rest.
    pub x: Vec<f64>,
    /// Derivatives by the numbers of the test.
    pub by: Vec<Resonance>,
    /// Why there is nothing, or are no derivatives.
    pub note: String,
}

impl ResonanceRow {
    /// Where no loop came to rest, after so many periods, and why not.
    pub fn lost(value: f64, periods: usize, note: String) -> ResonanceRow {
        let none = Reading::NONE;
        ResonanceRow {
            value,
            is_locked: false,
            periods,
            omega: none,
            lag: none,
            amplitude: none,
            force: none,
            work: none,
            energy: f64::NAN,
            kinetic: f64::NAN,
            x: vec![],
            by: vec![],
            note,
        }
    }

    /// `W/(4πK)`: the damping ratio of the oscillator that loses as much and has the same largest kinetic energy `K`, in which no preload is.
    pub fn damping(&self) -> f64 {
        self.work.mean / (4.0 * PI * self.kinetic)
    }

    /// Whether it is what a test leaves: numbers where its loop came to rest, and a frequency.
    pub fn is_sound(&self) -> bool {
        let is_number = |r: &Reading| r.mean.is_finite() && r.error >= 0.0;
        !self.is_locked
            || self.readings().iter().all(is_number)
                && self.omega.mean > 0.0
                && [self.energy, self.kinetic].iter().chain(&self.x).all(|x| x.is_finite())
                && !self.x.is_empty()
    }

    /// Names of the readings.
    pub const READINGS: [&str; 5] = ["omega", "lag", "amplitude", "force", "work"];

    /// These, in the order of their names.
    pub fn readings(&self) -> [Reading; 5] {
        [self.omega, self.lag, self.amplitude, self.force, self.work]
    }
}

/// How a test is made.
#[derive(Debug, Clone, PartialEq)]
pub struct Test {
    /// Key of the number.
    pub key: String,
    /// Its range.
    pub range: [f64; 2],
    /// Steps from one end of the range to the other.
    pub steps: usize,
    /// Frequency to begin with.
    pub omega: f64,
    /// `k_p` and `k_i` of the loop.
    pub gains: [f64; 2],
    /// The loop is at rest where the lag is as near as this to a quarter turn.
    pub tolerance: f64,
    /// Standard deviation of readings of a period, relative, and in radians.
    pub noise: f64,
    /// Periods that are averaged over.
    pub average: usize,
    /// Seed of the noise.
    pub seed: u64,
    /// Keys of numbers that readings are differentiated by, in the order of letters.
    pub by: Vec<String>,
}

/// A test of phase resonance.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseResonance {
    /// How it is made.
    pub test: Test,
    /// Value after value.
    pub rows: Vec<ResonanceRow>,
}

impl Test {
    /// The values.
    pub fn values(&self) -> Vec<f64> {
        super::diagram::evenly(self.range, self.steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_has_the_error_of_its_mean() {
        assert_eq!(Reading::of(&[3.0]), Reading { mean: 3.0, error: 0.0 });
        // means of blocks 0.5, 2.5, …, 18.5: standard deviation √(110/3), over √10
        let values: Vec<f64> = (0..20).map(f64::from).collect();
        let Reading { mean, error } = Reading::of(&values);
        assert!((mean - 9.5).abs() < 1e-12 && (error - (110.0f64 / 30.0).sqrt()).abs() < 1e-12);
    }
}
