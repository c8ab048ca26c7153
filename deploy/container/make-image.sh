#!/usr/bin/env bash
# Makes a container image of weftd from the Debian package. Needs root, debootstrap and the Debian mirror that this
# machine's apt uses; 1 GB of disk and some minutes.
#
# Usage: deploy/container/make-image.sh [--check] OUT.tar
#   --check   also runs weftd in the image's root, without a container engine, and asks it
# WEFT_DEB names a package to use instead of building one.
#
# Then: podman import --change 'ENTRYPOINT ["/usr/bin/run-weftd"]' OUT.tar weft
#       podman run --detach --volume weft-state:/var/lib/weft --volume /data:/srv/weft --publish 7411:7411 weft
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
source=$(cd "$here/../.." && pwd)
check=0
if [[ ${1:-} == --check ]]; then check=1; shift; fi
out=${1:?give the name of the image: make-image.sh [--check] OUT.tar}
if [[ $(id -u) != 0 ]] || ! command -v debootstrap > /dev/null; then
  echo "weft: needs root and debootstrap (apt-get install debootstrap)" >&2
  exit 2
fi
deb=${WEFT_DEB:-}
if [[ -z $deb ]]; then
  (cd "$source" && cmake --preset release > /dev/null && cmake --build --preset release --target package)
  deb=$(ls -t "$source"/build/release/weft_*.deb | head -n 1)
fi
root=$(mktemp -d --suffix=-weft-image)
trap 'rm -rf --one-file-system "$root" "$out.part"' EXIT

. /etc/os-release
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' "Codename: $VERSION_CODENAME" | head -n 1)
echo "== A bare root: $VERSION_CODENAME, minbase"
debootstrap --variant=minbase "$VERSION_CODENAME" "$root" "$mirror" > "$root.log" 2>&1 || { tail "$root.log"; exit 1; }
rm -f "$root.log"
chmod 755 "$root"
cp "$deb" "$root/tmp/weft.deb"
chroot "$root" env DEBIAN_FRONTEND=noninteractive sh -c '
  apt-get -q update && apt-get -q install -y --no-install-recommends /tmp/weft.deb ffmpeg > /tmp/apt.log 2>&1 || { tail /tmp/apt.log; exit 1; }
  id weft > /dev/null 2>&1 || useradd --system --home-dir /var/lib/weft --shell /usr/sbin/nologin --groups video weft
  mkdir -p /etc/weft /var/lib/weft /srv/weft
  [ -e /etc/weft/weftd.txtpb ] || cp /usr/share/weft/config/weftd.txtpb /etc/weft
  chmod 700 /var/lib/weft
  chown weft:weft /var/lib/weft /srv/weft
  apt-get -q clean; rm -rf /var/lib/apt/lists/* /tmp/* /var/log/*.log' > /dev/null
install -m 755 "$here/run-weftd.sh" "$root/usr/bin/run-weftd"
chroot "$root" weftd --config /etc/weft/weftd.txtpb --print-config > /dev/null

if ((check)); then
  echo "== weftd in it, with process ids and a network of its own"
  unshare --fork --pid --net --mount --kill-child bash -euc '
    root=$1
    ip link set lo up
    mount -t proc proc "$root/proc"
    chroot "$root" /usr/bin/run-weftd > "$root/var/lib/weftd.log" 2>&1 &
    for ((i = 0; i < 300; ++i)); do
      [[ -S $root/var/lib/weft/weftd.sock ]] && break
      sleep 0.1
    done
    chroot "$root" weft job list --server unix:/var/lib/weft/weftd.sock
    chroot "$root" weft doctor --no-cameras --disk-test-gib 0 | grep -E "daemon|program|state"
    chroot "$root" weft daemon drain --server unix:/var/lib/weft/weftd.sock
    wait %1' check "$root" || { tail "$root/var/lib/weftd.log" >&2; exit 1; }
  rm -rf "$root/var/lib/weftd.log" "$root"/var/lib/weft/*
fi

echo "== The image"
tar --numeric-owner --one-file-system -C "$root" -cf "$out.part" .
mv "$out.part" "$out"
ls -lh "$out"
