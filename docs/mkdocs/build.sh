#!/usr/bin/env bash
# The documentation as a site, warnings as errors: bash docs/mkdocs/build.sh [DIRECTORY]     (site by default)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
place=$(realpath -m "${1:-site}")
. jobs/environment.sh test
exec mkdocs build --strict -f docs/mkdocs/mkdocs.yml -d "$place"
