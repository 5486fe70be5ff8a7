"""The page's tables."""

import numpy as np
from result_case import make_result

from PolyPoseLib.data.carried import CarriedPoints
from PolyPoseLib.data.result import StructureResult
from PolyPoseLib.viewer import tables
from PolyPoseLib.viewer.content import NamedPoints


def test_motions_say_what_is_known_of_each_structure():
    result = make_result()
    femur = result.structures["femur"]
    uncertainty = {
        "along_mm": 4.0,
        "across_mm": [0.5, 1.5],
        "rotation_about_view_deg": 2.0,
        "rotation_across_deg": [3, 1],
    }
    result.structures["tibia"] = StructureResult.from_pose(
        femur.fixed_to_moving, np.zeros(3), uncertainty, ("left every view", "hidden by metal")
    )
    result.structures["patella"] = StructureResult.from_pose(femur.fixed_to_moving, np.zeros(3))
    rows = {row[0]: row for row in tables.motion_rows(result)}
    assert all(len(row) == len(tables.MOTION_HEADER) for row in rows.values())
    assert rows["pelvis (anchor)"][1:] == ["-"] * 9 + [""]
    assert rows["tibia"][6:] == ["4.0", "1.5", "2.0", "3.0", "left every view; hidden by metal"]
    assert rows["patella"][6:] == ["-"] * 4 + ["none found"]


def test_points_say_what_moved_them_and_what_is_not_known():
    places = np.array([(1.0, 2.0, -0.01), (4.0, 5.0, 6.0)])
    covariances = np.stack([np.diag([1.0, 4.0, 9.0]), np.full((3, 3), np.nan)])
    carried = CarriedPoints(places, covariances, ("femur", "displacement field"), np.array([True, False]))
    rows = tables.point_rows(NamedPoints(("a", "b"), places - [0, 3, 4], carried))
    assert all(len(row) == len(tables.POINT_HEADER) for row in rows)
    assert rows[0] == ["a", "1.0, -1.0, -4.0", "1.0, 2.0, 0.0", "5.0", "8.4 × 5.6 × 2.8", "femur", ""]
    assert rows[1][4:] == ["unknown", "displacement field", "beyond the transform's grid: extrapolated"]
