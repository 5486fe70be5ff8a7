"""A mouth that opens between the CT and the X-rays: is the mandible found, and what becomes of the teeth?

The head CT (`head_ct`) is given bones and a lower row of teeth (`jaw_anatomy`); its mouth opens by 5, 15 and 25 degrees
after `simulate --motion jaw`, about an axis and with a glide of the condyles that differ from seed to seed. Views are
2x30, one from the front and one from 30 degrees to its left, unless stated otherwise. Every case is registered as a
process of its own, as a user does it. From the poses that were found, and from the true ones, the CT is then put
into the open mouth by both smooth warps and composed of rigid bones (`jaw_teeth`).

    python Testing/Benchmarks/jaw.py --head FOLDER
    python Testing/Benchmarks/jaw.py --head FOLDER --picture

Rows that are in the results file already are not run again unless --again is given.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from benchmark_cases import parse_views
from benchmark_store import MAKING, Row, Store, add_run_arguments, parsed, register_row
from degraded_scores import score_folder
from head_ct import WHERE, read_head
from jaw_anatomy import LABELS, LOWER, MANDIBLE, Head, head_of, mouth
from jaw_pictures import write_picture
from jaw_tables import describe, write_tables
from jaw_teeth import teeth_numbers, true_mouth, warped_mouths

from PolyPoseLib.data.truth import Truth
from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation.score import score_result
from PolyPoseLib.geometry.rigid import rotation_angle_deg
from PolyPoseLib.io.cases import write_case
from PolyPoseLib.io.results import load_result
from PolyPoseLib.io.truths import load_truth
from PolyPoseLib.simulation.simulate import (
    SimulationOptions,
    arc_angles,
    simulate_case,
    structures_centre,
    view_cameras,
)

NAME = "jaw"

FIELDS = ("lower", "degrees", "seed", "views", "pixels")
"""What tells one row from another."""

DISTANCES_MM = (1020.0, 780.0)
"""Source to detector and source to isocenter."""


def main() -> int:
    """Run what is missing and write the tables after every row, or draw."""
    arguments = parse_arguments()
    try:
        scan = read_head(arguments.head)
        heads = {lower: head_of(scan, lower) for lower in arguments.lower}
        if arguments.picture:
            write_picture(head_of(scan, "completed"), arguments.output / f"{NAME}.png")
            return 0
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    store = Store(arguments.output / f"{NAME}.json", FIELDS, write_tables)
    keys = [
        {
            "lower": lower,
            "degrees": degrees,
            "seed": seed,
            "views": arguments.views,
            "pixels": arguments.pixels,
        }
        for lower in arguments.lower
        for seed in arguments.seeds
        for degrees in arguments.degrees
    ]
    missing = store.missing(keys, arguments.again)
    store.run(missing, arguments.jobs, lambda key: run_row(key, heads[key["lower"]], arguments), describe)
    return 0


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--head", type=Path, metavar="FOLDER|FILE", help=WHERE)
    parser.add_argument("--degrees", nargs="+", type=float, default=[5.0, 15.0, 25.0], help="of the opening")
    parser.add_argument("--lower", nargs="+", choices=LOWER, default=["completed"], help="row of teeth")
    parser.add_argument("--picture", action="store_true", help="only draw the mouth open by 25 degrees")
    add_run_arguments(parser, range(5), "2x30", 3600)
    arguments = parsed(parser)
    if arguments.head is None:
        print(f"--head is missing: {WHERE}.", file=sys.stderr)
        raise SystemExit(2)
    return arguments


def run_row(key: Row, head: Head, arguments: argparse.Namespace) -> Row:
    """Simulate, register, score."""
    with MAKING:
        folder = jaw_case(key, head, arguments.work)
    result = folder / "result"
    shutil.rmtree(result, ignore_errors=True)
    row = key | {"size_factor": 1.0} | register_row(folder / "study.json", result, arguments)
    if (result / "result.json").is_file():
        with MAKING:
            row |= scores(result, load_truth(folder / "truth"), head, key["lower"] == "completed")
    if not arguments.keep:
        shutil.rmtree(folder)
    return row


def jaw_case(key: Row, head: Head, work: Path) -> Path:
    """The folder of one case, simulated unless it is there already."""
    options = SimulationOptions(motion="jaw", amplitude=key["degrees"])
    folder = work / "-".join(
        [
            NAME,
            key["lower"],
            f"{key['degrees']:g}deg",
            key["views"],
            f"{key['pixels']}px",
            f"seed{key['seed']}",
        ]
    )
    settings = json.dumps({"options": repr(options), "head": digest(head)})
    stamp = folder / "settings.json"
    if stamp.is_file() and stamp.read_text() == settings:
        return folder
    if folder.exists():
        raise SystemExit(f"{folder} holds a case of other settings or an unfinished one: remove it.")
    structures = head.structures
    to_detector, to_isocenter = DISTANCES_MM
    cameras = view_cameras(
        head.ct,
        arc_angles(*parse_views(key["views"])),
        key["pixels"],
        source_to_detector_mm=to_detector,
        source_to_isocenter_mm=to_isocenter,
        isocenter=structures_centre(structures, head.ct.affine),
    )
    case = simulate_case(
        head.ct, structures, cameras=cameras, seed=key["seed"], options=options, source_labels=head.labels
    )
    write_case(case, folder, LABELS, source_to_detector_mm=to_detector)
    stamp.write_text(settings)
    return folder


def scores(result: Path, truth: Truth, head: Head, has_teeth: bool) -> dict[str, Any]:
    """What `score_folder` gives, the angle between true and found pose, the soft error, and numbers of the teeth.

    "angle_deg": between the true and the found orientation of the mandible; "opening_error_deg": of the found angle of
    opening over the true one; "soft_mm": mean error of the transform in the body outside the bones; "teeth":
    {"found", "true": {form: `teeth_numbers`}}, by whose poses.
    """
    row: dict[str, Any] = score_folder(result, truth, np.eye(4))
    loaded = load_result(result)
    true, found = truth.fixed_to_moving[MANDIBLE], loaded.structures[MANDIBLE].fixed_to_moving
    row["angle_deg"] = rotation_angle_deg(true[:3, :3].T @ found[:3, :3])
    row["opening_error_deg"] = rotation_angle_deg(found[:3, :3]) - rotation_angle_deg(true[:3, :3])
    row["soft_mm"] = score_result(loaded, truth)["summary"]["soft_error_mean_mm"]
    if has_teeth:
        poses = {name: motion.fixed_to_moving for name, motion in loaded.structures.items()}
        rest, open_mouth = mouth(head), true_mouth(head, truth.fixed_ct)
        by_poses = {
            whose: {
                form: teeth_numbers(rest, open_mouth, warped)
                for form, warped in warped_mouths(head, given).items()
            }
            for whose, given in (("found", poses), ("true", truth.fixed_to_moving))
        }
        row["teeth"] = by_poses | {"truth": teeth_numbers(rest, open_mouth, open_mouth)}
    return row


@cache
def digest(head: Head) -> str:
    """Tells one head from another."""
    from hashlib import sha256

    return sha256(head.ct.voxels.tobytes() + head.labels.voxels.tobytes()).hexdigest()


if __name__ == "__main__":
    sys.exit(main())
