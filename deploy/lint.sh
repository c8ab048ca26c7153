#!/usr/bin/env bash
# Runs clang-tidy (.clang-tidy) on the C++ files that differ from a base, headers by way of the sources of their name.
# Usage: deploy/lint.sh [BASE]     BASE: a commit or branch, main when not given (origin/main on main itself)
# Needs clang-tidy and a configured build/dev.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
if ! command -v clang-tidy > /dev/null; then
  echo "weft: clang-tidy is missing (apt-get install clang-tidy)" >&2
  exit 2
fi
if [[ ! -e build/dev/compile_commands.json ]]; then
  echo "weft: build/dev is missing; run cmake --preset dev && cmake --build --preset dev" >&2
  exit 2
fi
base=${1:-main}
if [[ $# == 0 && $(git rev-parse "$base") == $(git rev-parse HEAD) ]]; then
  base=$(git rev-parse --verify --quiet origin/main || git rev-parse HEAD~1)
fi
mapfile -t sources < <(git diff --name-only --diff-filter=AMR "$(git merge-base "$base" HEAD)" -- '*.cpp' '*.h' |
  sed 's/\.h$/.cpp/' | sort -u | while read -r file; do [[ ! -e $file ]] || echo "$file"; done)
if ((${#sources[@]} == 0)); then
  echo "no C++ file differs from $base"
  exit 0
fi
echo "clang-tidy on ${#sources[@]} files that differ from $base"
printf '%s\0' "${sources[@]}" | xargs -0 -n 4 -P "$(nproc)" clang-tidy -p build/dev --quiet --warnings-as-errors='*'
