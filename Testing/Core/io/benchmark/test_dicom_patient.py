"""A patient's DICOM folder: which of its CT series are taken, and in which order."""

import pytest
from dicom_stack import header
from pydicom.uid import CTImageStorage, generate_uid

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.dicom_patient import dicom_scans


def _write_series(folder, series, study, tags):
    """Ten slices of a CT in a new folder, with further tags by keyword."""
    folder.mkdir(parents=True)
    for number in range(10):
        file = header(series, CTImageStorage, 2, 2)
        file.StudyInstanceUID, file.InstanceNumber = study, number
        for keyword, value in tags.items():
            setattr(file, keyword, value)
        file.PixelData = bytes(8)
        file.save_as(folder / f"{number}.dcm", enforce_file_format=True)


def _one_study(folder, series):
    """A study of CT series (name, UID, number, pixel mm) with ten headers each."""
    study = generate_uid()
    for name, uid, number, pixel in series:
        tags = {"StudyDate": "20091022", "SeriesNumber": number, "PixelSpacing": [pixel, pixel]}
        _write_series(folder / name, uid, study, tags)
    return dicom_scans(folder, folder)


@pytest.mark.parametrize(
    "series",
    [
        [("wide", "1.2.3.9", 2, 1.5), ("narrow", "1.2.3.10", 3, 0.9)],
        [("later", "1.2.3.9", 10, 0.9), ("first", "1.2.3.10", 2, 0.9)],
        [("b", "1.2.3.10", 2, 0.9), ("a", "1.2.3.9", 2, 0.9)],
    ],
)
def test_of_several_whole_series_one_is_chosen_by_what_they_are_and_a_warning_says_which(series, tmp_path):
    """The UIDs' order as text chose silently: 1.2.3.9 came after 1.2.3.10, and the wider field of view was taken."""
    for order in (series, series[::-1]):
        folder = tmp_path / order[0][0]
        (found,) = _one_study(folder, order)
        assert found.folder.name == series[1][0]
        (told,) = found.warnings
        assert (
            f"series {series[1][2]} was taken, one of 2 whole CT series" in told and str(found.folder) in told
        )


def test_a_single_series_is_chosen_without_a_word(tmp_path):
    (found,) = _one_study(tmp_path, [("only", "1.2.3", 2, 1.0)])
    assert found.warnings == ()


WHEN = {
    "earlier day": (("20091022", "120000"), ("20100301", "080000"), ("20100302", "")),
    "earlier hour": (("20091022", "080000"), ("20091022", "120000"), ("20091023", "070000")),
}
UNKNOWN = {
    "times alone": (("", "080000"), ("", "120000")),
    "one date alone": (("", "080000"), ("20091022", "120000")),
    "nothing": (("", ""), ("", "")),
    "one day, one time": (("20091022", ""), ("20091022", "120000")),
    "the same": (("20091022", "120000"), ("20091022", "120000")),
}


def _scans_of(folder, whens, level="Study"):
    """Ten headers of a CT each, in folders a, b, ..., with dates and times."""
    for name, (date, time) in zip("abc", whens, strict=False):
        tags = dict.fromkeys(("StudyDate", "StudyTime", "SeriesDate", "SeriesTime"), "")
        tags |= {f"{level}Date": date, f"{level}Time": time}
        _write_series(folder / name, generate_uid(), generate_uid(), tags)
    return dicom_scans(folder, folder)


@pytest.mark.parametrize("level", ["Study", "Series"])
@pytest.mark.parametrize("name", WHEN)
def test_dates_and_on_one_day_times_tell_the_order(name, level, tmp_path):
    for turned in (False, True):
        whens = WHEN[name][::-1] if turned else WHEN[name]
        found = _scans_of(tmp_path / str(turned), whens, level)
        names = [scan.folder.name for scan in found]
        assert names == sorted("abc", reverse=turned)


@pytest.mark.parametrize("name", UNKNOWN)
def test_times_without_dates_tell_no_order(name, tmp_path):
    """The second CT may have been taken at an earlier hour of a later day."""
    with pytest.raises(InputError, match="no dates tell which of its 2 CTs is the earliest"):
        _scans_of(tmp_path, UNKNOWN[name])
