#!/usr/bin/env bash
# Renews the tested versions: the newest that pyproject.toml allows, with the hashes of their files, for each Python;
# and the oldest that it allows, for the oldest Python. Then run the tests with them, and commit.
#   bash jobs/locks/renew.sh              all
#   bash jobs/locks/renew.sh --lowest     only the oldest: after a change of a lower bound
#   bash jobs/locks/renew.sh --keep       all, with the versions they have: after a package was added or removed
# Needs Python and pip; nothing but the lists is changed. Names no registry: pip's own settings say where from.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
pythons=(3.11 3.12 3.13 3.14)
lowest=${pythons[0]}
if [ "${1:-}" = --lowest ]; then pythons=(); fi
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
"${PYTHON:-python3}" -m venv "$place/venv"
"$place/venv/bin/python" -m pip --quiet --disable-pip-version-check install uv
if [ -n "${PIP_INDEX_URL:-}" ]; then
    export UV_DEFAULT_INDEX=$PIP_INDEX_URL
fi
# What builds the project is installed with it: its editable installation then needs no network.
"$place/venv/bin/python" - pyproject.toml >"$place/build-system.txt" 2>/dev/null <<'PYTHON' ||
import sys, tomllib
with open(sys.argv[1], "rb") as file:
    print("\n".join(tomllib.load(file)["build-system"]["requires"]))
PYTHON
    { echo "Python 3.11 or newer is needed" >&2 && exit 2; }
cp pyproject.toml "$place"
if [ "${1:-}" = --keep ]; then cp -r jobs/locks/3.* jobs/locks/lowest-* "$place"; fi

# Compiled in a folder of its own, so that the comments of the lists name no path: compile PYTHON TARGET OPTIONS...
compile() {
    local python=$1 target=$2
    shift 2
    mkdir -p "$place/$(dirname "$target")"
    (cd "$place" && venv/bin/uv pip compile --quiet --no-config --generate-hashes --only-binary :all: \
        --python-version "$python" --python-platform x86_64-manylinux_2_28 \
        --custom-compile-command "bash jobs/locks/renew.sh" "$@" -o "$target" pyproject.toml build-system.txt)
    echo "jobs/locks/$target: $(grep -c == "$place/$target") packages"
}
# What runs is a part of what is tested: same versions.
both() {
    local python=$1 folder=$2
    shift 2
    compile "$python" "$folder/test.txt" --extra test "$@"
    compile "$python" "$folder/mpich,analysis.txt" --extra mpich --extra analysis -c "$folder/test.txt" "$@"
}
for python in "${pythons[@]}"; do
    both "$python" "$python"
done
both "$lowest" "lowest-$lowest" --resolution lowest-direct

for folder in "${pythons[@]}" "lowest-$lowest"; do
    rm -rf "jobs/locks/$folder"
    mv "$place/$folder" jobs/locks/
done
