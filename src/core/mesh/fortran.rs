//! Numbers as Fortran writes them.

/// `1.5`, `0.69D+09`, `7.85-9`; none where it is no finite number.
pub(crate) fn real(text: &str) -> Option<f64> {
    let text = text.trim();
    if let Ok(x) = text.parse::<f64>() {
        return Some(x).filter(|x| x.is_finite());
    }
    let with_e: String =
        text.chars().map(|c| if matches!(c, 'd' | 'D' | 'q' | 'Q') { 'e' } else { c }).collect();
    if let Ok(x) = with_e.parse::<f64>() {
        return Some(x).filter(|x| x.is_finite());
    }
    // an exponent without its letter
    let sign = with_e.char_indices().skip(1).find(|(_, c)| matches!(c, '+' | '-'))?.0;
    if with_e[..sign].contains('e') {
        return None;
    }
    let x: f64 = format!("{}e{}", &with_e[..sign], &with_e[sign..]).parse().ok()?;
    Some(x).filter(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::real;

    #[test]
    fn numbers_of_fortran() {
        for (text, value) in [
            ("1.5", 1.5),
            (" 0.69D+09", 0.69e9),
            ("7.85-9", 7.85e-9),
            ("-.134E-11", -0.134e-11),
            ("1.+3", 1e3),
            ("-2-1", -0.2),
        ] {
            assert_eq!(real(text), Some(value), "{text}");
        }
        for text in ["", "x", "1e", "nan", "inf", "1.2.3", "1-2-3", "1e400"] {
            assert_eq!(real(text), None, "{text}");
        }
    }
}
