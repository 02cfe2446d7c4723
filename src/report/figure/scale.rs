//! How numbers are written along an axis.

use std::ops::Range;

use crate::report::summary::significant;

/// The range of some numbers with a margin of 6 %.
pub fn range(values: impl IntoIterator<Item = f64>) -> Range<f64> {
    let (mut a, mut b) = (f64::INFINITY, f64::NEG_INFINITY);
    for v in values.into_iter().filter(|v| v.is_finite()) {
        (a, b) = (a.min(v), b.max(v));
    }
    if a > b {
        return 0.0..1.0;
    }
    let margin = if b > a { 0.06 * (b - a) } else { 0.5 * a.abs().max(1e-12) };
    a - margin..b + margin
}

/// How the ticks of a range are written.
#[derive(Debug, Clone, Copy)]
pub(super) struct TickStyle {
    /// Decimals that tell them apart; `None` for powers of ten.
    pub(super) decimals: Option<usize>,
    /// Numbers below this are rounding errors of zero.
    zero: f64,
}

impl TickStyle {
    pub(super) fn new(range: &Range<f64>) -> Self {
        let span = (range.end - range.start).abs();
        let largest = range.start.abs().max(range.end.abs());
        let decimals = (1e-2..1e5)
            .contains(&largest)
            .then(|| (2.0 - span.log10()).floor().clamp(0.0, 6.0) as usize);
        TickStyle { decimals, zero: 1e-6 * span }
    }

    pub(super) fn text(&self, v: f64) -> String {
        if v.abs() <= self.zero {
            return "0".into();
        }
        let text = match self.decimals {
            Some(d) => {
                let s = format!("{v:.d$}");
                match s.contains('.') {
                    true => s.trim_end_matches('0').trim_end_matches('.').to_owned(),
                    false => s,
                }
            }
            None => {
                let s = format!("{v:.2e}");
                match s.split_once('e') {
                    Some((m, e)) => {
                        format!("{}e{e}", m.trim_end_matches('0').trim_end_matches('.'))
                    }
                    None => s,
                }
            }
        };
        text.replace('-', "−")
    }
}

/// `10ⁿ`.
pub(super) fn power_of_ten(exponent: i32) -> String {
    let digits = "⁰¹²³⁴⁵⁶⁷⁸⁹";
    let raise = |c: char| digits.chars().nth(c.to_digit(10)? as usize);
    let raised: String = exponent.abs().to_string().chars().filter_map(raise).collect();
    format!("10{}{}", if exponent < 0 { "⁻" } else { "" }, raised)
}

/// Ticks of a logarithmic axis from 1, 2, …, 9 times powers of ten, and their names: none for those that would crowd.
pub(crate) fn log_ticks(range: &Range<f64>) -> Vec<(f64, String)> {
    let decades = range.end - range.start;
    let named = |digit: i32, exponent: i32| match decades {
        d if d <= 1.0 => digit <= 5,
        d if d <= 2.5 => [1, 2, 5].contains(&digit),
        d => digit == 1 && exponent.rem_euclid((d / 8.0).ceil() as i32) == 0,
    };
    let mut ticks = vec![];
    for exponent in range.start.floor() as i32..=range.end.ceil() as i32 {
        for digit in 1..10 {
            let value = f64::from(exponent) + f64::from(digit).log10();
            // between many decades nothing but the powers
            if !range.contains(&value) || (digit > 1 && decades > 6.0) {
                continue;
            }
            let name = match exponent {
                _ if !named(digit, exponent) => String::new(),
                -3..=4 => significant(10f64.powi(exponent) * f64::from(digit), 1),
                _ if digit == 1 => power_of_ten(exponent),
                _ => format!("{digit}·{}", power_of_ten(exponent)),
            };
            ticks.push((value, name));
        }
    }
    ticks
}
