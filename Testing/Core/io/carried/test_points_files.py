"""Landmarks and plans carried from file to file."""

import csv
import json

import numpy as np
import pytest
from carried_case import carried_result

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.carried.files import carry_file

MARKUP = {
    "@schema": "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#",
    "markups": [
        {
            "type": "Fiducial",
            "coordinateSystem": "RAS",
            "coordinateUnits": "mm",
            "controlPoints": [
                {"id": "1", "label": "inside", "description": "mine", "position": [0, 0, 0]},
                {"id": "2", "label": "soft", "position": [20.0, 30.0, -10.0]},
                {"id": "3", "label": "nowhere", "position": None, "positionStatus": "undefined"},
            ],
            "measurements": [],
            "display": {"color": [1, 0, 0]},
        }
    ],
}


def rows_of(path):
    return list(csv.DictReader(path.open()))


def femur_point(result) -> np.ndarray:
    return result.structures["femur"].centroid


def test_a_table_gains_covariance_and_what_moved(tmp_path):
    result = carried_result()
    points = np.array([femur_point(result), [20.0, 40, 0]])
    source, target = tmp_path / "in.csv", tmp_path / "out.csv"
    source.write_text(
        "label,x,y,z\n" + "".join(f'"p,{n}",{x},{y},{z}\n' for n, (x, y, z) in enumerate(points))
    )
    said = carry_file(result, source, target, "xray")
    expected = result.transform_points(points)
    rows = rows_of(target)
    assert list(rows[0]) == ["label", "x", "y", "z", "xx", "xy", "xz", "yy", "yz", "zz", "moved_by", "inside"]
    assert [row["label"] for row in rows] == ["p,0", "p,1"] and "2 points" in said
    assert [row["moved_by"] for row in rows] == ["femur", "displacement field"]
    found = np.array([[float(row[axis]) for axis in "xyz"] for row in rows])
    np.testing.assert_allclose(found, expected.points, atol=1e-5)
    upper = np.array([[float(row[name]) for name in ("xx", "xy", "xz", "yy", "yz", "zz")] for row in rows])
    np.testing.assert_allclose(
        upper, expected.covariances[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]], rtol=1e-6
    )
    carry_file(result, target, tmp_path / "back.csv", "ct")
    returned = np.array([[float(row[axis]) for axis in "xyz"] for row in rows_of(tmp_path / "back.csv")])
    np.testing.assert_allclose(returned, points, atol=5e-3)


def test_markups_keep_everything_but_their_places(tmp_path):
    result = carried_result()
    given = json.loads(json.dumps(MARKUP))
    femur = femur_point(result)
    given["markups"][0]["controlPoints"][0]["position"] = (femur * [-1, -1, 1]).tolist()
    source, target = tmp_path / "in.mrk.json", tmp_path / "out.mrk.json"
    source.write_text(json.dumps(given))
    carry_file(result, source, target, "xray")
    found = json.loads(target.read_text())
    points = found["markups"][0]["controlPoints"]
    expected = result.transform_points(np.array([femur, [-20.0, -30, -10]]))
    for each, place in zip(points, expected.points, strict=False):
        np.testing.assert_allclose(np.array(each["position"]) * [-1, -1, 1], place, atol=1e-9)
    assert points[0]["description"].startswith("mine [moved by femur; 95 % ellipsoid")
    assert points[2] == given["markups"][0]["controlPoints"][2]
    assert found["@schema"] == given["@schema"] and found["markups"][0]["display"] == {"color": [1, 0, 0]}
    carry_file(result, target, tmp_path / "back.mrk.json", "ct")
    back = json.loads((tmp_path / "back.mrk.json").read_text())["markups"][0]["controlPoints"]
    np.testing.assert_allclose(
        back[1]["position"], given["markups"][0]["controlPoints"][1]["position"], atol=5e-3
    )
    assert back[0]["description"].count("moved by") == 1


@pytest.mark.parametrize(("system", "sign"), [("LPS", 1), ("1", 1), ("RAS", -1), ("0", -1)])
def test_older_lists_of_points_are_carried_in_their_own_coordinates(tmp_path, system, sign):
    result = carried_result()
    source, target = tmp_path / "in.fcsv", tmp_path / "out.fcsv"
    flip = np.array([sign, sign, 1])
    femur = femur_point(result) * flip
    source.write_text(
        f"# Markups fiducial file version = 5.4\n# CoordinateSystem = {system}\n"
        "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
        f"1,{femur[0]},{femur[1]},{femur[2]},0,0,0,1,1,1,0,head,,vtkMRMLScalarVolumeNode1\n"
    )
    carry_file(result, source, target, "xray")
    lines = target.read_text().splitlines()
    assert lines[:3] == source.read_text().splitlines()[:3]
    row = next(csv.reader([lines[3]]))
    place = np.array(row[1:4], float) * flip
    np.testing.assert_allclose(place, result.transform_points(femur_point(result)[None]).points[0], atol=1e-5)
    assert len(row) == 14 and row[11] == "head" and row[12].startswith("[moved by femur")
    carry_file(result, source, tmp_path / "out.csv", "xray")
    assert rows_of(tmp_path / "out.csv")[0]["label"] == "head"


