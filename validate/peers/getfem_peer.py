"""GetFEM on the same mesh and data: the peer of `signorini precision --peer getfem`.

Reads a body written by signorini (argument 1: JSON with nodes, elements, material, held displacements, contact nodes with their
normals and gaps, initial displacements and velocities, end time) and prints one JSON object: frequencies of the body without contact, first
touch, last release, impulse of the contact, largest force, wall_s.

Elements, integration and assembly are GetFEM's, and so are its time scheme (Newmark, β = 1/4, γ = 1/2) and its Newton iteration. The contact is a penalty,
`r [u·n − g]₊` at the points of integration, with `r` = PENALTY E/h; steps are STEP of the time that a wave takes through the smallest element.
"""
import json
import sys
import time

import getfem as gf
import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import eigsh

PENALTY, STEP, FREQUENCIES = 10.0, 0.25, 5
TRANSFORMATIONS = {
    "T3": "GT_PK(2,1)", "T6": "GT_PK(2,2)", "Q4": "GT_QK(2,1)", "Q8": "GT_Q2_INCOMPLETE(2)", "Q9": "GT_QK(2,2)",
    "Tet4": "GT_PK(3,1)", "Tet10": "GT_PK(3,2)", "Hex8": "GT_QK(3,1)", "Hex20": "GT_Q2_INCOMPLETE(3)", "Hex27": "GT_QK(3,2)",
}


def mesh_of(body):
    """GetFEM's mesh: every element's nodes in the order of GetFEM's reference element."""
    dim, nodes = body["dim"], np.array(body["nodes"])
    mesh = gf.Mesh("empty", dim)
    for block in body["blocks"]:
        transformation = gf.GeoTrans(TRANSFORMATIONS[block["kind"]])
        own = np.array(block["places"])  # signorini's local coordinates, [−1, 1] for quadrilaterals and hexahedra
        own = own if block["kind"].startswith("T") else (own + 1) / 2
        order = [int(np.argmin(np.abs(own - p).sum(1))) for p in transformation.pts().T]
        assert sorted(order) == list(range(len(own))), block["kind"]
        for element in block["elements"]:
            mesh.add_convex(transformation, nodes[np.array(element)[order]].T)
    return mesh


def node_of(places, nodes):
    """The node at each place."""
    scale = 1e-9 * np.ptp(nodes, axis=0).max()
    index = {tuple(key): n for n, key in enumerate(np.round(nodes / scale).astype(np.int64))}
    found = []
    for key in np.round(places.T / scale).astype(np.int64):
        near = (index.get(tuple(key + np.array(d) - 1)) for d in np.ndindex(*(3,) * len(key)))
        found.append(next(n for n in near if n is not None))
    return np.array(found)


