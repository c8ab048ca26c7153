"""Many clients that behave well beside hostile ones of every kind at once, and beside processes that burn as much.

   WEFT_BIN=build/dev/bin python3 tests/system/hostile_crowd.py [--clients 200] [--seconds 300] [--per-s 100]

Three loads of client_load, one after the other: a quiet one, one beside a process of each attack of attackers.py, and one beside
unrelated processes. These burn the time of the processors that the attackers took, with their priority, and what the daemon took
beyond the quiet load, with its priority. Prints a table. Exit status 1 when a call of a client failed, when the p99 beside the
attackers is beyond twice that beside unrelated processes, or when the daemon's memory is beyond 1 GiB. Needs root.
"""

import argparse
import multiprocessing
import os
import sys
import tempfile
import time

from attackers import ATTACKS, FIRST_STRANGER, Target, attack_as_stranger
from client_load import load, make_studio, row, start_echo, submit
from hostile_load import MOST_MIB, MOST_RATIO, burners, children_s
from studio import weft
from studio_load import processor_s

QUIET_S = 60
KINDS = (("GetJob", "daemon"), ("SubmitJob", "submit"), ("CancelJob", "cancel"), ("FetchResult, a mesh", "fetch"),
         ("WatchJob, to the first update", "first_update"))


class Crowd:
    def __init__(self, folder, options):
        self.folder, self.options = folder, options
        self.daemon, self.network, self.local, identity, self.strangers = make_studio(folder, options.clients)
        os.chmod(folder, 0o755)
        self.tokens = {role: weft("access", "token", f"attacker-{role}", "--role", role, "--state", identity[2], check=0).stdout.strip()
                       for role in ("viewer", "client")}
        self.done = submit(folder, self.local, ":0001", "done")
        weft("job", "watch", self.done, "--server", self.local, check=0)
        self.echo, self.echo_address = start_echo(folder, self.network, self.done, identity)
        self.watched = submit(folder, self.local, "0003:", "watched")

    def target(self):
        scene, lair = (os.path.join(self.folder, "data", name) for name in ("scene", "lair"))
        os.mkdir(lair)
        os.chmod(lair, 0o777)
        frame = sorted(name for name in os.listdir(scene) if name.isdigit())[0]
        return Target(self.local, self.network, self.tokens["viewer"], self.tokens["client"], self.done, frame, scene, lair, self.strangers)

    def load(self, seconds, beside=()):
        """What the clients found beside these processes; the cores that processes and daemon took; the daemon's memory."""
        own_s, theirs_s, began = processor_s(self.daemon.pid), children_s(), time.monotonic()
        for process in beside:
            process.start()
        found, memory = load(self.daemon, self.folder, self.network, self.echo_address, self.options.clients, seconds, self.watched,
                             self.done, self.options.per_s)
        own, lasted = processor_s(self.daemon.pid) - own_s, time.monotonic() - began
        clients = found["client_cpu_cores"] * lasted if found else 0
        for process in beside:
            process.terminate()
            process.join()
        return found, (children_s() - theirs_s - clients) / lasted, own / lasted, max(most for _, most in memory)

    def stop(self):
        self.echo.stdin.close()
        self.echo.wait()
        self.daemon.terminate()
        self.daemon.wait()


def measure(crowd, seconds):
    """The three loads by name."""
    target, longest = crowd.target(), seconds + 60  # they are ended with the load
    loads = {"quiet": crowd.load(min(QUIET_S, seconds))}
    attackers = [multiprocessing.Process(target=attack_as_stranger, args=(name, user, target, longest))
                 for user, name in enumerate(ATTACKS, FIRST_STRANGER)]
    loads["attackers"] = crowd.load(seconds, attackers)
    _, theirs, own, _ = loads["attackers"]
    loads["processes"] = crowd.load(seconds, burners(max(0, theirs), True, longest) + burners(max(0, own - loads["quiet"][2]), False, longest))
    return loads


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clients", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=300)
    parser.add_argument("--per-s", type=float, default=100, help="calls a second of all clients together (default 100)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="weft-crowd-") as folder:
        crowd = Crowd(folder, options)
        try:
            loads = measure(crowd, options.seconds)
        finally:
            crowd.stop()
    failed = False
    print(f"{'':44} {'calls':>8} {'p50 ms':>9} {'p99 ms':>9} {'max ms':>9}")
    for name, (found, theirs, own, most_mib) in loads.items():
        if found is None:
            sys.exit(f"{name}: the clients ended")
        for kind, key in KINDS:
            print(row(f"{name}: {kind}", found[key]))
        print(f"{name}: cores: others {theirs:.2f}, weftd {own:.2f}; weftd at most {most_mib:.0f} MiB; failed calls {found['errors']}")
        failed |= bool(found["errors"]) or most_mib > MOST_MIB
    for kind, key in KINDS:
        ratio = loads["attackers"][0][key]["p99"] / loads["processes"][0][key]["p99"]
        print(f"p99 beside attackers to that beside processes, {kind}: {ratio:.2f}")
        failed |= ratio > MOST_RATIO
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
