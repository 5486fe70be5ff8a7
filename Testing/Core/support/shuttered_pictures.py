"""Pictures of a soft body with bones, cut by shutters whose shape, place and colour are drawn from a seed."""

import numpy as np
from scipy import ndimage

SIDE = 200

SHAPES = ("square", "tilted", "round", "polygon")

OUTSIDES = ("black", "white", "grey", "scatter", "text")


def anatomy(seed, air=False):
    """Grey levels (H, W) from 0 to 1, bone bright: a body that fills the picture, or one with air on both sides."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:SIDE, :SIDE] / (SIDE / 2) - 1
    width = 0.75 if air else 1.7
    thick = np.sqrt(np.clip(1 - (x / (width * (1 + 0.1 * np.sin(2 * y + seed)))) ** 2, 0, None))
    line = 3.0 * thick
    for _ in range(6):
        place, turn = rng.uniform(-0.6, 0.6, 2), rng.uniform(0, np.pi)
        u = (x - place[0]) * np.cos(turn) + (y - place[1]) * np.sin(turn)
        v = (y - place[1]) * np.cos(turn) - (x - place[0]) * np.sin(turn)
        bone = np.clip(1 - (u / rng.uniform(0.2, 0.7)) ** 2 - (v / rng.uniform(0.05, 0.2)) ** 2, 0, None)
        line += rng.uniform(0.5, 1.2) * np.sqrt(bone)
    line = ndimage.gaussian_filter(line, 0.8) + 0.04 * rng.normal(size=line.shape)
    return np.clip(line / 5, 0, 1)


def opening(shape, seed):
    """Pixels (H, W) that the shutter leaves open: half-planes or a disc, computed for each pixel's centre."""
    rng = np.random.default_rng([seed, SHAPES.index(shape)])
    y, x = (np.mgrid[:SIDE, :SIDE] - (SIDE - 1) / 2) / (SIDE / 2)
    if shape == "round":
        return np.hypot(x - rng.uniform(-0.05, 0.05), y - rng.uniform(-0.05, 0.05)) < rng.uniform(0.75, 1.05)
    sides = 4 if shape != "polygon" else int(rng.integers(5, 9))
    turn = 0.0 if shape == "square" else rng.uniform(0.1, 0.4) * rng.choice([-1, 1])
    inside = np.ones((SIDE, SIDE), dtype=bool)
    for angle in turn + np.arange(sides) * 2 * np.pi / sides:
        reach = rng.uniform(0.65, 0.9) if sides == 4 else 0.85
        inside &= x * np.cos(angle) + y * np.sin(angle) < reach
    return inside


def shuttered(picture, inside, outside, seed):
    """The picture (H, W), uint8, covered outside of a field (H, W) by a colour, noisy scatter, or text on black."""
    rng = np.random.default_rng([seed, OUTSIDES.index(outside)])
    if outside == "scatter":
        soft = ndimage.gaussian_filter(inside.astype(float), rng.uniform(0.5, 1.2))
        veil = 0.95 - 0.3 * ndimage.gaussian_filter(picture * inside, 30)
        covered = soft * picture + (1 - soft) * (veil + 0.03 * rng.normal(size=picture.shape))
    else:
        covered = np.where(inside, picture, {"black": 0.0, "white": 1.0, "grey": 0.2, "text": 0.0}[outside])
    if outside == "text":
        for row in range(2):
            for column in range(int(rng.integers(5, 10))):
                letter = rng.random((6, 4)) < 0.5
                covered[4 + 8 * row :, 4 + 5 * column :][:6, :4][letter] = 1.0
    return np.rint(255 * np.clip(covered, 0, 1)).astype(np.uint8)