class Body:
    def __init__(self, body):
        self.body, self.dim = body, body["dim"]
        nodes = np.array(body["nodes"])
        self.mesh = mesh_of(body)
        kind = TRANSFORMATIONS[body["blocks"][0]["kind"]]
        self.mf = gf.MeshFem(self.mesh, self.dim)
        self.mf.set_fem(gf.Fem(kind.replace("GT_", "FEM_")))
        simplex = "PK" in kind
        rule = {(2, True): "IM_TRIANGLE(6)", (3, True): "IM_TETRAHEDRON(6)", (2, False): "IM_GAUSS_PARALLELEPIPED(2,6)", (3, False): "IM_GAUSS_PARALLELEPIPED(3,6)"}
        self.mim = gf.MeshIm(self.mesh, gf.Integ(rule[(self.dim, simplex)]))
        # which displacement of which node each of GetFEM's unknowns is
        places = self.mf.basic_dof_nodes()
        of_node = node_of(places, nodes)
        self.entry = self.dim * of_node + np.arange(len(of_node)) % self.dim
        self.extend = self.free_motions(of_node)
        self.data = gf.MeshFem(self.mesh, self.dim)  # fields that are data, nothing held
        self.data.set_fem(gf.Fem(kind.replace("GT_", "FEM_")))
        self.scalar = gf.MeshFem(self.mesh, 1)
        self.scalar.set_fem(gf.Fem(kind.replace("GT_", "FEM_")))
        self.scalar_node = node_of(self.scalar.basic_dof_nodes(), nodes)
        if body["held"]:
            self.mf.set("reduction matrices", getfem_of(self.extend.T), getfem_of(self.extend))
        self.contact_region()
        young, nu = body["young"], body["poisson"]
        lame, mu = young * nu / ((1 + nu) * (1 - 2 * nu)), young / (2 * (1 + nu))
        if body["state"] == "plane stress":
            lame = 2 * lame * mu / (lame + 2 * mu)
        self.constants = {"lame": lame, "mu": mu, "rho": body["density"]}
        ring = body["state"] == "axisymmetric"
        self.weight = "(2*pi*X(1))" if ring else repr(float(body["thickness"]))
        self.strain = (
            "lame*(Div_u+u(1)/X(1))*(Div_Test_u+Test_u(1)/X(1)) + 2*mu*(Sym(Grad_u):Grad_Test_u + u(1)*Test_u(1)/(X(1)*X(1)))"
            if ring
            else "lame*Div_u*Div_Test_u + 2*mu*Sym(Grad_u):Grad_Test_u"
        )

    def free_motions(self, of_node):
        """Orthonormal motions of every node across its held directions, as columns."""
        held = {}
        for h in self.body["held"]:
            held.setdefault(h["node"], []).append(h["along"])
        rows, columns, values, n = [], [], [], 0
        for k in range(0, len(of_node), self.dim):
            along = np.array(held.get(of_node[k], [])).reshape(-1, self.dim)
            across = np.linalg.svd(along)[2][len(along):] if len(along) else np.eye(self.dim)
            for motion in across:
                rows += range(k, k + self.dim)
                columns += [n] * self.dim
                values += motion.tolist()
                n += 1
        return sp.csc_matrix((values, (rows, columns)), (len(of_node), n))

    def contact_region(self):
        """Faces all of whose nodes are contact nodes."""
        contact = np.array(self.body["nodes"])[[c["node"] for c in self.body["contact"]]]
        points = self.mesh.pts()
        touching = set(self.mesh.pid_from_coords(contact.T, 1e-9 * np.ptp(points)).tolist())
        faces = self.mesh.outer_faces()
        chosen = [k for k in range(faces.shape[1]) if set(self.mesh.pid_in_faces(faces[:, [k]]).tolist()) <= touching]
        self.region = 1000
        self.mesh.set_region(self.region, faces[:, chosen])

    def field(self, nodal):
        """A nodal field as GetFEM's unknowns."""
        return np.array(nodal).ravel()[self.entry]

    def model(self, elements=None):
        model = gf.Model("real")
        model.add_fem_variable("u", elements or self.mf)
        for name, value in self.constants.items():
            model.add_initialized_data(name, [value])
        return model

    def matrix(self, expression, elements):
        model = self.model(elements)
        model.add_linear_term(self.mim, f"{self.weight}*({expression})")
        model.assembly("build_matrix")
        return scipy_of(model.tangent_matrix())

    def frequencies(self):
        k = self.matrix(self.strain, self.mf)
        # a lumped mass is the sum of each row, before any displacement is held
        if self.body["lumped"]:
            masses = np.asarray(self.matrix("rho*u.Test_u", self.data).sum(axis=1)).ravel()
            m = self.extend.T @ sp.diags(masses) @ self.extend
        else:
            m = self.matrix("rho*u.Test_u", self.mf)
        shift = -1e-4 * self.body["unit"] ** 2
        values = eigsh(k.tocsc(), FREQUENCIES + 6, m.tocsc(), sigma=shift, which="LM")[0]
        omega = np.sqrt(np.maximum(np.sort(values), 0.0))
        return omega[omega > 1e-2 * self.body["unit"]][:FREQUENCIES].tolist()

    def drop(self):
        """First touch, last release, impulse, largest force."""
        body, h = self.body, self.body["size"]
        model = self.model()
        n = len(body["nodes"])
        normal, gap = np.zeros((n, self.dim)), np.zeros(n)
        for c in body["contact"]:
            normal[c["node"]], gap[c["node"]] = c["normal"], c["gap"]
        model.add_initialized_fem_data("n", self.data, self.field(normal))
        model.add_initialized_fem_data("g", self.scalar, gap[self.scalar_node])
        model.add_initialized_data("r", [PENALTY * body["young"] / h])
        model.add_linear_term(self.mim, f"{self.weight}*({self.strain})")
        force = f"{self.weight}*r*pos_part(u.n-g)"
        model.add_nonlinear_term(self.mim, f"{force}*(Test_u.n)", self.region)
        model.add_Newmark_scheme("u", 0.25, 0.5)
        model.add_linear_term(self.mim, f"{self.weight}*rho*(Dot2_u.Test_u)")
        step = STEP * h / body["wave_speed"]
        steps = int(np.ceil(body["until"] / step))
        step = body["until"] / steps
        model.set_time_step(step)
        model.set_variable("Previous_u", self.extend.T @ self.field(body["u0"]))
        model.set_variable("Previous_Dot_u", self.extend.T @ self.field(body["v0"]))
        model.perform_init_time_derivative(step / 2)
        model.solve("max_res", 1e-10)
        t, f = [0.0], [0.0]
        for k in range(steps):
            model.solve("max_res", 1e-10)
            t.append((k + 1) * step)
            f.append(float(gf.asm_generic(self.mim, 0, force, self.region, model)))
            model.shift_variables_for_time_integration()
        t, f = np.array(t), np.array(f)
        touching = np.flatnonzero(f > 1e-9 * f.max()) if f.max() > 0 else np.array([], int)
        ends = [float(t[touching[0]]), float(t[touching[-1]])] if len(touching) else [None, None]
        return {"touch": ends[0], "release": ends[1], "impulse": float(np.sum(0.5 * (f[1:] + f[:-1]) * np.diff(t))), "force": float(f.max()), "steps": steps}


def getfem_of(a):
    matrix, entries = gf.Spmat("empty", *a.shape), a.tocoo()
    for i, j, v in zip(entries.row, entries.col, entries.data):
        matrix.add([int(i)], [int(j)], float(v))
    return matrix


def scipy_of(a):
    (columns, rows), values = a.csc_ind(), a.csc_val()
    return sp.csc_matrix((values, rows, columns), a.size())


def main():
    with open(sys.argv[1]) as file:
        body = Body(json.load(file))
    gf.util_trace_level(0)
    begun = time.perf_counter()
    answer = {"frequencies": body.frequencies(), **body.drop()}
    print(json.dumps({**answer, "wall_s": time.perf_counter() - begun}))


main()
