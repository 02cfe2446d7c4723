"""What `signorini export` writes, read by others: CSV as text, VTU and XDMF with meshio, and with VTK where it is installed.

    python outside_export.py RUN.h5 STEM EVERY FROM TO        (STEM.csv, STEM-vtu/ and STEM.xdmf exist)

Every time and every value must be that of the run's HDF5 file, bit by bit; the stress is computed again here.
"""

import os
import sys
import tomllib
import xml.etree.ElementTree as ET

import h5py
import meshio
import numpy as np

try:
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy
except ImportError:
    if os.environ.get("SIGNORINI_STRICT") == "1":
        raise
    vtk = None


def expected(path, every, first, last):
    """Times, points, cells and, for every chosen state, the fields."""
    f = h5py.File(path, "r")
    t = f["trajectory/t"][:]
    rows = np.flatnonzero((t >= first) & (t <= last))[::every]
    points, cells = f["mesh/nodes"][:], f["mesh/elements"][:]
    dof, contact, gap = f["mesh/dof_map"][:], f["mesh/contact_nodes"][:], f["mesh/gap"][:]
    normal = f["mesh"].attrs["contact_normal"]
    sign, axis = (-1.0 if normal[0] == "-" else 1.0), "xy".index(normal[1])
    body = tomllib.loads(f.attrs["scene"])["body"]
    states = []
    for row in rows:
        fields = {}
        for name, key in [("displacement", "u"), ("velocity", "v")]:
            padded = np.append(f["trajectory"][key][row], 0.0)  # -1 picks the last entry
            fields[name] = np.column_stack([padded[dof], np.zeros(len(points))])
        u = fields["displacement"]
        if len(contact):
            for name, rest, kind, values in [
                ("contact_pressure", 0.0, float, f["trajectory/pressure"][row]),
                ("contact_status", -1, int, f["trajectory/active"][row]),
                ("gap", np.nan, float, gap - sign * u[contact, axis]),
            ]:
                fields[name] = np.full(len(points), rest, dtype=kind)
                fields[name][contact] = values
            area, outward = f["mesh/contact_area"][:], f["mesh/contact_normals"][:]
            force = np.zeros((len(points), 3))
            force[contact, :2] = area[:, None] * -(f["trajectory/pressure"][row][:, None] * outward)
            fields["contact_force"] = force
        states.append((t[row], fields, stress(body, points, cells, u)))
    return f, rows, np.column_stack([points, np.zeros(len(points))]), cells, states


def stress(body, points, cells, u):
    """Hooke's law on the mean slopes of rectangles whose corners run round, or of bars."""
    young = body["young"]
    if cells.shape[1] == 2:
        a, b = cells.T
        axial = young * (u[b, 0] - u[a, 0]) / (points[b, 0] - points[a, 0])
        return {"stress": axial, "stress_recovered": young * slopes(points, cells, u)[:, 0, 0]}
    p, q, r, s = cells.T
    hx, hy = points[q, 0] - points[p, 0], points[s, 1] - points[p, 1]
    dx = ((u[q] - u[p]) + (u[r] - u[s])) / (2 * hx[:, None])
    dy = ((u[s] - u[p]) + (u[r] - u[q])) / (2 * hy[:, None])
    nu = body.get("poisson", 0.0)
    e_x, e_y, g = dx[:, 0], dy[:, 1], dx[:, 1] + dy[:, 0]
    c = young / (1 - nu**2)
    xx, yy, xy = c * (e_x + nu * e_y), c * (e_y + nu * e_x), young / (2 * (1 + nu)) * g
    zero = np.zeros_like(xx)
    tensor = np.column_stack([xx, xy, zero, xy, yy, zero, zero, zero, zero])
    # at each corner by the slopes of its own sides; at nodes the mean of the elements around, by their areas
    sums, areas = np.zeros((len(points), 9)), np.zeros(len(points))
    for own, across, up in [(p, (p, q), (p, s)), (q, (p, q), (q, r)), (r, (s, r), (q, r)), (s, (s, r), (p, s))]:
        dx, dy = (u[across[1]] - u[across[0]]) / hx[:, None], (u[up[1]] - u[up[0]]) / hy[:, None]
        a, b, g = dx[:, 0], dy[:, 1], dx[:, 1] + dy[:, 0]
        sx, sy, sxy = c * (a + nu * b), c * (b + nu * a), young / (2 * (1 + nu)) * g
        at_corner = np.column_stack([sx, sxy, zero, sxy, sy, zero, zero, zero, zero])
        np.add.at(sums, own, (hx * hy)[:, None] * at_corner)
        np.add.at(areas, own, hx * hy)
    averaged = sums / areas[:, None]
    g = slopes(points, cells, u)
    a, b, g = g[:, 0, 0], g[:, 1, 1], g[:, 0, 1] + g[:, 1, 0]
    sx, sy, sxy = c * (a + nu * b), c * (b + nu * a), young / (2 * (1 + nu)) * g
    rest = np.zeros_like(sx)
    smooth = np.column_stack([sx, sxy, rest, sxy, sy, rest, rest, rest, rest])
    mises = lambda xx, yy, xy: np.sqrt(xx**2 - xx * yy + yy**2 + 3 * xy**2)
    return {
        "stress": tensor, "von_mises": mises(xx, yy, xy), "stress_averaged": averaged,
        "stress_recovered": smooth, "von_mises_recovered": mises(smooth[:, 0], smooth[:, 4], smooth[:, 1]),
    }


