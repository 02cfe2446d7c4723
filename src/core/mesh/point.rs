//! Vectors in space.

use super::Point;

/// `a + b`
pub fn plus(a: &Point, b: &Point) -> Point {
    std::array::from_fn(|c| a[c] + b[c])
}

/// `a − b`
pub fn minus(a: &Point, b: &Point) -> Point {
    std::array::from_fn(|c| a[c] - b[c])
}

/// `a·b`
pub fn dot(a: &Point, b: &Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a × b`
pub fn cross(a: &Point, b: &Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `|a|`
pub fn norm(a: &Point) -> f64 {
    a[0].hypot(a[1]).hypot(a[2])
}

/// Components of a direction below this are rounding errors.
const OFF_AXIS: f64 = 1e-10;

/// A direction of length one without what is a rounding error beside its other components: what points along an axis does so to the digit, however a mesh was
/// turned, moved or scaled.
pub fn aligned(a: Point) -> Point {
    let is_off = |x: &f64| *x != 0.0 && x.abs() < OFF_AXIS;
    match a.iter().any(is_off) {
        true => unit(a.map(|x| if is_off(&x) { 0.0 } else { x })),
        false => a,
    }
}

/// `a/|a|`
pub fn unit(a: Point) -> Point {
    let size = norm(&a);
    a.map(|x| x / size)
}
