#!/usr/bin/env bash
# Set-up and all checks; every step runs whatever became of the others, and one table ends it. Exit 1 if a test failed.
#   bash tests/run.sh           short profile: what a change must pass before it lands (.ci/run)
#   bash tests/run.sh --quick   for the loop while developing, under 3 minutes once the kernel is compiled
#   bash tests/run.sh --nightly short profile and tests marked nightly: blocks of the pages, examples, kills, fuzz, more parameters
#   bash tests/run.sh --full    everything, and the job scripts on a real Slurm where it is installed
#   bash tests/run.sh --strict  exit 1 for lint, format, types and layers too (.ci/run); --nightly and --full: types for every locked Python
# --latest and --lowest choose other versions (jobs/environment.sh). All other words go to pytest:
#   bash tests/run.sh tests/test_kriging.py -k nugget
set -u
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 1

profile=short
strict=
versions=()
words=()
for word in "$@"; do
    case $word in
    --quick | --nightly | --full) profile=${word#--} ;;
    --latest | --lowest) versions+=("$word") ;;
    --strict) strict=1 ;;
    *) words+=("$word") ;;
    esac
done

# Left out of --quick: they start mpiexec, other programs or a browser by the dozen, compile kernels of their own, or
# simulate for long. A file that is new is in.
long=(
    api checkpoint cli cluster comm dataset docs effects figures fuzz hard_cases hostile jacobian limits linkage_scenes
    motion native_windows notebook oracle plan progress random_scenes report robust sensitivity statistics
    stiff study survival target tight trust
)

rows=()
left=()
marks=
red=0
said=$(mktemp)
table() {
    printf '\n%-32s %-8s %s\n' step result time
    printf '%s\n' "${rows[@]}"
    [ -z "$marks" ] || echo "left out by this profile: tests marked $marks"
    if [ "${#left[@]}" -gt 0 ]; then
        echo "and ${#left[@]} of $(ls tests/test_*.py | wc -l) test files:"
        printf '%s\n' "${left[*]}" | fold -s -w 100 | sed 's/^/    /'
    fi
    if grep -q '^SKIPPED' "$said" 2>/dev/null; then
        echo "skipped, and why:"
        grep '^SKIPPED' "$said" | sed 's/^SKIPPED/   /'
    fi
    rm -f "$said"
}
row() { # name, code, seconds
    local result=ok
    if [ "$2" -ne 0 ]; then
        result=RED
        red=1
    fi
    rows+=("$(printf '%-32s %-8s %d:%02d' "$1" "$result" $(($3 / 60)) $(($3 % 60)))")
}
warning() { # name, command...: it says what a reader may improve, and changes no exit code
    local name=$1 start=$SECONDS result=ok
    shift
    printf '\n== %s\n' "$name"
    "$@" || result=warning
    rows+=("$(printf '%-32s %-8s %d:%02d' "$name" "$result" $(((SECONDS - start) / 60)) $(((SECONDS - start) % 60)))")
}
step() { # name, command...
    local name=$1 start=$SECONDS code=0
    shift
    printf '\n== %s\n' "$name"
    "$@" || code=$?
    row "$name" "$code" $((SECONDS - start))
}

# Sourced, as it changes PATH: whether it returns, exits or breaks off, the table says so.
trap 'row set-up 1 $SECONDS; table; echo "set-up failed: nothing was tested" >&2; exit 1' EXIT
set -e
. jobs/environment.sh test ${versions[@]+"${versions[@]}"}
set +e
trap - EXIT
# Programs are started by the hundred: what one of them has loaded is compiled for all.
unset PYTHONDONTWRITEBYTECODE
row set-up 0 $SECONDS

case $profile in
full) ;;
nightly) marks="full" ;;
quick) marks="full or nightly" left=("${long[@]}") ;;
short) if [ "${#words[@]}" -gt 0 ]; then marks="full"; else marks="full or nightly"; fi ;; # files that are named run
esac
choice=(${marks:+-m "not ($marks)"})
for name in ${left[@]+"${left[@]}"}; do choice+=("--ignore=tests/test_$name.py"); done
tests() { # what pytest says is kept, for the reasons of skips at the end
    python -m pytest "$@" | tee "$said"
    return "${PIPESTATUS[0]}"
}
ahead() {
    local code=0 other
    python tests/compile_ahead.py 1 & other=$!
    python tests/compile_ahead.py || code=1
    wait "$other" || code=1
    return "$code"
}
# Named files compile what they need.
if [ "${#words[@]}" -eq 0 ] && [ -f tests/compile_ahead.py ]; then step "compile" ahead; fi
# Three at a time on two cores: many tests wait for mpiexec, for a kill or for a stop. The limit is for what hangs, on a busy machine too.
step "tests, serial and under mpiexec" tests -q -ra --timeout 3600 -n 3 --dist loadfile --no-loadscope-reorder --durations=20 \
    ${choice[@]+"${choice[@]}"} ${words[@]+"${words[@]}"}
if [ "$profile" = full ]; then
    step "job scripts on Slurm" bash tests/slurm/run.sh
fi
# A user's result does not depend on these: newer libraries may describe their types in another way, and all runs well.
tested=$red
step lint ruff check .
step format ruff format --check .
# Older libraries describe their own types less well; what runs with them is what the tests say.
# Of what NumPy and others say of their types in other versions the nightly profile hears soon enough.
case "$profile ${versions[*]-} " in
*--lowest*) ;;
nightly* | full*) step "types, every locked Python" bash tests/types.sh ;;
*) step types mypy ;;
esac
step layers lint-imports
if [ -f docs/mkdocs/wording.py ]; then warning wording python docs/mkdocs/wording.py; fi
table
if [ -z "$strict" ] && [ "$tested" -ne "$red" ]; then
    echo "the tests pass; what is RED concerns developers only and does not change the exit code (--strict)"
fi
exit "$((strict ? red : tested))"
