#!/usr/bin/env bash
# Installs the Debian packages of packages.txt that this machine lacks. Needs root or sudo only if one is missing.
#
# Usage: deploy/install-packages.sh [--with-pcl] [--with-slurm] [--with-console] [--with-fuzz]
#   --with-pcl    those of packages-pcl.txt as well, for PCD files
#   --with-slurm  those of packages-slurm.txt as well, for clusters of virtual nodes (deploy/slurm/cluster.sh)
#   --with-console  those of packages-console.txt as well, for the console's pages; a Node that is there with its npm is kept
#   --with-fuzz   those of packages-fuzz.txt as well: clang, whose libFuzzer runs the fuzz targets
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

lists=("$here/packages.txt")
for option in "$@"; do
  case $option in
    --with-pcl | --with-slurm | --with-console | --with-fuzz) lists+=("$here/packages-${option#--with-}.txt") ;;
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

# A fresh Debian often updates itself. apt's own option waits for the lock of dpkg, not for that of the lists.
apt() {
  local deadline=$((SECONDS + ${WEFT_APT_PATIENCE_S:-900})) told=
  until "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive LC_ALL=C apt-get -o DPkg::Lock::Timeout=60 "$@" > "$log" 2>&1; do
    if ! grep -qE 'Could not get lock|Unable to (acquire|lock)|is held by process' "$log" || ((SECONDS > deadline)); then
      tail -n 20 "$log" >&2
      echo "weft: apt-get failed; its last lines stand above" >&2
      exit 1
    fi
    [[ -n $told ]] || echo "Another program installs packages; waiting until it is through"
    told=1
    sleep 3
  done
}
apt update -q
apt install -y -q --no-install-recommends "${missing[@]}"