def slopes(points, cells, u):
    """Gradients of the displacement at the nodes, [node, axis, component]: those of a polynomial, quadratic in each coordinate, through the displacements of the nodes
    around, by least squares; around a node stand the nodes of its elements, and of those next to them where these do not decide the polynomial."""
    dim = 1 if cells.shape[1] == 2 else 2
    gradients = np.zeros((len(points), dim, u.shape[1]))
    for node, place in enumerate(points):
        near = np.unique(cells[(cells == node).any(axis=1)])
        for _ in range(3):
            x = (points[near] - place)[:, :dim]
            x = x / (scale := np.abs(x).max(axis=0))
            columns = [np.ones(len(near)), *x.T, *(x.T**2)]
            if dim == 2:
                columns += [a * b for a in (x[:, 0], x[:, 0] ** 2) for b in (x[:, 1], x[:, 1] ** 2)]
            rows = np.column_stack(columns)
            if np.linalg.matrix_rank(rows, tol=1e-9) == rows.shape[1]:
                break
            near = np.unique(cells[np.isin(cells, near).any(axis=1)])
        else:
            raise AssertionError("a body that is one element thick")
        gradients[node] = (np.linalg.pinv(rows) @ u[near])[1 : 1 + dim] / scale[:, None]
    return gradients


def same(points, cells, found, wanted):
    """One state as somebody read it: (time, mesh, point fields, cell fields)."""
    t, mesh_points, mesh_cells, point_data, cell_data = found
    time, fields, stresses = wanted
    assert t == time, (t, time)
    assert np.array_equal(mesh_points, points) and np.array_equal(mesh_cells, cells)
    stresses = dict(stresses)
    point_data = dict(point_data)
    for name in ["stress_averaged", "stress_recovered", "von_mises_recovered"]:
        if name in stresses:
            at_nodes = stresses.pop(name)
            got = point_data.pop(name).reshape(at_nodes.shape)
            assert np.abs(got - at_nodes).max() <= 1e-11 * (np.abs(at_nodes).max() or 1.0), name
    assert set(point_data) == set(fields), set(point_data)
    for name, values in fields.items():
        got = point_data[name]
        assert got.shape == values.shape and got.dtype.kind == values.dtype.kind, name
        assert np.array_equal(got, values, equal_nan=values.dtype.kind == "f"), name
    assert set(cell_data) == set(stresses), set(cell_data)
    for name, values in stresses.items():
        scale = np.abs(values).max() or 1.0
        assert cell_data[name].shape == values.shape, name
        assert np.abs(cell_data[name] - values).max() <= 1e-11 * scale, name


