#!/usr/bin/env bash
# The paper's study on this machine: about N core-seconds of simulation (see `hpcclear check`), then surrogates and the
# optimisation on one core. Usage: bash jobs/run_mpi.sh [SCENE] [DIRECTORY]   (RANKS=4 for four ranks)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. jobs/environment.sh mpich,analysis
cores=$(env -u OMP_NUM_THREADS nproc) # with it, nproc answers 1
exec mpiexec -n "${RANKS:-$cores}" hpcclear run "${1:-jobs/robust_slider_crank.toml}" -o "${2:-results/robust_slider_crank}"
