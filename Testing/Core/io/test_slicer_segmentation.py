"""A .seg.nrrd that Slicer's own storage node wrote: cropped, with overlapping segments in layers."""

import importlib.util
import subprocess
import sys

import numpy as np
import pytest

from PolyPoseLib.data.structures import build_structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.segmentations import read_segmentation

SHAPE = (8, 9, 10)
IJK_TO_RAS = np.array([[-2, 0, 0, 10], [0, -2, 0, 20], [0, 0, 3, 30], [0, 0, 0, 1.0]])
NAMES = ("left hip", "sacrum", "femur")

WRITER = """
import sys
import numpy as np
import slicer
import vtk
from vtk.util import numpy_support

masks, matrix, names = np.load(sys.argv[1]), vtk.vtkMatrix4x4(), sys.argv[3:]
matrix.DeepCopy(masks["matrix"].ravel())
scene, node = slicer.vtkMRMLScene(), slicer.vtkMRMLSegmentationNode()
scene.AddNode(node)
for number, name in enumerate(names):
    mask = masks[str(number)]
    image = slicer.vtkOrientedImageData()
    image.SetExtent(0, mask.shape[2] - 1, 0, mask.shape[1] - 1, 0, mask.shape[0] - 1)
    image.AllocateScalars(vtk.VTK_UNSIGNED_CHAR, 1)
    numpy_support.vtk_to_numpy(image.GetPointData().GetScalars())[:] = mask.ravel()
    image.SetImageToWorldMatrix(matrix)
    segment = slicer.vtkSegment()
    segment.SetName(name)
    segment.AddRepresentation("Binary labelmap", image)
    node.GetSegmentation().AddSegment(segment)
node.GetSegmentation().SetSourceRepresentationName("Binary labelmap")
node.GetSegmentation().CollapseBinaryLabelmaps(False)
storage = slicer.vtkMRMLSegmentationStorageNode()
scene.AddNode(storage)
storage.SetCropToMinimumExtent(True)
storage.SetFileName(sys.argv[2])
sys.exit(0 if storage.WriteData(node) else 1)
"""


@pytest.mark.skipif(importlib.util.find_spec("slicer") is None, reason="slicer-core is not installed")
def test_segments_are_where_slicer_put_them(tmp_path):
    masks = np.zeros((3, *SHAPE), np.uint8)
    masks[0, 1:5, 2:6, 2:6] = masks[1, 4:7, 2:6, 2:6] = masks[2, 6:8, 7:9, 7:9] = 1
    np.savez(tmp_path / "masks.npz", matrix=IJK_TO_RAS, **{str(n): mask for n, mask in enumerate(masks)})
    path = tmp_path / "slicer.seg.nrrd"
    command = [sys.executable, "-c", WRITER, str(tmp_path / "masks.npz"), str(path), *NAMES]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    segmentation = read_segmentation(path)
    assert segmentation.has_layers
    assert segmentation.layers[0].shape != SHAPE
    grid = Volume(np.zeros(SHAPE, np.float32), np.diag([-1.0, -1.0, 1.0, 1.0]) @ IJK_TO_RAS)
    for name, mask in zip(NAMES, masks, strict=True):
        structures, _ = build_structures(segmentation, {"bone": [name]}, grid)
        assert np.array_equal(structures.mask("bone"), mask > 0)
