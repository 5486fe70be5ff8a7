"""A result as DICOM: CT series, segmentation, contours and registrations, for planning systems."""
