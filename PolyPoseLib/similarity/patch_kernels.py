"""Sums over patches of an image, for the compiled loops that normalise images."""

import numba


@numba.njit(fastmath=True)
def box_sums(values, first, half, window, between, sums):
    """Sums over patches of 2 half + 1 pixels a side, zeros beyond the border.

    values: of the image's part that begins at the row and column ``first``; window: rows and columns of the image for
    which sums are wanted, no more than half a patch away from that part's border unless that is the image's; between:
    scratch like values; sums: (rows, columns) of the window, overwritten.
    """
    height, width = values.shape
    row0, column0 = window[0] - first[0], window[2] - first[1]
    rows, columns = window[1] - window[0], window[3] - window[2]
    for r in range(height):
        total = 0.0
        for c in range(max(column0 - half, 0), min(column0 + half, width)):
            total += values[r, c]
        for c in range(columns):
            entering, leaving = column0 + c + half, column0 + c - half - 1
            if entering < width:
                total += values[r, entering]
            if leaving >= 0:
                total -= values[r, leaving]
            between[r, c] = total
    for c in range(columns):
        sums[0, c] = 0.0
    for r in range(max(row0 - half, 0), min(row0 + half + 1, height)):
        for c in range(columns):
            sums[0, c] += between[r, c]
    for r in range(1, rows):
        entering, leaving = row0 + r + half, row0 + r - half - 1
        for c in range(columns):
            total = sums[r - 1, c]
            if entering < height:
                total += between[entering, c]
            if leaving >= 0:
                total -= between[leaving, c]
            sums[r, c] = total
