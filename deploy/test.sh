#!/usr/bin/env bash
# Builds Weft and runs its tests; installs the Debian packages that are missing.
#
# Usage: deploy/test.sh [CTEST-ARGUMENT...]   the suite: unit, structure, fuzz and system tests; e.g. -L unit or -R Rig
#        deploy/test.sh --sanitize            its fast part under the address, undefined-behaviour and thread sanitizers
#        deploy/test.sh --long [NAME...]      what takes hours: crash campaigns, an hour of each fuzz target, endurance,
#                                             bare roots; names of steps run those alone; logs and a table are in build/long
# WEFT_PRESET=asan or tsan builds the suite with that preset instead of dev; gate takes half the time from nothing, since
# it compiles several files as one, and has the fuzz targets replay their corpora under libFuzzer, each two seconds more. WEFT_UNITY_BUILD=ON does that with every preset.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"

# Of what is not in ccache, dependencies tell what was included: no run of the preprocessor, 15 % of a compilation.
export CCACHE_DEPEND=1
# Some tests wait for cameras and clusters, and leave their core to another.
tests=$(($(nproc) + 1))

build() { # PRESET [TARGET...]
  local preset=$1
  shift
  cmake --preset "$preset" ${WEFT_UNITY_BUILD:+-DWEFT_UNITY_BUILD="$WEFT_UNITY_BUILD"} > /dev/null
  cmake --build --preset "$preset" ${1:+--target "$@"}
}

case ${1:-} in
  -h | --help)
    sed -n '2,/^set/{/^set/!s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"
    ;;
  --sanitize)
    bash deploy/install-packages.sh --with-pcl --with-slurm --with-console
    status=0
    for preset in asan tsan; do
      build "$preset" fast_tests
      ctest --preset "$preset" --parallel "$tests" --label-regex 'unit|fuzz' || status=1
    done
    exit $status
    ;;
  --long)
    shift
    bash deploy/install-packages.sh --with-pcl --with-slurm --with-console --with-fuzz
    build dev
    build fuzz
    exec python3 tests/long_tests.py "$@"
    ;;
  *)
    bash deploy/install-packages.sh --with-pcl --with-slurm --with-console
    preset=${WEFT_PRESET:-dev}
    build "$preset"
    if [[ $preset == gate ]]; then
      # Fuzz targets are built in what the tests leave of the processors; those that run them wait.
      bash deploy/install-packages.sh --with-fuzz
      chrt --idle 0 bash tests/fuzz/build.sh > build/fuzz.log 2>&1 &
      tests=$((tests + 1)) # one of them waits for that
    fi
    exec ctest --preset "$preset" --parallel "$tests" "$@"
    ;;
esac
