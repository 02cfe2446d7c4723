//! The meshes that a body, or several, are compared on: numbers of elements along each axis of each body.

use std::fmt;

use super::{Body, BodyKind, Change, Portion, Scene, Support};

/// Numbers of elements along each axis, a list a body: `10`, `10x3`, `10x3+8x4`. Without a list the body has no elements that could be other ones.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Elements(Vec<Vec<usize>>);

impl Elements {
    /// Of a bar.
    pub(crate) fn of_bar(n: usize) -> Elements {
        Elements(vec![vec![n]])
    }

    /// From `10`, `10x3` or `10x3+8x4`; none where it is no such thing.
    pub fn parse(text: &str) -> Option<Elements> {
        let number = |n: &str| n.trim().parse().ok().filter(|n| *n > 0);
        let list = |body: &str| body.split(['x', '×']).map(number).collect();
        text.split('+').map(list).collect::<Option<_>>().map(Elements)
    }

    /// Those of a scene.
    pub(crate) fn of(scene: &Scene) -> Elements {
        match scene.body.kind {
            BodyKind::Matrices => Elements::default(),
            _ => Elements(scene.bodies().into_iter().map(|(_, b)| b.elements.clone()).collect()),
        }
    }

    /// Whether there is none.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.iter().all(Vec::is_empty)
    }

    /// How many elements.
    pub(crate) fn count(&self) -> usize {
        self.0.iter().filter(|own| !own.is_empty()).map(|own| own.iter().product::<usize>()).sum()
    }

    /// As many numbers as the bodies of a scene have axes: one number alone is that of the first body along its first axis, and keeps the shape of all elements.
    pub(crate) fn in_shape_of(&self, own: &Elements) -> Option<Elements> {
        let axes = |all: &Elements| all.0.iter().map(Vec::len).collect::<Vec<_>>();
        if axes(self) == axes(own) {
            return Some(self.clone());
        }
        let [only] = &self.0[..] else { return None };
        let (&[n], Some(&first)) = (&only[..], own.0.first().and_then(|own| own.first())) else {
            return None;
        };
        let scaled = |&k: &usize| rounded(n * k, first);
        Some(Elements(own.0.iter().map(|body| body.iter().map(scaled).collect()).collect()))
    }

    /// Every number over `by`, rounded; none where the first of a body would be less than two, or nothing changes.
    pub(crate) fn divided(&self, by: usize) -> Option<Elements> {
        let scaled = |n: &usize| rounded(*n, by);
        let all: Vec<Vec<usize>> = self.0.iter().map(|b| b.iter().map(scaled).collect()).collect();
        let is_coarse = |body: &Vec<usize>| body.first().is_none_or(|n| *n < 2);
        let divided = Elements(all);
        (divided != *self && !divided.0.iter().any(is_coarse)).then_some(divided)
    }

    /// What gives them to a scene.
    pub(crate) fn changes(&self, scene: &Scene) -> Vec<Change> {
        let of = |((key, _), n): ((String, _), &Vec<usize>)| {
            Change::set(format!("{key}.elements"), format!("{n:?}"))
        };
        scene.bodies().into_iter().zip(&self.0).filter(|(_, n)| !n.is_empty()).map(of).collect()
    }

    /// The same, in the scene as it is read.
    pub(crate) fn put(self, scene: &mut Scene) {
        let bodies = match scene.parts.is_empty() {
            true => std::slice::from_mut(&mut scene.body),
            false => &mut scene.parts[..],
        };
        bodies.iter_mut().zip(self.0).for_each(|(body, n)| body.elements = n);
    }
}

/// `n/by`, rounded, at least one.
fn rounded(n: usize, by: usize) -> usize {
    ((2 * n + by) / (2 * by)).max(1)
}

impl Scene {
    /// Whether all of its bodies have elements that could be other ones: none comes from a file, and no node is named.
    pub(crate) fn has_elements_of_choice(&self) -> bool {
        let is_given = |b: &Body| matches!(b.kind, BodyKind::Matrices | BodyKind::Mesh);
        let names = |s: &Support| matches!(s.part(), Some((_, Portion::Nodes(_))));
        let named = self.contact.as_ref().is_some_and(|c| c.at_nodes().is_some());
        !named
            && !self.supports.iter().any(names)
            && !self.bodies().iter().any(|(_, b)| is_given(b))
    }
}

impl fmt::Display for Elements {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let body =
            |own: &Vec<usize>| own.iter().map(usize::to_string).collect::<Vec<_>>().join("x");
        let all: Vec<String> = self.0.iter().filter(|own| !own.is_empty()).map(body).collect();
        f.write_str(&all.join("+"))
    }
}

#[cfg(test)]
mod tests {
    use super::Elements;

    #[test]
    fn one_number_keeps_the_shape_of_all_bodies() {
        let own = Elements::parse("10x3+8x4").unwrap();
        assert_eq!((own.to_string(), own.count()), ("10x3+8x4".to_owned(), 62));
        let shaped = |text: &str| {
            let asked = Elements::parse(text).unwrap();
            asked.in_shape_of(&own).map(|e| e.to_string())
        };
        assert_eq!(shaped("20").as_deref(), Some("20x6+16x8"));
        assert_eq!(shaped("5").as_deref(), Some("5x2+4x2"));
        assert_eq!(shaped("7x2 + 3×3").as_deref(), Some("7x2+3x3"));
        for other in ["7x2", "7x2+3", "7+3", "7x2x1+3x3", "7x2+3x3+2x2"] {
            assert_eq!(shaped(other), None, "{other}");
        }
        for none in ["", "x", "10x", "0", "10x3+", "-2", "1.5"] {
            assert_eq!(Elements::parse(none), None, "{none}");
        }
        let bar = Elements::parse("20").unwrap();
        assert_eq!(bar.in_shape_of(&Elements::of_bar(7)), Some(bar));
        assert_eq!(own.divided(2).unwrap().to_string(), "5x2+4x2");
        assert_eq!(own.divided(8), None);
    }
}
