#!/usr/bin/env bash
# A job on a Slurm cluster, in one command: starts virtual nodes on this machine, renders a take, plans a job, registers
# the take on the cluster and once more without it, and compares the meshes byte by byte.
#
# Usage: deploy/slurm/quickstart.sh [OUT]      OUT defaults to weft-slurm-quickstart in the current folder
# WEFT_BUILD_DIR names a build tree to use instead of building one; WEFT_NODES the number of nodes (4). Needs root.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

step() { printf '\n== %s\n' "$*"; }

if [[ -z ${WEFT_QUICKSTART_OUT:-} ]]; then
  out=${1:-$PWD/weft-slurm-quickstart}
  mkdir -p "$out"
  build=${WEFT_BUILD_DIR:-}
  step "Packages and build"
  bash "$root/deploy/install-packages.sh" --with-slurm
  if [[ -z $build ]]; then
    (cd "$root" && cmake --preset release > /dev/null && cmake --build --preset release)
    build=$root/build/release
  fi
  out=$(cd "$out" && pwd) build=$(cd "$build" && pwd)
  step "A cluster of ${WEFT_NODES:-4} virtual nodes"
  WEFT_QUICKSTART_OUT=$out WEFT_BUILD_DIR=$build exec "$root/deploy/slurm/cluster.sh" --nodes "${WEFT_NODES:-4}" \
    bash "${BASH_SOURCE[0]}"
fi

# From here on: on the cluster.
out=$WEFT_QUICKSTART_OUT weft=$WEFT_BUILD_DIR/bin/weft
sinfo
rm -rf "$out/take" "$out/local" "$out/cluster" "$out/state" "$out/shared" "$out/weftd.address"

step "A synthetic take"
"$weft" simulate --preset tiny --frames 24 --out "$out/take"
inputs=("$out/take" --rig "$out/take/rig.json" --board "$out/take/board.json" --template "$out/take/template")

step "What the job will take"
"$weft" job plan "${inputs[@]}" --pilot 8 --cores "${WEFT_NODES:-4}" --compare 1 2

step "The daemon, which hands its tasks to Slurm"
"$WEFT_BUILD_DIR/bin/weftd" --listen 127.0.0.1:0 --address-file "$out/weftd.address" --state "$out/state" --allow-path "$out" \
  --slurm-folder "$out/shared" --slurm-frames-per-task 4 --slurm-memory-mib 1000 > "$out/weftd.log" 2>&1 &
daemon=$!
trap 'kill "$daemon" 2> /dev/null; wait 2> /dev/null || true' EXIT
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

step "The job, on the cluster"
job=$("$weft" register "${inputs[@]}" --out "$out/cluster" --server "$address" --detach)
sleep 2
squeue
"$weft" job watch "$job" --server "$address"
"$weft" job show "$job" --server "$address" | grep -E '^(tasks|logs)'

step "The same on this machine alone"
"$weft" register "${inputs[@]}" --out "$out/local" --quiet

step "Comparison of the meshes"
for mesh in "$out"/local/*/mesh.ply; do
  cmp "$mesh" "$out/cluster/${mesh#"$out/local/"}"
done
echo "$(find "$out/local" -name mesh.ply | wc -l) meshes are the same, byte by byte"
