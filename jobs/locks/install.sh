#!/usr/bin/env bash
# Brings a virtual environment of this checkout up to date; jobs/environment.sh calls it.
#   bash jobs/locks/install.sh locked|latest|lowest EXTRAS DIRECTORY
# Quiet when all is well. What keeps it from its work is one line, with pip's own words where they add something, and
# exit code 2.
set -u
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
versions=$1
extras=$2
venv=$3

give_up() {
    printf 'set-up: %s\n' "$1" >&2
    exit 2
}

# The one line for a failure: explain WHAT_WAS_DONE OUTPUT
explain() {
    local reported space="the environment needs 1.5 GB in ${venv%/*}, and as much in ${TMPDIR:-/tmp} while it is made"
    reported=$(printf '%s\n' "$2" | grep -m 1 -E 'ERROR|[Ee]rror:' | sed 's/^ERROR: //' | cut -c -300)
    case $2 in
    *"No space left on device"* | *"Disk quota exceeded"*) give_up "the disk is full: $space" ;;
    *"Permission denied"* | *"Read-only file system"*) give_up "$1 failed, the place is not writable: $reported" ;;
    *"DO NOT MATCH THE HASHES"*) give_up "the registry sent another file than was tested (jobs/locks):
$2" ;;
    *"Retrying ("* | *"Max retries exceeded"* | *"ConnectionError"*)
        give_up "the package registry cannot be reached; is there a network? (pip: $reported)"
        ;;
    *"from versions:"*)
        give_up "the package registry has not what is needed for Python $found (pip: $reported)"
        ;;
    *) give_up "$1 failed:
$2" ;;
    esac
}

case $versions in
locked | latest | lowest) ;;
*) give_up "VERSIONS is locked, latest or lowest, not $versions" ;;
esac

# -I: no file of the current directory is taken for a module.
version_of() { "$1" -I -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null; }
made=$(version_of "$venv/bin/python")
found=${made:-}
if [ -z "$made" ] || [ -n "${PYTHON:-}" ]; then
    python=${PYTHON:-python3}
    found=$(version_of "$python") || give_up "there is no $python; Python 3.11 or newer is needed, PYTHON names one"
    case $found in
    2.* | 3.? | 3.10)
        give_up "Python 3.11 or newer is needed, $python is $found; set PYTHON=/path/to/python3.11"
        ;;
    esac
    if [ -n "$made" ] && [ "$made" != "$found" ]; then
        give_up "$venv was made by Python $made, not $found; remove it first"
    fi
fi

lock=$root/jobs/locks/$found/$extras.txt
case $versions in
lowest)
    lock=$root/jobs/locks/lowest-$found/$extras.txt
    [ -f "$lock" ] || give_up "there is no list of lowest versions for Python $found ($extras): see jobs/locks"
    ;;
esac
if [ "$versions" = latest ]; then
    lock=
elif [ ! -f "$lock" ]; then
    echo "no versions were tested together for Python $found ($extras): taking the newest" >&2
    lock=
fi

# Installed again only when the place, the project's metadata or the lock changed; the newest are looked up every time.
stamp=$venv/.installed-$extras
wanted=$(printf '%s\n' "$root" "$found" && cat "$root/pyproject.toml" ${lock:+"$lock"})
if [ "$versions" != latest ] && [ -n "$made" ] && [ "$(cat "$stamp" 2>/dev/null)" = "$wanted" ]; then
    exit 0
fi

[ -w "$root" ] || give_up "$root is not writable: clone the repository where you may write"
exec 9<"$root" # two commands at once: the second waits here until the first has installed
if command -v flock >/dev/null; then flock 9; fi # macOS has none
clear=()
if [ -f "$venv/.place" ] && [ "$(cat "$venv/.place")" != "$root" ]; then
    clear=(--clear) # the checkout was moved or copied: programs in the environment name the old place
    made=
fi
if [ -z "$made" ]; then
    python=${PYTHON:-python3}
    "$python" -I -c 'import ensurepip, venv' 2>/dev/null ||
        give_up "$python comes without venv or ensurepip; on Debian and Ubuntu: apt-get install python3-venv"
    echo "making $venv"
    said=$("$python" -I -m venv "${clear[@]}" "$venv" 2>&1) || {
        rm -rf "$venv" # half an environment would be taken for a whole one
        explain "making $venv" "$said"
    }
    printf '%s\n' "$root" >"$venv/.place"
fi
pip() {
    # pip would compile every module of every package, which takes longer than all else; few of them are ever loaded
    said=$("$venv/bin/python" -I -m pip --quiet --disable-pip-version-check install --no-compile "$@" 2>&1) ||
        explain "installing hpcclear[$extras]" "$said"
}
echo "installing hpcclear[$extras] ($versions versions, Python $found); the first time takes a minute or two"
if [ -n "$lock" ]; then
    pip --require-hashes -r "$lock"
    pip --no-deps --no-build-isolation -e "$root"
else
    pip --upgrade --upgrade-strategy eager -e "${root}[$extras]"
fi
# Loading what commands load compiles it, once and for all ranks, and for those who may only read; what is wrong with it they say.
(cd "$root" && env -u PYTHONDONTWRITEBYTECODE "$venv/bin/python" -P -c "import hpcclear.study, hpcclear.report") >/dev/null 2>&1
printf '%s\n' "$wanted" >"$stamp" || give_up "$stamp cannot be written: is the disk full?"
