"""Which kind of file is carried, and how: chosen by its name's ending, and by its content for DICOM."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from PolyPoseLib.carrying.lines import carry_with_lines
from PolyPoseLib.carrying.pieces import carry_with_pieces
from PolyPoseLib.data.carried import Frame
from PolyPoseLib.data.result import Result
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.carried.images import IMAGE_ENDINGS, carry_image
from PolyPoseLib.io.carried.meshes import MESH_ENDINGS, read_vertices, write_vertices
from PolyPoseLib.io.carried.points import POINT_ENDINGS, read_points
from PolyPoseLib.io.carried.table import write_table
from PolyPoseLib.io.carried.words import NOT_TRUSTED, summary
from PolyPoseLib.io.dicom import looks_like_dicom

ALL_ENDINGS = (*POINT_ENDINGS, *MESH_ENDINGS, *IMAGE_ENDINGS, ".dcm")


def longest_ending(path: Path, endings: Iterable[str]) -> str:
    """The longest of the endings that a file's name has, in whatever case, or ""."""
    name = path.name.lower()
    return max((each for each in endings if name.endswith(each)), key=len, default="")


def ending_of(path: Path) -> str:
    """The ending that tells a file's kind, "" for none; raises InputError for one that is not known."""
    ending = longest_ending(path, (*ALL_ENDINGS, ".ima"))
    if ending:
        return ".dcm" if ending == ".ima" else ending
    if path.is_file() and looks_like_dicom(path):
        return ".dcm"
    raise InputError(
        f"{path}: this kind of file is not carried: give landmarks (.csv, .mrk.json, .fcsv), a plan of screws (.json), "
        f"a mesh ({', '.join(MESH_ENDINGS)}), an image or label map (.nii.gz, .nrrd, .mha), or an RT Dose or RT "
        "Structure Set (.dcm)."
    )


def require_endings(source: Path, target: Path) -> None:
    """Refuse a target whose name asks for another kind of file than the source is; points may become a table."""
    kind, wanted = ending_of(source), target.name.lower()
    if kind == ".json" and wanted.endswith(".mrk.json"):
        raise InputError(f"{target}: a plan of screws is written as .json or .csv, not as .mrk.json.")
    if wanted.endswith(kind) or (kind in POINT_ENDINGS and wanted.endswith(".csv")):
        return
    if kind == ".dcm" and not Path(wanted).suffix:
        return
    if kind in IMAGE_ENDINGS and any(wanted.endswith(each) for each in IMAGE_ENDINGS):
        return
    also = " or .csv" if kind in POINT_ENDINGS and kind != ".csv" else ""
    raise InputError(f"{target}: what {source.name} becomes is written as {kind}{also}: let the name end so.")


def carry_file(result: Result, source: Path, target: Path, to: Frame, labels: bool | None = None) -> str:
    """Carry a file.

    Parameters
    ----------
    result : Result
        Of the registration.
    source, target : Path
        What is read, and where to write.
    to : {"xray", "ct"}
        The frame to which it is carried.
    labels : bool, optional
        Whether an image is a label map; None to tell by its values.

    Returns
    -------
    str
        What to say of it.

    Raises
    ------
    InputError
        A kind of file that is not known, a damaged file, or a result of an earlier version.

    """
    if not source.is_file():
        raise InputError(f"{source}: there is no such file; check the name and the folder.")
    kind = ending_of(source)
    require_endings(source, target)
    if kind == ".dcm":
        from PolyPoseLib.io.carried.dicom_rt import carry_dicom

        return carry_dicom(result, source, target, to)
    if kind in IMAGE_ENDINGS:
        return carry_image(result, source, target, to, labels)
    if kind in MESH_ENDINGS:
        return _carry_mesh(result, source, target, to)
    return _carry_points(result, source, target, to, kind)


def _carry_mesh(result: Result, source: Path, target: Path, to: Frame) -> str:
    carrier = result.point_carrier()
    vertices, edges, signs = read_vertices(source)
    carried, pieces = carry_with_pieces(carrier, vertices, edges, to)
    write_vertices(target, source, signs, carried, tuple(result.structures))
    said = summary(carried, "vertices")
    for name, count in pieces.items():
        what = "1 connected piece" if count == 1 else f"{count} connected pieces"
        said += f"; {what} moved as a whole by {name}, on which most vertices lie"
    return said


def _carry_points(result: Result, source: Path, target: Path, to: Frame, kind: str) -> str:
    """Landmarks and screws; every kind may be written as a table instead of its own."""
    carrier, warning = result.point_carrier(), NOT_TRUSTED if result.distrust else ""
    held = read_points(source, kind)
    carried = carry_with_lines(carrier, held.points, held.lines, to)
    if target.name.lower().endswith(".csv"):
        write_table(target, held.labels, carried)
    else:
        held.write(target, carried, warning)
    return summary(carried)
