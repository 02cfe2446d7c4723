//! Meshes that are put somewhere, and several as one.

use std::collections::BTreeMap;

use super::{Block, Facet, Mesh, Point};

impl Mesh {
    /// The mesh in the image of a map that turns it inside out, a reflection: the nodes of every element are exchanged, groups keep their sides.
    pub fn mirrored(&self, map: impl Fn(Point) -> Point) -> Mesh {
        let mut mesh = self.moved(map);
        for block in &mut mesh.blocks {
            let n = block.kind.nodes();
            block.connectivity.chunks_exact_mut(n).for_each(|nodes| block.kind.turn_round(nodes));
        }
        let set = |mesh: &Mesh, facet: Facet| {
            let mut nodes = mesh.side_nodes(facet);
            nodes.sort_unstable();
            nodes
        };
        let same_side = |facet: &Facet| {
            let wanted = set(self, *facet);
            let sides = 0..mesh.element(*facet).kind.sides();
            let mut facets = sides.map(|side| Facet { side, ..*facet });
            facets.find(|f| set(&mesh, *f) == wanted).unwrap_or(*facet)
        };
        let of_group = |(name, facets): (&String, &Vec<Facet>)| {
            (name.clone(), mesh.in_chains(&facets.iter().map(same_side).collect::<Vec<_>>()))
        };
        let groups = self.groups.iter().map(of_group).collect();
        Mesh { groups, ..mesh }
    }

    /// Several meshes as one, in their order; groups are called `"name:group"`, regions are counted on.
    pub fn joined(parts: &[(&str, Mesh)], regions: &[usize]) -> Mesh {
        let dim = parts.first().map_or(1, |(_, m)| m.dim);
        let (mut nodes, mut blocks) = (vec![], vec![]);
        let (mut groups, mut chosen) = (BTreeMap::new(), BTreeMap::new());
        for ((name, mesh), first_region) in parts.iter().zip(regions) {
            let (first_node, first_block) = (nodes.len(), blocks.len());
            nodes.extend(&mesh.nodes);
            blocks.extend(mesh.blocks.iter().map(|b| Block {
                region: first_region + b.region,
                connectivity: b.connectivity.iter().map(|n| first_node + n).collect(),
                ..b.clone()
            }));
            let placed = |f: &Facet| Facet { block: first_block + f.block, ..*f };
            for (group, facets) in &mesh.groups {
                groups.insert(format!("{name}:{group}"), facets.iter().map(placed).collect());
            }
            for (group, nodes) in &mesh.chosen {
                let nodes = nodes.iter().map(|n| first_node + n).collect();
                chosen.insert(format!("{name}:{group}"), nodes);
            }
        }
        Mesh { dim, nodes, blocks, groups, chosen }
    }
}

#[cfg(test)]
mod tests {
    use super::super::structured;
    use super::*;

    #[test]
    fn an_image_has_the_sides_of_its_original() {
        let mesh = structured::rectangle(2.0, 1.0, 3, 2);
        let image = mesh.mirrored(|[x, y, z]| [4.0 - x, y, z]);
        for name in ["left", "right", "bottom", "top"] {
            let (mut a, mut b) = (mesh.group_nodes(name), image.group_nodes(name));
            a.sort_unstable();
            b.sort_unstable();
            assert_eq!(a, b, "{name}");
        }
        let bar = structured::bar(1.0, 4).mirrored(|[x, y, z]| [-x, y, z]);
        assert_eq!((bar.group_nodes("left"), bar.group_nodes("right")), (vec![0], vec![4]));
        let both = Mesh::joined(&[("a", mesh.clone()), ("b", image)], &[0, 1]);
        assert_eq!((both.n_nodes(), both.n_elements()), (24, 12));
        assert_eq!(both.group_nodes("b:right").iter().min(), Some(&(12 + 9)));
        assert_eq!(both.parts().iter().max(), Some(&1));
        assert_eq!(both.elements().last().map(|e| e.region), Some(1));
    }
}
