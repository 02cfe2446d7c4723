//! An element in patches of one colour each.

/// A node of an element in a picture: place and value.
#[derive(Clone, Copy)]
pub(super) struct Corner {
    pub at: [f64; 2],
    pub value: f64,
}

/// Colours that an element is at least divided into, over the whole scale; and least size of a patch in pixels.
const SHADES: f64 = 48.0;
const SMALLEST_PATCH: f64 = 3.0;

/// An element in patches of one colour each, in as many steps as the change of the value asks for; elements of second order as four of first order.
pub(super) fn patches(nodes: &[Corner], scale: f64, largest: f64) -> Vec<(Vec<[f64; 2]>, f64)> {
    let at = |parts: &[[usize; 4]], nodes: &[Corner]| {
        let part = |p: &[usize; 4]| quadrilateral(p.map(|k| nodes[k]), scale, largest);
        parts.iter().flat_map(part).collect()
    };
    const QUARTERS: [[usize; 4]; 4] = [[0, 4, 8, 7], [4, 1, 5, 8], [8, 5, 2, 6], [7, 8, 6, 3]];
    match nodes.len() {
        // triangles: two corners in one
        3 => at(&[[0, 1, 2, 2]], nodes),
        6 => at(&[[0, 3, 5, 5], [3, 1, 4, 4], [5, 4, 2, 2], [3, 4, 5, 5]], nodes),
        4 => at(&[[0, 1, 2, 3]], nodes),
        8 => {
            // its shape functions at the centre
            let mean = |f: &dyn Fn(&Corner) -> f64| {
                let sum = |n: &[Corner]| n.iter().map(f).sum::<f64>();
                0.5 * sum(&nodes[4..]) - 0.25 * sum(&nodes[..4])
            };
            let centre =
                Corner { at: [0, 1].map(|c| mean(&|n| n.at[c])), value: mean(&|n| n.value) };
            at(&QUARTERS, &[nodes, &[centre]].concat())
        }
        9 => at(&QUARTERS, nodes),
        _ => vec![],
    }
}

/// The value is interpolated bilinearly between the corners.
fn quadrilateral([a, b, c, d]: [Corner; 4], scale: f64, largest: f64) -> Vec<(Vec<[f64; 2]>, f64)> {
    let mix = |f: &dyn Fn(Corner) -> f64, s: f64, t: f64| {
        (1.0 - t) * ((1.0 - s) * f(a) + s * f(b)) + t * ((1.0 - s) * f(d) + s * f(c))
    };
    let steps = |p: [Corner; 2], q: [Corner; 2]| -> usize {
        let of = |[p, q]: [Corner; 2]| {
            let length = scale * (p.at[0] - q.at[0]).hypot(p.at[1] - q.at[1]);
            let shades = SHADES * (p.value - q.value).abs() / largest;
            shades.min(length / SMALLEST_PATCH)
        };
        of(p).max(of(q)).ceil().clamp(1.0, 12.0) as usize
    };
    let (m, n) = (steps([a, b], [d, c]), steps([a, d], [b, c]));
    let mut all = Vec::with_capacity(m * n);
    for i in 0..m {
        for j in 0..n {
            let at = |i: usize, j: usize| {
                let (s, t) = (i as f64 / m as f64, j as f64 / n as f64);
                [mix(&|c| c.at[0], s, t), mix(&|c| c.at[1], s, t)]
            };
            let middle = |k: usize, n: usize| (k as f64 + 0.5) / n as f64;
            let value = mix(&|c| c.value, middle(i, m), middle(j, n));
            all.push((vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], value));
        }
    }
    all
}
