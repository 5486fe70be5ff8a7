"""Principal components against numpy's singular values."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from PolyPoseLib.baselines.trained import pca
from PolyPoseLib.baselines.trained.pca import principal_components


@given(number=st.integers(2, 9), size=st.integers(10, 60), seed=st.integers(0, 99), half=st.booleans())
def test_agrees_with_singular_values(number, size, seed, half):
    fields = np.random.default_rng(seed).normal(size=(number, size)) * np.linspace(1, 4, size)
    fields = fields.astype(np.float16 if half else np.float32)
    mean, components = principal_components(fields, number)
    values = fields.astype(np.float64)
    _, singular, right = np.linalg.svd(values - values.mean(0), full_matrices=False)
    count = number - 1
    assert components.shape == (count, size)
    np.testing.assert_allclose(mean, values.mean(0), atol=1e-4)
    np.testing.assert_allclose(
        np.linalg.norm(components, axis=1), singular[:count] / np.sqrt(count), rtol=1e-4
    )
    agreement = np.abs((components * right[:count]).sum(1)) / np.linalg.norm(components, axis=1)
    gaps = np.abs(np.diff(singular[: count + 1])) > 1e-2 * singular[0]
    assert (agreement[gaps & np.r_[True, gaps[:-1]]] > 0.999).all()


def test_parts_do_not_matter(monkeypatch):
    fields = np.random.default_rng(0).normal(size=(5, 101)).astype(np.float32)
    whole = principal_components(fields, 3)
    monkeypatch.setattr(pca, "VALUES_AT_ONCE", 7)
    for a, b in zip(whole, principal_components(fields, 3), strict=True):
        np.testing.assert_allclose(np.abs(a), np.abs(b), atol=1e-5)


def test_coefficients_have_the_spread_of_standard_deviations():
    rng = np.random.default_rng(1)
    basis = np.linalg.qr(rng.normal(size=(50, 2)))[0].T
    fields = rng.normal(size=(400, 2)) * (5.0, 0.5) @ basis + 3
    _, components = principal_components(fields.astype(np.float32), 10)
    assert len(components) == 2  # the rest is rounding
    assert np.linalg.norm(components, axis=1) == pytest.approx((5.0, 0.5), rel=0.1)


def test_equal_fields_have_no_components():
    mean, components = principal_components(np.ones((4, 30), np.float32), 3)
    assert (mean == 1).all() and len(components) == 0
