"""Kills, clocks, disks: nothing that a daemon acknowledged or finished is gone, but what its audit log named beforehand.

   WEFT_BIN=build/dev/bin WEFT_DISK_FAULTS=... WEFT_WRONG_CLOCK=... python3 tests/system/loss_campaign.py --log FILE
       [--begin N] [--count N] [--table]

One daemon has takes, jobs with results of its own, items, uploads that stopped midway, and operations, under rules that remove
things after minutes. Each trial adds one of them while something happens: trials 0 to 199 kill the daemon, 200 to 299 fail its
writes, 300 to 359 set its clock (forward or back, at the start or at run), 360 to 379 fill its disk. Then all that was
acknowledged is looked for, byte by byte. Each adds a line of JSON to the log; the exit status is 1 when something was gone
that no line of the audit log named.
"""

import argparse
import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time

from live_studio import enter_network
from studio import BIN, processes_of, read, wait_for, weft, write

KILL, FAULT, CLOCK, FULL = "kill", "disk fault", "clock", "full disk"
TRIALS = [KILL] * 200 + [FAULT] * 100 + [CLOCK] * 60 + [FULL] * 20
THINGS = ["take", "job", "item", "upload", "operation", "deleted take"]
DAY_S = 24 * 3600
# What ended 10 minutes ago goes; looks every 60 s at the most.
RULES = ["--keep-jobs-days", str(600 / DAY_S), "--keep-trash-days", str(600 / DAY_S), "--keep-uploads-days", str(600 / DAY_S),
         "--least-free-gib", "0.05", "--least-trash-hours", "0.05"]
PATIENCE_S = 60


def digest(path):
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def files_of(folder, endings):
    """Digests by name of what must not change."""
    found = {}
    for base, _, names in os.walk(folder):
        for name in names:
            if name.endswith(endings):
                found[os.path.relpath(os.path.join(base, name), folder)] = digest(os.path.join(base, name))
    return found


