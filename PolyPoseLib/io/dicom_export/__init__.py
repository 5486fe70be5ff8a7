"""A result as DICOM: CT series, segmentation, and registrations, for planning systems."""
