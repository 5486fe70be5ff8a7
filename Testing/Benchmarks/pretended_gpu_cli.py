"""PolyPose's command line on a machine whose GPU is only pretended: what a GPU would compute, computed by the CPU.

    python Testing/Benchmarks/pretended_gpu_cli.py register case/study.json --output result --device cuda

Slow, since every call of torch is watched.
"""

from __future__ import annotations

import sys
from pathlib import Path

import torch

from PolyPoseLib.__main__ import main

sys.path.insert(0, str(Path(__file__).parents[1] / "Core"))
from support.pretended_gpu import PretendedGpu

if __name__ == "__main__":
    torch.cuda.is_available = lambda: True
    with PretendedGpu():
        sys.exit(main())
