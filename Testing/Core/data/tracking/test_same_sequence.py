"""An earlier track is told from that of another sequence by all that it keeps."""

from dataclasses import replace

import numpy as np
import pytest
from json_values import assert_one_sentence
from track_case import FRAMES, make_track, write_sequence

from PolyPoseLib.data.tracking.same_sequence import require_same_sequence
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking.sequences import load_sequence


@pytest.fixture
def sequence(tmp_path):
    return load_sequence(write_sequence(tmp_path / "walk"))


@pytest.fixture
def track(sequence):
    return replace(
        make_track(frames=FRAMES),
        centroids=sequence.structures.centroids(sequence.ct.affine),
        cameras={view.name: view.camera for view in sequence.views},
        frames_per_second=sequence.frames_per_second,
        inputs=sequence.inputs,
    )


def test_the_track_of_the_same_files_is_known_again(sequence, track, tmp_path):
    require_same_sequence(sequence, track)
    require_same_sequence(load_sequence(tmp_path / "walk" / "TRACK.json"), track)
    require_same_sequence(sequence, replace(track, inputs=None))


def refused(sequence, track):
    """The sentence."""
    with pytest.raises(InputError) as error:
        require_same_sequence(sequence, track)
    assert_one_sentence(error)
    return str(error.value)


def test_another_track_is_refused_by_what_differs(sequence, track):
    assert "structures are a, b" in refused(sequence, replace(track, names=("a", "b"), reference="a"))
    assert 'reference is "talus"' in refused(sequence, replace(track, reference="talus"))
    assert "frames per second are 49" in refused(sequence, replace(track, frames_per_second=49.0))
    moved = track.centroids + np.array([[0, 0, 0], [0, 0.1, 0]])
    assert '"talus" has its centroid elsewhere' in refused(sequence, replace(track, centroids=moved))
    assert "holds the frames 0 to 4" in refused(sequence, replace(track, frames=track.frames[:5]))
    names = {f"{name}!": camera for name, camera in track.cameras.items()}
    assert "cameras are camera 1!" in refused(sequence, replace(track, cameras=names))
    extrinsic = track.cameras["camera 2"].extrinsic.copy()
    extrinsic[0, 3] += 0.01
    cameras = {**track.cameras, "camera 2": track.cameras["camera 2"].with_extrinsic(extrinsic)}
    assert '"camera 2" has another calibration' in refused(sequence, replace(track, cameras=cameras))


def test_another_ct_other_labels_and_other_images_are_refused(sequence, track):
    voxels = sequence.ct.voxels.copy()
    voxels[0, 0, 0] += 1
    assert "CT has other voxels" in refused(replace(sequence, ct=sequence.ct.with_voxels(voxels)), track)
    flipped = sequence.structures.labels[:, :, ::-1].copy()  # boxes that lie in the middle
    labels = replace(sequence.structures, labels=np.where(flipped == 1, 1, sequence.structures.labels))
    other = replace(sequence, structures=labels)
    known = replace(track, centroids=labels.centroids(sequence.ct.affine))
    assert not np.array_equal(labels.labels, sequence.structures.labels)
    assert "structures have other voxels" in refused(other, known)
    images = {**track.inputs.images, "camera 2": "0" * 64}
    said = refused(sequence, replace(track, inputs=replace(track.inputs, images=images)))
    assert '"camera 2" has other images' in said
