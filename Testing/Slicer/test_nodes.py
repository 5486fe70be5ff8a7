"""Nodes to arrays and back: frames, parents, left-handed and sheared volumes, layers; inputs stay as they are."""

from __future__ import annotations

import contextlib
import unittest
from collections.abc import Iterator

import numpy as np
import scenes
import slicer
import vtk
from PolyPoseSlicer.scene import frames
from PolyPoseSlicer.scene.grid_transform import set_grid_transform
from PolyPoseSlicer.scene.nodes import Grid, Voxels, lattice_shift, read_layers, read_volume, region_on
from slicer_case import SlicerTestCase

from PolyPoseLib.errors import InputError


@contextlib.contextmanager
def untouched(test: SlicerTestCase, *nodes: slicer.vtkMRMLNode) -> Iterator[None]:
    """Fail when one of the nodes reports that it was modified, or has another parent afterwards."""
    # The parent is looked up at the first call, which counts as a change.
    parents = [node.GetTransformNodeID() for node in nodes]
    changed = []
    tags = [node.AddObserver(vtk.vtkCommand.ModifiedEvent, lambda *_: changed.append(1)) for node in nodes]
    yield
    for node, tag in zip(nodes, tags, strict=True):
        node.RemoveObserver(tag)
    test.assertEqual((changed, [node.GetTransformNodeID() for node in nodes]), ([], parents))


def points_of(grid: Grid, number: int = 200, seed: int = 5) -> np.ndarray:
    """Random points (N, 3), LPS mm, inside of a grid."""
    index = np.random.default_rng(seed).uniform(0.5, np.array(grid.shape[::-1]) - 1.5, (number, 3))
    return index @ grid.affine[:3, :3].T + grid.affine[:3, 3]


class FramesTest(SlicerTestCase):
    def test_flips_undo_themselves(self) -> None:
        random = np.random.default_rng(1)
        matrix = np.vstack([random.normal(size=(3, 4)), [0, 0, 0, 1]])
        points = random.normal(size=(7, 3))
        np.testing.assert_array_equal(frames.flip_affine(frames.flip_affine(matrix)), matrix)
        np.testing.assert_array_equal(frames.flip_map(frames.flip_map(matrix)), matrix)
        np.testing.assert_array_equal(frames.flip_vectors(frames.flip_vectors(points)), points)
        np.testing.assert_array_equal(frames.from_vtk(frames.to_vtk(matrix)), matrix)

    def test_a_map_commutes_with_the_flip(self) -> None:
        matrix = scenes.rotation((1, -2, 0.5), 40.0)
        point = np.array([1.0, 2.0, 3.0])
        moved = frames.flip_vectors(matrix[:3, :3] @ point)
        np.testing.assert_allclose(frames.flip_map(matrix)[:3, :3] @ frames.flip_vectors(point), moved)


class VolumeTest(SlicerTestCase):
    def assert_grid(self, voxels: Voxels, affine: np.ndarray) -> None:
        np.testing.assert_allclose(voxels.grid.affine, affine, atol=1e-6)
        np.testing.assert_array_equal(voxels.values, scenes.voxels())

    def test_plain_and_left_handed(self) -> None:
        for left_handed in (False, True):
            matrix = scenes.affine(left_handed, tilt_deg=20.0)
            self.assertEqual(np.linalg.det(matrix[:3, :3]) < 0, left_handed)
            self.assert_grid(read_volume(scenes.add_ct(matrix)), matrix)

    def test_under_a_chain_of_parents_it_is_where_it_is_shown(self) -> None:
        ct = scenes.add_ct()
        outer = scenes.add_transform(scenes.rotation((0, 1, 0), 25.0))
        inner = scenes.rotation((1, 0, 0), -40.0)
        inner[:3, 3] = (5, 6, 7)
        inner_node = scenes.add_transform(inner)
        inner_node.SetAndObserveTransformNodeID(outer.GetID())
        ct.SetAndObserveTransformNodeID(inner_node.GetID())
        expected = frames.flip_map(scenes.rotation((0, 1, 0), 25.0) @ inner) @ scenes.affine()
        with untouched(self, ct, inner_node, outer):
            self.assert_grid(read_volume(ct), expected)

    def test_what_comes_back_is_a_copy(self) -> None:
        ct = scenes.add_ct()
        read_volume(ct).values[...] = 7
        np.testing.assert_array_equal(slicer.util.arrayFromVolume(ct), scenes.voxels())

    def test_a_sheared_volume_is_resampled_onto_right_angles(self) -> None:
        matrix = scenes.affine()
        shear = np.eye(4)
        shear[0, 2] = 0.3
        ct = scenes.add_ct(matrix)
        ct.SetAndObserveTransformNodeID(scenes.add_transform(shear).GetID())
        voxels = read_volume(ct)
        self.assertTrue(voxels.grid.is_straight())
        # A voxel in the middle of the large bone is found where it is shown.
        index = np.array([7.0, 11.0, 10.0, 1.0])
        place = np.linalg.inv(voxels.grid.affine) @ frames.flip_map(shear) @ matrix @ index
        i, j, k = np.round(place[:3]).astype(int)
        self.assertLess(abs(float(voxels.values[k, j, i]) - 670), 25)

    def test_a_nonlinear_parent_is_applied_to_a_copy(self) -> None:
        ct = scenes.add_ct()
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLGridTransformNode")
        vectors, affine = scenes.field()
        set_grid_transform(node, 0 * vectors + np.float32(4), affine)
        ct.SetAndObserveTransformNodeID(node.GetID())
        with untouched(self, ct, node):
            voxels = read_volume(ct)
        # warp(x) = x + 4: what was at p is shown at p - 4.
        index = np.array([7.0, 11.0, 10.0])
        moved = scenes.affine()[:3, :3] @ index + scenes.affine()[:3, 3] - 4
        i, j, k = np.round(np.linalg.inv(voxels.grid.affine) @ [*moved, 1])[:3].astype(int)
        self.assertLess(abs(float(voxels.values[k, j, i]) - 670), 40)

    def test_an_empty_volume_is_one_sentence(self) -> None:
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLScalarVolumeNode", "nothing")
        with self.assertRaisesRegex(InputError, "'nothing' has no voxels"):
            read_volume(node)


