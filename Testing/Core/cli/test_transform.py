"""The subcommand transform."""

import csv

import numpy as np
import pytest
from carried_case import carried_result

from PolyPoseLib.__main__ import main


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    result = carried_result()
    return result, result.save(tmp_path_factory.mktemp("transform") / "result")


def table(folder, result):
    x, y, z = result.structures["femur"].centroid
    path = folder / "in.csv"
    path.write_text(f"label,x,y,z\nhead,{x},{y},{z}\nskin,20,30,5\n")
    return path


def places(path) -> np.ndarray:
    return np.array([[float(row[axis]) for axis in "xyz"] for row in csv.DictReader(path.open())])


def test_points_are_carried_there_and_back(tmp_path, capsys, saved):
    result, folder = saved
    source, target = table(tmp_path, result), tmp_path / "out.csv"
    assert main(["transform", str(folder), str(source), "--output", str(target)]) == 0
    said = capsys.readouterr().out
    assert "2 points" in said and "1 by femur" in said and str(target) in said
    np.testing.assert_allclose(places(target), result.transform_points(places(source)).points, atol=1e-3)
    back = tmp_path / "back.csv"
    assert main(["transform", str(folder), str(target), "--output", str(back), "--to", "ct"]) == 0
    np.testing.assert_allclose(places(back), places(source), atol=5e-3)
    assert sorted(each.name for each in tmp_path.iterdir() if "lock" not in each.name) == [
        "back.csv", "in.csv", "out.csv",
    ]  # fmt: skip


def test_a_file_is_replaced_only_when_asked_and_never_the_input(tmp_path, capsys, saved):
    result, folder = saved
    source, target = table(tmp_path, result), tmp_path / "out.csv"
    target.write_text("mine")
    arguments = ["transform", str(folder), str(source), "--output"]
    assert main([*arguments, str(target)]) == 2 and target.read_text() == "mine"
    assert "--overwrite" in capsys.readouterr().err
    assert main([*arguments, str(target), "--overwrite"]) == 0 and target.read_text() != "mine"
    assert main([*arguments, str(source), "--overwrite"]) == 2
    assert "the input itself" in capsys.readouterr().err and places(source).shape == (2, 3)


@pytest.mark.parametrize(
    ("source", "output", "words"),
    [
        ("absent.csv", "out.csv", "no such file"),
        ("in.csv", "out.stl", "written as .csv"),
        ("in.csv", "nowhere/out.csv", "does not exist"),
        ("in.xyz", "out.xyz", "not carried"),
    ],
)
def test_wrong_arguments_end_in_one_sentence(tmp_path, capsys, saved, source, output, words):
    result, folder = saved
    table(tmp_path, result)
    (tmp_path / "in.xyz").write_text("1 2 3")
    status = main(["transform", str(folder), str(tmp_path / source), "--output", str(tmp_path / output)])
    error = capsys.readouterr().err
    assert status == 2 and words in error and error.count("\n") == 1


def test_a_result_of_an_earlier_version_says_to_register_again(tmp_path, capsys):
    result = carried_result()
    result.structure_labels = None
    folder = result.save(tmp_path / "result")
    source = table(tmp_path, result)
    assert main(["transform", str(folder), str(source), "--output", str(tmp_path / "out.csv")]) == 2
    assert "structures.nii.gz" in capsys.readouterr().err and not (tmp_path / "out.csv").exists()


def test_a_result_that_is_not_trusted_is_used_but_ends_with_3(tmp_path, capsys):
    result = carried_result()
    result.distrust = ("nothing fits",)
    folder = result.save(tmp_path / "result")
    source = table(tmp_path, result)
    assert main(["transform", str(folder), str(source), "--output", str(tmp_path / "out.csv")]) == 3
    assert "must not be trusted: nothing fits" in capsys.readouterr().err
    assert places(tmp_path / "out.csv").shape == (2, 3)


@pytest.mark.parametrize("name", ["out.csv", "warped_ct.csv", "../result/out.csv"])
def test_nothing_is_written_into_the_result(tmp_path, capsys, saved, name):
    result, folder = saved
    before = sorted(each.name for each in folder.iterdir())
    source = table(tmp_path, result)
    assert main(["transform", str(folder), str(source), "--output", str(folder / name), "--overwrite"]) == 2
    error = capsys.readouterr().err
    assert "folder of the result" in error and error.count("\n") == 1
    assert sorted(each.name for each in folder.iterdir()) == before
    link = tmp_path / "link"
    link.symlink_to(folder)
    assert main(["transform", str(folder), str(source), "--output", str(link / "out.csv")]) == 2
