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

/// `a/|a|`
pub fn unit(a: Point) -> Point {
    let size = norm(&a);
    a.map(|x| x / size)
}