class SegmentationTest(SlicerTestCase):
    def on_grid(self, node: slicer.vtkMRMLSegmentationNode, grid: Grid) -> np.ndarray:
        """The segments' numbers on a grid."""
        out = np.zeros(grid.shape, np.uint8)
        ids = list(node.GetSegmentation().GetSegmentIDs())
        for layer in read_layers(node, ids):
            region, values = region_on(layer.voxels, grid)
            for segment, label in layer.labels.items():
                out[region][values == label] = ids.index(segment) + 1
        return out

    def test_labels_come_back_on_the_ct_grid(self) -> None:
        for matrix in (scenes.affine(True, 15.0), scenes.affine(False, 33.0)):
            ct = scenes.add_ct(matrix)
            node = scenes.add_segmentation(ct)
            with untouched(self, node, ct):
                np.testing.assert_array_equal(self.on_grid(node, read_volume(ct).grid), scenes.labels())

    def test_under_a_rotated_parent_it_stays_with_the_ct(self) -> None:
        ct = scenes.add_ct()
        ct.SetAndObserveTransformNodeID(scenes.add_transform(scenes.rotation((1, 1, 0), 50.0)).GetID())
        node = scenes.add_segmentation(ct)
        np.testing.assert_array_equal(self.on_grid(node, read_volume(ct).grid), scenes.labels())

    def test_under_another_parent_than_the_ct_it_is_moved(self) -> None:
        ct = scenes.add_ct()
        node = scenes.add_segmentation(ct)
        shift = np.eye(4)
        shift[:3, 3] = (-2 * scenes.SPACING[0], 0, 0)  # RAS: two voxels along +i in LPS
        node.SetAndObserveTransformNodeID(scenes.add_transform(shift).GetID())
        expected = np.roll(scenes.labels(), 2, axis=2)
        np.testing.assert_array_equal(self.on_grid(node, read_volume(ct).grid), expected)

    def test_surfaces_are_turned_into_labels_in_a_copy(self) -> None:
        ct = scenes.add_ct()
        node = scenes.add_segmentation(ct)
        names = slicer.vtkSegmentationConverter
        node.CreateClosedSurfaceRepresentation()
        node.GetSegmentation().SetSourceRepresentationName(
            names.GetSegmentationClosedSurfaceRepresentationName()
        )
        node.GetSegmentation().RemoveRepresentation(names.GetSegmentationBinaryLabelmapRepresentationName())
        found = self.on_grid(node, read_volume(ct).grid)
        overlap = (
            2 * (found == 1)[scenes.labels() == 1].sum() / ((found == 1).sum() + (scenes.labels() == 1).sum())
        )
        self.assertGreater(overlap, 0.8)
        self.assertFalse(
            node.GetSegmentation().ContainsRepresentation(
                names.GetSegmentationBinaryLabelmapRepresentationName()
            )
        )

    def test_an_unknown_segment_is_one_sentence(self) -> None:
        node = scenes.add_segmentation(scenes.add_ct())
        with self.assertRaisesRegex(InputError, "no segment 'tail'"):
            read_layers(node, ["tail"])


