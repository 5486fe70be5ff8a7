#!/bin/bash
# Everything that needs a GPU, in at most 8 minutes: the CUDA tests, the ray kernel against the card's memory, warp and
# soft tissue part by part, and whole registrations on the GPU and on the CPU. Writes results/gpu.json and results/gpu.md.
#
#   Testing/Benchmarks/gpu.sh [FOLDER OF WHEELS]
#
# Packages come from the wheels where a folder is given, and from what the machine has otherwise; nothing is downloaded
# then. torch must be a CUDA build.
set -euo pipefail
cd "$(dirname "$0")/../.."
export OMP_WAIT_POLICY=PASSIVE
if [ $# -gt 0 ]; then
    environment=$(mktemp -d)
    trap 'rm -rf "$environment"' EXIT
    python3 -m venv --system-site-packages "$environment"
    export PATH=$environment/bin:$PATH
    python3 -m pip install --quiet --no-index --find-links "$1" -e ".[test]"
fi
export PYTHONPATH=$PWD${PYTHONPATH:+:$PYTHONPATH}
python3 -c 'import sys, torch; sys.exit(None if torch.cuda.is_available() else "gpu.sh: torch finds no CUDA device: run it on a machine with an NVIDIA GPU and a CUDA build of torch.")'
timeout 90 python3 -m pytest -q -p no:xdist -k "cuda" \
    Testing/Core/registration/fit/test_device_problem.py Testing/Core/registration/fit/test_device_soft_tissue.py \
    Testing/Core/warp/test_torch_warp.py ||
    echo "gpu.sh: CUDA tests failed or ran out of time; going on." >&2
timeout 380 python3 Testing/Benchmarks/gpu.py --device cuda
