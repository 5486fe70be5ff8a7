"""What is fuzzed: a table of all targets, which lie in the files of their subjects."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import fuzz_benchmarks
import fuzz_studies
import fuzz_tracks
import fuzz_volumes
import fuzz_xrays
from fuzz_subject import Subject

TARGETS: dict[str, Callable[[Path], list[Subject]]] = {
    each.__name__: each
    for each in (
        fuzz_volumes.nrrd,
        fuzz_volumes.metaimage,
        fuzz_volumes.nifti,
        fuzz_volumes.dicom_ct,
        fuzz_volumes.dicom_segments,
        fuzz_xrays.dicom_xray,
        fuzz_xrays.picture,
        fuzz_xrays.calibration,
        fuzz_xrays.landmarks,
        fuzz_xrays.image_run,
        fuzz_studies.study,
        fuzz_studies.result,
        fuzz_studies.transform,
        fuzz_studies.camera_model,
        fuzz_studies.cohort,
        fuzz_tracks.sequence,
        fuzz_tracks.track,
        fuzz_tracks.joint_curves,
        fuzz_benchmarks.deepfluoro_file,
        fuzz_benchmarks.deepfluoro_folder,
        fuzz_benchmarks.headneck,
        fuzz_benchmarks.thoraxcbct,
        fuzz_benchmarks.simulated,
    )
}
"""Every target: makes its sound files in a folder, and says how they are read."""
