"""What a GPU is worth: the ray kernel against the card's memory, warp and soft tissue part by part against compiled
loops, and whole registrations on the GPU and on the CPU.

    python Testing/Benchmarks/gpu.py --device cuda
    python Testing/Benchmarks/gpu.py --device cpu --cases          # only the kernel and the parts, on the CPU

gpu.sh runs it together with the CUDA tests. Tables are written after every row.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
import torch
from benchmark_cases import STRUCTURES, case_folder
from benchmark_runs import RESULTS, register_and_score, register_command, run_measured
from benchmark_tables import machine, measured_on, table
from gpu_parts import SHAPE, part_lines, parts, seconds_of
from memory import phantom_case
from memory_phantom import SHAPE as LARGE_SHAPE

from PolyPoseLib.geometry.rigid import perturbation
from PolyPoseLib.io.truths import load_truth
from PolyPoseLib.rendering.rigid import index_rays
from PolyPoseLib.rendering.torch_backend import TorchBackend
from PolyPoseLib.rendering.torch_rays import bundle
from PolyPoseLib.rendering.trial import sample

PHANTOM, PHANTOM_PIXELS = "26 structures", 512
"""The large case of memory.py."""

POSES, REPEATS = 32, 10
"""Poses of the kernel's bone that are rendered at once, and how often."""

COPIED_BYTES = {"cpu": 1 << 28, "cuda": 1 << 32}
"""Of a tensor whose copy measures the memory's bandwidth; each byte is read once and written once."""

BYTES_PER_SAMPLE = 8 * 4
"""Eight voxels of float32, if none were in a cache."""


def main() -> int:
    """Measure, and write the tables."""
    arguments = parse_arguments()
    if arguments.device == "cuda" and not torch.cuda.is_available():
        print(
            "gpu.py: torch finds no CUDA device: give --device cpu, or a CUDA build of torch.",
            file=sys.stderr,
        )
        return 2
    arguments.output.mkdir(parents=True, exist_ok=True)
    found: dict = {"machine": machine() | {"device": device_name(arguments.device)}}
    found["kernel"] = kernel(arguments.device)
    write(found, arguments.output)
    found["parts"] = parts(arguments.device)
    write(found, arguments.output)
    found["registrations"] = []
    for case in arguments.cases:
        for device in dict.fromkeys((arguments.device, "cpu")):
            options = argparse.Namespace(device=device, threads=None, limit=arguments.limit)
            found["registrations"].append(
                {"case": case, "device": device} | register(case, arguments.work, options)
            )
            write(found, arguments.output)
    return 0


def register(case: str, work: Path, options: argparse.Namespace) -> dict:
    """One registration: seconds, memory, and errors where the case has a truth beside it."""
    if case != PHANTOM:
        folder = case_folder(case, "2x30", 0, 400, work)
        return register_and_score(
            folder / "study.json", load_truth(folder / "truth"), options.device, options
        )
    work.mkdir(parents=True, exist_ok=True)
    folder = phantom_case(LARGE_SHAPE, PHANTOM_PIXELS, work)
    command = register_command(
        folder / "study.json", folder / f"result_{options.device}", device=options.device
    )
    return run_measured(command, folder / f"log_{options.device}.txt", options.limit)


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--device", default="cuda", choices=("cpu", "cuda"))
    parser.add_argument("--cases", nargs="*", choices=(*STRUCTURES, PHANTOM), default=[*STRUCTURES, PHANTOM])
    parser.add_argument("--limit", type=float, default=150, metavar="SECONDS", help="of one registration")
    parser.add_argument("--work", type=Path, default=Path("benchmark-work"), help="where cases are kept")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the tables")
    return parser.parse_args()


