"""Surface meshes (STL, PLY, OBJ, VTK, VTP) whose vertices are carried; everything else of them stays.

VTK reads and writes them, in a process of its own: a damaged mesh can end it. Vertices cross to this one as an array.
"""

from __future__ import annotations

import tempfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from PolyPoseLib.data.carried import CarriedPoints
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.carried.table import FARTHEST_MM
from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.guarded import Limits, run_child

MESH_ENDINGS = (".stl", ".ply", ".obj", ".vtk", ".vtp")

MAX_BYTES = 1 << 30
"""Larger files are refused unread."""

_LIMITS = Limits(cpu_seconds=120, wall_seconds=600, memory_bytes=16 << 30)

_READ = """
def polydata(path):
    ending = path.lower().rsplit(".", 1)[1]
    if ending == "vtp":
        from vtkmodules.vtkIOXML import vtkXMLPolyDataReader as Reader
    elif ending == "vtk":
        from vtkmodules.vtkIOLegacy import vtkPolyDataReader as Reader
    elif ending == "ply":
        from vtkmodules.vtkIOPLY import vtkPLYReader as Reader
    elif ending == "stl":
        from vtkmodules.vtkIOGeometry import vtkSTLReader as Reader
    else:
        from vtkmodules.vtkIOGeometry import vtkOBJReader as Reader
    reader = Reader()
    reader.SetFileName(path)
    failed = []
    reader.AddObserver("ErrorEvent", lambda *_: failed.append(1))
    reader.Update()
    mesh = reader.GetOutput()
    if failed or mesh is None or mesh.GetNumberOfPoints() == 0:
        refuse("no vertex can be read from it")
    return mesh
def space(path, mesh):
    stated = mesh.GetFieldData().GetAbstractArray("SPACE")
    text = str(stated.GetValue(0)) if stated is not None and stated.GetNumberOfValues() else ""
    if not text:
        with open(path, "rb") as stream:
            text = stream.read(4096).decode("latin-1")
        text = text[text.find("SPACE=") + 6 :] if "SPACE=" in text else "LPS"
    return text[:3]
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy, numpy_to_vtk
"""

_READ_POINTS = (
    _READ
    + """
path, target = sys.argv[1:]
mesh = polydata(path)
edges = []
for cells in (mesh.GetLines(), mesh.GetPolys(), mesh.GetStrips()):
    if cells is None or cells.GetNumberOfCells() == 0:
        continue
    corners = vtk_to_numpy(cells.GetConnectivityArray()).astype(np.int64)
    begins = np.zeros(len(corners) + 1, bool)
    begins[vtk_to_numpy(cells.GetOffsetsArray())] = True
    edges.append(np.stack([corners[:-1], corners[1:]], axis=1)[~begins[1:-1]])
edges = np.concatenate(edges) if edges else np.zeros((0, 2), np.int64)
points = vtk_to_numpy(mesh.GetPoints().GetData()).astype(np.float64)
if len(edges) and not (edges.min() >= 0 and edges.max() < len(points)):
    refuse("a cell names a vertex that there is not")
np.savez(target, points=points, edges=edges, space=space(path, mesh))
"""
)

_READ_TRIANGLES = (
    _READ
    + """
path, target = sys.argv[1:]
mesh = polydata(path)
stated = space(path, mesh)
from vtkmodules.vtkFiltersCore import vtkTriangleFilter
split = vtkTriangleFilter()
split.PassLinesOff()
split.PassVertsOff()
split.SetInputData(mesh)
split.Update()
mesh = split.GetOutput()
if mesh.GetNumberOfPolys() == 0:
    refuse("it has no faces")
corners = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).astype(np.int64).reshape(-1, 3)
points = vtk_to_numpy(mesh.GetPoints().GetData()).astype(np.float64)
np.savez(target, points=points, corners=corners, space=stated)
"""
)

