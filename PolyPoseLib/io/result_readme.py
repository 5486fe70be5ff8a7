"""README.txt of a result folder: which of its files is for what."""

README = "README.txt"

README_TEXT = """\
This folder holds the result of a PolyPose registration of one CT to X-rays of the same patient in another posture.
Research software, not for clinical decisions. All coordinates are LPS, millimetres.

Two frames share these axes: "moving" is the CT, "fixed" is the patient as X-rayed.

To carry landmarks, screw plans, meshes, label maps, doses or RT structures of the CT to the patient as X-rayed:
    polypose transform THIS_FOLDER INPUT --output FILE
and back, from the X-rays to the CT, with --to ct. Points inside a bone take the bone's own motion, exactly; all
others the transform below; every point comes with its 95 % uncertainty.

result.json            motions of the bones and their uncertainty, cameras, similarity, warnings
transform.h5           from the X-rays to the CT: the direction in which images are resampled. Resampling the CT (or a
                       label map or a dose of the CT) through it gives the picture of the patient as X-rayed. In
                       3D Slicer, a volume under this transform moves to the X-rays, too.
inverse_transform.h5   from the CT to the X-rays: the direction in which points, contours and meshes of a plan move, and
                       in which images of the patient as X-rayed are resampled onto the CT
structures.nii.gz      label map of the bones in the CT, numbered by "label" of "structures" in result.json
warped_ct.nii.gz       the CT in the posture of the X-rays
warped_labels.nii.gz   the study's label map likewise
xray_N_drr.nii.gz      the final rendering of X-ray N, counted from 0
xray_N.nii.gz          the X-ray as it was compared: line integrals times 1000, as seen from the source
report.html            outlines of the bones on the X-rays, motions, intervals and reasons; opens in a browser, offline
report.png             the same in one picture

Both transforms are smooth and interpolated between nodes some millimetres apart. At joint surfaces they differ from the
bones' own motions ("fixed_to_moving" in result.json): use those for what belongs to one bone.
"""