def kernel(device: str) -> dict:
    """Samples and gathered bytes a second of the ray kernel, and the memory's bandwidth by copying."""
    backend = TorchBackend(device)
    body, camera = sample()
    rng = np.random.default_rng(0)
    poses = np.stack([perturbation(rng.normal(0, [0.05] * 3 + [3.0] * 3)) for _ in range(POSES)])
    rays = backend.image_rays(index_rays(body, camera, poses, (0, camera.height, 0, camera.width), 2.0))
    high = (
        torch.tensor(body.voxels.shape[::-1], dtype=torch.float64, device=backend.device).expand(POSES, 3) - 1
    )
    near, far = backend.seen(body.occupied, np.zeros(3), rays)
    samples = int(bundle(rays, torch.zeros_like(high), high, near, far).count.sum())
    plain = seconds_of(lambda: backend.sums(body.voxels, rays, False, body.occupied), device, REPEATS)
    moments = seconds_of(lambda: backend.sums(body.voxels, rays, True, body.occupied), device, REPEATS)
    block = torch.zeros(COPIED_BYTES[device], dtype=torch.uint8, device=backend.device)
    copying = seconds_of(block.clone, device, REPEATS)
    return {
        "poses": POSES,
        "samples": samples,
        "image_seconds": plain,
        "moments_seconds": moments,
        "gathered_bytes_per_second": samples * BYTES_PER_SAMPLE / plain,
        "copied_bytes_per_second": 2 * len(block) / copying,
    }


def device_name(device: str) -> str:
    """The card's name, or "cpu"."""
    return torch.cuda.get_device_name() if device == "cuda" else "cpu"


def write(found: dict, output: Path) -> None:
    """gpu.json and gpu.md."""
    (output / "gpu.json").write_text(json.dumps(found, indent=1) + "\n")
    rays = found["kernel"]
    sections = [
        f"# GPU\n\nDevice: {found['machine']['device']}.\n",
        "## Ray kernel\n",
        f"{rays['poses']} poses of a bone of 10 cm in one call, {rays['samples']} samples. Gathered: eight voxels a "
        "sample whether they are cached or not; the limit is the memory's bandwidth, measured by copying.\n",
        table(
            ["", "ms", "million samples / s", "GB / s", "of the limit"],
            [
                _kernel_line("image", rays, "image_seconds"),
                _kernel_line("image and moments", rays, "moments_seconds"),
            ],
        ),
    ]
    if found.get("parts"):
        voxels = " x ".join(str(n) for n in SHAPE[::-1])
        sections += [f"## Warp and soft tissue of a CT with 26 structures and {voxels} voxels\n"]
        sections += ["A derivative stays where it is computed; all else ends in the CPU's memory.\n"]
        sections += [table(*part_lines(found["parts"]))]
    if found.get("registrations"):
        head = ["case", "device", "exit", "s", "CPU s", "mean TRE mm", "worst mm", "MiB"]
        sections += ["## Whole registrations, 2 views over 30 degrees, loading and saving included\n"]
        sections += [table(head, [_case_line(row) for row in found["registrations"]])]
    sections.append(measured_on(found["machine"]))
    (output / "gpu.md").write_text("\n".join(sections) + "\n", encoding="utf-8")


def _kernel_line(name: str, rays: dict, key: str) -> list[str]:
    rate = rays["samples"] / rays[key]
    gathered, limit = rate * BYTES_PER_SAMPLE, rays["copied_bytes_per_second"]
    return [
        name,
        f"{1e3 * rays[key]:.2f}",
        f"{rate / 1e6:.0f}",
        f"{gathered / 1e9:.1f}",
        f"{gathered / limit:.0%}",
    ]


def _case_line(row: dict) -> list[str]:
    summary = row.get("summary", {})
    return [
        row["case"],
        row["device"],
        str(row["exit_status"]),
        f"{row['wall_seconds']:.1f}",
        f"{row['cpu_seconds']:.0f}",
        *(f"{summary[key]:.2f}" if key in summary else "-" for key in ("mean_tre_mm", "worst_tre_mm")),
        f"{row['peak_memory_mib']:.0f}",
    ]


if __name__ == "__main__":
    sys.exit(main())
