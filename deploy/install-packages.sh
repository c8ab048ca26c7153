#!/usr/bin/env bash
# Installs the Debian packages of packages.txt that this machine lacks. Needs root or sudo only if one is missing.
#
# Usage: deploy/install-packages.sh [--with-pcl] [--with-slurm] [--with-console]
#   --with-pcl    those of packages-pcl.txt as well, for PCD files
#   --with-slurm  those of packages-slurm.txt as well, for clusters of virtual nodes (deploy/slurm/cluster.sh)
#   --with-console  those of packages-console.txt as well, for the console's pages; a Node that is there with its npm is kept
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

lists=("$here/packages.txt")
for option in "$@"; do
  case $option in
    --with-pcl | --with-slurm | --with-console) lists+=("$here/packages-${option#--with-}.txt") ;;
    *) echo "weft: unknown option $option" >&2 && exit 2 ;;
  esac
done

missing=()
while read -r package; do
  [[ -z $package ]] && continue
  # NodeSource's package has an npm of its own and conflicts with Debian's.
  [[ $package == nodejs || $package == npm ]] && command -v npm > /dev/null && continue
  status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [[ $status == installed ]] || missing+=("$package")
done < <(cat "${lists[@]}")
if ((${#missing[@]} == 0)); then
  exit 0
fi

as_root=()
if [[ $(id -u) != 0 ]]; then
  if ! command -v sudo > /dev/null; then
    echo "weft: these packages are missing, and neither root nor sudo is at hand: ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi
echo "Installing ${#missing[@]} Debian packages (once, about 2 minutes)"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if ! { "${as_root[@]}" apt-get update -q &&
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"; } > "$log" 2>&1; then
  tail -n 20 "$log" >&2
  echo "weft: apt-get failed; its last lines stand above" >&2
  exit 1
fi
