//! An order of the nodes in which neighbours are close: programs that make meshes number nodes as they come.
//!
//! Level by level from the contact (Cuthill and McKee 1969), the contact last: what is next to it is a range of rows, and what a product reads stays in the cache.

use crate::mesh::Mesh;

/// Nodes are taken in another order where their numbers are so many times further apart than in that.
const DISORDER: usize = 3;

/// The elements of each node.
struct Neighbours<'m> {
    start: Vec<usize>,
    elements: Vec<&'m [usize]>,
}

impl<'m> Neighbours<'m> {
    fn new(mesh: &'m Mesh) -> Neighbours<'m> {
        let mut start = vec![0; mesh.n_nodes() + 1];
        for e in mesh.elements() {
            e.nodes.iter().for_each(|n| start[n + 1] += 1);
        }
        for n in 0..mesh.n_nodes() {
            start[n + 1] += start[n];
        }
        let mut next = start.clone();
        let none: &[usize] = &[];
        let mut elements = vec![none; start[mesh.n_nodes()]];
        for e in mesh.elements() {
            for &n in e.nodes {
                elements[next[n]] = e.nodes;
                next[n] += 1;
            }
        }
        Neighbours { start, elements }
    }

    fn of(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        let own = &self.elements[self.start[node]..self.start[node + 1]];
        own.iter().flat_map(|e| e.iter().copied())
    }

    /// Puts a node behind those of `order`, and goes on from it.
    fn begin(
        &self,
        node: usize,
        order: &mut Vec<usize>,
        is_new: &mut [bool],
        wanted: impl Fn(usize) -> bool,
    ) {
        let first = order.len();
        is_new[node] = false;
        order.push(node);
        self.go_on(order, first, is_new, wanted);
    }

    /// Goes on from the nodes of `order` to all that are connected with them and wanted, level by level; `is_new` is true of nodes that are not in `order`.
    fn go_on(
        &self,
        order: &mut Vec<usize>,
        from: usize,
        is_new: &mut [bool],
        wanted: impl Fn(usize) -> bool,
    ) {
        let mut k = from;
        while k < order.len() {
            for n in self.of(order[k]) {
                if is_new[n] && wanted(n) {
                    is_new[n] = false;
                    order.push(n);
                }
            }
            k += 1;
        }
    }
}

/// The largest difference of the places of two nodes of an element.
fn reach(mesh: &Mesh, place: impl Fn(usize) -> usize) -> usize {
    let of = |nodes: &[usize]| {
        let places = nodes.iter().map(|n| place(*n));
        let (low, high) = places.fold((usize::MAX, 0), |(l, h), p| (l.min(p), h.max(p)));
        high.saturating_sub(low)
    };
    mesh.elements().map(|e| of(e.nodes)).max().unwrap_or(0)
}

/// The nodes with those of the contact last, or their own order where that is no worse.
pub(super) fn order(mesh: &Mesh, contact: &[usize]) -> Vec<usize> {
    let n = mesh.n_nodes();
    let own: Vec<usize> = (0..n).collect();
    if contact.is_empty() {
        return own;
    }
    let neighbours = Neighbours::new(mesh);
    let mut is_new = vec![true; n];
    let mut of_contact = vec![false; n];
    contact.iter().for_each(|&c| of_contact[c] = true);
    // the contact along itself, from an end of each of its pieces
    let (mut order, mut pieces) = (vec![], vec![]);
    let mut is_apart = is_new.clone();
    for &c in contact {
        if is_apart[c] {
            neighbours.begin(c, &mut pieces, &mut is_apart, |n| of_contact[n]);
            let end = pieces[pieces.len() - 1];
            neighbours.begin(end, &mut order, &mut is_new, |n| of_contact[n]);
        }
    }
    neighbours.go_on(&mut order, 0, &mut is_new, |_| true);
    // other bodies, and nodes of no element
    for node in 0..n {
        if is_new[node] {
            neighbours.begin(node, &mut order, &mut is_new, |_| true);
        }
    }
    order.reverse();
    let mut place = vec![0; n];
    order.iter().enumerate().for_each(|(k, &node)| place[node] = k);
    match reach(mesh, |n| n) > DISORDER * reach(mesh, |n| place[n]) {
        true => order,
        false => own,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::structured;

    #[test]
    fn ordered_meshes_stay_and_others_are_ordered_from_the_contact() {
        let mesh = structured::rectangle(2.0, 1.0, 40, 20);
        let right: Vec<usize> =
            (0..mesh.n_nodes()).filter(|&n| mesh.nodes()[n][0] == 2.0).collect();
        assert_eq!(order(&mesh, &right), (0..mesh.n_nodes()).collect::<Vec<_>>());
        assert_eq!(order(&mesh, &[]).len(), mesh.n_nodes());
        // the same with its numbers shuffled
        let n = mesh.n_nodes();
        let new = |k: usize| (k * 347 + 11) % n;
        let mut nodes = vec![[0.0; 3]; n];
        (0..n).for_each(|k| nodes[new(k)] = mesh.nodes()[k]);
        let mut blocks = mesh.blocks().to_vec();
        blocks.iter_mut().flat_map(|b| &mut b.connectivity).for_each(|k| *k = new(*k));
        let shuffled = Mesh::new(2, nodes, blocks, Default::default());
        let contact: Vec<usize> = right.iter().rev().map(|&k| new(k)).collect();
        let found = order(&shuffled, &contact);
        let mut all = found.clone();
        all.sort_unstable();
        assert_eq!(all, (0..n).collect::<Vec<_>>());
        let mut place = vec![0; n];
        found.iter().enumerate().for_each(|(k, &node)| place[node] = k);
        // columns of 21 nodes
        assert!(reach(&shuffled, |n| place[n]) < 2 * 22);
        let columns: Vec<f64> = found.iter().map(|&k| shuffled.nodes()[k][0]).collect();
        assert!(columns.is_sorted());
    }
}
