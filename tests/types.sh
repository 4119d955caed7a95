#!/usr/bin/env bash
# Types against what each locked Python brings: NumPy and others describe their own types, differently by version.
#   bash tests/types.sh [3.11 3.12 ...]     all locked Pythons by default
# Needs this checkout's environment (mypy) and the package registry, none of those Pythons: only the descriptions are
# read. They are kept in .types, one folder a Python, until its lock changes.
set -u
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 1
if [ $# -eq 0 ]; then set -- $(cd jobs/locks && ls -d 3.*); fi
red=0
for version in "$@"; do
    lock=jobs/locks/$version/mpich,analysis.txt # what the package itself imports
    place=$PWD/.types/$version
    if ! cmp -s "$lock" "$place/lock.txt"; then
        rm -rf "$place"
        # an environment of the running Python whose packages are those of the other
        python -m venv --without-pip "$place" || exit 2
        packages=$("$place/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
        # The largest describe no types, so mypy reads nothing of them.
        awk -v untyped='^(llvmlite|mpich|numba|scikit-learn|scipy)==' '/^[a-z]/ { keep = $0 !~ untyped } keep' "$lock" >"$place/typed.txt"
        # nothing of it is ever run, so it may ask for another Python
        python -m pip -qq --disable-pip-version-check install --no-compile --no-deps --only-binary :all: --ignore-requires-python \
            --python-version "$version" --target "$packages" --require-hashes -r "$place/typed.txt" || exit 2
        cp "$lock" "$place/lock.txt"
    fi
    printf '%s: ' "Python $version"
    mypy --python-version "$version" --python-executable "$place/bin/python" --cache-dir "$place/cache" || red=1
done
exit "$red"
