//! The ridge of a set of forced responses: where their amplitudes peak.

use serde::{Deserialize, Serialize};

use super::bits;

/// A peak of a response.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// Branch.
    pub branch: usize,
    /// Frequency.
    #[serde(with = "bits::one")]
    pub omega: f64,
    /// Largest contact displacement.
    #[serde(with = "bits::one")]
    pub amplitude: f64,
    /// Energy there.
    #[serde(with = "bits::one")]
    pub energy: f64,
}

/// A maximum that stands out by less than this, relative, is a corner of the branch.
const PROMINENCE: f64 = 0.01;

/// Beside a neighbour that differs by more than this, relative, the branch jumps: no curve goes through both.
const JUMP: f64 = 0.2;

/// The peaks of the amplitude along a branch, whose orbits come in the order of the walk: frequency, amplitude, energy. They are the tops of parabolas
/// over the length of the branch in the plane of frequency and amplitude, through the highest orbit and its neighbours; the highest orbit itself beside a jump.
pub fn peaks(branch: usize, row: Vec<[f64; 3]>) -> Vec<Peak> {
    summits(branch, row).into_iter().map(|s| s.0).collect()
}

/// The same, each with the places in the row of the orbit before, of the highest and of the one behind.
pub fn summits(branch: usize, row: Vec<[f64; 3]>) -> Vec<(Peak, [usize; 3])> {
    let mut row: Vec<(usize, [f64; 3])> = row.into_iter().enumerate().collect();
    row.dedup_by(|a, b| a.1[0] == b.1[0] && a.1[1] == b.1[1]);
    let (places, row): (Vec<usize>, Vec<[f64; 3]>) = row.into_iter().unzip();
    let highest: Vec<usize> = (1..row.len().saturating_sub(1))
        .filter(|&k| row[k][1] >= row[k - 1][1] && row[k][1] > row[k + 1][1])
        .filter(|&k| stands_out(&row, k))
        .collect();
    let of = |k: usize| {
        let around = [k - 1, k, k + 1];
        (top(branch, around.map(|k| row[k])), around.map(|k| places[k]))
    };
    highest.into_iter().map(of).collect()
}

/// Whether the branch falls by enough on both sides before it rises above a maximum again.
fn stands_out(row: &[[f64; 3]], k: usize) -> bool {
    let height = row[k][1];
    let falls = |side: &mut dyn Iterator<Item = &[f64; 3]>| {
        side.take_while(|p| p[1] <= height).any(|p| p[1] < (1.0 - PROMINENCE) * height)
    };
    falls(&mut row[..k].iter().rev()) && falls(&mut row[k + 1..].iter())
}

/// Frequency, amplitude and energy as parabolas of the length along the branch, at the top of the amplitude's.
fn top(branch: usize, p: [[f64; 3]; 3]) -> Peak {
    let [omega, amplitude, energy] = p[1];
    if [p[0], p[2]].iter().any(|q| (q[1] - amplitude).abs() > JUMP * amplitude) {
        return Peak { branch, omega, amplitude, energy };
    }
    let length = |a: &[f64; 3], b: &[f64; 3]| {
        ((a[0] - b[0]) / b[0]).hypot((a[1] - b[1]) / b[1]).max(f64::MIN_POSITIVE)
    };
    let s = [-length(&p[0], &p[1]), 0.0, length(&p[2], &p[1])];
    // Newton form through the three: y₁ + slope s + curvature s²
    let parabola = |c: usize| {
        let (left, right) = ((p[1][c] - p[0][c]) / -s[0], (p[2][c] - p[1][c]) / s[2]);
        let curvature = (right - left) / (s[2] - s[0]);
        (p[1][c], left - s[0] * curvature, curvature)
    };
    let (_, slope, curvature) = parabola(1);
    let at = if curvature < 0.0 { (-0.5 * slope / curvature).clamp(s[0], s[2]) } else { 0.0 };
    let value = |c: usize| {
        let (y, slope, curvature) = parabola(c);
        y + at * (slope + at * curvature)
    };
    Peak { branch, omega: value(0), amplitude: value(1), energy: value(2) }
}

/// The top of the parabola through three values, if the middle one is the largest; else the middle one.
pub(crate) fn crest(t: [f64; 3], y: [f64; 3]) -> f64 {
    if y[1] < y[0] || y[1] < y[2] {
        return y[1];
    }
    let (a, b) = ((y[1] - y[0]) / (t[1] - t[0]), (y[2] - y[1]) / (t[2] - t[1]));
    let curvature = (b - a) / (t[2] - t[0]);
    if curvature.is_nan() || curvature >= 0.0 {
        return y[1];
    }
    // Newton form about the middle: y₁ + slope (t − t₁) + curvature (t − t₁)²
    let slope = a + curvature * (t[1] - t[0]);
    y[1] - slope * slope / (4.0 * curvature)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point((omega, amplitude): (f64, f64)) -> [f64; 3] {
        [omega, amplitude, amplitude * amplitude]
    }

    /// A resonance that leans over: the peak lies before the fold, between two points of the branch; its error falls with the square of the step.
    #[test]
    fn the_top_of_a_curve_that_folds_is_found_between_its_points() {
        let curve = |x: f64| (1.5 + 0.2 * x - 0.1 * x * x, 2.0 - (x - 0.31).powi(2));
        let (omega, amplitude) = curve(0.31);
        let errors = |step: f64| {
            let count = (2.5 / step) as i32;
            let at = |k: i32| curve(-1.0 + step * f64::from(k));
            let found = peaks(3, (0..=count).map(at).map(point).collect());
            assert!(found.len() == 1 && found[0].branch == 3);
            let p = found[0];
            [p.omega - omega, p.amplitude - amplitude, p.energy - amplitude * amplitude]
        };
        let (coarse, fine) = (errors(0.05), errors(0.0125));
        for (coarse, fine) in coarse.iter().zip(&fine) {
            assert!(coarse.abs() < 5e-4 && fine.abs() < 0.1 * coarse.abs(), "{coarse} {fine}");
        }
    }

    /// A walk over frequencies falls from the fold to the motion that does not touch.
    #[test]
    fn beside_a_jump_the_highest_orbit_is_the_peak() {
        let row = [(1.605, 1.146), (1.62, 1.17), (1.635, 1.186), (1.65, 0.629), (1.665, 0.522)];
        let found = peaks(0, row.map(point).to_vec());
        assert_eq!(found.iter().map(|p| (p.omega, p.amplitude)).collect::<Vec<_>>(), [row[2]]);
    }

    #[test]
    fn ripple_and_ends_are_no_peaks() {
        let climb = |k: i32| 1.0 + 0.01 * f64::from(k) + 1e-3 * f64::from(k % 2);
        let row = (0..100).map(|k| point((1.0 + 0.01 * f64::from(k), climb(k)))).collect();
        assert_eq!(peaks(0, row), []);
    }
}
