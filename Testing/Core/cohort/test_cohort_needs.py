"""The memory that is set aside for a study is what its registration would ask for, told from headers alone."""

import json

import numpy as np
import pytest
from small_study import write_small_study
from xray_samples import dataset, save

from PolyPoseLib.cohort.needs import MARGIN, REPORT_MIB, UNKNOWN_MIB, memory_needs, need_mib
from PolyPoseLib.data.cohort.entries import CohortEntry
from PolyPoseLib.data.cohort.settings import StudySettings
from PolyPoseLib.data.cohort.sizes import StudySizes
from PolyPoseLib.data.options import Options
from PolyPoseLib.data.study import Study
from PolyPoseLib.io.cohort.study_sizes import sizes_of
from PolyPoseLib.registration.memory import needed_memory


def test_it_is_what_the_loaded_study_would_need(tmp_path):
    path = write_small_study(tmp_path / "a")
    study = Study.load(path)
    loaded = needed_memory(study, Options.from_dict({"threads": 1}), compiles=True).resident / (1 << 20)
    told = need_mib(sizes_of(path, False), {"threads": 1})
    # The picture is a NIfTI, of which a byte counts as a pixel: a difference of kilobytes.
    assert told == pytest.approx(MARGIN * loaded + REPORT_MIB, abs=1.5)


def test_sizes_are_those_of_the_headers(tmp_path):
    path = write_small_study(tmp_path / "a")
    sizes = sizes_of(path, False)
    assert (sizes.shape, sizes.spacing, sizes.structures) == ((10, 11, 12), (1.0, 1.0, 1.0), 2)
    folder = path.parent / "ct"
    folder.mkdir()
    for number in range(7):
        ds = dataset(np.zeros((16, 18), np.int16), "CT", bits=16, known=False)
        ds.PixelSpacing, ds.SliceThickness = [0.7, 0.8], 2.5
        save(ds, folder / f"{number}.dcm")
    save(dataset(np.zeros((30, 40), np.uint16), "XA", bits=16), path.parent / "ap.dcm")
    fields = json.loads(path.read_text())
    fields["ct"], fields["xrays"][0]["image"] = "ct", "ap.dcm"
    path.write_text(json.dumps(fields))
    sizes = sizes_of(path, False)
    assert (sizes.shape, sizes.spacing, sizes.pixels) == ((7, 16, 18), (0.8, 0.7, 2.5), (1200,))


def test_a_large_ct_of_many_bones_needs_gigabytes():
    small = StudySizes((112, 101, 122), (3.0, 3.0, 3.0), 4, (160_000,) * 2)
    large = StudySizes((400, 512, 512), (0.8, 0.8, 1.0), 26, (1_000_000,) * 2)
    assert 1200 < need_mib(small, {}) < 1800 and 3700 < need_mib(large, {}) < 8192


@pytest.mark.parametrize("damage", ["absent", "no json", "cut", "huge", "option"])
def test_a_study_that_is_wrong_has_a_usual_need_and_ends_nothing(tmp_path, damage):
    path = write_small_study(tmp_path / "a")
    ct = path.parent / "ct.nii.gz"
    if damage == "absent":
        ct.unlink()
    elif damage == "no json":
        path.write_text("{")
    elif damage == "cut":
        ct.write_bytes(ct.read_bytes()[:20])
    elif damage == "huge":
        import gzip

        raw = bytearray(gzip.decompress(ct.read_bytes()))
        raw[42:48] = np.full(3, 32767, "<i2").tobytes()
        ct.write_bytes(gzip.compress(bytes(raw)))
    else:
        path.write_text(path.read_text().replace('"version": 1', '"version": 1, "options": {"threads": -1}'))
    entry = CohortEntry("a", path, None)
    assert memory_needs([entry], StudySettings()) == [UNKNOWN_MIB]
