"""Fused ray kernels for the CPU: one pass along every ray gives the line integral and what its Jacobian needs.

Compiled with numba on first use; callers go through :class:`PolyPoseLib.rendering.backend.NumbaBackend`.
All coordinates are voxel indices (i, j, k) of a volume that is padded with one layer of zeros, so that the
interpolant falls to zero continuously at the box. Volumes are passed flat, and indices counted in 32 bits: the
compiler then gathers the voxels of many samples at once.
"""

import math

import numba
import numpy as np

from PolyPoseLib.compiled import compiled

TILE = 4
"""Pixels along the edge of the image's tiles; each has its own range of depths."""

FARTHEST = 1e30
"""Stands for infinity, which the compiler may take for something that never happens."""

_SURROUNDS = 1e-6
"""A block whose nearest depth is a smaller share of its farthest is taken to surround the source."""


@numba.njit(inline="always", fastmath=True)
def _clip(origin, direction, near, far, low, high):
    """Clip the interval [near, far] of depth to where one coordinate lies in low .. high."""
    if abs(direction) < 1e-12:
        if origin <= low or origin >= high:
            return 1.0, 0.0
        return near, far
    first = (low - origin) / direction
    second = (high - origin) / direction
    if first > second:
        first, second = second, first
    return max(near, first), min(far, second)


@numba.njit(inline="always", fastmath=True)
def _samples_of_ray(source, along, pixel, step_mm, near, far, low, high):
    """Samples of one ray: their number, the first one's depth, and their distance in depth.

    source, along: (3,) indices, and indices per mm of depth; pixel: (2,) place on the plane at depth 1; near, far:
    depths between which anything is to be seen; low, high: (3,) box of indices. Samples lie at fixed depths from the
    source, so that the image changes smoothly with the pose, wherever the ray is clipped.
    """
    distance = step_mm / math.sqrt(pixel[0] * pixel[0] + pixel[1] * pixel[1] + 1.0)
    near, far = _clip(source[0], along[0], near, far, low[0], high[0])
    near, far = _clip(source[1], along[1], near, far, low[1], high[1])
    near, far = _clip(source[2], along[2], near, far, low[2], high[2])
    if far <= near:
        return np.int32(0), 0.0, distance
    first = math.ceil(near / distance - 0.5)
    count = int(math.floor(far / distance - 0.5)) - int(first) + 1
    return np.int32(count), (first + 0.5) * distance, distance


@numba.njit(inline="always", fastmath=True)
def _direction(row, column, rays):
    """Index units per mm of depth along the ray of a pixel."""
    corner, per_column, per_row = rays.corner, rays.per_column, rays.per_row
    return (
        corner[0] + column * per_column[0] + row * per_row[0],
        corner[1] + column * per_column[1] + row * per_row[1],
        corner[2] + column * per_column[2] + row * per_row[2],
    )


@numba.njit(inline="always", fastmath=True)
def _place(row, column, inverse_intrinsics):
    """Where the ray of a pixel meets the plane at depth 1."""
    return (
        inverse_intrinsics[0, 0] * column + inverse_intrinsics[0, 1] * row + inverse_intrinsics[0, 2],
        inverse_intrinsics[1, 1] * row + inverse_intrinsics[1, 2],
    )


@numba.njit(inline="always", fastmath=True)
def _cell(position, last):
    """Lower end, as a 32-bit index up to ``last``, of the cell of a coordinate, and the fraction inside it."""
    lower = min(max(np.int32(position), np.int32(0)), last)
    return lower, position - np.float32(lower)


@numba.njit(inline="always", fastmath=True)
def _flat_index(i, j, k, next_j, next_k):
    """Place of a voxel in the flat volume, in 32 bits."""
    return np.int32(np.int32(np.int32(k * next_k) + np.int32(j * next_j)) + i)


@numba.njit(inline="always", fastmath=True)
def _value(volume, at, next_j, next_k, fx, fy, fz):
    """Trilinear value in the cell whose first voxel is ``at``."""
    a00, a01 = volume[at], volume[at + next_j]
    a10, a11 = volume[at + next_k], volume[at + next_k + next_j]
    c00 = a00 + fx * (volume[at + 1] - a00)
    c01 = a01 + fx * (volume[at + next_j + 1] - a01)
    c10 = a10 + fx * (volume[at + next_k + 1] - a10)
    c11 = a11 + fx * (volume[at + next_k + next_j + 1] - a11)
    c0, c1 = c00 + fy * (c01 - c00), c10 + fy * (c11 - c10)
    return c0 + fz * (c1 - c0)


