#!/usr/bin/env bash
# A tour of Weft without cameras, in about five minutes: calibrates a rig, films a garment, builds its template, registers
# the take and judges the result, all of it simulated. docs/tour.md explains the steps. Needs `weft` and nothing else.
#
# Usage: tour.sh [DIR]      DIR, new or empty, defaults to weft-tour in the current folder
# WEFT_TOUR_PRESET names another preset of `weft simulate` to film, e.g. tiny.
set -euo pipefail
examples=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/examples
out=${1:-weft-tour}
if ! command -v weft > /dev/null; then
  echo "weft: the program is not on the PATH; after a build it is in build/release/bin" >&2
  exit 1
fi
mkdir -p "$out"
if [[ -n $(ls -A "$out") ]]; then
  echo "weft: $out is not empty; name another folder for the tour" >&2
  exit 2
fi
cd "$out"

step() { printf '\n== %s\n' "$*"; }
run() {
  printf '$ %s\n' "$*"
  "$@"
}

step "A print for the fabric"
run weft pattern generate --rows 40 --cols 60 --cell-mm 3 --out board

step "Calibrated cameras"
run weft rig target --rows 4 --cols 3 --tag-mm 60 --out target
run weft rig rehearse --target target/target.json --cameras 6 --frames 48 --width-px 640 --height-px 480 --out boards
run weft rig calibrate boards --target target/target.json --out rig.json

step "A garment, filmed"
run weft simulate --preset "${WEFT_TOUR_PRESET:-quickstart}" --frames 3 --out studio
run weft take import studio --fps 30 --out take
run weft take info take

step "Its template, from the recording"
run weft template build take --rig studio/rig.json --board studio/board.json --openings 2 --out garment

step "Registration"
run weft register take --rig studio/rig.json --board studio/board.json --template garment --out result --observations

step "How good is it"
run weft evaluate result --truth studio/truth --quick --out evaluation

if command -v python3 > /dev/null; then
  step "The meshes in a program of your own"
  run python3 "$examples/read_mesh.py" result
fi

step "Done"
printf '%s\n' "pages to look at: $PWD/rig.report.html" "                  $PWD/garment/report.html" \
  "                  $PWD/result/report.html" "                  $PWD/evaluation/report.html"
