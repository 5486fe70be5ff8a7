"""X-ray files: DICOM and plain pictures become line integrals with a camera."""
