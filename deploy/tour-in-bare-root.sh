#!/usr/bin/env bash
# Proves that the Debian package is enough: builds it, makes a bare Debian root, installs the package and nothing else
# there, and takes the tour as a user without privileges and without a network. Takes half an hour with the build, 1 GB
# of disk, and the Debian mirror that this machine's apt uses.
#
# Usage: deploy/tour-in-bare-root.sh [DIR]      DIR, new, defaults to a temporary folder that is removed at the end
# Needs root and debootstrap. WEFT_DEB names a package to use instead of building one.
set -euo pipefail
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
deb=${WEFT_DEB:-}
if [[ $(id -u) != 0 ]] || ! command -v debootstrap > /dev/null; then
  echo "weft: needs root and debootstrap (apt-get install debootstrap)" >&2
  exit 2
fi
if [[ -z $deb ]]; then
  (cd "$source" && cmake --preset release > /dev/null && cmake --build --preset release --target package)
  deb=$(ls -t "$source"/build/release/weft_*.deb | head -n 1)
fi
deb=$(realpath "$deb")
root=${1:-$(mktemp -d --suffix=-weft-root)}

keep=${1:-}
cleanup() {
  ! mountpoint -q "$root/proc" || umount "$root/proc"
  [[ -n $keep ]] || rm -rf --one-file-system "$root"
}
trap cleanup EXIT

. /etc/os-release
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' "Codename: $VERSION_CODENAME" | head -n 1)
echo "== A bare root: $VERSION_CODENAME, minbase"
debootstrap --variant=minbase "$VERSION_CODENAME" "$root" "$mirror" > "$root.log" 2>&1 || { tail "$root.log"; exit 1; }
rm -f "$root.log"
mount -t proc proc "$root/proc"
before=$(chroot "$root" dpkg-query -f '.\n' -W | wc -l)

echo "== The package: $(basename "$deb"), $(du -h "$deb" | cut -f 1)"
dpkg-deb --field "$deb" Package Version Depends Recommends
chmod 755 "$root"
cp "$deb" "$root/tmp/weft.deb"
chroot "$root" env DEBIAN_FRONTEND=noninteractive sh -c \
  'apt-get -q update && apt-get -q install -y --no-install-recommends /tmp/weft.deb' > "$root/tmp/apt.log" 2>&1 ||
  { tail -n 20 "$root/tmp/apt.log"; exit 1; }
after=$(chroot "$root" dpkg-query -f '.\n' -W | wc -l)
echo "$before packages before, $after after; $(du -shx "$root" | cut -f 1) in all"
chroot "$root" weft --version
chroot "$root" bash -c 'ls -l /usr/bin/weft* /usr/share/weft /usr/share/bash-completion/completions/weft \
  /usr/share/zsh/vendor-completions/_weft /usr/share/doc/weft/copyright'

echo "== The tour, as a user without a network"
chroot "$root" useradd --create-home visitor
SECONDS=0
unshare --net chroot --userspec=visitor:visitor "$root" \
  env -i HOME=/home/visitor PATH=/usr/bin:/bin LANG=C.UTF-8 /usr/share/weft/tour.sh /home/visitor/tour
echo "== The tour took $SECONDS s"
for page in rig.report.html garment/report.html result/report.html evaluation/report.html; do
  [[ -s $root/home/visitor/tour/$page ]] || { echo "weft: the tour wrote no $page" >&2; exit 1; }
done
