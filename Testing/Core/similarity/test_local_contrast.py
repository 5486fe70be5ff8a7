"""Local normalisation by compiled loops is that by numpy, for any mask, patch, window and noise."""

from __future__ import annotations

import numpy as np
import pytest

from PolyPoseLib.geometry.windows import Window
from PolyPoseLib.similarity import local_contrast
from PolyPoseLib.similarity.local_contrast import LocalContrast


def window_in(rng: np.random.Generator, height: int, width: int) -> Window:
    row, column = int(rng.integers(height)), int(rng.integers(width))
    return row, int(rng.integers(row, height)) + 1, column, int(rng.integers(column, width)) + 1


@pytest.mark.parametrize("seed", range(40))
def test_compiled_loops_and_numpy_agree(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("numba")
    rng = np.random.default_rng(seed)
    height, width = (int(n) for n in rng.integers(3, 60, 2))
    mask = rng.random((height, width)) < rng.choice([0.0, 0.3, 0.9, 1.0])
    noise = rng.uniform(0, 0.1, (height, width)).astype(np.float32) if seed % 2 else 0.02
    contrast = LocalContrast(mask, 2 * int(rng.integers(0, 12)) + 1, 0.03, noise)
    image = rng.normal(rng.normal(0, 4), rng.choice([0.1, 1.0, 5.0]), (height, width)).astype(np.float32)
    window = window_in(rng, height, width)
    changes = rng.normal(size=(6, window[1] - window[0], window[3] - window[2])).astype(np.float32)

    compiled = contrast.normalise(image, noisy=seed % 3 == 0)
    derivative = contrast.derivative(compiled, changes, window)
    monkeypatch.setattr(local_contrast, "_compiled", lambda: None)
    plain = contrast.normalise(image, noisy=seed % 3 == 0)
    expected = contrast.derivative(compiled, changes, window)

    counts = contrast.support > 0
    for name in ("values", "centred", "mean", "deviation"):
        found, right = (getattr(each, name)[counts] for each in (compiled, plain))
        np.testing.assert_allclose(found, right, rtol=1e-4, atol=1e-5, err_msg=name)
    assert not compiled.values[~counts].any()
    assert derivative[1] == expected[1]
    scale = max(1.0, float(np.abs(expected[0]).max()))
    np.testing.assert_allclose(derivative[0] / scale, expected[0] / scale, atol=2e-6)


def test_what_is_not_a_number_stays_so() -> None:
    image = np.ones((20, 20), np.float32)
    image[4, 5] = np.nan
    normalised = LocalContrast(np.ones((20, 20), bool), 5, 0.03).normalise(image)
    assert np.isnan(normalised.values[4, 5])


def test_images_and_changes_of_another_shape_are_refused() -> None:
    contrast = LocalContrast(np.ones((20, 24), bool), 5, 0.03)
    with pytest.raises(ValueError, match="mask of shape"):
        contrast.normalise(np.zeros((20, 20), np.float32))
    image = contrast.normalise(np.zeros((20, 24), np.float32))
    with pytest.raises(ValueError, match="for the window"):
        contrast.derivative(image, np.zeros((6, 4, 4), np.float32), (2, 7, 3, 7))
