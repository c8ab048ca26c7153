#!/usr/bin/env bash
# From a fresh Debian 12 machine to registered cloth: installs packages where they are missing, builds, films a
# small synthetic take, starts the daemon on loopback, registers the take through gRPC, and compares the result
# with the truth that the simulator knows.
#
# Usage: deploy/quickstart.sh [OUT]      OUT defaults to weft-quickstart in the current folder
# WEFT_BUILD_DIR names a build tree to use instead of building one.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=${1:-$PWD/weft-quickstart}
mkdir -p "$out"
out=$(cd "$out" && pwd)

step() { printf '\n== %s\n' "$*"; }

build=${WEFT_BUILD_DIR:-}
if [[ -z $build ]]; then
  step "Packages and build"
  bash "$root/deploy/install-packages.sh"
  (cd "$root" && cmake --preset release > /dev/null && cmake --build --preset release)
  build=$root/build/release
fi
weft=$build/bin/weft

step "A synthetic take: cloth in motion in front of calibrated cameras"
rm -rf "$out/take" "$out/result" "$out/state"
"$weft" simulate --preset quickstart --out "$out/take"

step "The daemon"
rm -f "$out/weftd.address"
"$build/bin/weftd" --listen 127.0.0.1:0 --address-file "$out/weftd.address" --state "$out/state" \
  --allow-path "$out" > "$out/weftd.log" 2>&1 &
daemon=$!
trap 'kill "$daemon" 2> /dev/null; wait "$daemon" 2> /dev/null || true' EXIT
for _ in $(seq 100); do
  [[ -s $out/weftd.address ]] && break
  if ! kill -0 "$daemon" 2> /dev/null; then
    tail -n 20 "$out/weftd.log" >&2
    echo "weft: the daemon did not start; its log is $out/weftd.log" >&2
    exit 1
  fi
  sleep 0.1
done
address=$(cat "$out/weftd.address")
echo "weftd listens on $address, log in $out/weftd.log"

step "Registration of the take, through gRPC"
"$weft" register "$out/take" --rig "$out/take/rig.json" --board "$out/take/board.json" \
  --template "$out/take/template" --out "$out/result" --observations --server "$address"

step "Accuracy against ground truth"
"$weft" evaluate "$out/result" --truth "$out/take/truth" --quick --out "$out/evaluation"

step "Done"
echo "meshes  $out/result/<frame>/mesh.ply"
echo "clouds  $out/result/<frame>/cloud.ply"
echo "report  $out/result/report.html"
