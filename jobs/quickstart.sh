#!/usr/bin/env bash
# Set-up and main job in one command, on a machine with Python 3.11+ and the package registry.
#
# Simulates a Latin hypercube of slider-cranks with two clearance joints on two MPI ranks and shows what came
# out: results/quickstart/ holds the NetCDF files and figures. Interrupted? The same command goes on.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. jobs/environment.sh mpich,analysis
mkdir -p results/quickstart
mpiexec -n "${RANKS:-2}" hpcclear sample jobs/quickstart.toml -o results/quickstart/samples.nc
python analysis/plot_samples.py results/quickstart/samples.nc -o results/quickstart/samples.png