class LatticeTest(SlicerTestCase):
    def test_whole_voxels_are_found_and_fractions_are_not(self) -> None:
        matrix = scenes.affine(True, 12.0)
        grid = Grid(matrix, scenes.SHAPE)
        for shift, found in (((2, -3, 1), True), ((0.5, 0, 0), False)):
            step = np.eye(4)
            step[:3, 3] = shift
            result = lattice_shift(Grid(matrix @ step, (3, 4, 5)), grid)
            self.assertEqual(result is not None, found)
            if found:
                np.testing.assert_array_equal(result, shift)


class GridTransformTest(SlicerTestCase):
    def test_points_follow_simpleitk_within_a_twentieth_of_a_millimetre(self) -> None:
        import SimpleITK as sitk

        for left_handed, tilt in ((False, 0.0), (True, 0.0), (True, 30.0), (False, -50.0)):
            matrix = scenes.affine(left_handed, tilt)
            vectors, coarse = scenes.field(matrix)
            node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLGridTransformNode")
            set_grid_transform(node, vectors, coarse)
            image = sitk.GetImageFromArray(vectors.astype(np.float64), isVector=True)
            spacing = np.linalg.norm(coarse[:3, :3], axis=0)
            image.SetSpacing(spacing.tolist())
            image.SetDirection((coarse[:3, :3] / spacing).ravel().tolist())
            image.SetOrigin(coarse[:3, 3].tolist())
            oracle = sitk.DisplacementFieldTransform(image)
            from_world = vtk.vtkGeneralTransform()
            node.GetTransformFromWorld(from_world)
            for point in points_of(Grid(matrix, scenes.SHAPE)):
                ras = from_world.TransformPoint(*frames.flip_vectors(point))
                expected = np.array(oracle.TransformPoint(point.tolist()))
                self.assertLess(np.linalg.norm(frames.flip_vectors(np.array(ras)) - expected), 0.05)

    def test_a_hardened_volume_is_what_simpleitk_resamples(self) -> None:
        import SimpleITK as sitk

        from PolyPoseLib.data.displacement_field import DisplacementField
        from PolyPoseLib.data.volume import Volume

        matrix = scenes.affine(True, 10.0)
        vectors, coarse = scenes.field(matrix)
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLGridTransformNode")
        set_grid_transform(node, 0.3 * vectors, coarse)
        ct = scenes.add_ct(matrix)
        ct.SetAndObserveTransformNodeID(node.GetID())
        shown = read_volume(ct)  # hardened in a copy, on a larger grid
        image = Volume(scenes.voxels().astype(np.float32), matrix).to_sitk()
        oracle = DisplacementField(0.3 * vectors, coarse).to_sitk_transform()
        warped = sitk.GetArrayFromImage(sitk.Resample(image, oracle, sitk.sitkLinear, -1000.0))
        mine = Volume(shown.values.astype(np.float32), shown.grid.affine).to_sitk()
        same = sitk.GetArrayFromImage(sitk.Resample(mine, image, sitk.Transform(), sitk.sitkLinear, -1000.0))
        inner = (slice(4, -4),) * 3
        self.assertLess(np.abs(same[inner] - warped[inner]).mean(), 40.0)
        self.assertGreater(np.corrcoef(same[inner].ravel(), warped[inner].ravel())[0, 1], 0.98)

    def test_slicer_reads_the_transform_file_as_the_same_map(self) -> None:
        from PolyPoseLib.data.displacement_field import DisplacementField
        from PolyPoseLib.io.transforms import write_transform

        matrix = scenes.affine(True, 10.0)
        vectors, coarse = scenes.field(matrix)
        write_transform(DisplacementField(vectors, coarse), self.folder / "t.h5")
        loaded = slicer.util.loadTransform(str(self.folder / "t.h5"))
        loaded.GetTransformFromParent().SetInterpolationModeToLinear()  # ITK's own; Slicer reads it as cubic
        made = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLGridTransformNode")
        set_grid_transform(made, vectors, coarse)
        ours, theirs = vtk.vtkGeneralTransform(), vtk.vtkGeneralTransform()
        made.GetTransformFromWorld(ours)
        loaded.GetTransformFromWorld(theirs)
        for point in points_of(Grid(matrix, scenes.SHAPE), 50):
            ras = frames.flip_vectors(point)
            np.testing.assert_allclose(ours.TransformPoint(*ras), theirs.TransformPoint(*ras), atol=1e-3)


if __name__ == "__main__":
    unittest.main()
