"""The ablations' tables, on rows made by hand: mean(SD) over seeds, and one table for each CT and study."""

import math
import random
import statistics
import sys

import ablations
import pytest
from ablation_cases import Settings, points, settings_of
from ablation_tables import plot, write_tables

SUMMARY = (
    "mean_tre_mm",
    "worst_tre_mm",
    "mean_pose_tre_mm",
    "mean_dice",
    "organ_dice",
    "soft_error_mean_mm",
    "folds_percent",
    "sd_log_jacobian",
)

NUMBERS = {
    "mean TRE mm": ("mean_tre_mm", 2),
    "worst TRE mm": ("worst_tre_mm", 2),
    "pose TRE mm": ("mean_pose_tre_mm", 2),
    "bone Dice": ("mean_dice", 3),
    "HD95 mm": ("hd95_mm", 2),
    "organ Dice": ("organ_dice", 3),
    "soft mm": ("soft_error_mean_mm", 2),
    "folds %": ("folds_percent", 4),
    "SD log J": ("sd_log_jacobian", 3),
    "camera mm": ("projection_mean_mm", 2),
    "camera deg": ("rotation_deg", 2),
    "CPU s": ("cpu_seconds", 0),
    "MiB": ("peak_memory_mib", 0),
}
"""Column: the number in a row that it is of, and its decimals."""


def made(settings, rng):
    """A row with a number of its own in every place that a column shows."""
    numbers = {name: rng.uniform(0.1, 40) for name, _ in NUMBERS.values()}
    bone = {"hd95_mm": numbers["hd95_mm"], "rest_tre_mean_mm": 5.0}
    anchor = {"hd95_mm": 1e3, "rest_tre_mean_mm": 0.0}
    row = {
        "settings": settings.key(),
        "exit_status": 0,
        "structures": {"pelvis": anchor, "femur_left": bone},
        "summary": {name: numbers[name] for name in SUMMARY},
        "cameras": [{name: numbers[name] for name in ("projection_mean_mm", "rotation_deg")}],
        "kept_percent": 100.0,
        **{name: numbers[name] for name in ("cpu_seconds", "peak_memory_mib")},
    }
    return row, numbers


def tables(path):
    """{heading: [{column: cell} of each line]}."""
    found, heading, head = {}, "", []
    for line in path.read_text().splitlines():
        if line.startswith("## "):
            heading = line[3:]
        elif line.startswith("| ---"):
            found[heading] = []
        elif line.startswith("| "):
            cells = line[2:-2].split(" | ")
            if heading in found:
                found[heading].append(dict(zip(head, cells, strict=True)))
            else:
                head = cells
    return found


def angles(anatomy, seeds, rng):
    """Rows of the study of angles, and {(angle, seed): its numbers}."""
    rows, numbers = [], {}
    for point in points("angle", anatomy, ["default"]):
        for seed in seeds:
            row, numbers[point.label, seed] = made(settings_of(point, Settings(anatomy, seed, 400)), rng)
            rows.append(row)
    rng.shuffle(rows)
    return rows, numbers


@pytest.mark.parametrize("seeds", [(0,), (0, 1), (3, 4, 7, 9, 11)])
def test_every_cell_is_the_mean_and_sd_over_seeds(tmp_path, seeds):
    rng = random.Random(len(seeds))
    wanted = {anatomy: angles(anatomy, seeds, rng) for anatomy in ("pelvis", "chest")}
    write_tables([row for rows, _ in wanted.values() for row in rows], "default", tmp_path / "t.md")
    found = tables(tmp_path / "t.md")
    for anatomy, (_, numbers) in wanted.items():
        lines = found[f"Angle between two views, degrees ({anatomy}, 400 x 400 pixels)"]
        assert len(lines) == 9
        for line in lines:
            assert line["seeds"] == str(len(seeds))
            for column, (name, decimals) in NUMBERS.items():
                values = [numbers[line["angle"], seed][name] for seed in seeds]
                mean = f"{statistics.mean(values):.{decimals}f}"
                if len(seeds) > 1:
                    mean += f"({statistics.stdev(values):.{decimals}f})"
                assert line[column] == mean, column


