#!/usr/bin/env bash
# From a fresh Debian 12 machine to registered cloth: installs packages where they are missing, builds, and renders
# cloth in motion. Then it starts the daemon on loopback, opens a session with GigE cameras without hardware, records
# a take, and registers it while it is recorded. A second job registers the pictures as they were rendered, to compare
# its meshes with the truth that the simulator knows.
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
rm -rf "$out/take" "$out/live" "$out/result" "$out/evaluation" "$out/state"
"$weft" simulate --preset quickstart --out "$out/take"

step "The daemon"
rm -f "$out/weftd.address"
"$build/bin/weftd" --listen 127.0.0.1:0 --address-file "$out/weftd.address" --state "$out/state" \
  --allow-path "$out" > "$out/weftd.log" 2>&1 &
daemon=$! cameras=
trap 'kill $cameras "$daemon" 2> /dev/null; wait 2> /dev/null || true' EXIT
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

step "A session: 16 GigE cameras without hardware film the cloth again and again"
rm -f "$out/session.json"
"$weft" camera fake --address 127.0.7.1 --pictures "$out/take" --fps 2 --session "$out/session.json" > "$out/cameras.log" 2>&1 &
cameras=$!
until [[ -s $out/session.json ]]; do
  if ! kill -0 "$cameras" 2> /dev/null; then
    cat "$out/cameras.log" >&2
    exit 1
  fi
  sleep 0.1
done
lease=$("$weft" session open "$out/session.json" --rig "$out/take/rig.json" --board "$out/take/board.json" \
  --template "$out/take/template" --lease-s 600 --detach --server "$address")

# Its length is fixed: all of its sets are registered in the end, so a take that waited for a busy machine would
# only give it more to do.
step "A take: the daemon records, and every third frame set is registered at once"
take=$("$weft" take start --lease "$lease" --seconds 6 --server "$address")
"$weft" register "take:$take" --live 3 --out "$out/live" --server "$address"
"$weft" take list --server "$address"
"$weft" session close "$lease" --server "$address"

step "A job: registration of the pictures as they were rendered"
"$weft" register "$out/take" --rig "$out/take/rig.json" --board "$out/take/board.json" \
  --template "$out/take/template" --out "$out/result" --observations --server "$address"

step "Accuracy against ground truth"
"$weft" evaluate "$out/result" --truth "$out/take/truth" --quick --out "$out/evaluation"

step "Done"
echo "meshes  $out/live/<frame>/mesh.ply, $out/result/<frame>/mesh.ply"
echo "clouds  $out/live/<frame>/cloud.ply, $out/result/<frame>/cloud.ply"
echo "report  $out/live/report.html, $out/result/report.html"
