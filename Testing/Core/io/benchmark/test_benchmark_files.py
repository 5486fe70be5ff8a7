"""Jobs, cases and rows survive their files; a folder is taken only where it is a benchmark's."""

import dataclasses
import json
import os

import pytest

from PolyPoseLib.data.benchmark.job import CaseSource, KnownCase, RunJob, RunSettings
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.benchmark_folder import data_stamp, opened_benchmark
from PolyPoseLib.io.benchmark.jobs import (
    job_text,
    parse_job_text,
    parse_source_text,
    read_cases,
    source_text,
    write_cases,
)
from PolyPoseLib.io.benchmark.row_files import VERSION, read_row, write_row
from PolyPoseLib.io.cohort.cohort_folder import opened_cohort

SOURCE = CaseSource("headneck", "/data/é \"q'", "subject01", "2x30")
CASE = KnownCase(SOURCE, "subject01-2x30", "subject01", "2x30", "d1", "s1")
JOB = RunJob(
    CASE,
    "x",
    "my:X",
    RunSettings(2, "cuda", 3),
    "/out",
    "d2",
    "s2",
    "w2",
    "/w.pt",
    keep_field=True,
    draw=True,
)
ROW = {
    "case": "a-2x30", "dataset": "simulated", "subject": "a", "views": "2x30", "system": "rest", "status": "done",
    "reason": "", "seconds": 1.5, "cpu_seconds": None, "peak_memory_mib": 2.0, "notes": ["n"],
    "scores": {"structures": {}}, "digest": "d", "case_digest": "c", "system_digest": "s", "weights_digest": "",
    "polypose": "0.1.0", "settings": {"threads": 1, "device": "cpu", "seed": 0},
}  # fmt: skip


def test_what_crosses_to_a_process_comes_out_the_same(tmp_path):
    assert parse_job_text(job_text(JOB)) == JOB and "\n" not in job_text(JOB)
    assert parse_source_text(source_text(SOURCE)) == SOURCE
    write_cases(tmp_path / "cases.json", "stamp", [CASE, dataclasses.replace(CASE, name="other")])
    assert read_cases(tmp_path / "cases.json", "stamp", SOURCE) == (
        CASE,
        dataclasses.replace(CASE, name="other"),
    )
    assert read_cases(tmp_path / "cases.json", "another stamp", SOURCE) is None
    assert "data" not in (tmp_path / "cases.json").read_text()  # where it lies may name a patient
    assert read_cases(tmp_path / "absent.json", "stamp", SOURCE) is None


@pytest.mark.parametrize("field", [field.name for field in dataclasses.fields(RunJob)])
def test_a_job_without_a_field_or_with_a_wrong_one_is_refused(field):
    for value in (None, 7.5, []):
        fields = json.loads(job_text(JOB)) | {field: value}
        with pytest.raises(InputError, match=field):
            parse_job_text(json.dumps(fields))


def test_a_row_survives_and_a_damaged_one_counts_as_none(tmp_path):
    path = tmp_path / "row.json"
    assert read_row(path) is None
    write_row(path, ROW)
    assert read_row(path) == {"version": VERSION, **ROW}
    assert os.listdir(tmp_path) == ["row.json"]
    whole = path.read_text()
    for text in (
        whole[: len(whole) // 2],
        "[]",
        whole.replace('"done"', '"won"'),
        whole.replace(f'"version": {VERSION}', '"version": 1', 1),
    ):
        path.write_text(text)
        assert read_row(path) is None
    for name in ("case", "system", "digest", "status", "settings", "scores", "notes", "polypose"):
        write_row(path, {key: value for key, value in ROW.items() if key != name})
        assert read_row(path) is None


@pytest.fixture
def data(tmp_path):
    (tmp_path / "data/a").mkdir(parents=True)
    (tmp_path / "data/a/ct.nii").write_text("ct")
    return tmp_path / "data"


def test_any_change_of_a_file_changes_the_stamp_of_the_data(data, tmp_path):
    stamps = [data_stamp(data), data_stamp(data)]
    assert stamps[0] == stamps[1]
    for change in (
        lambda: (data / "a/ct.nii").write_text("ct2"),
        lambda: os.utime(data / "a/ct.nii", ns=(1, 1)),
        lambda: (data / "a/ct.nii").rename(data / "a/ct2.nii"),
        lambda: (data / "new").write_text(""),
        lambda: ((data / "empty").mkdir(), (data / "link").symlink_to(data / "empty")),
        lambda: (data / "new").unlink(),
    ):
        change()
        stamps.append(data_stamp(data))
    # Of a link to an empty folder there is no file, and without "new" all is as it was before.
    assert len(set(stamps)) == 5 and stamps[-1] == stamps[-4] and stamps[-2] == stamps[-3]
    (data / "other").symlink_to(data / "a")
    (data / "a/back").symlink_to(data)
    assert data_stamp(data) not in stamps and data_stamp(data / "a/ct2.nii") != data_stamp(data)


def test_the_stamp_of_the_data_knows_nothing_of_what_lies_elsewhere(data, tmp_path):
    """A link to the root of the file system would be walked for hours."""
    stamp = data_stamp(data)
    (tmp_path / "elsewhere/inner").mkdir(parents=True)
    (tmp_path / "elsewhere/file").write_text("x")
    (data / "folder").symlink_to(tmp_path / "elsewhere")
    (data / "a/file").symlink_to(tmp_path / "elsewhere/file")
    (data / "root").symlink_to("/")
    (data / "nowhere").symlink_to(tmp_path / "absent")
    assert data_stamp(data) == stamp
    (tmp_path / "elsewhere/file").write_text("other")
    assert data_stamp(data) == stamp


def test_a_benchmark_goes_on_only_where_that_is_asked(data, tmp_path):
    for resume in (False, True):
        with opened_benchmark(tmp_path / "out", "simulated", data, resume) as folder:
            assert {"benchmark.json", "rows", "cases", "logs"} <= set(os.listdir(folder))
    with pytest.raises(InputError, match="add --resume"), opened_benchmark(folder, "simulated", data, False):
        pass
    other = "a benchmark of simulated, not of headneck"
    with pytest.raises(InputError, match=other), opened_benchmark(folder, "headneck", data, True):
        pass
    with (
        opened_benchmark(folder, "simulated", data, True),
        pytest.raises(InputError, match="another run"),
        opened_benchmark(folder, "simulated", data, True),
    ):
        pass


def test_no_other_folder_is_written_to(data, tmp_path):
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos/me.jpg").write_text("a photo")
    (tmp_path / "file").write_text("")
    with opened_cohort(tmp_path / "cohort", data):
        pass
    for place, said in (
        (tmp_path / "photos", '("me.jpg")'),
        (tmp_path / "file", "this is a file"),
        (tmp_path / "absent/out", "does not exist"),
        (tmp_path / "cohort", "no benchmark's"),
        (data, "must lie beside each other"),
        (data / "out", "must lie beside each other"),
        (tmp_path, "must lie beside each other"),
    ):
        for resume in (False, True):
            with pytest.raises(InputError) as refused, opened_benchmark(place, "simulated", data, resume):
                pass
            assert said in str(refused.value)
    assert os.listdir(tmp_path / "photos") == ["me.jpg"] and os.listdir(data) == ["a"]
