"""Kills and removals while jobs run: whatever a job that says DONE holds equals the undisturbed run, byte by byte.

   WEFT_BIN=build/dev/bin python3 tests/system/job_campaign.py --log FILE [--begin N] [--count N] [--table]

Trials have fixed numbers: 0 to 99 kill daemon or worker when the last frame's report appears, 100 to 199 at a random
moment, 200 to 229 remove results midway. Each adds a line of JSON to the log, so a campaign can go on where it was
stopped; the closing table counts every trial of the log. The exit status is 1 when a job said DONE with other results.
"""

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from studio import BIN, processes_of, read, results, temporary_files, wait_for, weft, write

AIMED, RANDOM, REMOVED = "kill at the last report", "kill at random", "results removed"
TRIALS = [AIMED] * 100 + [RANDOM] * 100 + [REMOVED] * 30
FRAMES = 4
WORKERS = 2


def differing(found, expected):
    """Names of the files that are missing, too many, or have other bytes."""
    return sorted(name for name in expected.keys() | found.keys() if expected.get(name) != found.get(name))


class Studio:
    """A take, and a daemon that may be killed, in a folder."""

    def __init__(self, folder, take):
        self.folder, self.take = folder, take
        self.state, self.out = os.path.join(folder, "state"), os.path.join(folder, "out")
        self.frames = sorted(name for name in os.listdir(take) if name.isdigit())
        self.daemon = None
        self.address = ""

    def start_daemon(self, *more, workers=WORKERS, listen="127.0.0.1:0", env=None):
        address_file = os.path.join(self.folder, "address")
        if os.path.exists(address_file):
            os.remove(address_file)
        with open(os.path.join(self.folder, "weftd.log"), "a") as log:
            self.daemon = subprocess.Popen(
                [os.path.join(BIN, "weftd"), "--listen", listen, "--address-file", address_file, "--state", self.state,
                 "--allow-path", os.path.dirname(self.take), "--allow-path",
                 self.folder, "--workers", str(workers), "--threads-per-worker", "1", *more], stdout=log, stderr=log, env=env)

        def listening():
            if self.daemon.poll() is not None:
                raise AssertionError(read(os.path.join(self.folder, "weftd.log")))
            return os.path.exists(address_file) and read(address_file).strip()
        self.address = wait_for(listening, "weftd to listen")

    def register_arguments(self, *more, out=None):
        return ["register", self.take, "--rig", f"{self.take}/rig.json", "--board", f"{self.take}/board.json",
                "--template", f"{self.take}/template", "--out", out or self.out, "--observations", *more]

    def submit(self, *more, out=None):
        """Starts a job and returns its id."""
        return weft(*self.register_arguments("--server", self.address, "--detach", *more, out=out),
                    check=0).stdout.strip()

    def kill_daemon(self):
        self.daemon.kill()
        self.daemon.wait()
        wait_for(lambda: not processes_of(self.folder, "weft-worker"), "the workers to end with their daemon")

    def jobs(self):
        """The newest first."""
        return json.loads(weft("job", "list", "--server", self.address, "--json", check=0).stdout)["jobs"]

    def wait_for_end(self, job_id):
        def ended():
            # Asking costs a process, so ask when the daemon wrote what comes last.
            if not os.path.exists(os.path.join(self.out, "job.json")) and time.monotonic() < self.ask_at:
                return None
            self.ask_at = time.monotonic() + 2
            job = next(job for job in self.jobs() if job["id"] == job_id)
            return job if job["state"] in ("JOB_STATE_DONE", "JOB_STATE_FAILED", "JOB_STATE_CANCELLED") else None
        self.ask_at = time.monotonic() + 2
        return wait_for(ended, "the job to end", pause_s=0.1)

    def reported(self):
        """How many frames have a report."""
        return sum(os.path.exists(os.path.join(self.out, frame, "report.json")) for frame in self.frames)


def kill(studio, choice):
    """Kills the daemon, which then goes on, or a worker. Returns what was killed."""
    workers = processes_of(studio.folder, "weft-worker")
    if choice.random() < 0.5 and workers:
        try:
            os.kill(choice.choice(workers), signal.SIGKILL)
        except ProcessLookupError:
            return "nothing"
        return "worker"
    studio.kill_daemon()
    studio.start_daemon()
    return "daemon"


