"""What an export needs besides the result: the CT's series and the names of labels, from a study's file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from PolyPoseLib.data.label_names import label_table
from PolyPoseLib.data.result import Result
from PolyPoseLib.data.segmentation import Segmentation
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import paths as study_paths
from PolyPoseLib.io import study_schema
from PolyPoseLib.io.dicom_export.source import SourceSeries, on_slices, placeholder_source, read_source
from PolyPoseLib.io.same_study import require_same_study
from PolyPoseLib.io.segmentations import read_segmentation
from PolyPoseLib.io.volumes import is_dicom_place, read_ct


@dataclass(frozen=True)
class CtChoice:
    """Which CT is taken.

    Attributes
    ----------
    folder
        Its DICOM slices, instead of those that the study names.
    series
        Instance UID or number of the series where the folder holds several; the study's "ct_series" otherwise.
    new_patient
        Patient ID for a CT that is not DICOM, which is then written as DICOM, too.
    allow_outside
        Whether the study may name files outside its folder.

    """

    folder: Path | None = None
    series: str | int | None = None
    new_patient: str | None = None
    allow_outside: bool = False


@dataclass(frozen=True)
class ExportInputs:
    """What an export needs besides the result's motions.

    Attributes
    ----------
    source
        The CT's series.
    warped_ct, warped_labels
        The result's, with axes as the CT's slices have them.
    names
        Of the warped labels, by number.
    bones
        Those labels that structures have.
    ct
        The CT itself where it never was DICOM and has to be written, too.

    """

    source: SourceSeries
    warped_ct: Volume
    warped_labels: Volume
    names: Mapping[int, str] = field(default_factory=dict)
    bones: frozenset[int] = frozenset()
    ct: Volume | None = None


def read_inputs(path: Path, result: Result, choice: CtChoice) -> ExportInputs:
    """Read the CT's headers and the labels' names.

    Parameters
    ----------
    path
        The study's file.
    result
        Of the same study.
    choice
        Which CT is taken.

    Raises
    ------
    InputError
        The study's file is wrong, its CT is not DICOM and nothing stands in for it, or study and result do not belong
        together.

    """
    fields = study_schema.read(path)
    require_same_study(path, fields, result)
    folder = path.parent.resolve()
    try:
        labels_path = study_paths.resolve(
            fields["segmentation"], "segmentation", folder, choice.allow_outside
        )
        ct_path = choice.folder or study_paths.resolve(fields["ct"], "ct", folder, choice.allow_outside)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    source, ct = _source(path, ct_path, choice, fields.get("ct_series"))
    warped = (
        on_slices(source, result.warped_ct, str(ct_path)),
        on_slices(source, _labels(result), str(ct_path)),
    )
    segmentation = read_segmentation(labels_path, source.grid)
    if segmentation.has_layers:
        names = dict(enumerate(result.structures, start=1))
        return ExportInputs(source, *warped, names, frozenset(names), ct)
    names, bones = label_names(segmentation, fields["structures"], fields.get("label_table"))
    return ExportInputs(source, *warped, names, bones, ct)


def _labels(result: Result) -> Volume:
    """The warped labels, known to be whole numbers."""
    return Segmentation.from_labels(result.warped_labels, "warped_labels.nii.gz").layers[0]


def _source(
    path: Path, ct_path: Path, choice: CtChoice, series: str | int | None
) -> tuple[SourceSeries, Volume | None]:
    """The CT's series, and the CT where that is not DICOM."""
    is_dicom = is_dicom_place(ct_path)
    if choice.folder is not None and not is_dicom:
        raise InputError(f"{ct_path}: this is no folder of DICOM slices: give one by --ct.")
    if is_dicom and choice.new_patient is not None:
        raise InputError(f"{ct_path}: this CT is DICOM and names its patient: leave out --new-patient.")
    if is_dicom:
        wanted = choice.series if choice.series is not None or choice.folder is not None else series
        return read_source(ct_path, wanted), None
    if choice.new_patient is None:
        raise InputError(
            f'{path}: "ct" is not DICOM, so that the patient is not known: give the DICOM folder of the same CT by '
            "--ct, or an ID for a new patient by --new-patient, which writes this CT as DICOM, too."
        )
    ct = read_ct(ct_path)
    source = placeholder_source(choice.new_patient, ct)
    return source, on_slices(source, ct, str(ct_path))


def label_names(
    segmentation: Segmentation, groups: Mapping[str, list[int | str]], table: str | None
) -> tuple[dict[int, str], frozenset[int]]:
    """Names of a label map's numbers, and which of them belong to structures.

    Parameters
    ----------
    segmentation
        Of one layer.
    groups
        {structure: labels}, as a study has them.
    table
        A label table whose names may be used besides those of segments.

    """
    by_table = label_table(table) if table else {}
    numbers = {name: number for number, name in by_table.items()}
    for segment in segmentation.segments:
        numbers.update({segment.identifier: segment.label, segment.name: segment.label})
    given = {segment.label: segment.name for segment in segmentation.segments}
    names: dict[int, str] = {}
    for structure, labels in groups.items():
        for label in labels:
            known = (
                by_table.get(label, label) if isinstance(label, int) and not segmentation.numbered else label
            )
            number = numbers.get(known) if isinstance(known, str) else known
            if number is not None:
                names[number] = structure if len(labels) == 1 else f"{structure} {label}"
    bones = frozenset(names)
    if segmentation.numbered:
        names = {**names, **by_table}
    return {**names, **given}, bones