@numba.njit(inline="always", fastmath=True)
def _value_and_gradient(volume, at, next_j, next_k, fx, fy, fz):
    """Trilinear value, and its derivatives by the index, in the cell whose first voxel is ``at``."""
    a00, a01 = volume[at], volume[at + next_j]
    a10, a11 = volume[at + next_k], volume[at + next_k + next_j]
    d00, d01 = volume[at + 1] - a00, volume[at + next_j + 1] - a01
    d10, d11 = volume[at + next_k + 1] - a10, volume[at + next_k + next_j + 1] - a11
    c00, c01 = a00 + fx * d00, a01 + fx * d01
    c10, c11 = a10 + fx * d10, a11 + fx * d11
    c0, c1 = c00 + fy * (c01 - c00), c10 + fy * (c11 - c10)
    e0, e1 = d00 + fy * (d01 - d00), d10 + fy * (d11 - d10)
    by_y = (c01 - c00) + fz * ((c11 - c10) - (c01 - c00))
    return c0 + fz * (c1 - c0), e0 + fz * (e1 - e0), by_y, c1 - c0


@numba.njit(inline="always", fastmath=True)
def _displacement(field, at, next_j, next_k, fx, fy, fz):
    """One component of a field in the cell whose first node's component is ``at``."""
    ex, ey, ez = np.float32(1.0) - fx, np.float32(1.0) - fy, np.float32(1.0) - fz
    return (
        ez * ey * (ex * field[at] + fx * field[at + 3])
        + ez * fy * (ex * field[at + next_j] + fx * field[at + next_j + 3])
        + fz * ey * (ex * field[at + next_k] + fx * field[at + next_k + 3])
        + fz * fy * (ex * field[at + next_k + next_j] + fx * field[at + next_k + next_j + 3])
    )


@numba.njit(fastmath=True)
def _to_pixels(directions):
    """(3, 3) takes a direction from the source, in indices, to (depth column, depth row, depth)."""
    rows = np.empty((3, 3))
    for axis in range(3):
        a, b = directions[(axis + 1) % 3], directions[(axis + 2) % 3]
        rows[axis, 0] = a[1] * b[2] - a[2] * b[1]
        rows[axis, 1] = a[2] * b[0] - a[0] * b[2]
        rows[axis, 2] = a[0] * b[1] - a[1] * b[0]
    volume = rows[0, 0] * directions[0][0] + rows[0, 1] * directions[0][1] + rows[0, 2] * directions[0][2]
    return rows / volume


@compiled(fastmath=True)
def depth_ranges(centres, half_edges, source, directions, near, far):
    """Depths (mm) between which the rays of every tile of an image can meet any of some blocks.

    A tile's range holds all depths of every block whose bounds in the image touch it, hence all that its rays meet.

    Parameters
    ----------
    centres
        (M, 3) indices of the blocks' centres.
    half_edges
        (3,) of the blocks.
    source
        (3,).
    directions
        (per_column, per_row, corner), (3,) each, of the rays: indices per mm of depth.
    near, far
        (tile rows, tile columns), overwritten; where no block projects, far is less than near.

    """
    near[:] = FARTHEST
    far[:] = -FARTHEST
    farthest_around = 0.0
    to_pixels = _to_pixels(directions)
    half = np.abs(to_pixels) @ half_edges
    for block in range(len(centres)):
        offset = centres[block] - source
        across = to_pixels[0, 0] * offset[0] + to_pixels[0, 1] * offset[1] + to_pixels[0, 2] * offset[2]
        down = to_pixels[1, 0] * offset[0] + to_pixels[1, 1] * offset[1] + to_pixels[1, 2] * offset[2]
        depth = to_pixels[2, 0] * offset[0] + to_pixels[2, 1] * offset[1] + to_pixels[2, 2] * offset[2]
        nearest, farthest = depth - half[2], depth + half[2]
        if nearest <= _SURROUNDS * farthest:  # around the source, where every ray may meet it, or behind it
            farthest_around = max(farthest_around, farthest)
            continue
        column, row = across / depth, down / depth
        # |a / d - a0 / d0| = |(a - a0) - (a0 / d0) (d - d0)| / d
        wide, high = 0.0, 0.0
        for axis in range(3):
            wide += abs(to_pixels[0, axis] - column * to_pixels[2, axis]) * half_edges[axis]
            high += abs(to_pixels[1, axis] - row * to_pixels[2, axis]) * half_edges[axis]
        wide, high = wide / nearest, high / nearest
        first_column = max(int(math.floor((column - wide) / TILE)), 0)
        last_column = min(int(math.floor((column + wide) / TILE)), near.shape[1] - 1)
        first_row = max(int(math.floor((row - high) / TILE)), 0)
        last_row = min(int(math.floor((row + high) / TILE)), near.shape[0] - 1)
        for r in range(first_row, last_row + 1):
            for c in range(first_column, last_column + 1):
                near[r, c] = min(near[r, c], nearest)
                far[r, c] = max(far[r, c], farthest)
    if farthest_around > 0.0:
        near[:] = 0.0
        far[:] = np.maximum(far, farthest_around)


