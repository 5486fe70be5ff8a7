"""X-rays of a heap of spheres from any direction, in closed form: anatomy without symmetry for tests of pictures."""

import numpy as np

SIZE = 240


def heap(seed, count=140):
    """Centres (N, 3) in mm around the origin, radii (N,) mm and densities (N,) 1/mm."""
    rng = np.random.default_rng(seed)
    centres = rng.normal(0, [70, 70, 90], (count, 3))
    return centres, rng.uniform(3, 25, count), rng.uniform(0.01, 0.04, count)


def view(spheres, turn_deg=0.0, noise=0.02, seed=0):
    """Line integrals (H, W) from a direction about the third axis, 2 mm a pixel at the centre, from 800 mm away."""
    centres, radii, densities = spheres
    angle = np.radians(turn_deg)
    across = centres[:, 0] * np.cos(angle) + centres[:, 1] * np.sin(angle)
    depth = 800 - centres[:, 0] * np.sin(angle) + centres[:, 1] * np.cos(angle)
    scale = 800 / depth / 2.0
    row, column = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    image = np.zeros((SIZE, SIZE))
    for x, z, radius, density, zoom in zip(across, centres[:, 2], radii, densities, scale, strict=True):
        inside = np.maximum((radius * zoom) ** 2 - (column - x * zoom) ** 2 - (row - z * zoom) ** 2, 0)
        image += 2 * density / zoom * np.sqrt(inside)
    return image + noise * np.random.default_rng(seed).normal(size=image.shape)
