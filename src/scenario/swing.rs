//! Gaps that move from place to place, of an expression of `x`, `y`, `z` and the time `t`, which stands inside sines and cosines, linear:
//!
//! ```text
//! g(x, t) = g₀(x) + Σ_k a_k(x) cos(ω_k t + φ_k(x))
//! ```
//!
//! Such a call is read as a name `S_k` of its own: `g₀` is the expression at `S = 0`, `a_k` what `S_k = 1` adds to it.

use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use super::expression::Field;

/// Values of a sine or cosine, and times, at which an expression is asked whether it is linear in them.
const VALUES: [f64; 6] = [-1.0, -0.731, -0.270_4, 0.312, 0.613, 0.87];
const TIMES: [f64; 6] = [0.37, 1.234, 2.9, 17.77, 311.3, 5003.1];

/// Angles beyond this have lost their phase.
const LARGEST: f64 = 1e7;

/// A time at which an angle `ω t + φ` tells `ω`: a power of two, large beside `φ/ω`.
const LATE: f64 = 1_048_576.0;

/// What two evaluations of an expression may differ by, over their size.
const ROUNDING: f64 = 1e-9;

/// One sine or cosine with the time in it.
#[derive(Debug, Clone)]
struct Swing {
    is_sine: bool,
    /// The angle at the times 0, [`LATE`], and [`TIMES`].
    angle: Vec<Field>,
    /// The gap with this call at 1, and at [`VALUES`], all others at 0.
    with: Vec<Field>,
}

/// What moves of a gap.
#[derive(Debug, Clone)]
pub struct Swings {
    /// The gap at all calls 0, and with call `k` at the value `j + k` of [`VALUES`].
    still: Field,
    together: Vec<Field>,
    swings: Vec<Swing>,
}

/// A harmonic part of the gap at a place, `a cos(ω t + φ)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wave {
    /// `ω > 0`
    pub omega: f64,
    /// `a`
    pub amplitude: f64,
    /// `φ`
    pub phase: f64,
}

/// A gap: what stays of it, and what moves.
#[derive(Debug, Clone)]
pub(super) struct Moving {
    pub still: Field,
    pub swings: Option<Swings>,
}

impl Moving {
    /// Parse a gap; one without `t` is a field as any other.
    pub fn parse(text: &str) -> Result<Moving, String> {
        let calls = calls(text)?;
        if calls.is_empty() {
            return Ok(Moving { still: Field::parse(text)?, swings: None });
        }
        // the expression with each call at a value
        let outer = |value: &dyn Fn(usize) -> f64| {
            let (mut written, mut from) = (String::new(), 0);
            for (k, call) in calls.iter().enumerate() {
                written += &text[from..call.whole.start];
                written += &format!("({})", value(k));
                from = call.whole.end;
            }
            in_words(&(written + &text[from..]), text)
        };
        let swing = |(k, call): (usize, &Call)| {
            let at = |t: f64| in_words(&with_time(&text[call.angle.clone()], t), text);
            let with = |value: f64| outer(&|j| if j == k { value } else { 0.0 });
            Ok::<_, String>(Swing {
                is_sine: call.is_sine,
                angle: [0.0, LATE].into_iter().chain(TIMES).map(at).collect::<Result<_, _>>()?,
                with: std::iter::once(1.0).chain(VALUES).map(with).collect::<Result<_, _>>()?,
            })
        };
        let swings = calls.iter().enumerate().map(swing).collect::<Result<_, _>>()?;
        let still = outer(&|_| 0.0)?;
        let mixed = |j: usize| outer(&|k| VALUES[(j + k) % VALUES.len()]);
        let together = (0..VALUES.len()).map(mixed).collect::<Result<_, _>>()?;
        let swings = Swings { still: still.clone(), together, swings };
        Ok(Moving { still, swings: Some(swings) })
    }
}

impl Swings {
    /// Whether it depends on `z`.
    pub(super) fn is_in_space(&self) -> bool {
        let of = |s: &Swing| s.angle.iter().chain(&s.with).any(Field::is_in_space);
        self.swings.iter().any(of)
    }

