"""What `signorini export --format vtkhdf` writes, read by VTK as a series in time.

    python vtk_reader.py RUN.h5 RUN.vtkhdf VOLUME

Every time and every displacement is that of the run's own file, bit by bit, on the cells that VTK takes them for.
"""

import sys

import h5py
import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

# nodes of a cell: its type in VTK
VTK_CELLS = {4: 10, 10: 24, 8: 12, 20: 25, 27: 29, 6: 13, 15: 26, 18: 32}
# its corners, and the cell of them whose functions are linear
CORNERS = {4: (4, vtk.vtkTetra), 10: (4, vtk.vtkTetra), 6: (6, vtk.vtkWedge), 15: (6, vtk.vtkWedge), 18: (6, vtk.vtkWedge)}


# Gauss's points of the interval and of the square, and those of the square folded onto a triangle
LINE = [((1 + x) / 2, w / 2) for x, w in zip(*np.polynomial.legendre.leggauss(5))]
TRIANGLE = [(a, (1 - a) * b, (1 - a) * v * w) for a, v in LINE for b, w in LINE]
POINTS = {
    "hexahedron": [(a, b, c, u * v * w) for a, u in LINE for b, v in LINE for c, w in LINE],
    "wedge": [(a, b, c, v * w) for a, b, v in TRIANGLE for c, w in LINE],
    "tetrahedron": [(a, b, (1 - a - b) * c, (1 - a - b) * v * w) for a, b, v in TRIANGLE for c, w in LINE],
}


def volume_of(cell):
    """The integral of the determinant of VTK's own derivatives (its filter of sizes cuts a cell into tetrahedra, whose volumes are others)."""
    n = cell.GetNumberOfPoints()
    x = np.array([cell.GetPoints().GetPoint(k) for k in range(n)])
    form = "tetrahedron" if n in (4, 10) else "wedge" if n in (6, 15, 18) else "hexahedron"
    total = 0.0
    for *place, weight in POINTS[form]:
        derivatives = [0.0] * (3 * n)
        cell.InterpolateDerivs(place, derivatives)
        total += weight * abs(np.linalg.det(np.reshape(derivatives, (3, n)) @ x))
    return total


def main(run, exported, volume):
    f = h5py.File(run, "r")
    t, u, dof = f["trajectory/t"][:], f["trajectory/u"][:], f["mesh/dof_map"][:]
    nodes, cells = f["mesh/nodes"][:], f["mesh/elements"][:]
    pressure, contact = f["trajectory/pressure"][:], f["mesh/contact_nodes"][:]
    reader = vtk.vtkHDFReader()
    reader.SetFileName(exported)
    reader.UpdateInformation()
    information = reader.GetExecutive().GetOutputInformation(0)
    times = information.Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    assert np.array_equal(times, t), "times"
    for k, time in enumerate(times):
        reader.UpdateTimeStep(time)
        grid = reader.GetOutput()
        point = grid.GetPointData()
        places = vtk_to_numpy(grid.GetPoints().GetData())
        assert np.array_equal(places, nodes), "points"
        kinds = {grid.GetCellType(c) for c in range(grid.GetNumberOfCells())}
        assert grid.GetNumberOfCells() == len(cells) and kinds == {VTK_CELLS[cells.shape[1]]}, kinds
        padded = np.append(u[k], 0.0)  # -1 picks the last entry
        assert np.array_equal(vtk_to_numpy(point.GetArray("displacement")), padded[dof]), "displacement"
        expected = np.zeros(len(nodes))
        expected[contact] = pressure[k]
        assert np.array_equal(vtk_to_numpy(point.GetArray("contact_pressure")), expected), "pressure"
        stress = vtk_to_numpy(grid.GetCellData().GetArray("stress"))
        assert stress.shape == (len(cells), 9) and np.array_equal(stress, stress[:, [0, 3, 6, 1, 4, 7, 2, 5, 8]])
    # edges and faces in the order of VTK: cells of the second order have the volume of the body, and their nodes where their functions are one
    found = sum(volume_of(grid.GetCell(c)) for c in range(grid.GetNumberOfCells()))
    assert abs(found / volume - 1) < 1e-9, found
    grid = reader.GetOutput()
    for c in range(grid.GetNumberOfCells()):
        cell = grid.GetCell(c)
        local, weights, place = cell.GetParametricCoords(), [0.0] * cell.GetNumberOfPoints(), [0.0] * 3
        corners, linear = CORNERS.get(cell.GetNumberOfPoints(), (8, vtk.vtkHexahedron))
        linear = linear()
        x = np.array([cell.GetPoints().GetPoint(k) for k in range(cell.GetNumberOfPoints())])
        for k in range(len(x)):
            functions = [0.0] * corners
            linear.InterpolateFunctions([local[3 * k + j] for j in range(3)], functions)
            assert np.allclose(np.array(functions) @ x[:corners], x[k], atol=1e-12), (c, k)
    print(f"{len(times)} states of {len(cells)} cells of {cells.shape[1]} nodes")


main(sys.argv[1], sys.argv[2], float(sys.argv[3]))
