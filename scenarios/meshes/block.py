"""block.msh: a block 4 x 1 x 1 of hexahedra with 20 nodes, in the format 2.2 of Gmsh. `python block.py > block.msh`"""

COUNT = (8, 2, 2)
SIZE = (4.0, 1.0, 1.0)
# corners of an element, and the pairs of corners whose middles are its other nodes, in the order of Gmsh
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
EDGES = [(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)]

nodes = {}


def node(place):
    """The number of a node; places are counted in halves of an element."""
    return nodes.setdefault(place, len(nodes) + 1)


def of_corners(corners, edges):
    middles = [tuple((a + b) // 2 for a, b in zip(corners[i], corners[j])) for i, j in edges]
    return [node(p) for p in corners + middles]


elements = []
for i in range(COUNT[0]):
    for j in range(COUNT[1]):
        for k in range(COUNT[2]):
            corners = [tuple(2 * (e + c) for e, c in zip((i, j, k), corner)) for corner in CORNERS]
            elements.append((17, 1, of_corners(corners, EDGES)))
            around = [(0, 1), (1, 2), (2, 3), (3, 0)]
            if i == 0:
                elements.append((16, 2, of_corners([corners[c] for c in (0, 4, 7, 3)], around)))
            # the last quarter of the underside
            if k == 0 and i >= 3 * COUNT[0] // 4:
                elements.append((16, 3, of_corners([corners[c] for c in (0, 3, 2, 1)], around)))

print("$MeshFormat\n2.2 0 8\n$EndMeshFormat")
print('$PhysicalNames\n3\n3 1 "body"\n2 2 "wall"\n2 3 "sole"\n$EndPhysicalNames')
print(f"$Nodes\n{len(nodes)}")
for place, number in nodes.items():
    x, y, z = (p * s / (2 * n) for p, s, n in zip(place, SIZE, COUNT))
    print(number, f"{x:g} {y:g} {z:g}")
print(f"$EndNodes\n$Elements\n{len(elements)}")
for number, (kind, group, of) in enumerate(elements, 1):
    print(number, kind, 2, group, group, *of)
print("$EndElements")
