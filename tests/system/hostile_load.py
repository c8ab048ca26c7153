"""What hostile, broken and slow clients take from one that behaves well.

   WEFT_BIN=build/dev/bin python3 tests/system/hostile_load.py [--seconds 10] [ATTACK ...]

A client with a token asks a daemon for a job 100 times a second, and measures. Meanwhile processes of another user attack, one
kind after the other. After each attack unrelated processes burn the same time of the processors: that of the attackers with
their priority, that of the daemon with its workers and readers, beyond what it takes when all is quiet, with its priority.
Prints a line for each: the latency of the client that behaves well, the p99 beside the unrelated processes, the daemon's memory
and descriptors, and how many entries of the audit log name the attackers. Exit status 1 when a call of the client failed, its
p99 was beyond twice that beside unrelated processes, memory grew without bound or did not come back, or the audit log is
silent. Needs root, to be two users.
"""

import argparse
import json
import math
import multiprocessing
import os
import resource
import subprocess
import sys
import tempfile
import time

from attackers import ATTACKS, FIRST_STRANGER, SILENT, Target, attack_as_stranger
from client_load import resident_mib
from studio import BIN, read, wait_for, weft, write
from studio_load import processor_s

MOST_RATIO = 2
LEAST_P99_MS = 2.0  # below it p99 is the scheduler's noise
BURST_S = 0.02
MOST_MIB = 1024
MOST_LEFT_MIB, LEAVES_WITHIN_S = 50, 60  # beyond the start, when all are gone


def burn(share, idle, seconds):
    """Takes this share of a core, in bursts."""
    if idle:
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        began, spent_s = time.monotonic(), time.process_time()
        while time.process_time() - spent_s < share * BURST_S and time.monotonic() < until:
            pass
        time.sleep(max(0, began + BURST_S - time.monotonic()))


def burners(cores, idle, seconds):
    """Processes that burn so many cores together, as many as there are whole ones and one more."""
    count = math.ceil(cores)
    return [multiprocessing.Process(target=burn, args=(cores / count, idle, seconds)) for _ in range(count)]


