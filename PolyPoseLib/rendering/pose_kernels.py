"""Fused ray kernels for one body under many poses in one view.

A bone that is fitted from many starts is small in the image: rendered pose by pose, most of the time goes into what
surrounds the rays. Here all poses are rendered at once, each inside its own window of the image.
"""

import numba

from PolyPoseLib.compiled import compiled
from PolyPoseLib.rendering.kernel_arguments import IndexRays
from PolyPoseLib.rendering.kernels import depth_ranges, line_integral, line_moments


@numba.njit(inline="always")
def _rays_of(rays, n):
    """The rays of one pose."""
    return IndexRays(
        rays.source[n],
        rays.corner[n],
        rays.per_column[n],
        rays.per_row[n],
        rays.inverse_intrinsics,
        rays.rows,
        rays.columns,
        rays.step_mm,
    )


@compiled(parallel=True, fastmath=True)
def depth_ranges_of_poses(centres, half_edges, rays, near, far):
    """:func:`PolyPoseLib.rendering.kernels.depth_ranges` for every pose.

    rays: as in :func:`project_poses`; near, far: (S, tile rows, tile columns), overwritten.
    """
    for n in numba.prange(len(near)):
        own = _rays_of(rays, n)
        directions = own.per_column, own.per_row, own.corner
        depth_ranges(centres, half_edges, own.source, directions, near[n], far[n])


@compiled(parallel=True, fastmath=True)
def project_poses(volume, size, rays, windows, near, far, images):
    """Line integrals of a volume under S poses.

    Parameters
    ----------
    volume, size
        As :func:`PolyPoseLib.rendering.kernels.project` takes them.
    rays
        :class:`PolyPoseLib.rendering.kernel_arguments.IndexRays` of the whole image, source, corner, per_column and
        per_row of shape (S, 3).
    windows
        (S, 4) row 0, row 1, column 0, column 1 of the part of the image in which the body projects.
    near, far
        (S, tile rows, tile columns) depths in mm.
    images
        (S, rows, columns) float32 of zeros, filled inside the windows.

    """
    count, rows, _ = images.shape
    for task in numba.prange(count * rows):
        n, row = task // rows, task % rows
        if row < windows[n, 0] or row >= windows[n, 1]:
            continue
        own = _rays_of(rays, n)
        for column in range(windows[n, 2], windows[n, 3]):
            images[n, row, column] = line_integral(volume, size, row, column, own, (near[n], far[n]))


@compiled(parallel=True, fastmath=True)
def project_poses_with_jacobian(
    volume, size, rays, windows, near, far, frames, images, jacobians
):  # fmt: skip
    """As :func:`project_poses`, with the derivative of each image by its pose's perturbation.

    frames: :class:`PolyPoseLib.rendering.kernel_arguments.PoseFrames`; jacobians: (S, 6, rows, columns) float32 of
    zeros, by rotation (1/rad) and translation (1/mm). Components along a ray are the integral's own instead of the
    samples', as in :func:`PolyPoseLib.rendering.rigid.project_body`.
    """
    count, rows, _ = images.shape
    for task in numba.prange(count * rows):
        n, row = task // rows, task % rows
        if row < windows[n, 0] or row >= windows[n, 1]:
            continue
        own = _rays_of(rays, n)
        to_index, start, turned = frames.to_index, frames.start[n], frames.turned[n]
        for column in range(windows[n, 2], windows[n, 3]):
            line, a, b, c, d, e, f = line_moments(volume, size, row, column, own, (near[n], far[n]))
            images[n, row, column] = line
            if line == 0.0:
                continue
            dx = turned[0, 2] + column * turned[0, 0] + row * turned[0, 1]
            dy = turned[1, 2] + column * turned[1, 0] + row * turned[1, 1]
            dz = turned[2, 2] + column * turned[2, 0] + row * turned[2, 1]
            gx, gy, gz = _in_mm(a, b, c, to_index)
            hx, hy, hz = _in_mm(d, e, f, to_index)
            squared = dx * dx + dy * dy + dz * dz
            along = (gx * dx + gy * dy + gz * dz) / squared
            gx, gy, gz = gx - along * dx, gy - along * dy, gz - along * dz
            along = (hx * dx + hy * dy + hz * dz + line) / squared
            hx, hy, hz = hx - along * dx, hy - along * dy, hz - along * dz
            jacobian = jacobians[n, :, row, column]
            jacobian[0] = start[1] * gz - start[2] * gy + dy * hz - dz * hy
            jacobian[1] = start[2] * gx - start[0] * gz + dz * hx - dx * hz
            jacobian[2] = start[0] * gy - start[1] * gx + dx * hy - dy * hx
            jacobian[3], jacobian[4], jacobian[5] = gx, gy, gz


@numba.njit(inline="always", fastmath=True)
def _in_mm(a, b, c, to_index):
    """A gradient (a, b, c) by index as one by mm."""
    return (
        a * to_index[0, 0] + b * to_index[1, 0] + c * to_index[2, 0],
        a * to_index[0, 1] + b * to_index[1, 1] + c * to_index[2, 1],
        a * to_index[0, 2] + b * to_index[1, 2] + c * to_index[2, 2],
    )
