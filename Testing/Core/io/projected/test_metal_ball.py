"""A metal ball in a bone of a simulated patient: the marker of its place in the CT must land on its shadow.

The simulation renders with a projector of its own and moves the bones by its own law; the ball is in the patient alone.
"""

import csv
import dataclasses

import numpy as np
import pytest
import SimpleITK as sitk
from phantom_study import phantom

from PolyPoseLib.__main__ import main
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.pipeline import register
from PolyPoseLib.simulation.case_study import case_to_study
from PolyPoseLib.simulation.simulate import SimulationOptions, simulate_case, view_cameras

BALL = np.array([70.0, 8.0, -48.0])
"""In the shaft of the femur, LPS mm."""


def simulated(ct, structures):
    cameras = view_cameras(ct, (0.0, 60.0), 120, detector_mm=330.0)
    options = SimulationOptions(motion_scale=1.0, rotation_deg=3.0, translation_mm=8.0, projector="sum")
    return simulate_case(ct, structures, cameras=cameras, seed=3, options=options)


def shadow(with_ball, without):
    """(column, row) of the middle of what the ball adds to an X-ray, and how many pixels it covers."""
    added = np.clip(with_ball - without, 0, None)
    added[added < 0.3 * added.max()] = 0
    row, column = np.indices(added.shape)
    return np.array([(added * column).sum(), (added * row).sum()]) / added.sum(), int((added > 0).sum())


def cross_in(picture, near, radius=14):
    """(column, row) of the marker's cross, found by its colour in a drawn X-ray."""
    column, row = np.rint(near).astype(int)
    part = picture[row - radius : row + radius + 1, column - radius : column + radius + 1].astype(int)
    blue = (part[..., 2] > 180) & (part[..., 2] - part[..., 0] > 90)
    assert blue.any()
    # The cross is the longest row and the longest column of its colour.
    return np.array([blue.sum(axis=0).argmax() - radius + column, blue.sum(axis=1).argmax() - radius + row])


@pytest.mark.slow
def test_the_marker_lands_on_the_shadow_of_the_ball(tmp_path):
    ct, structures = phantom()
    k, j, i = np.indices(ct.shape)
    points = ct.to_world(np.stack([i, j, k], axis=-1))
    metal = np.linalg.norm(points - BALL, axis=-1) <= 5.0
    assert metal.sum() > 10 and (structures.labels[metal] == 2).all()
    plain = simulated(ct, structures)
    case = simulated(Volume(np.where(metal, np.float32(20000), ct.voxels), ct.affine), structures)
    study = dataclasses.replace(case_to_study(case, {"preset": "fast"}, camera="known"), ct=ct)
    register(study).save(tmp_path / "result")
    (tmp_path / "plan.csv").write_text("label,x,y,z\nball,{},{},{}\n".format(*BALL))
    arguments = ["project", tmp_path / "result", tmp_path / "plan.csv", "--output", tmp_path / "drawn"]
    assert main([str(each) for each in arguments]) == 0
    with (tmp_path / "drawn" / "points.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [each["where"] for each in rows] == ["in the picture"] * 2
    moved = []
    for n, row in enumerate(rows):
        middle, pixels = shadow(case.clean_images[n], plain.clean_images[n])
        moved.append(float(np.linalg.norm(case.cameras[n].project(BALL) - middle)))
        told = np.array([float(row["column_px"]), float(row["row_px"])])
        assert 4 <= pixels < 60
        assert np.linalg.norm(told - middle) < 0.7
        assert row["moved_by"] == "femur_left"
        assert np.linalg.norm(told - middle) < 2 * float(row["half_axis_95_major_px"]) + 0.3
        picture = sitk.GetArrayFromImage(sitk.ReadImage(str(tmp_path / "drawn" / f"xray_{n}.png")))
        scale = picture.shape[1] / 120
        drawn = cross_in(picture, (told + 0.5) * scale - 0.5)
        assert np.abs((drawn + 0.5) / scale - 0.5 - middle).max() < 0.9
    assert max(moved) > 2.5  # the ball's place in the CT alone would miss
