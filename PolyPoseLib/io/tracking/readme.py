"""README.txt of a track's folder: which of its files is for what, and in which coordinates."""

README = "README.txt"

README_TEXT = """\
This folder holds the motion of bones of one CT through a sequence of X-rays, as PolyPose tracked it. Research software,
not for clinical decisions. Lengths are millimetres, frames are counted from 0.

Two frames of coordinates: "moving" is the CT (LPS), "fixed" is the world of the rig, in which the calibrations (or
extrinsics) of the cameras are given.

track.json      everything: poses from the rig's world to the CT (4x4, row by row), covariances (6x6 of rotation in
                rad, then translation in mm, a perturbation on the left of the pose about the structure's centroid in
                the CT), residuals, doubts, sources, cameras, versions, and whether the poses were smoothed
poses.csv       one row a frame and structure: where the centroid is in the rig's world, how the structure is turned
                from the CT to the frame (rotation vector and quaternion), 95 % intervals (plus or minus) along and
                across the cameras' common viewing direction, flags
STRUCTURE.tra   for Autoscoper: one line a frame from frame 0, 16 numbers of a 4x4 matrix row by row, separated by
                commas, mm; NaN where the structure was lost or the frame not tracked. From the coordinates of
                Autoscoper's volume to the rig's world; that volume is the whole CT as a stack of TIFF pages{mirrored}.
                Load it as type Matrix, orientation Row, separator Comma, translation in mm.
joints.csv, joints.json, plots/
                angles and translations of bones relative to each other, with 95 % intervals, helical axes, and what is
                positive; null or empty where a bone was lost
overlay.mp4     the bones' outlines on the X-rays
surfaces/       bones where they are in chosen frames, in the rig's world: STL, or VTP with the longest half axis of
                each vertex's 95 % ellipsoid ("uncertainty_mm")
warped/         the CT (HU) and its structures in the posture of chosen frames, with the reference where the CT has it
"""

MIRRORED = ",\n                in reverse order of its slices (its grid is left-handed)"


def readme_text(mirrored: bool) -> str:
    """The text; mirrored: whether the CT's grid is left-handed."""
    return README_TEXT.format(mirrored=MIRRORED if mirrored else "")
