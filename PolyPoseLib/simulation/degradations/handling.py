"""Pictures that were handed on without a word: inverted, mirrored, exchanged, cropped, or given twice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase, View, grey_levels, with_grey


def inverted(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Bone dark, where the reader takes it as bright."""
    return degraded.with_views(lambda view, _: with_grey(view, 1 - grey_levels(view)))


def mirrored(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Columns in reverse order: the view from the detector's side."""
    return degraded.with_views(lambda view, _: replace(view, image=np.ascontiguousarray(view.image[:, ::-1])))


def views_exchanged(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Each view's picture is filed under the next one's camera."""
    views = degraded.views
    return degraded.with_views(lambda view, n: replace(views[(n + 1) % len(views)], stated=view.stated))


def view_twice(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """The first X-ray is given again in the last one's place, with its own camera."""
    return replace(degraded, views=(*degraded.views[:-1], degraded.views[0]))


def cropped(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Cut to a part that is not in the middle, without a word of where the central ray meets it."""

    def cut(view: View, number: int) -> View:
        height, width = view.image.shape
        top, bottom = rng.permutation([rng.uniform(0.01, 0.04), rng.uniform(0.09, 0.15)]) * height
        left, right = rng.permutation([rng.uniform(0.01, 0.04), rng.uniform(0.10, 0.16)]) * width
        rows, columns = slice(int(top), height - int(bottom)), slice(int(left), width - int(right))
        kept = (rows, columns)
        stated = replace(view.stated, principal_point_px=None)
        return replace(
            view,
            camera=view.camera.cropped(rows.start, rows.stop, columns.start, columns.stop),
            body=view.body[kept],
            line=view.line[kept],
            leaves=None if view.leaves is None else view.leaves[kept],
            blanked=None if view.blanked is None else view.blanked[kept],
            image=np.ascontiguousarray(view.image[kept]),
            stated=stated,
        )

    return degraded.with_views(cut)
