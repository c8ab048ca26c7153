"""A daemon that records four cameras and registers while it records, and may be killed at any moment."""

import json
import os
import signal
import subprocess
import threading
import time

from job_campaign import Studio, differing
from live_studio import read_ledger
from studio import BIN, LONG_S, processes_of, results, temporary_files, wait_for, weft

# Its own network has this port for itself, so clients find the next daemon where the last one was.
ADDRESS = "127.0.0.1:7411"
OPEN_PHASES = ("RECORDER_PHASE_UNSPECIFIED", "RECORDER_PHASE_STARTING", "RECORDER_PHASE_RECORDING")


def left_over(folder):
    """Command lines of processes that name the folder."""
    found = []
    for name in os.listdir("/proc"):
        try:
            with open(f"/proc/{name}/cmdline", "rb") as file:
                words = file.read().decode(errors="replace").split("\0")
        except OSError:
            continue
        if any(folder in word for word in words):
            found.append(" ".join(words).strip())
    return found


class Commits:
    """Watches a job's folder for results that change after their frame was reported.

    Meshes are left out: the refinement over neighbours replaces them."""
    ONCE = ("cloud.ply", "observations.csv")

    def __init__(self, out):
        self.out, self.seen, self.over = out, {}, threading.Event()
        self.thread = threading.Thread(target=self.watch)
        self.thread.start()

    def watch(self):
        while not self.over.wait(0.03):
            self.look()

    def look(self):
        for frame in os.listdir(self.out) if os.path.isdir(self.out) else ():
            folder = os.path.join(self.out, frame)
            if frame not in self.seen and os.path.exists(os.path.join(folder, "report.json")):
                self.seen[frame] = self.identity(folder)

    def identity(self, folder):
        def of(name):
            try:
                info = os.stat(os.path.join(folder, name))
            except FileNotFoundError:
                return None
            return info.st_ino, info.st_mtime_ns
        return {name: of(name) for name in self.ONCE}

    def forget(self):
        """Frames that failed are registered again."""
        self.seen = {}

    def close(self):
        """Names of the files that were committed twice."""
        self.over.set()
        self.thread.join()
        return sorted(f"{frame}/{name}" for frame, then in self.seen.items()
                      for name, identity in self.identity(os.path.join(self.out, frame)).items() if identity != then[name])


