//! Nodes whose mass is not the same in all directions: what a constraint of their program leaves behind (an equation, a roller along no axis).

use std::collections::BTreeMap;

use super::DofName;

/// A node whose directions have different masses.
#[derive(Debug, Clone, PartialEq)]
pub struct Uneven {
    /// The node.
    pub node: String,
    /// The direction that has more mass, and the one that has less.
    pub directions: [u8; 2],
    /// The larger over the smaller.
    pub ratio: f64,
}

/// Masses in text have thirteen digits.
const SAME: f64 = 1e-9;

/// Of the diagonal of a mass matrix with names: nodes of which two directions of x, y and z differ. Where most nodes do (beams, the thickness of plane stress) it is
/// the elements' way, and says nothing; nor do directions without mass.
pub fn uneven_nodes(names: &[DofName], diagonal: &[f64]) -> Vec<Uneven> {
    let mut of_node: BTreeMap<&str, [Option<f64>; 3]> = BTreeMap::new();
    for (name, mass) in names.iter().zip(diagonal) {
        if let (1..=3, true) = (name.direction, *mass > 0.0) {
            of_node.entry(&name.node).or_default()[usize::from(name.direction) - 1] = Some(*mass);
        }
    }
    let mut found: BTreeMap<&str, Uneven> = BTreeMap::new();
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        let pairs = of_node.iter().filter_map(|(node, m)| Some((*node, m[a]?, m[b]?)));
        let pairs: Vec<(&str, f64, f64)> = pairs.collect();
        let differs = |(_, x, y): &&(&str, f64, f64)| (x - y).abs() > SAME * x.max(*y);
        let odd: Vec<_> = pairs.iter().filter(differs).collect();
        if 2 * odd.len() > pairs.len() {
            continue;
        }
        for (node, x, y) in odd {
            let [more, less] = if x > y { [a, b] } else { [b, a] };
            let directions = [more, less].map(|c| c as u8 + 1);
            let new = Uneven { node: (*node).to_owned(), directions, ratio: x.max(*y) / x.min(*y) };
            let known = found.entry(node).or_insert_with(|| new.clone());
            if new.ratio > known.ratio {
                *known = new;
            }
        }
    }
    found.into_values().collect()
}
