"""Row, field and pictures of a system on a case are of one and the same run."""

import pytest
from benchmark_case import MY_SYSTEMS
from benchmark_home import run

from PolyPoseLib.benchmark import run_system
from PolyPoseLib.io.benchmark.row_files import read_row

NAME = "case-1-own-2x60--m"


@pytest.fixture
def drawn(monkeypatch):
    """Pictures are one file each, which tells the run."""

    def draw_case(case, motion, folder, system):
        (folder / "picture.png").write_text(motion.notes[0])

    monkeypatch.setattr("PolyPoseLib.io.benchmark.figures.draw_case", draw_case)


def noting(home, note):
    """A system whose runs are told apart by a note."""
    (home / "my_systems.py").write_text(
        MY_SYSTEMS
        + f"""

class Notes(Mine):
    def fit(self, study, setting):
        return Motion(super().fit(study, setting).field, notes=("{note}",))
"""
    )


def kept(home):
    """Which of the files there are."""
    out = home / "out"
    places = (out / "rows" / f"{NAME}.json", out / "fields" / f"{NAME}.h5", out / "pictures" / NAME)
    return [path.exists() for path in places]


def test_a_run_removes_field_and_pictures_of_the_one_before(home, drawn):
    home, _ = home
    system = "m=my_systems:Notes"
    noting(home, "first")
    run(home, system, keep_fields=True, draw=True)
    assert kept(home) == [True] * 3
    noting(home, "second")
    run(home, system)
    assert kept(home) == [True, False, False]
    run(home, system, keep_fields=True, draw=True)
    (row,) = run(home, system, keep_fields=True, draw=True)
    assert kept(home) == [True] * 3 and row["notes"] == ["second"]
    assert (home / "out/pictures" / NAME / "picture.png").read_text() == "second"


def test_a_run_that_fails_leaves_nothing_of_the_one_before(home, drawn):
    home, _ = home
    noting(home, "first")
    run(home, "m=my_systems:Notes", keep_fields=True, draw=True)
    (row,) = run(home, "m=my_systems:Raises", keep_fields=True, draw=True)
    assert row["status"] == "failed" and kept(home) == [True, False, False]
    assert read_row(home / f"out/rows/{NAME}.json")["status"] == "failed"


def test_a_process_that_dies_while_it_writes_leaves_no_scores_of_another_run(home, drawn, monkeypatch):
    home, _ = home
    noting(home, "first")
    run(home, "m=my_systems:Notes", keep_fields=True)
    noting(home, "second")

    def die(*_):
        raise KeyboardInterrupt  # the process ends without a row

    monkeypatch.setattr(run_system, "_write_field", die)
    (row,) = run(home, "m=my_systems:Notes", keep_fields=True)
    assert row["status"] == "failed" and kept(home) == [True, False, False]


def test_what_lies_behind_a_link_to_pictures_stays(home, drawn):
    home, _ = home
    noting(home, "first")
    run(home, "m=my_systems:Notes", draw=True)
    place = home / "out/pictures" / NAME
    place.rename(home / "elsewhere")
    place.symlink_to(home / "elsewhere")
    noting(home, "second")
    run(home, "m=my_systems:Notes")
    assert not place.is_symlink() and (home / "elsewhere/picture.png").is_file()