class TakeStudio(Studio):
    def __init__(self, folder, cameras):
        super().__init__(folder, cameras.garment)
        self.cameras = cameras
        self.id, self.recording, self.job, self.commits = "", "", "", None
        self.acknowledged, self.killed, self.environment = set(), [], None
        self.fault, self.retried, self.ended = {}, "", {}
        self.compared = 0  # sets of which every byte was compared

    def start_daemon(self, *more, **options):
        super().start_daemon(*more, listen=ADDRESS, env=self.environment, **options)

    # Takes.
    def start_take_command(self):
        return [os.path.join(BIN, "weft"), "take", "start", "--session", self.cameras.session, "--no-disk-test",
                "--server", ADDRESS]

    def start_take(self, disturb=lambda: None):
        """`disturb` is called while the daemon answers. A client that was told of a failure looks and starts again."""
        starting = subprocess.Popen(self.start_take_command(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        disturb()
        said, errors = starting.communicate(timeout=LONG_S)
        if starting.returncode != 0 and not said.strip():  # one that was started is looked at, however it ended
            assert "no daemon answers" in errors, errors
            takes = self.takes()
            self.begun(takes[0]["id"] if takes else weft(*self.start_take_command()[1:], check=0).stdout.strip())
        else:
            self.begun(said.strip())

    def begun(self, take_id):
        self.id = take_id
        self.recording = os.path.join(self.state, "takes", take_id, "take")

    def takes(self):
        return json.loads(weft("take", "list", "--server", ADDRESS, "--json", check=0).stdout).get("takes", [])

    def shown(self):
        takes = self.takes()
        assert takes and takes[0]["id"] == self.id, f"the take {self.id} is not the newest: {takes}"
        return takes[0]

    def phase(self):
        return self.shown()["state"].get("phase", OPEN_PHASES[0])

    def recorded(self):
        return {number for event, number, *_ in read_ledger(self.recording) if event == "recorded"}

    def recorder(self):
        return processes_of(self.folder, "weft-recorder")

    def wait_for_sets(self, position):
        """Until so many sets are acknowledged, and that part of a period more."""
        wait_for(lambda: len(self.recorded()) >= int(position) or not self.recorder(), "frame sets")
        time.sleep(position % 1 / self.cameras.fps)

    def stop_take(self):
        weft("take", "stop", self.id, "--server", ADDRESS)
        wait_for(lambda: self.phase() not in OPEN_PHASES, "the take to be closed", 0.2)

    def follow_arguments(self, every):
        return ["register", f"take:{self.id}", *self.register_arguments()[2:], "--live", every, "--server", ADDRESS, "--detach"]

    def follow(self, every):
        """Starts a job that registers the take while it is recorded."""
        self.followed(weft(*self.follow_arguments(every), check=0).stdout.strip())

    def followed(self, job_id):
        self.job = job_id
        self.commits = Commits(self.out)

    # Kills.
    def kill(self, victim, choice):
        """Ends them at once: daemon, recorder, worker (one of them) or all. Notes whom it met."""
        workers, recorder = processes_of(self.folder, "weft-worker"), self.recorder()
        met = {"daemon": [self.daemon.pid], "recorder": recorder, "worker": choice.sample(workers, min(1, len(workers))),
               "all": [self.daemon.pid, *recorder, *workers]}[victim]
        choice.shuffle(met)
        for process in met:
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                continue
        if met:
            self.killed.append(victim)
        if victim in ("recorder", "all"):
            wait_for(lambda: not self.recorder(), "the recorder to end")
        # What stands in the ledger now was acknowledged, and must never go away.
        self.acknowledged |= self.recorded() if self.recording else set()
        if victim in ("daemon", "all"):
            self.kill_daemon()

    def restart(self):
        self.start_daemon()

    # Disks that fail.
    def try_to_record(self, sets):
        """Daemon, take and job on a disk that may fail at any step, which must be told. False: no take was started."""
        try:
            self.start_daemon()
        except AssertionError as failed:
            assert "error" in str(failed), failed
            return False
        starting = weft(*self.start_take_command()[1:])
        if starting.returncode != 0:
            assert "weft: error: " in starting.stderr, starting
            takes = self.takes() if self.daemon.poll() is None else []
            assert not any(take.get("recorder_lives") for take in takes), takes
            return False
        self.begun(starting.stdout.strip())
        wait_for(lambda: self.recorded() or not self.recorder(), "the first frame set")
        following = weft(*self.follow_arguments(2))
        if following.returncode == 0:
            self.followed(following.stdout.strip())
        else:
            assert "weft: error: " in following.stderr, following
        self.wait_for_sets(sets)
        return True

    def restart_after_error(self):
        """Recorders go on with the disk that they have."""
        if self.daemon.poll() is None:
            self.kill_daemon()
        self.start_daemon()

    def start_next_take(self):
        """After the first, which is remembered no more."""
        self.acknowledged = set()
        self.begun(weft(*self.start_take_command()[1:], check=0).stdout.strip())
        wait_for(self.recorded, "the first frame set of the next take")

    def retry_if_failed(self):
        """A job may fail for its disk, says why, and goes on when it is told to."""
        job = self.wait_for_end(self.job)
        if job["state"] == "JOB_STATE_FAILED" or self.lacking(job):
            assert job.get("message") or job["frames"].get("failed"), job
            self.retried = job.get("message", "") or str(job["frames"])
            self.commits.forget()
            weft("job", "retry", self.job, "--server", ADDRESS, check=0)
            # wait_for_end looks for this.
            if os.path.exists(os.path.join(self.out, "job.json")):
                os.unlink(os.path.join(self.out, "job.json"))

    # Checks: what is wrong, in words.
    def faults_of_take(self, whole, patience_s=LONG_S):
        """`whole`: the recorder was left alone, so no trigger may be missing."""
        if not os.path.exists(os.path.join(self.recording, "take.json")):
            return [f"sets {sorted(self.acknowledged)} are gone"] if self.acknowledged else []
        verified = weft("take", "verify", self.recording, patience_s=patience_s)
        faults = [] if verified.returncode == 0 else [f"verify: {verified.stdout}{verified.stderr}"]
        wrong, sets = self.cameras.faults_of(self.recording)
        faults += wrong
        ledger = read_ledger(self.recording)
        recorded = [number for event, number, *_ in ledger if event == "recorded"]
        if len(recorded) != len(set(recorded)):
            faults.append("a set is in the ledger twice")
        self.compared += len(recorded)
        lost = self.acknowledged - set(recorded)
        if lost:
            faults.append(f"acknowledged sets are not in the ledger: {sorted(lost)}")
        missing = {(line[1], line[3]) for line in ledger if line[0] == "missing"}
        for camera, there in sets.items():
            absent = {number for number in recorded if number not in there and (number, camera) not in missing}
            if absent:
                faults.append(f"{camera}: frames of recorded sets are gone: {sorted(absent)}")
        if whole and (recorded != list(range(len(recorded))) or missing or any(line[0] == "dropped" for line in ledger)):
            faults.append(f"sets are lost: {[line for line in ledger if line[0] != 'recorded']}")
        return faults

    def faults_of_replay(self):
        played = json.loads(weft("take", "replay", self.recording, "--fastest", "--json", check=0).stdout)
        sets = int(played.get("sets", 0))
        return [] if sets == len(self.recorded()) else [f"a replay has {sets} of {len(self.recorded())} sets"]

    def faults_of_job(self, job_id, expected):
        job = self.wait_for_end(job_id)
        faults = [] if job["state"] == "JOB_STATE_DONE" else [f"the job ended as {job['state']}: {job.get('message', '')}"]
        if self.lacking(job):
            faults.append(f"frames: {job['frames']}")
        faults += [f"differs from the undisturbed run: {name}" for name in differing(results(self.out), expected)]
        faults += [f"committed twice: {name}" for name in self.commits.close()]
        faults += [f"left behind: {os.path.relpath(path, self.out)}" for path in temporary_files(self.out)]
        return faults

    def lacking(self, job):
        """Frames without a mesh although their sets have all cameras; a recovery may bring back sets that lack some."""
        incomplete = {line[1] for line in read_ledger(self.recording) if line[0] == "missing"} if self.recording else ()
        return max(0, job["frames"].get("total", 0) - len(incomplete) - job["frames"].get("done", 0))

    def offline(self):
        """The results of a registration after the take."""
        out = os.path.join(self.folder, "offline")
        done = weft("register", self.recording, *self.register_arguments(out=out)[2:])
        assert done.returncode in (0, 1), done.stderr  # 1: frames of incomplete sets failed
        return results(out)

    def close(self):
        """Ends the daemon; returns what is left of it."""
        if self.daemon and self.daemon.poll() is None:
            self.kill_daemon()
        if self.commits:
            self.commits.close()
        left = left_over(self.folder)
        for process in self.recorder():
            os.kill(process, signal.SIGKILL)
        return [f"a process is left: {command}" for command in left]
