#!/usr/bin/env bash
# Set-up and main job in one command, on a machine with Python 3.11+ and the package registry.
#
# The paper's study in small, on two MPI ranks: some 25 000 simulations of a slider-crank with two clearance joints (10
# revolutions each), sensitivities, a Kriging model, a robust swarm for two cases, and the designs it found verified by
# direct simulation. The first run also compiles the kernel. results/quickstart/ holds the NetCDF files, the figures and
# report.html. Interrupted? The same command goes on.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. jobs/environment.sh mpich,analysis "$@"
mkdir -p results
mpiexec -n "${RANKS:-2}" hpcclear run jobs/quickstart.toml -o results/quickstart
hpcclear plot results/quickstart/samples.nc --figure samples -o results/quickstart/samples.png
hpcclear report results/quickstart
