#!/usr/bin/env bash
# Formats all C++ files of the tree as .clang-format says; with --check it changes nothing and names those that differ.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# Other versions break lines in other places.
formatter=$(command -v clang-format-14 || command -v clang-format || true)
if [[ -z $formatter ]] || ! "$formatter" --version | grep -q ' 14\.'; then
  echo "weft: clang-format 14 is missing (deploy/install-packages.sh)" >&2
  exit 2
fi
list() {
  find . -path ./build -prune -o -path './.*' -prune -o -name '*.cpp' -print0 -o -name '*.h' -print0
}
if [[ ${1:-} != --check ]]; then
  list | xargs -0 "$formatter" -i
  exit 0
fi
if ! list | xargs -0 "$formatter" --dry-run -Werror; then
  echo "weft: these files are not formatted; deploy/format.sh does it" >&2
  exit 1
fi