def remove(studio, choice):
    """Removes or damages some of the results. Returns what."""
    there = [frame for frame in studio.frames if os.path.isdir(os.path.join(studio.out, frame))]
    how = choice.choice(["all", "frame", "meshes", "file", "damage"])
    if how == "all" or not there:
        shutil.rmtree(studio.out, ignore_errors=True)
        return "the folder"
    if how == "frame":
        shutil.rmtree(os.path.join(studio.out, choice.choice(there)), ignore_errors=True)
        return "a frame"
    if how == "meshes":
        for frame in there:
            if os.path.exists(os.path.join(studio.out, frame, "mesh.ply")):
                os.remove(os.path.join(studio.out, frame, "mesh.ply"))
        return "all meshes"
    folder = os.path.join(studio.out, choice.choice(there))
    names = [name for name in os.listdir(folder) if name.endswith((".ply", ".csv", ".json"))]
    if not names:
        return "nothing"
    path = os.path.join(folder, choice.choice(names))
    try:
        if how == "file":
            os.remove(path)
            return "a file"
        content = bytearray(read(path, "rb"))
        content[len(content) // 2:] = content[len(content) // 2:][::-1]
        write(path, bytes(content))
        return "damage to a file"
    except FileNotFoundError:
        return "nothing"


def disturb(studio, kind, choice):
    """Waits for the moment, and does it. Moments go by how far the job is, since machines are not equally fast."""
    start = time.monotonic()
    if kind == AIMED:
        wait_for(lambda: studio.reported() == len(studio.frames), "the last report", pause_s=0.001)
        time.sleep(choice.uniform(0, 0.1))
        return kill(studio, choice)
    if kind == RANDOM:
        reports = choice.randrange(len(studio.frames) + 1)
        wait_for(lambda: processes_of(studio.folder, "weft-worker") and studio.reported() >= reports
                 or studio.reported() == len(studio.frames), "some reports", pause_s=0.001)
        time.sleep(choice.uniform(0, (time.monotonic() - start) / (reports + 1)))
        return kill(studio, choice)
    reports = choice.randrange(len(studio.frames))  # never all: the job still runs
    wait_for(lambda: studio.reported() >= reports, "some reports", pause_s=0.001)
    time.sleep(choice.uniform(0, 0.02))
    return remove(studio, choice)


def run_trial(number, kind, take, expected, keep=None):
    """One job, disturbed once. Returns a record."""
    choice = random.Random(number)
    with tempfile.TemporaryDirectory(prefix="weft-campaign-") as folder:
        studio = Studio(folder, take)
        start = time.monotonic()
        try:
            studio.start_daemon()
            job_id = studio.submit()
            what = disturb(studio, kind, choice)
            job = studio.wait_for_end(job_id)
            wrong = differing(results(studio.out), expected)
            left = [os.path.relpath(path, folder) for path in temporary_files(studio.out)]
        finally:
            if studio.daemon and studio.daemon.poll() is None:
                studio.kill_daemon()
        if wrong and keep:
            shutil.copytree(folder, os.path.join(keep, f"trial-{number}"), dirs_exist_ok=True)
        return {"trial": number, "kind": kind, "what": what, "state": job["state"].removeprefix("JOB_STATE_"),
                "frames": job["frames"]["done"], "wrong": wrong, "left": left, "message": job.get("message", ""),
                "seconds": round(time.monotonic() - start, 1)}


def undisturbed(take):
    """The results of a job that nobody disturbs, and how long it takes."""
    with tempfile.TemporaryDirectory(prefix="weft-campaign-") as folder:
        studio = Studio(folder, take)
        studio.start_daemon()
        try:
            start = time.monotonic()
            job = studio.wait_for_end(studio.submit())
            job_s = time.monotonic() - start
        finally:
            studio.kill_daemon()
        assert job["state"] == "JOB_STATE_DONE", job
        return results(studio.out), job_s


def make_take(folder, frames=FRAMES):
    take = os.path.join(folder, "take")
    weft("simulate", "--preset", "tiny", "--frames", frames, "--cameras", 6, "--width-px", 128, "--height-px", 170,
         "--out", take, check=0)
    return take


def closing_table(records):
    lines = [f"{'':24}{'trials':>8}{'DONE':>8}{'of them wrong':>16}{'not DONE':>10}{'files left':>12}"]
    for kind in (AIMED, RANDOM, REMOVED):
        own = [record for record in records if record["kind"] == kind]
        done = [record for record in own if record["state"] == "DONE"]
        lines.append(f"{kind:24}{len(own):8}{len(done):8}{sum(bool(r['wrong']) for r in done):16}"
                     f"{len(own) - len(done):10}{sum(bool(r['left']) for r in own):12}")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--log", required=True, help="file of records, one line of JSON per trial")
    parser.add_argument("--begin", type=int, default=0, help="number of the first trial")
    parser.add_argument("--count", type=int, default=len(TRIALS), help="how many trials from there")
    parser.add_argument("--keep", help="folder for what wrong trials leave")
    parser.add_argument("--table", action="store_true", help="only print the table of the log")
    options = parser.parse_args()
    records = [json.loads(line) for line in read(options.log).splitlines()] if os.path.exists(options.log) else []
    if not options.table:
        known = {record["trial"] for record in records}
        with tempfile.TemporaryDirectory(prefix="weft-campaign-take-") as folder:
            take = make_take(folder)
            expected, job_s = undisturbed(take)
            print(f"undisturbed: {len(expected)} files in {job_s:.1f} s", flush=True)
            for number in range(options.begin, min(options.begin + options.count, len(TRIALS))):
                if number in known:
                    continue
                record = run_trial(number, TRIALS[number], take, expected, options.keep)
                records.append(record)
                with open(options.log, "a") as log:
                    log.write(json.dumps(record) + "\n")
                print(f"{number:4} {record['kind']}: {record['what']}; {record['state']}, {len(record['wrong'])} files "
                      f"differ, {record['seconds']} s {record['message']}", flush=True)
    print(closing_table(records))
    return 1 if any(record["wrong"] for record in records if record["state"] == "DONE") else 0


if __name__ == "__main__":
    sys.exit(main())
