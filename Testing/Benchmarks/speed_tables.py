"""The speed benchmark's tables in Markdown."""

from __future__ import annotations

from pathlib import Path

from speed_limits import ARITHMETIC, BYTES_PER_SAMPLE, LOADS


def write_tables(results: dict, path: Path) -> None:
    """Write every part that there are results of, and the machine."""
    parts = ["# Speed\n"]
    for name, write in WRITERS.items():
        if name in results:
            parts += write(results[name])
    parts += ["## Measured on\n", *(f"- {key}: {value}" for key, value in results["machine"].items()), ""]
    path.write_text("\n".join(parts))


def _table(head: list[str], rows: list[list[str]]) -> list[str]:
    return [
        "| " + " | ".join(head) + " |",
        "| " + " | ".join("---" for _ in head) + " |",
        *("| " + " | ".join(row) + " |" for row in rows),
        "",
    ]


def _projector(times: dict) -> list[str]:
    best = next(iter(times.values()))["median"]
    rows = [
        [name, f"{1e3 * t['median']:.1f}", f"{t['median'] / best:.1f}", f"{t['relative_l2']:.1e}"]
        for name, t in times.items()
    ]
    return [
        "## One rendering of the pelvis, samples 2 mm apart\n",
        *_table(["renderer", "ms", "times the first", "relative L2 to samples 0.25 mm apart"], rows),
    ]


def _iteration(found: dict) -> list[str]:
    times = found["times"]
    best = next(iter(times.values()))["median"]
    rows = [[name, f"{1e3 * t['median']:.0f}", f"{t['median'] / best:.2f}"] for name, t in times.items()]
    head = (
        "## One joint iteration: 2 views, 6 structures, voxels and steps of 2 mm, value and all derivatives\n"
    )
    note = f"{found['samples']} ray samples; the official method warps {found['voxels']} voxels."
    if "relative_l2" in found["agreement"]:
        note += f" Its renderings differ by {found['agreement']['relative_l2']:.1e} (relative L2)."
    return [head, *_table(["", "ms", "times the first"], rows), note + "\n"]


def _limits(found: dict) -> list[str]:
    rays, whole = found["rays"], found["whole"]
    seconds, samples = rays["seconds"], rays["samples"]
    limit = max(seconds[LOADS], seconds[ARITHMETIC])
    rows = [
        [
            name,
            f"{1e3 * each:.2f}",
            f"{samples / each / 1e6:.0f}",
            f"{8 * samples / each / 1e9:.2f}" if name != ARITHMETIC else "",
            f"{BYTES_PER_SAMPLE * samples / each / 1e9:.1f}" if name != ARITHMETIC else "",
            "" if name in (LOADS, ARITHMETIC) else f"{limit / each:.0%}",
        ]
        for name, each in seconds.items()
    ]
    total, inside = whole["seconds"], sum(whole["kernels"].values())
    saved = inside * (1 - limit / seconds["image"])
    shares = [
        [name, f"{each:.2f}", f"{each / total:.0%}"]
        for name, each in sorted(whole["kernels"].items(), key=lambda item: -item[1])
    ]
    return [
        "## The ray kernel against its limits\n",
        f"One image of {samples / 1e6:.1f} million samples through {rays['voxels'] / 1e6:.1f} million voxels. A kernel "
        "that loads a cell and interpolates in it at every sample cannot pass the slower of the last two lines. "
        f"Copying moves {rays['copied_bytes_per_second'] / 1e9:.1f} GB/s. Measured on {found['measured']['date']} with "
        f"{found['measured']['threads']} threads.\n",
        *_table(["", "ms", "million samples / s", "billion loads / s", "GB / s", "of the limit"], rows),
        f"A registration of the pelvis in a process that has compiled and loaded everything takes {total:.1f} s, "
        f"{inside:.1f} s of it inside ray kernels; with all at the limit it would take {total - saved:.1f} s.\n",
        *_table(["kernel", "s", "of the registration"], shares),
    ]


def _registration(rows: dict) -> list[str]:
    lines = []
    first = next(iter(rows.values()))
    for preset, row in rows.items():
        summary = row.get("summary", {})
        lines.append(
            [
                preset,
                f"{row['wall_seconds']:.1f}",
                f"{row['wall_seconds'] / first['wall_seconds']:.1f}",
                f"{row['cpu_seconds']:.1f}",
                f"{row['peak_memory_mib']:.0f}",
                f"{summary['mean_tre_mm']:.2f}" if summary else f"failed ({row['exit_status']})",
                f"{summary['worst_tre_mm']:.2f}" if summary else "",
            ]
        )
    head = ["preset", "seconds", "times the first", "CPU s", "peak MiB", "mean TRE mm", "worst TRE mm"]
    return [
        "## Whole registrations of the simulated pelvis, 2 views 30 degrees apart\n",
        "Whole processes, loading and saving included. paper/torch: the same method without the fused kernels.\n",
        *_table(head, lines),
    ]


def _scaling(found: dict) -> list[str]:
    rows = [
        [
            row["factor"],
            *(str(row[name]) for name in ("views", "pixels", "structures", "voxels")),
            f"{1e3 * row['paper']:.0f}",
            f"{1e3 * row['default']:.0f}",
        ]
        for row in found["rows"]
    ]
    fits = [
        [factor, f"{fit['paper']:.2f}", f"{fit['default']:.2f}"] for factor, fit in found["exponents"].items()
    ]
    return [
        "## One iteration against the size of the problem (phantom of 320 mm, steps of 2 mm)\n",
        "Pixels and voxels are counted along one side. The default averages X-rays to pixels of the level, 2 mm here: "
        "finer ones do not cost it more.\n",
        *_table(["varied", "views", "pixels", "structures", "voxels", "paper ms", "default ms"], rows),
        "Fitted exponents:\n",
        *_table(["", "paper", "default"], fits),
    ]


def _memory(found: dict) -> list[str]:
    shape = " x ".join(str(n) for n in reversed(found["shape"]))
    return [
        "## Memory\n",
        f"The paper's iteration, {found['structures']} structures on a CT of {shape}, 2 views of 200 x 200: peak "
        f"{found['peak_mib']:.0f} MiB, {found['seconds']:.1f} s an iteration.\n",
    ]


WRITERS = {
    "projector": _projector,
    "iteration": _iteration,
    "limits": _limits,
    "registration": _registration,
    "scaling": _scaling,
    "memory": _memory,
}