    /// The harmonic parts at a place, each with a positive frequency; an error says what of the expression is no such gap.
    pub fn at(&self, place: [f64; 3]) -> Result<Vec<Wave>, &'static str> {
        let still = self.still.at(place);
        let near = |a: f64, b: f64, size: f64| (a - b).abs() <= ROUNDING * size;
        let (mut waves, mut shares) = (vec![], vec![]);
        for swing in &self.swings {
            let with: Vec<f64> = swing.with.iter().map(|f| f.at(place)).collect();
            let share = with[0] - still;
            let size = share.abs() + still.abs();
            let grows = |(x, v): (&f64, f64)| near(*x, still + v * share, size);
            if !with[1..].iter().zip(VALUES).all(grows) {
                return Err("does not grow in proportion to its sine or cosine of t");
            }
            shares.push(share);
            let angle: Vec<f64> = swing.angle.iter().map(|f| f.at(place)).collect();
            let (first, rate) = (angle[0], (angle[1] - angle[0]) / LATE);
            let runs =
                |(x, t): (&f64, f64)| near(*x, first + rate * t, first.abs() + (rate * t).abs());
            if !rate.is_finite() || !angle[2..].iter().zip(TIMES).all(runs) {
                return Err("has an angle that is not linear in t");
            }
            if first.abs() > LARGEST {
                return Err("has an angle at t = 0 that is too large for a phase");
            }
            let angle = if swing.is_sine { first - FRAC_PI_2 } else { first };
            // cos(φ − ωt) = cos(ωt − φ)
            let phase = if rate < 0.0 { -angle } else { angle };
            // as it was written: the difference of two angles knows some 15 digits
            let omega = format!("{:.13e}", rate.abs()).parse().unwrap_or(rate.abs());
            waves.push(Wave { omega, amplitude: share, phase });
        }
        for (j, together) in self.together.iter().enumerate() {
            let value = |k: usize| VALUES[(j + k) % VALUES.len()];
            let sum: f64 = shares.iter().enumerate().map(|(k, share)| value(k) * share).sum();
            let size = still.abs() + shares.iter().map(|s| s.abs()).sum::<f64>();
            if !near(together.at(place), still + sum, size) {
                return Err("has products of sines and cosines of t");
            }
        }
        if waves.iter().any(|w| w.omega == 0.0) {
            return Err("has an angle in which t has no part");
        }
        Ok(waves)
    }

    /// The first frequency, as a place tells it.
    pub(super) fn omega(&self) -> Option<f64> {
        // a place where hardly any expression is singular
        self.at([0.7, 0.4, 0.3]).ok()?.first().map(|w| w.omega)
    }
}

/// Parse a part of an expression; what is wrong with it is told of the whole.
fn in_words(part: &str, whole: &str) -> Result<Field, String> {
    Field::parse(part).map_err(|why| why.replace(part, whole))
}

/// A sine or cosine of the time: all of it, and its angle.
struct Call {
    is_sine: bool,
    whole: Range<usize>,
    angle: Range<usize>,
}

/// Names in a text; exponents of numbers are none.
fn names(text: &str) -> Vec<Range<usize>> {
    let mut all = vec![];
    let mut word: Option<usize> = None;
    for (i, c) in text.char_indices().chain([(text.len(), ' ')]) {
        let goes_on = c.is_alphanumeric() || c == '_' || (word.is_some() && c == '.');
        match word {
            None if goes_on || c == '.' => word = Some(i),
            Some(from) if !goes_on => {
                if text[from..].starts_with(|c: char| c.is_alphabetic()) {
                    all.push(from..i);
                }
                word = None;
            }
            _ => {}
        }
    }
    all
}

/// Whether the time stands in a text.
fn has_time(text: &str) -> bool {
    names(text).into_iter().any(|name| &text[name] == "t")
}

/// The text at a time.
fn with_time(text: &str, t: f64) -> String {
    let (mut written, mut from) = (String::new(), 0);
    for name in names(text).into_iter().filter(|name| &text[name.clone()] == "t") {
        written += &text[from..name.start];
        written += &format!("({t})");
        from = name.end;
    }
    written + &text[from..]
}

