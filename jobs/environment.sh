# Makes or reuses the virtual environment of this checkout: source it with the extras to install.
#   . jobs/environment.sh mpich,analysis
# PYTHON names another interpreter (3.11 or newer).

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
extras=$1
python=${PYTHON:-python3}
if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
    echo "Python 3.11 or newer is needed; set PYTHON=/path/to/python3.11" >&2
    exit 2
fi
if [ ! -x "$root/.venv/bin/python" ]; then
    echo "making $root/.venv"
    "$python" -m venv "$root/.venv"
fi
# Installed again only when the project's metadata or the extras changed.
stamp=$root/.venv/.installed-$extras
if ! cmp -s "$stamp" "$root/pyproject.toml"; then
    echo "installing hpcclear[$extras]; the first time takes a minute or two"
    "$root/.venv/bin/python" -m pip install --quiet --disable-pip-version-check -e "$root[$extras]"
    cp "$root/pyproject.toml" "$stamp"
fi
PATH=$root/.venv/bin:$PATH
export PATH
# One thread a rank: the ranks fill the cores.
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 NUMBA_NUM_THREADS=1