@pytest.mark.parametrize("kind", ["json", "mrk.json"])
def test_a_screw_moves_with_the_bone_that_holds_it_and_keeps_its_length(tmp_path, kind):
    result = carried_result()
    target = femur_point(result)
    entry = target + np.array([0, 0, 60.0])  # beyond the femur, in soft tissue
    assert result.transform_points(entry[None]).moved_by == ("displacement field",)
    source, out = tmp_path / f"plan.{kind}", tmp_path / f"out.{kind}"
    if kind == "json":
        screw = {"name": "s", "entry": entry.tolist(), "target": target.tolist(), "diameter_mm": 6.5}
        source.write_text(json.dumps({"version": 1, "screws": [screw]}))
    else:
        ends = [{"label": str(n), "position": each.tolist()} for n, each in enumerate((entry, target))]
        source.write_text(
            json.dumps({"markups": [{"type": "Line", "coordinateSystem": "LPS", "controlPoints": ends}]})
        )
    carry_file(result, source, out, "xray")
    fields = json.loads(out.read_text())
    if kind == "json":
        screw = fields["screws"][0]
        found = np.array([screw["entry"], screw["target"]])
        assert screw["diameter_mm"] == 6.5 and screw["entry_moved_by"] == "femur"
        assert np.array(screw["entry_covariance_mm2"]).shape == (3, 3)
        assert carry_file(result, out, tmp_path / "back.json", "ct")
    else:
        found = np.array([each["position"] for each in fields["markups"][0]["controlPoints"]])
    back = np.linalg.inv(result.structures["femur"].fixed_to_moving)
    np.testing.assert_allclose(found, np.array([entry, target]) @ back[:3, :3].T + back[:3, 3], atol=1e-9)


WRONG = {
    "no.csv": ("a,b\n1,2\n", 'no column "label"'),
    "empty.csv": ("label,x,y,z\n", "holds no points"),
    "text.csv": ("label,x,y,z\np,1,2,here\n", 'line 2 has "here" as z'),
    "short.csv": ("label,x,y,z\np,1\n", 'line 2 has "" as y'),
    "nan.csv": ("label,x,y,z\np,1,nan,3\n", "LPS millimetres"),
    "far.csv": ("label,x,y,z\np,1,1e9,3\n", "LPS millimetres"),
    "list.mrk.json": ("[]", "one JSON object"),
    "plane.mrk.json": ('{"markups": [{"type": "Plane"}]}', "Plane"),
    "none.mrk.json": ('{"markups": [{"type": "Fiducial", "controlPoints": []}]}', "no control point"),
    "unit.mrk.json": ('{"markups": [{"type": "Fiducial", "coordinateUnits": "m"}]}', "millimetres"),
    "axes.mrk.json": ('{"markups": [{"type": "Fiducial", "coordinateSystem": "XYZ"}]}', "LPS or RAS"),
    "place.mrk.json": (
        '{"markups": [{"type": "Fiducial", "controlPoints": [{"position": [1, 2]}]}]}',
        '"position"',
    ),
    "bad.fcsv": ("# columns = id,x,y,z\n1,2,3,q\n", "line 2"),
    "columns.fcsv": ("# columns = id,label\n1,2\n", "names no x, y and z"),
    "version.json": ('{"version": 9, "screws": []}', '"version"'),
    "empty.json": ('{"version": 1, "screws": []}', '"screws" is empty'),
    "point.json": (
        '{"version": 1, "screws": [{"name": "s", "entry": [1, 2, 3], "target": [1, 2, 3]}]}',
        "entry at its target",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_files_are_refused_in_a_sentence_that_names_them(tmp_path, name):
    text, words = WRONG[name]
    source = tmp_path / name
    source.write_text(text)
    target = tmp_path / f"out.{name.partition('.')[2]}"
    with pytest.raises(InputError) as caught:
        carry_file(carried_result(), source, target, "xray")
    assert words in str(caught.value) and name in str(caught.value) and "\n" not in str(caught.value)
    assert not target.exists()


@pytest.mark.parametrize(
    ("source", "target"),
    [("a.csv", "b.fcsv"), ("a.stl", "b.ply"), ("a.json", "b.mrk.json"), ("a.nii.gz", "b.csv")],
)
def test_another_kind_of_output_is_refused(tmp_path, source, target):
    (tmp_path / source).write_text("x")
    with pytest.raises(InputError, match=r"written as"):
        carry_file(carried_result(), tmp_path / source, tmp_path / target, "xray")


def test_an_unknown_kind_of_file_is_refused(tmp_path):
    (tmp_path / "a.docx").write_text("x")
    with pytest.raises(InputError, match="not carried"):
        carry_file(carried_result(), tmp_path / "a.docx", tmp_path / "b.docx", "xray")


FIDUCIALS = """# Markups fiducial file version = 5.0
# CoordinateSystem = LPS
# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID
1,20,30,5,0,0,0,1,1,1,0,skin,,
"""


@pytest.mark.parametrize("distrust", [(), ("nothing fits",)])
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("in.mrk.json", json.dumps(MARKUP)),
        ("in.fcsv", FIDUCIALS),
        (
            "in.json",
            '{"version": 1, "screws": [{"name": "s", "entry": [20, 30, 5], "target": [20, 30, 25]}]}',
        ),
    ],
)
def test_points_of_a_result_that_is_not_trusted_say_so(tmp_path, name, text, distrust):
    result = carried_result()
    result.distrust = distrust
    (tmp_path / name).write_text(text)
    target = tmp_path / name.replace("in", "out")
    carry_file(result, tmp_path / name, target, "xray")
    assert ("NOT TO BE TRUSTED" in target.read_text()) == bool(distrust)
    carry_file(result, target, tmp_path / name.replace("in", "back"), "ct")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the file is empty"),
        ("\ufeff \r\n\n", "the file is empty"),
        ("label;x;y;z\na;1,5;2;3\n", "separated by semicolons"),
        ("label\tx\ty\tz\na\t1\t2\t3\n", "separated by tabs"),
        ("label,x,y\na,1,2\n", 'no column "z"'),
    ],
)
def test_a_table_that_is_none_is_refused_for_what_it_is(tmp_path, text, words):
    (tmp_path / "in.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        carry_file(carried_result(), tmp_path / "in.csv", tmp_path / "out.csv", "xray")
