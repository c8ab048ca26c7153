"""Disks of a daemon that fill and are emptied, or report errors, while it records and registers.

Trials of take_campaign.py: each returns a studio, whose disk is well again, and what was wrong in words."""

import os
import random
import subprocess
import tempfile
import time

from live_studio import NAMESPACES
from studio import faulty_disk, wait_for, weft
from take_studio import TakeStudio

SMALL_MIB = 1280  # a recorder reserves 256 MiB a camera ahead
CALLS = ("write", "sync", "rename", "open", "fallocate", "truncate", "mkdir")
# Calls that a trial's program makes, about.
CALLS_OF = {"weft-recorder": 150, "weftd": 200, "weft-worker": 60}


def run(*command):
    return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True)


class FullDisk:
    """A tmpfs."""

    def __init__(self, folder):
        self.folder, self.filler = folder, os.path.join(folder, "filler")
        os.makedirs(folder, exist_ok=True)
        run("mount", "-t", "tmpfs", "-o", f"size={SMALL_MIB}m", "weft-test", folder)

    def fill(self):
        with open(self.filler, "wb", buffering=0) as file:
            try:
                while True:
                    file.write(bytes(1 << 16))
            except OSError:
                pass

    def empty(self):
        os.unlink(self.filler)

    def repair(self):
        """What an operator does before the daemon is started again."""

    def close(self):
        run("umount", "-l", self.folder)


class LoopDisk:
    """ext4 in a file of a tmpfs that fills: every write that needs a new block of the file fails, journal included."""

    def __init__(self, folder):
        self.below, self.folder = FullDisk(folder + "-below"), folder
        self.image = os.path.join(self.below.folder, "disk.img")
        with open(self.image, "wb") as file:
            file.truncate(2 * SMALL_MIB << 20)
        run("mkfs.ext4", "-q", "-E", "lazy_itable_init=0,lazy_journal_init=0", self.image)
        os.makedirs(folder, exist_ok=True)
        self.mount()

    def mount(self):
        run("mount", "-o", "loop", self.image, self.folder)

    def fill(self):
        self.below.fill()

    def empty(self):
        self.below.empty()

    def repair(self):
        run("umount", self.folder)
        done = subprocess.run(["e2fsck", "-p", self.image], check=False, capture_output=True, text=True)
        assert done.returncode < 4, done.stdout + done.stderr
        self.mount()

    def close(self):
        subprocess.run(["umount", self.folder], check=False)
        self.below.close()


def can_have_loops():
    """Only with root's own rights."""
    return os.path.exists("/dev/loop-control") and os.access("/dev/loop-control", os.W_OK) and subprocess.run(
        [*NAMESPACES[0], "true"], check=False, stderr=subprocess.DEVNULL).returncode == 0


def end_take(studio):
    """A take that ended by itself must say so; one that goes on is stopped."""
    if studio.shown().get("recorder_lives"):
        studio.stop_take()
    wait_for(lambda: not studio.shown().get("recorder_lives"), "the recorder to end", 0.2)
    studio.ended = studio.shown()["state"]


def faults_after(studio, scene):
    """What is wrong now that the disk is well again: with the take, its job, and the next take."""
    end_take(studio)
    faults = studio.faults_of_take(whole=False)
    if studio.job and studio.recorded():
        studio.retry_if_failed()
        faults += studio.faults_of_job(studio.job, studio.offline()) + studio.faults_of_replay()
    elif studio.job:
        weft("job", "cancel", studio.job, "--server", studio.address)
    scene.killed_at = time.monotonic()
    scene.wait_for_cameras()
    studio.start_next_take()
    studio.wait_for_sets(3)
    studio.stop_take()
    return faults + [f"the next take: {fault}" for fault in studio.faults_of_take(whole=True)]


def studio_on(disk, folder, scene):
    """State and results are on that disk, logs are not."""
    studio = TakeStudio(folder, scene.cameras)
    studio.state, studio.out = os.path.join(disk, "state"), os.path.join(disk, "out")
    return studio


def run_full(number, scene, disk_type):
    choice = random.Random(number)
    with tempfile.TemporaryDirectory(prefix="weft-take-disk-") as folder:
        disk = disk_type(os.path.join(folder, "disk"))
        studio = studio_on(os.path.join(folder, "disk"), folder, scene)
        try:
            studio.start_daemon()
            studio.start_take()
            studio.wait_for_sets(1)
            studio.follow(2)
            studio.wait_for_sets(choice.uniform(1, 12))
            disk.fill()
            studio.killed.append("disk")
            time.sleep(choice.uniform(0, 4))
            victim = choice.choice([None, None, "daemon", "recorder", "worker", "all"])
            if disk_type is LoopDisk:
                victim = "all"  # nobody may hold a disk that is taken out
            if victim:
                studio.kill(victim, choice)
            studio.acknowledged |= studio.recorded()
            restarts = victim in ("daemon", "all")
            if restarts and disk_type is FullDisk:
                studio.restart()  # while nothing can be written
                restarts = False
                time.sleep(choice.uniform(0, 2))
            disk.empty()
            disk.repair()
            if restarts:
                studio.restart()
            faults = faults_after(studio, scene)
        finally:
            left = studio.close()
            disk.close()
        return studio, faults + left


def run_faulty(number, scene):
    choice = random.Random(number)
    program = choice.choice(list(CALLS_OF))
    fault = {"WEFT_FAULT_PROGRAM": program, "WEFT_FAULT_CALLS": ",".join(choice.sample(CALLS, choice.randint(1, len(CALLS)))),
             "WEFT_FAULT_NTH": str(choice.randint(1, CALLS_OF[program])), "WEFT_FAULT_HOW": choice.choice(["error", "torn"]),
             "WEFT_FAULT_ERRNO": choice.choice(["5", "28"]), **({"WEFT_FAULT_ONWARDS": "1"} if choice.random() < 0.5 else {})}
    with tempfile.TemporaryDirectory(prefix="weft-take-disk-") as folder:
        studio = studio_on(os.path.join(folder, "disk"), folder, scene)
        studio.fault = fault
        try:
            # The daemon's first start is another test's.
            studio.start_daemon()
            studio.kill_daemon()
            studio.environment = {**os.environ, **faulty_disk(), "WEFT_FAULT_UNDER": os.path.dirname(studio.state), **fault}
            if not studio.try_to_record(choice.uniform(6, 12)):
                studio.environment = None
                studio.restart_after_error()
                scene.killed_at = time.monotonic()
                scene.wait_for_cameras()
                studio.try_to_record(6)
            else:
                studio.acknowledged |= studio.recorded()
                studio.environment = None
                studio.restart_after_error()
            faults = faults_after(studio, scene)
        finally:
            left = studio.close()
        return studio, faults + left