def csv(f, rows, stem, first, last):
    table = [line.rstrip("\n").split(",") for line in open(stem + ".csv")]
    head, body = table[0], table[1:]
    assert not any("e0" in cell for line in body for cell in line if cell.endswith("e0"))
    number = np.array([[float(x) for x in line] for line in body])
    assert number.shape == (len(rows), len(head))
    wanted = [f["trajectory/t"][:]] + [
        f["energy"][k][:] for k in ["kinetic", "elastic", "external", "dissipated", "jumps"]
    ]
    n_c, sign = len(f["mesh/gap"]), -1.0 if f["mesh"].attrs["contact_normal"][0] == "-" else 1.0
    u = f["trajectory/u"][:]
    for i, node in enumerate(f["mesh/contact_nodes"][:]):
        assert head[6 + 3 * i : 9 + 3 * i] == [f"u_n[{node}]", f"pressure[{node}]", f"active[{node}]"]
        wanted += [sign * u[:, u.shape[1] - n_c + i]]
        wanted += [f["trajectory/pressure"][:, i], f["trajectory/active"][:, i]]
    for kind, word in [("contact", "force"), ("support", "support")]:
        if f"forces/{kind}" in f:
            axes, force = "xy"[: f["mesh/nodes"].shape[1]], f[f"forces/{kind}/force"][:]
            groups = [name.decode() for name in f[f"forces/{kind}/group"][:]]
            axes = axes[: force.shape[1] // len(groups)]
            names = [f"{word}_{axis}[{group}]" for group in groups for axis in axes]
            assert head[len(wanted) : len(wanted) + len(names)] == names
            wanted += list(force.T)
    assert np.array_equal(number, np.column_stack(wanted)[rows])
    lines = open(stem + "-switches.csv").read().splitlines()[1:]
    t = f["switches/t"][:]
    inside = np.flatnonzero((t >= first) & (t <= last))
    assert [float(line.split(",")[0]) for line in lines] == list(t[inside])
    assert [float(line.split(",")[3]) for line in lines] == list(f["switches/energy_jump"][:][inside])


def marked(path):
    assert open(path, "rb").read(200).split(b"\n")[1] == b"<!-- signorini -->", path


def collection(stem):
    folder, name = stem + "-vtu", os.path.basename(stem)
    pvd = os.path.join(folder, name + ".pvd")
    marked(pvd)
    steps = ET.parse(pvd).getroot().findall("Collection/DataSet")
    files = [s.get("file") for s in steps]
    assert files == [f"{name}-{k:06}.vtu" for k in range(len(files))]
    assert sorted(os.listdir(folder)) == sorted(files + [name + ".pvd"])
    return [(float(s.get("timestep")), os.path.join(folder, s.get("file"))) for s in steps]


def through_vtk(grid):
    point, cell = ({a.GetName(): vtk_to_numpy(a) for a in map(d.GetArray, range(d.GetNumberOfArrays()))}
                   for d in (grid.GetPointData(), grid.GetCellData()))
    ids = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    cells = ids.reshape(grid.GetNumberOfCells(), -1)
    kinds = {grid.GetCellType(k) for k in range(grid.GetNumberOfCells())}
    assert kinds <= {3, 4} if cells.shape[1] == 2 else kinds == {9}, kinds
    return vtk_to_numpy(grid.GetPoints().GetData()), cells, point, cell


def main():
    run, stem = sys.argv[1:3]
    every, first, last = int(sys.argv[3]), float(sys.argv[4]), float(sys.argv[5])
    f, rows, points, cells, states = expected(run, every, first, last)
    csv(f, rows, stem, first, last)

    files = collection(stem)
    assert len(files) == len(states) > 0
    for (t, path), state in zip(files, states):
        marked(path)
        mesh = meshio.read(path)
        assert len(mesh.cells) == 1
        cell_data = {k: v[0] for k, v in mesh.cell_data.items()}
        same(points, cells, (t, mesh.points, mesh.cells[0].data, mesh.point_data, cell_data), state)

    marked(stem + ".xdmf")
    assert h5py.File(stem + ".xdmf.h5", "r").attrs["signorini_version"] == f.attrs["signorini_version"]
    with meshio.xdmf.TimeSeriesReader(stem + ".xdmf") as reader:
        mesh_points, mesh_cells = reader.read_points_cells()
        assert reader.num_steps == len(states) and len(mesh_cells) == 1
        for k, state in enumerate(states):
            t, point_data, cell_data = reader.read_data(k)
            cell_data = {name: v[0] for name, v in cell_data.items()}
            same(points, cells, (t, mesh_points, mesh_cells[0].data, point_data, cell_data), state)

    if vtk:
        for (t, path), state in zip(files, states):
            reader = vtk.vtkXMLUnstructuredGridReader()
            reader.SetFileName(path)
            reader.Update()
            grid = reader.GetOutput()
            assert grid.GetFieldData().GetArray("TimeValue").GetValue(0) == t
            same(points, cells, (t, *through_vtk(grid)), state)
        reader = vtk.vtkXdmfReader()
        reader.SetFileName(stem + ".xdmf")
        reader.UpdateInformation()
        times = reader.GetOutputInformation(0).Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS())
        assert list(times) == [state[0] for state in states]
        for t, state in zip(times, states):
            reader.UpdateTimeStep(t)
            blocks = reader.GetOutputDataObject(0)
            grids = [blocks.GetBlock(k) for k in range(blocks.GetNumberOfBlocks())]
            # the mesh by itself, and the state
            grid = grids[-1]
            same(points, cells, (t, *through_vtk(grid)), state)
    print("fine", len(states), "states", "with VTK" if vtk else "without VTK")


main()
