"""The parts of an export, and what each is for people."""

PARTS = ("segmentation", "contours", "bones", "deformation")
"""What may be left out beside the warped CT."""

SEGMENTATION, CONTOURS, BONES, DEFORMATION = PARTS

CONTENTS = {
    "original_ct": ("The CT as it was given, for a placeholder patient, since it was not DICOM.",),
    "ct": ("The CT in the posture of the X-rays (CT Image Storage), in a frame of reference of its own.",),
    "segmentation.dcm": ("The labels in the same frame of reference (Segmentation Storage).",),
    "contours.dcm": (
        "The same labels as contours (RT Structure Set Storage), which more planning systems read.",
    ),
    "deformation.dcm": (
        "Deformable Spatial Registration: leads from each point of the patient as X-rayed to the CT's point.",
        "Import it to deform the CT, its contours or a dose into the posture of the X-rays.",
    ),
    "bones": (
        "Spatial Registration, one file a bone: the rigid motion of that bone from the CT to the X-rays.",
        "Import the one bone's file to carry a plan that belongs to it; the anchor's matrix is the identity.",
    ),
}
"""What each file and folder is, in the order of a listing."""
