//! Arrays in a page: the bytes of numbers, in base 64.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

/// Largest whole number that a displacement is rounded to.
const LARGEST: f64 = 32767.0;

fn block(kind: &str, bytes: &[u8], scale: f64) -> Value {
    json!({"kind": kind, "scale": scale, "data": STANDARD.encode(bytes)})
}

/// Numbers to sixteen digits: times, energies.
pub(super) fn exact(x: impl IntoIterator<Item = f64>) -> Value {
    let bytes: Vec<u8> = x.into_iter().flat_map(f64::to_le_bytes).collect();
    block("f8", &bytes, 1.0)
}

/// Numbers to seven digits: what is drawn as curves.
pub(super) fn single(x: impl IntoIterator<Item = f64>) -> Value {
    let bytes: Vec<u8> = x.into_iter().flat_map(|x| (x as f32).to_le_bytes()).collect();
    block("f4", &bytes, 1.0)
}

/// Numbers to a part in 32767 of the largest of them: what is drawn as places.
pub(super) fn rounded(x: &[f64]) -> Value {
    let largest = x.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let scale = if largest > 0.0 && largest.is_finite() { largest / LARGEST } else { 1.0 };
    let number = |x: &f64| (x / scale).round().clamp(-LARGEST, LARGEST) as i16;
    let bytes: Vec<u8> = x.iter().flat_map(|x| number(x).to_le_bytes()).collect();
    block("i2", &bytes, scale)
}

/// Whole numbers.
pub(super) fn whole(x: impl IntoIterator<Item = usize>) -> Value {
    let bytes: Vec<u8> =
        x.into_iter().flat_map(|x| i32::try_from(x).unwrap_or(-1).to_le_bytes()).collect();
    block("i4", &bytes, 1.0)
}

/// 0 and 1.
pub(super) fn flags(x: impl IntoIterator<Item = bool>) -> Value {
    let bytes: Vec<u8> = x.into_iter().map(u8::from).collect();
    block("u1", &bytes, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_kept_to_what_is_said() {
        let of = |v: &Value| STANDARD.decode(v["data"].as_str().unwrap()).unwrap();
        let x = [1.0, -2.0, 0.3333333333, 0.0];
        let v = rounded(&x);
        let scale = v["scale"].as_f64().unwrap();
        for (bytes, x) in of(&v).chunks_exact(2).zip(x) {
            let back = f64::from(i16::from_le_bytes([bytes[0], bytes[1]])) * scale;
            assert!((back - x).abs() <= 0.5001 * 2.0 / 32767.0, "{back} {x}");
        }
        assert_eq!(of(&exact([0.1])), 0.1f64.to_le_bytes());
        assert_eq!(rounded(&[0.0, 0.0])["scale"], 1.0);
        assert_eq!(of(&whole([3, 70000])), [3, 0, 0, 0, 112, 17, 1, 0]);
    }
}