def children_s():
    """Time of the processors that processes took which have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run_all(processes):
    for process in processes:
        process.start()
    for process in processes:
        process.join()


class Studio:
    def __init__(self, folder):
        self.folder = folder
        os.chmod(folder, 0o755)
        for name in ("data", "state"):
            os.mkdir(self.path(name))
        scene = self.path("data", "scene")
        weft("simulate", "--preset", "tiny", "--out", scene, check=0)
        tokens = {}
        for name, role in (("probe", "viewer"), ("attacker", "viewer"), ("attacker-2", "client")):
            tokens[name] = weft("access", "token", name, "--role", role, "--state", self.path("state"), check=0).stdout.strip()
            write(self.path(name), tokens[name])
        lair = self.path("data", "lair")
        os.mkdir(lair)
        os.chmod(lair, 0o777)
        os.mkdir(self.path("certificates"))
        made = subprocess.run([os.path.join(BIN, "make_certificates"), self.path("certificates")], capture_output=True, text=True, check=True)
        authority, certificate, key, revocations, *clients = made.stdout.split()
        for path in (authority, *clients):
            os.chmod(path, 0o644)
        self.daemon = subprocess.Popen(
            [os.path.join(BIN, "weftd"), "--listen", "127.0.0.1:0", "--listen", "0.0.0.0:0", "--tls-cert", certificate, "--tls-key", key,
             "--tls-client-ca", authority, "--tls-client-crl", revocations, "--address-file", self.path("address"),
             "--state", self.path("state"), "--allow-path", self.path("data"), "--workers", "1"],
            stdout=subprocess.DEVNULL, stderr=open(self.path("log"), "w"))
        self.address, network = wait_for(lambda: os.path.exists(self.path("address")) and read(self.path("address")).split(), "weftd to listen")
        done = weft("register", scene, "--rig", f"{scene}/rig.json", "--board", f"{scene}/board.json", "--template", f"{scene}/template",
                    "--server", self.address, "--detach", "--out", self.path("data", "out"), check=0)
        self.job = done.stdout.split()[0]
        weft("job", "watch", self.job, "--server", self.address, check=0)
        frame = sorted(name for name in os.listdir(scene) if name.isdigit())[0]
        self.target = Target(self.address, "127.0.0.1:" + network.rsplit(":", 1)[1], tokens["attacker"], tokens["attacker-2"], self.job, frame, scene,
                             lair, [authority, *clients[:6]])
        self.probe = subprocess.Popen([os.path.join(BIN, "probe"), self.address, self.job, "100"], text=True, stdin=subprocess.PIPE,
                                      stdout=subprocess.PIPE, env={**os.environ, "WEFT_TOKEN_FILE": self.path("probe")})

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def seen(self):
        self.probe.stdin.write("\n")
        self.probe.stdin.flush()
        return json.loads(self.probe.stdout.readline())

    def spent_s(self):
        """Time of the processors that the daemon and its workers and readers took."""
        return processor_s(self.daemon.pid, with_children=True)

    def audited(self, user):
        lines = weft("access", "log", "--state", self.path("state"), "--last", "100000", check=0).stdout.split("\n")
        return sum(1 for line in lines if f"user uid {user}" in line or "attacker" in line)

    def cancel_jobs(self):
        for job in json.loads(weft("job", "list", "--server", self.address, "--json", check=0).stdout)["jobs"]:
            if job["state"] in ("JOB_STATE_QUEUED", "JOB_STATE_RUNNING"):
                weft("job", "cancel", job["id"], "--server", self.address)

    def stop(self):
        self.probe.stdin.close()
        self.probe.wait()
        alive = self.daemon.poll() is None
        self.daemon.terminate()
        self.daemon.wait()
        return alive


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--attackers", type=int, default=2, help="processes of each kind")
    parser.add_argument("attacks", nargs="*", metavar="ATTACK", help=", ".join(ATTACKS))
    options = parser.parse_args()
    failures = []
    with tempfile.TemporaryDirectory(prefix="weft-hostile-") as folder:
        studio = Studio(folder)
        time.sleep(2)
        studio.seen()
        spent_s = studio.spent_s()
        time.sleep(options.seconds)
        quiet_s = studio.spent_s() - spent_s
        quiet, quiet_mib = studio.seen(), resident_mib(studio.daemon.pid)
        print(f"{'':18} {'calls':>6} {'p50 ms':>8} {'p99 ms':>8} {'max ms':>8} {'burn':>8} {'ratio':>6} {'cores':>6} {'failed':>6} {'MiB':>6} "
              f"{'open':>5} {'audited':>8}")

        def show(name, seen, beside, ratio, cores, audited):
            descriptors = len(os.listdir(f"/proc/{studio.daemon.pid}/fd"))
            print(f"{name:18} {seen['n']:6} {seen['p50']:8.2f} {seen['p99']:8.2f} {seen['max']:8.2f} {beside['p99']:8.2f} {ratio:6.2f} "
                  f"{cores:6.2f} {seen['failed']:6} {resident_mib(studio.daemon.pid):6.0f} {descriptors:5} {audited:8} {seen['reason']}",
                  flush=True)
        show("quiet", quiet, quiet, 1, 0, 0)
        for user, name in enumerate(options.attacks or ATTACKS, FIRST_STRANGER):
            before, spent_s, theirs_s = studio.audited(user), studio.spent_s(), children_s()
            studio.seen()
            run_all([multiprocessing.Process(target=attack_as_stranger, args=(name, user, studio.target, options.seconds))
                     for _ in range(options.attackers)])
            seen = studio.seen()
            theirs = (children_s() - theirs_s) / options.seconds
            own = max(0, studio.spent_s() - spent_s - quiet_s) / options.seconds
            studio.cancel_jobs()
            time.sleep(3)
            studio.seen()
            run_all(burners(theirs, True, options.seconds) + burners(own, False, options.seconds))
            beside = studio.seen()
            ratio = seen["p99"] / max(beside["p99"], LEAST_P99_MS)
            audited = studio.audited(user) - before
            show(name, seen, beside, ratio, theirs + own, audited)
            if seen["failed"] or ratio > MOST_RATIO or resident_mib(studio.daemon.pid) > MOST_MIB or (audited == 0 and name not in SILENT):
                failures.append(name)
        until = time.monotonic() + LEAVES_WITHIN_S
        while resident_mib(studio.daemon.pid) > quiet_mib + MOST_LEFT_MIB and time.monotonic() < until:
            time.sleep(1)
        print(f"the daemon: {quiet_mib:.0f} MiB at first, {resident_mib(studio.daemon.pid):.0f} at last")
        if resident_mib(studio.daemon.pid) > quiet_mib + MOST_LEFT_MIB:
            failures.append("memory stays")
        if not studio.stop():
            failures.append("the daemon ended")
    print("worse than allowed: " + ", ".join(failures) if failures else "all as it should be")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
