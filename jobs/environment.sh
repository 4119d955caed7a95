# Makes or reuses the virtual environment of this checkout: source it with the extras to install.
#   . jobs/environment.sh mpich,analysis [--latest | --lowest]
# Without an option the versions are those of jobs/locks, which were tested together, in .venv. --latest (or
# VERSIONS=latest) takes the newest that pyproject.toml allows, in .venv-latest; --lowest the oldest, in .venv-lowest.
# PYTHON names another interpreter (3.11 or newer).

hpcclear_root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
hpcclear_versions=${VERSIONS:-locked}
for hpcclear_word in "${@:2}"; do
    case $hpcclear_word in
    --latest | --lowest) hpcclear_versions=${hpcclear_word#--} ;;
    esac
done
case $hpcclear_versions in
locked) hpcclear_venv=$hpcclear_root/.venv ;;
*) hpcclear_venv=$hpcclear_root/.venv-$hpcclear_versions ;;
esac
# In a process of its own: a failure must not end the shell that this file is sourced in.
bash "$hpcclear_root/jobs/locks/install.sh" "$hpcclear_versions" "$1" "$hpcclear_venv" || return
PATH=$hpcclear_venv/bin:$PATH
export PATH
# One thread a rank: the ranks fill the cores.
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 NUMBA_NUM_THREADS=1
unset hpcclear_root hpcclear_versions hpcclear_venv hpcclear_word
