//! Motions of two frequencies as plain data: closed curves of the period map, one larger than the other.

use std::f64::consts::TAU;

/// A closed curve that the map of a period of the loads carries into itself.
#[derive(Debug, Clone, PartialEq)]
pub struct TorusRow {
    /// Circular frequency of the loads.
    pub omega: f64,
    /// Rotation number: turns around the curve in a period of the loads.
    pub rho: f64,
    /// Size of its first coefficient, as a frame vector.
    pub size: f64,
    /// The last coefficients over the first.
    pub tail: f64,
    /// By how much a state beside it comes nearer in a period; not a number where that is nothing that can be seen.
    pub attraction: f64,
    /// Largest contact displacement in magnitude.
    pub amplitude: f64,
    /// Largest force of all contact points together.
    pub force: f64,
    /// By how much larger the next one is to be.
    pub step: f64,
    /// Frame vectors at phase zero of the loads, at even phases around the curve.
    pub states: Vec<Vec<f64>>,
    /// Displacement and velocity of the contact point that moves most around the curve, at these.
    pub lead: Vec<[f64; 2]>,
}

impl TorusRow {
    /// The trigonometric polynomial through displacement and velocity of the point that moves most, at so many phases and the first again.
    pub fn around(&self, count: usize) -> Vec<[f64; 2]> {
        let n = self.lead.len();
        let coefficient = |k: usize, part: usize| {
            let weight = if k == 0 { 1.0 } else { 2.0 } / n as f64;
            self.lead.iter().enumerate().fold((0.0, 0.0), |(c, s), (j, p)| {
                let (sin, cos) = (TAU * (k * j) as f64 / n as f64).sin_cos();
                (c + weight * cos * p[part], s + weight * sin * p[part])
            })
        };
        let all: Vec<[(f64, f64); 2]> =
            (0..=n / 2).map(|k| [coefficient(k, 0), coefficient(k, 1)]).collect();
        let at = |i: usize| {
            [0, 1].map(|part| {
                all.iter()
                    .enumerate()
                    .map(|(k, c)| {
                        let (sin, cos) = (TAU * (k * i) as f64 / count as f64).sin_cos();
                        c[part].0 * cos + c[part].1 * sin
                    })
                    .sum()
            })
        };
        (0..=count).map(at).collect()
    }

    /// Whether what lies beside comes to it.
    pub fn attracts(&self) -> bool {
        self.attraction < 1.0
    }
}

/// A family of such curves, from where a pair of multipliers leaves the unit circle.
#[derive(Debug, Clone, PartialEq)]
pub struct Tori {
    /// Circular frequency of the orbit that it begins at.
    pub start: f64,
    /// Frequencies of the loads that it is followed in.
    pub range: [f64; 2],
    /// Curves that are asked for.
    pub count: usize,
    /// The first size.
    pub size: f64,
    /// The curves.
    pub rows: Vec<TorusRow>,
    /// How the family ended; empty while it is computed.
    pub end: String,
}
