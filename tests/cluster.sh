#!/bin/bash
# Jobs on several nodes of a cluster in a box: every trial of tests/test_cluster.py, ten minutes. Needs root and iproute2.
#   bash tests/cluster.sh
#   bash tests/cluster.sh -k cut
set -euo pipefail
cd "$(dirname "$0")/.."
python=${PYTHON:-.venv/bin/python}
[[ -x $python ]] || python=python3
exec "$python" -m pytest -q -rs tests/test_cluster.py "$@"
