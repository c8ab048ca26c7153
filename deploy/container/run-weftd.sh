#!/bin/sh
# What a container of weftd runs: as the user weft, in the place of this script, so that it gets the signals.
set -e
chown weft:weft /var/lib/weft /srv/weft
exec setpriv --reuid weft --regid weft --init-groups --inh-caps -all \
  /usr/bin/weftd --config /etc/weft/weftd.txtpb --log-level info "$@"