class Studio:
    def __init__(self, folder):
        self.folder = folder
        self.state, self.take = os.path.join(folder, "state"), os.path.join(folder, "take")
        self.clock, self.session = os.path.join(folder, "clock"), os.path.join(folder, "session.json")
        os.makedirs(self.state)
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=3g,mode=700", "tmpfs", self.state], check=True)
        weft("simulate", "--preset", "tiny", "--frames", 2, "--out", self.take, check=0)
        write(self.clock, "0")
        self.cameras = subprocess.Popen([os.path.join(BIN, "weft"), "camera", "fake", "--pictures", self.take, "--fps", "5",
                                         "--session", self.session], stdout=subprocess.PIPE, text=True)
        self.cameras.stdout.readline()
        write(self.session, json.dumps({**json.loads(read(self.session)), "max_wait_ms": 5000, "low_disk_gib": 0.001}))
        self.known = []  # kind, id, folder, files
        self.number = 0
        self.daemon = None

    def close(self):
        self.kill()
        for name in ("weft-recorder", "weft-worker"):
            for process in processes_of(self.folder, name):
                os.kill(process, signal.SIGKILL)
        self.cameras.kill()
        self.cameras.communicate()
        subprocess.run(["umount", "--lazy", self.state], check=False)

    def begin(self, **faults):
        """Whether it listens."""
        address = os.path.join(self.folder, "address")
        if os.path.exists(address):
            os.remove(address)
        preload = [os.environ["WEFT_WRONG_CLOCK"]] + ([os.environ["WEFT_DISK_FAULTS"]] if faults else [])
        with open(os.path.join(self.folder, "weftd.log"), "a") as log:
            self.daemon = subprocess.Popen(
                [os.path.join(BIN, "weftd"), "--listen", "127.0.0.1:0", "--address-file", address, "--state", self.state,
                 "--allow-path", self.folder, "--workers", "1", "--threads-per-worker", "1", *RULES], stdout=log, stderr=log,
                env={**os.environ, **faults, "LD_PRELOAD": ":".join(preload), "WEFT_CLOCK_FILE": self.clock})
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline and self.daemon.poll() is None:
            if os.path.exists(address) and read(address).strip():
                self.server = read(address).strip()
                return True
            time.sleep(0.02)
        return False

    def kill(self):
        if self.daemon is not None and self.daemon.poll() is None:
            self.daemon.kill()
            self.daemon.wait()

    def set_clock(self, days):
        write(self.clock + ".new", str(int(days * DAY_S)))
        os.replace(self.clock + ".new", self.clock)

    def try_weft(self, *words):
        """What it printed, or None where it failed: then nothing was acknowledged."""
        try:
            done = weft(*words, "--server", self.server, patience_s=PATIENCE_S)
        except subprocess.TimeoutExpired:
            return None
        return done.stdout if done.returncode == 0 else None

    def add(self, thing):
        """Makes one, and remembers what was acknowledged of it."""
        self.number += 1
        if thing == "item":
            path = os.path.join(self.folder, f"rig{self.number}.json")
            write(path, read(f"{self.take}/rig.json") + " " * self.number)
            if (said := self.try_weft("library", "upload", "rig", path, "--json")) is not None:
                item = json.loads(said)["id"]
                self.known.append(("item", item, os.path.join(self.state, "library/rig", item, "content"), {os.path.basename(path): digest(path)}))
        elif thing == "upload":
            # A client that is killed midway: what came is there, and goes on.
            path = os.path.join(self.folder, f"big{self.number}.json")
            write(path, read(f"{self.take}/rig.json") + " " * (8 << 20))
            client = subprocess.Popen([os.path.join(BIN, "weft"), "library", "upload", "rig", path, "--server", self.server],
                                      stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            uploads, begun = os.path.join(self.state, "uploads"), set()
            while client.poll() is None and not begun:
                begun = {upload for upload in (os.listdir(uploads) if os.path.isdir(uploads) else ())
                         if os.path.exists(os.path.join(uploads, upload, "upload.json"))} - {name for _, name, _, _ in self.known}
            client.kill()
            finished = client.wait() == 0
            os.remove(path)
            self.known += [] if finished else [("upload", upload, os.path.join(uploads, upload), None) for upload in begun]
        elif thing == "job":
            with tempfile.TemporaryDirectory() as elsewhere:
                done = self.try_weft("register", self.take, "--rig", f"{self.take}/rig.json", "--board", f"{self.take}/board.json",
                                     "--template", f"{self.take}/template", "--frames", "0000:0001", "--upload", "--json",
                                     "--out", f"{elsewhere}/result")
            if done is not None:
                job = json.loads(done)["id"]
                folder = os.path.join(self.state, "results", job)
                self.known.append(("job", job, folder, files_of(folder, (".ply", "report.json"))))
        elif thing in ("take", "deleted take"):
            if (said := self.try_weft("take", "start", "--session", self.session, "--no-disk-test", "--seconds", "1")) is None:
                return
            take = said.strip().splitlines()[-1]
            self.known.append(("take", take, os.path.join(self.state, "takes", take), None))
            time.sleep(2.5)
            if thing == "deleted take" and self.try_weft("take", "delete", take) is not None:
                self.known[-1] = ("take in the trash", take, os.path.join(self.state, "trash", take), None)
        elif thing == "operation":
            self.try_weft("take", "export", self.take, "--format", "images", "--out", os.path.join(self.folder, f"export{self.number}"))
            if (said := self.try_weft("operation", "list", "--json")) is not None:
                for operation in json.loads(said).get("operations", []):
                    if ("operation", operation["id"]) not in {one[:2] for one in self.known}:
                        self.known.append(("operation", operation["id"], os.path.join(self.state, "operations", operation["id"]), None))

    def listed(self):
        """All that the daemon knows, by its own words."""
        deadline = time.monotonic() + PATIENCE_S
        while True:
            jobs, takes = self.try_weft("job", "list", "--json", "--limit", "1000"), self.try_weft("take", "list", "--json", "--limit", "1000")
            if jobs is not None and takes is not None:
                return ({job["id"]: job for job in json.loads(jobs).get("jobs", [])},
                        {take["id"]: take for take in json.loads(takes).get("takes", [])})
            if time.monotonic() > deadline:
                raise AssertionError("the daemon answers no more")
            time.sleep(1)

    def named(self):
        """What the audit log says went: (kind, id)."""
        gone = set()
        for age in ("", ".1", ".2", ".3"):
            path = os.path.join(self.state, "audit.log" + age)
            for line in read(path).splitlines() if os.path.exists(path) else ():
                if '"Retention"' in line:
                    try:
                        entry = json.loads(line)
                    except ValueError:
                        continue
                    if entry.get("outcome") == "OK":
                        gone |= set(entry["about"].items())
        return gone

    def losses(self):
        jobs, takes = self.listed()
        gone, lost, left = self.named(), [], []
        for kind, name, folder, files in self.known:
            if (kind, name) in gone:
                continue  # by its rule, or it goes at this moment
            if kind in ("take", "take in the trash", "upload", "operation") and not os.path.exists(folder):
                if (kind, name) not in self.named():
                    lost.append(f"{kind} {name}")
            elif kind == "job" and name not in jobs and ("job", name) not in self.named():
                lost.append(f"job {name}")
            elif files is not None:
                for path, was in files.items():
                    whole = os.path.join(folder, path)
                    if not os.path.exists(whole) or digest(whole) != was:
                        if (kind, name) not in self.named():
                            lost.append(f"{kind} {name}: {path}")
            if kind == "take" and name in takes and int(takes[name].get("keeping", {}).get("deleted_unix_ns", 0)):
                lost.append(f"take {name} is marked as deleted")
            left.append((kind, name, folder, files))
        self.known = left
        return lost


def trial(studio, number):
    choice = random.Random(number)
    kind, thing = TRIALS[number], choice.choice(THINGS)
    how = ""
    if kind == KILL:
        assert studio.begin()
        how = f"{choice.uniform(0, 9 if thing == 'job' else 3):.2f} s"
        killer = subprocess.Popen([sys.executable, "-c", f"import os,time; time.sleep({how[:-2]}); os.kill({studio.daemon.pid}, 9)"])
        studio.add(thing)
        killer.wait()
        studio.daemon.wait()
    elif kind == FAULT:
        nth, errno, onwards = choice.randrange(1, 120), choice.choice([5, 28]), choice.random() < 0.3
        how = f"call {nth}, errno {errno}{', onwards' if onwards else ''}"
        faults = {"WEFT_FAULT_UNDER": studio.state, "WEFT_FAULT_PROGRAM": "weftd", "WEFT_FAULT_NTH": str(nth), "WEFT_FAULT_ERRNO": str(errno),
                  "WEFT_FAULT_CALLS": "write,sync,fallocate,truncate,rename,open,unlink,mkdir"}
        if onwards:
            faults["WEFT_FAULT_ONWARDS"] = "1"
        if studio.begin(**faults):
            studio.add(thing)
            time.sleep(1)
    elif kind == CLOCK:
        days, at_start = choice.choice([400, -400, 8, -8, 0.5, 40000]), choice.random() < 0.5
        how = f"{days:+g} days at {'the start' if at_start else 'run'}"
        if at_start:
            studio.set_clock(days)
        assert studio.begin()
        studio.add(thing)
        if not at_start:
            studio.set_clock(days)
            studio.add(choice.choice(THINGS))
        time.sleep(choice.uniform(2, 15))
    else:
        assert studio.begin()
        space = os.statvfs(studio.state)
        with open(os.path.join(studio.state, "junk"), "wb") as junk:
            free = space.f_bavail * space.f_frsize
            how = choice.choice(["full", "30 MiB left"])
            try:
                os.posix_fallocate(junk.fileno(), 0, max(1, free - ((30 << 20) if how != "full" else 1 << 20)))
                junk.seek(0, os.SEEK_END)
                while how == "full":
                    os.write(junk.fileno(), bytes(4096))
            except OSError:
                pass  # not a byte is left
        studio.add(thing)
        time.sleep(choice.uniform(2, 8))
        os.remove(os.path.join(studio.state, "junk"))
    studio.kill()
    studio.set_clock(0)
    assert studio.begin(), read(os.path.join(studio.folder, "weftd.log"))[-2000:]
    losses = studio.losses()
    studio.kill()
    return {"trial": number, "kind": kind, "thing": thing, "how": how, "known": len(studio.known), "lost": losses}


def table(log):
    records = [json.loads(line) for line in read(log).splitlines()]
    for kind in (KILL, FAULT, CLOCK, FULL):
        of_kind = [record for record in records if record["kind"] == kind]
        print(f"{kind:12} {len(of_kind):4} trials, {sum(bool(record['lost']) for record in of_kind)} with losses")
    return any(record["lost"] for record in records)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--log", required=True)
    parser.add_argument("--begin", type=int, default=0)
    parser.add_argument("--count", type=int, default=len(TRIALS))
    parser.add_argument("--table", action="store_true", help="only the table of the log")
    options = parser.parse_args()
    if not options.table:
        with tempfile.TemporaryDirectory(prefix="weft-losses-") as folder:
            studio = Studio(folder)
            try:
                for number in range(options.begin, min(options.begin + options.count, len(TRIALS))):
                    record = trial(studio, number)
                    with open(options.log, "a") as log:
                        log.write(json.dumps(record) + "\n")
                    print(record, flush=True)
            finally:
                studio.close()
    sys.exit(1 if table(options.log) else 0)


if __name__ == "__main__":
    enter_network()
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    main()