def test_seeds_that_failed_or_have_no_number_are_not_in_the_sd(tmp_path):
    rows, numbers = angles("pelvis", (0, 1, 2), random.Random(0))

    def row_of(arc, seed):
        wanted = {"seed": seed, "arc_deg": arc, "views": 2}
        return next(row for row in rows if wanted.items() <= row["settings"].items())

    failed = row_of(10.0, 1)
    kept = failed["settings"]
    failed.clear()
    failed |= {"settings": kept, "exit_status": 1, "failed": "out of memory", "kept_percent": 100.0}
    row_of(20.0, 0)["summary"]["organ_dice"] = math.nan
    row_of(20.0, 2)["summary"]["organ_dice"] = math.nan
    for arc in (0, 1, 2):
        row_of(45.0, arc)["summary"]["organ_dice"] = math.nan
    write_tables(rows, "default", tmp_path / "t.md")
    (lines,) = tables(tmp_path / "t.md").values()
    lines = {line["angle"]: line for line in lines}
    two = [numbers["10°", seed]["mean_tre_mm"] for seed in (0, 2)]
    assert lines["10°"]["seeds"] == "2 (1 failed)"
    assert lines["10°"]["mean TRE mm"] == f"{statistics.mean(two):.2f}({statistics.stdev(two):.2f})"
    assert lines["20°"]["organ Dice"] == f"{numbers['20°', 1]['organ_dice']:.3f}"
    assert lines["45°"]["organ Dice"] == "-"


def test_a_line_has_no_seeds_that_no_other_line_of_its_study_has(tmp_path):
    """The usual case is run once for all studies: its mean would be over other motions than those beside it."""
    rng = random.Random(3)
    rows, numbers = angles("pelvis", (0, 1), rng)
    for seed in (2, 3):
        usual, _ = made(Settings("pelvis", seed, 400), rng)
        rows.append(usual)
    write_tables(rows, "default", tmp_path / "t.md")
    (lines,) = tables(tmp_path / "t.md").values()
    (line,) = (line for line in lines if line["angle"] == "30°")
    two = [numbers["30°", seed]["mean_tre_mm"] for seed in (0, 1)]
    assert line["seeds"] == "2"
    assert line["mean TRE mm"] == f"{statistics.mean(two):.2f}({statistics.stdev(two):.2f})"
    alone = [row for row in rows if row["settings"]["seed"] == 2]
    write_tables(alone, "default", tmp_path / "alone.md")
    assert not tables(tmp_path / "alone.md")


def test_both_cts_are_run_unless_one_is_named(monkeypatch):
    def anatomies(*words):
        monkeypatch.setattr(sys, "argv", ["ablations.py", "--studies", "angle", *words])
        return [each.anatomy for each in ablations.planned(ablations.parse_arguments())]

    assert sorted(set(anatomies())) == ["chest", "pelvis"]
    assert set(anatomies("--anatomy", "pelvis")) == {"pelvis"}


def test_representations_are_a_table_with_honest_iterations(tmp_path):
    """Systems of other iterations are other lines, and one without poses has no number for them."""
    rng = random.Random(1)
    rows = []
    for count in (None, 30):
        for point in points("representation", "pelvis", [], [count]):
            row, _ = made(settings_of(point, Settings("pelvis", 0, 400)), rng)
            if point.changes["system"].startswith("dense"):
                row["summary"]["mean_pose_tre_mm"] = None
            if row not in rows and row["settings"] not in [each["settings"] for each in rows]:
                rows.append(row)
    write_tables(rows, "default", tmp_path / "t.md")
    ((heading, lines),) = tables(tmp_path / "t.md").items()
    assert heading == "Representation of the motion (pelvis, 400 x 400 pixels)"
    assert [line["representation"] for line in lines] == [
        "nothing moves",
        "polyrigid (ours)",
        "dense R3",
        "dense R3, 30 iterations",
        "dense SE(3)",
        "dense SE(3), 30 iterations",
    ]
    assert [line["pose TRE mm"] == "-" for line in lines] == [False, False, True, True, True, True]
    plot(rows, "default", tmp_path / "t.png")
    assert (tmp_path / "t.png").stat().st_size > 5000


def test_rows_older_than_a_setting_are_still_known(tmp_path):
    """They are as usual in it, and not run again."""
    rows, _ = angles("pelvis", (0,), random.Random(2))
    write_tables(rows, "default", tmp_path / "new.md")
    for row in rows:
        row["settings"] = {name: value for name, value in row["settings"].items() if value is not None}
    write_tables(rows, "default", tmp_path / "old.md")
    assert tables(tmp_path / "old.md") == tables(tmp_path / "new.md") != {}