@numba.njit(inline="always", fastmath=True)
def _march(row, column, rays, tile_depths, low, high):
    """Samples of the ray of a pixel: their number, depth of the first and distance in depth, place and step (3 + 3).

    tile_depths: (near, far) per tile of the image; low, high: (3,) box of indices.
    """
    start, end = tile_depths[0][row // TILE, column // TILE], tile_depths[1][row // TILE, column // TILE]
    along = _direction(row, column, rays)
    pixel = _place(row, column, rays.inverse_intrinsics)
    count, s, ds = _samples_of_ray(rays.source, along, pixel, rays.step_mm, start, end, low, high)
    x, sx = np.float32(rays.source[0] + s * along[0]), np.float32(ds * along[0])
    y, sy = np.float32(rays.source[1] + s * along[1]), np.float32(ds * along[1])
    z, sz = np.float32(rays.source[2] + s * along[2]), np.float32(ds * along[2])
    return count, s, ds, x, y, z, sx, sy, sz


@numba.njit(inline="always", fastmath=True)
def line_integral(volume, size, row, column, rays, tile_depths):
    """Line integral of a trilinear volume along the ray of a pixel, by the midpoint rule; see :func:`project`."""
    depth, height, width = size
    high = (width - 1.0, height - 1.0, depth - 1.0)
    last_i, last_j, last_k = np.int32(width - 2), np.int32(height - 2), np.int32(depth - 2)
    next_j, next_k = np.int32(width), np.int32(width * height)
    count, _s, _ds, x, y, z, sx, sy, sz = _march(row, column, rays, tile_depths, (0.0, 0.0, 0.0), high)
    total = np.float32(0.0)
    for n in range(count):
        m = np.float32(n)
        i, fx = _cell(x + m * sx, last_i)
        j, fy = _cell(y + m * sy, last_j)
        k, fz = _cell(z + m * sz, last_k)
        total += _value(volume, _flat_index(i, j, k, next_j, next_k), next_j, next_k, fx, fy, fz)
    return total * np.float32(rays.step_mm)


@numba.njit(inline="always", fastmath=True)
def line_moments(volume, size, row, column, rays, tile_depths):
    """Line integrals along the ray of a pixel: of a volume, its gradient by index (3), and depth times that (3)."""
    depth, height, width = size
    high = (width - 1.0, height - 1.0, depth - 1.0)
    last_i, last_j, last_k = np.int32(width - 2), np.int32(height - 2), np.int32(depth - 2)
    next_j, next_k = np.int32(width), np.int32(width * height)
    count, s, ds, x, y, z, sx, sy, sz = _march(row, column, rays, tile_depths, (0.0, 0.0, 0.0), high)
    total = np.float32(0.0)
    gx, gy, gz = np.float32(0.0), np.float32(0.0), np.float32(0.0)
    hx, hy, hz = np.float32(0.0), np.float32(0.0), np.float32(0.0)
    for n in range(count):
        m = np.float32(n)
        i, fx = _cell(x + m * sx, last_i)
        j, fy = _cell(y + m * sy, last_j)
        k, fz = _cell(z + m * sz, last_k)
        at = _flat_index(i, j, k, next_j, next_k)
        value, tx, ty, tz = _value_and_gradient(volume, at, next_j, next_k, fx, fy, fz)
        total += value
        gx += tx
        gy += ty
        gz += tz
        hx += m * tx
        hy += m * ty
        hz += m * tz
    # the depth of sample n is s + n ds: folded in once a ray
    weight, first, between = np.float32(rays.step_mm), np.float32(s), np.float32(ds)
    return (
        total * weight,
        gx * weight,
        gy * weight,
        gz * weight,
        (first * gx + between * hx) * weight,
        (first * gy + between * hy) * weight,
        (first * gz + between * hz) * weight,
    )


@compiled(parallel=True, fastmath=True)
def project(volume, size, rays, near, far, image):
    """Line integrals of a trilinear volume by the midpoint rule.

    Parameters
    ----------
    volume
        Flat float32, zero on its border.
    size
        (D, H, W) of the volume.
    rays
        :class:`PolyPoseLib.rendering.kernel_arguments.IndexRays`, in indices of the volume.
    near, far
        Depths (mm) per tile of the image, between which anything is to be seen.
    image
        (rows, columns) float32 of zeros, filled.

    """
    rows, columns = image.shape
    for row in numba.prange(rows):
        for column in range(columns):
            image[row, column] = line_integral(volume, size, row, column, rays, (near, far))


@compiled(parallel=True, fastmath=True)
def project_with_moments(volume, size, rays, near, far, image, moments):
    """As :func:`project`, with the moments from which the Jacobian of a rigid motion follows.

    Into moments (rows, columns, 6), float32 of zeros, go the integral of the volume's gradient in index units (3) and
    of depth times that gradient (3): a rigid motion displaces a point of the ray linearly in its depth, so these six
    numbers give all six partial derivatives.
    """
    rows, columns = image.shape
    for row in numba.prange(rows):
        for column in range(columns):
            line, gx, gy, gz, hx, hy, hz = line_moments(volume, size, row, column, rays, (near, far))
            image[row, column] = line
            moments[row, column, 0], moments[row, column, 1], moments[row, column, 2] = gx, gy, gz
            moments[row, column, 3], moments[row, column, 4], moments[row, column, 5] = hx, hy, hz


@compiled(parallel=True, fastmath=True)
def project_warped(
    volume, size, field, field_size, grid_scale, grid_offset, low, high, rays, near, far, image
):  # fmt: skip
    """As :func:`project`, of a volume that is warped by a field.

    The field is flat float32 displacements in the volume's index units, of field_size (d, h, w) times 3, on a grid
    whose coordinate is index * grid_scale + grid_offset (3,) each; beyond the grid the nearest displacement is taken.
    Rays are clipped to the box of indices from low to high (3,).
    """
    depth, height, width = size
    nodes_k, nodes_j, nodes_i = field_size
    rows, columns = image.shape
    scale_x, scale_y, scale_z = (
        np.float32(grid_scale[0]),
        np.float32(grid_scale[1]),
        np.float32(grid_scale[2]),
    )
    shift_x, shift_y, shift_z = (
        np.float32(grid_offset[0]),
        np.float32(grid_offset[1]),
        np.float32(grid_offset[2]),
    )
    zero = np.float32(0.0)
    top_x, top_y, top_z = (
        np.float32(nodes_i - 1.001),
        np.float32(nodes_j - 1.001),
        np.float32(nodes_k - 1.001),
    )
    end_x, end_y, end_z = np.float32(width - 1.0), np.float32(height - 1.0), np.float32(depth - 1.0)
    last_i, last_j, last_k = np.int32(width - 2), np.int32(height - 2), np.int32(depth - 2)
    last_node_i, last_node_j, last_node_k = (
        np.int32(nodes_i - 2),
        np.int32(nodes_j - 2),
        np.int32(nodes_k - 2),
    )
    next_j, next_k = np.int32(width), np.int32(width * height)
    node_j, node_k = np.int32(3 * nodes_i), np.int32(3 * nodes_i * nodes_j)
    for row in numba.prange(rows):
        for column in range(columns):
            count, _s, _ds, x, y, z, sx, sy, sz = _march(row, column, rays, (near, far), low, high)
            total = zero
            for n in range(count):
                m = np.float32(n)
                px, py, pz = x + m * sx, y + m * sy, z + m * sz
                i, fx = _cell(min(max(px * scale_x + shift_x, zero), top_x), last_node_i)
                j, fy = _cell(min(max(py * scale_y + shift_y, zero), top_y), last_node_j)
                k, fz = _cell(min(max(pz * scale_z + shift_z, zero), top_z), last_node_k)
                at = _flat_index(np.int32(3 * i), j, k, node_j, node_k)
                px += _displacement(field, at, node_j, node_k, fx, fy, fz)
                py += _displacement(field, at + 1, node_j, node_k, fx, fy, fz)
                pz += _displacement(field, at + 2, node_j, node_k, fx, fy, fz)
                inside = (px > zero) & (py > zero) & (pz > zero) & (px < end_x) & (py < end_y) & (pz < end_z)
                i, fx = _cell(px, last_i)
                j, fy = _cell(py, last_j)
                k, fz = _cell(pz, last_k)
                value = _value(volume, _flat_index(i, j, k, next_j, next_k), next_j, next_k, fx, fy, fz)
                total += value if inside else zero
            image[row, column] = total * np.float32(rays.step_mm)
