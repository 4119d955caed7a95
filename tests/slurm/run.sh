#!/usr/bin/env bash
# The job scripts on a real Slurm of this one machine: finished, out of time and requeued to the end, cancelled and
# resumed by hand. Five to ten minutes on two cores. Needs root and Debian's slurm-wlm and munge:
#     apt-get update && apt-get install -y slurm-wlm munge
#     bash tests/slurm/run.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
for program in slurmctld slurmd munged sbatch; do
    if ! command -v "$program" >/dev/null; then
        echo "Slurm suite: not run, $program is not installed (apt-get install slurm-wlm munge)"
        exit 0
    fi
done
if [ "$(id -u)" != 0 ]; then
    echo "Slurm suite: not run, it needs root to start the daemons"
    exit 0
fi
. jobs/environment.sh test
. tests/slurm/cluster.sh
folder=$(mktemp -d "${TMPDIR:-/tmp}/hpcclear-slurm-XXXXXX")
trap 'stop_cluster; rm -rf "$folder"' EXIT
start_cluster "$folder"
python tests/slurm/suite.py "$folder/results"