_WRITE_POINTS = (
    _READ
    + """
path, values, target = sys.argv[1:]
from vtkmodules.vtkCommonCore import vtkPoints
mesh = polydata(path)
stated = "SPACE=" + space(path, mesh)
given = np.load(values, allow_pickle=False)
points = vtkPoints()
points.SetDataTypeToFloat() if target.endswith((".stl", ".ply")) else points.SetDataTypeToDouble()
points.SetData(numpy_to_vtk(given["points"], deep=True, array_type=points.GetDataType()))
mesh.SetPoints(points)
mesh.GetPointData().SetNormals(None)
mesh.GetCellData().SetNormals(None)
ending = target.lower().rsplit(".", 1)[1]
if ending in ("vtk", "vtp"):
    for name in ("moved_by", "uncertainty_mm"):
        array = numpy_to_vtk(given[name], deep=True)
        array.SetName(name)
        mesh.GetPointData().AddArray(array)
if ending == "vtp":
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter as Writer
elif ending == "vtk":
    from vtkmodules.vtkIOLegacy import vtkPolyDataWriter as Writer
elif ending == "ply":
    from vtkmodules.vtkIOPLY import vtkPLYWriter as Writer
elif ending == "stl":
    from vtkmodules.vtkIOGeometry import vtkSTLWriter as Writer
else:
    from vtkmodules.vtkIOGeometry import vtkOBJWriter as Writer
writer = Writer()
writer.SetFileName(target)
writer.SetInputData(mesh)
if ending == "vtk":
    writer.SetHeader("PolyPose " + stated)
    writer.SetFileVersion(42)
    writer.SetFileTypeToBinary()
elif ending == "stl":
    writer.SetHeader("PolyPose " + stated)
    writer.SetFileTypeToBinary()
elif ending == "ply":
    writer.AddComment(stated)
    if mesh.GetPointData().HasArray("RGB"):
        writer.SetArrayName("RGB")
elif ending == "vtp" and mesh.GetFieldData().GetAbstractArray("SPACE") is None:
    from vtkmodules.vtkCommonCore import vtkStringArray
    array = vtkStringArray()
    array.SetName("SPACE")
    array.InsertNextValue(stated[6:])
    mesh.GetFieldData().AddArray(array)
if not writer.Write():
    refuse("it cannot be written")
if ending == "obj":
    with open(target, "rb") as stream:
        text = stream.read()
    with open(target, "wb") as stream:
        stream.write(b"# " + stated.encode() + b"\\n" + text)
"""
)


def read_vertices(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (N, 3) of a mesh in LPS mm, its edges (M, 2), and the signs (3,) by which they become the file's.

    Slicer's remark SPACE=RAS is heeded; files that do not say are in LPS.

    Raises
    ------
    InputError
        VTK is missing, the file is damaged or too large, or its vertices are no places in mm.

    """
    parts = _read_parts(path, _READ_POINTS)
    return parts["points"], parts["edges"], parts["signs"]


def read_surface(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (N, 3) of a mesh in LPS mm and its triangles (T, 3); raises InputError as ``read_vertices``."""
    parts = _read_parts(path, _READ_TRIANGLES)
    return parts["points"], parts["corners"]


def _read_parts(path: Path, program: str) -> dict[str, np.ndarray]:
    """The arrays that a child reads from a mesh: vertices in LPS mm, "signs" and others."""
    require_vtk()
    refuse_special_file(path)
    if path.stat().st_size > MAX_BYTES:
        raise InputError(f"{path}: a mesh of {path.stat().st_size >> 20} MiB is too large: decimate it.")
    with tempfile.TemporaryDirectory(prefix="polypose-") as folder:
        kept = Path(folder) / "parts.npz"
        _run(program, [path.resolve(), kept], folder, path)
        with np.load(kept, allow_pickle=False) as arrays:
            parts = dict(arrays)
    signs = np.array([-1.0, -1.0, 1.0]) if str(parts["space"]) == "RAS" else np.ones(3)
    if not (np.abs(parts["points"]) <= FARTHEST_MM).all():
        raise InputError(f"{path}: some of its vertices are no places in mm: export the mesh again.")
    return {**parts, "points": parts["points"] * signs, "signs": signs}


def write_vertices(
    path: Path, source: Path, signs: np.ndarray, carried: CarriedPoints, names: tuple[str, ...]
) -> None:
    """Write the mesh of ``source`` with carried vertices; VTK and VTP files also get two arrays of the vertices.

    "moved_by" is 0 for the displacement field and n for the nth of the structures' names, "uncertainty_mm" the longest
    half axis of the 95 % ellipsoid.
    """
    number = {name: n for n, name in enumerate(names, start=1)}
    with tempfile.TemporaryDirectory(prefix="polypose-") as folder:
        values = Path(folder) / "values.npz"
        np.savez(
            values,
            points=carried.points * signs,
            moved_by=np.array([number.get(name, 0) for name in carried.moved_by], np.int16),
            uncertainty_mm=carried.semi_axes_mm[:, 2].astype(np.float32),
        )
        _run(_WRITE_POINTS, [source.resolve(), values, path.absolute()], folder, source)


def _run(program: str, arguments: list[Path], folder: str, path: Path) -> None:
    """Run a child; raises InputError that says why it failed."""
    done = run_child(program, arguments, _LIMITS, folder)
    if done is None:
        raise InputError(f"{path}: the mesh is damaged: reading it takes too long.")
    if done.returncode != 0:
        reason = (
            " ".join(done.stdout.decode("utf-8", "replace").split())[:200] if done.returncode == 2 else ""
        )
        raise InputError(
            f"{path}: the mesh is damaged ({reason or 'VTK does not survive it'}): export it again."
        )


def require_vtk() -> None:
    """Raise InputError where VTK is missing."""
    if find_spec("vtkmodules") is None:
        raise InputError("Meshes need the package vtk: pip install 'polypose[mesh]'.")
