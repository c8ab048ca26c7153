#!/usr/bin/env bash
# Builds the fuzz targets for libFuzzer. One build at a time: a second one waits, and then has nothing to do.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
export CCACHE_DEPEND=1
mkdir -p build/fuzz
exec 9> build/fuzz/building.lock
flock 9
cmake --preset fuzz > /dev/null
exec cmake --build --preset fuzz