/// The outermost sines and cosines that have the time in their angle; an error where it stands elsewhere.
fn calls(text: &str) -> Result<Vec<Call>, String> {
    let mut all: Vec<Call> = vec![];
    for name in names(text) {
        let is_inside = all.last().is_some_and(|call| name.start < call.whole.end);
        if is_inside {
            continue;
        }
        let word = &text[name.clone()];
        if word == "t" {
            return Err(format!(
                "t stands outside a sine or cosine in `{text}`: a gap moves as one, such as \"0.3 + 0.1*cos(2*(atan2(y, x) - 5.0*t))\""
            ));
        }
        let rest = &text[name.end..];
        let open = name.end + (rest.len() - rest.trim_start().len());
        if !matches!(word, "sin" | "cos") || !text[open..].starts_with('(') {
            continue;
        }
        let mut depth = 0;
        let end = text[open..].char_indices().find(|(_, c)| {
            depth += match c {
                '(' => 1,
                ')' => -1,
                _ => 0,
            };
            depth == 0
        });
        let Some((end, _)) = end else { continue };
        let angle = open + 1..open + end;
        if has_time(&text[angle.clone()]) {
            let whole = name.start..open + end + 1;
            all.push(Call { is_sine: word == "sin", whole, angle });
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the expression itself, written in Rust.
    #[test]
    fn a_gap_that_moves_is_what_it_says() {
        type Exact = fn([f64; 3], f64) -> f64;
        let cases: [(&str, usize, Exact); 5] = [
            ("0.356 + 0.37*cos(2*(atan2(y, x) - 1344*t))", 1, |[x, y, _], t| {
                0.356 + 0.37 * (2.0 * (y.atan2(x) - 1344.0 * t)).cos()
            }),
            ("1 - x*sin(3*t)/2", 1, |[x, ..], t| 1.0 - x * (3.0 * t).sin() / 2.0),
            ("(2 + y) * (1 + 1e-1 * cos (x + t))", 1, |[x, y, _], t| {
                (2.0 + y) * (1.0 + 0.1 * (x + t).cos())
            }),
            ("exp(-x) + sin(2*t) - cos(5*t + y)*y^2", 2, |[x, y, _], t| {
                (-x).exp() + (2.0 * t).sin() - (5.0 * t + y).cos() * y * y
            }),
            ("0.2 + tan(x)*sin(x)*cos(-t + .5e0)", 1, |[x, ..], t| {
                0.2 + x.tan() * x.sin() * (0.5 - t).cos()
            }),
        ];
        for (text, count, exact) in cases {
            let gap = Moving::parse(text).unwrap();
            for (k, place) in
                [[0.3, 0.8, 0.0], [-1.2, 0.4, 0.0], [0.9, -0.7, 0.0]].into_iter().enumerate()
            {
                let t = 0.37 + 0.2 * k as f64;
                let waves = gap.swings.as_ref().unwrap().at(place).unwrap();
                assert_eq!(waves.len(), count, "{text}");
                let moved = waves.iter().map(|w| w.amplitude * (w.omega * t + w.phase).cos());
                let value = gap.still.at(place) + moved.sum::<f64>();
                assert!((value - exact(place, t)).abs() < 1e-10, "{text}: {value}");
            }
        }
        assert!(Moving::parse("1 + 0.2*y").unwrap().swings.is_none());
        for wrong in ["1 + t", "1 + exp(cos(t)) + t*x"] {
            assert!(Moving::parse(wrong).unwrap_err().contains("outside"), "{wrong}");
        }
        for (wrong, why) in [
            ("1 + cos(t)^2", "proportion"),
            ("1 + exp(cos(t))", "proportion"),
            ("1 + cos(t)*sin(t)", "products"),
            ("1 + cos(t^2)", "linear"),
            ("1 + cos(sin(t))", "linear"),
            ("1 + cos(t - t)", "no part"),
            ("1 + abs(cos(t))", "proportion"),
            ("1 + max(cos(t), 0)", "proportion"),
            ("1 - signum(cos(t))", "proportion"),
            ("1 + min(0.05*cos(t), 0)", "proportion"),
            ("1 + round(3*cos(t))", "proportion"),
            ("1 + abs(0.6*cos(t) + 0.8*sin(t))", "proportion"),
            ("1 + cos(floor(t))", "linear"),
            ("1 + cos(atan2(sin(t), cos(t)))", "linear"),
            ("1 + cos(t + 1e17)", "phase"),
            ("1 + cos(t + 1e9)", "phase"),
        ] {
            let swings = Moving::parse(wrong).unwrap().swings.unwrap();
            let found = swings.at([0.3, 0.2, 0.1]).unwrap_err();
            assert!(found.contains(why), "{wrong}: {found}");
        }
        assert!(Moving::parse("1 + cos(t").is_err() && Moving::parse("1 + cos(t + w)").is_err());
    }
}
