#!/usr/bin/env bash
# Set-up and all checks: lint, format, types, layer rules, serial tests, tests under mpiexec.
#   bash tests/run.sh          short profile, under 15 minutes on two cores
#   bash tests/run.sh --full   everything, and the job scripts on a real Slurm where it is installed
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. jobs/environment.sh test "$@"
marks=("-m" "not full")
if [ "${1:-}" = "--full" ]; then
    marks=()
fi
step() { printf '\n== %s\n' "$1"; }
step "lint and format"
ruff check .
ruff format --check .
step "types"
mypy
step "layers"
lint-imports
step "tests, serial and under mpiexec"
# Two files at a time: many tests wait for a compiler or for mpiexec.
python -m pytest -q --timeout 900 -n 2 --dist loadfile "${marks[@]}"
if [ "${1:-}" = "--full" ]; then
    step "job scripts on Slurm"
    bash tests/slurm/run.sh
fi
