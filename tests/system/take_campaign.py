"""Kills while four cameras are recorded and registered: what was acknowledged is there, exact, and jobs end as if nothing was.

   WEFT_BIN=build/dev/bin python3 tests/system/take_campaign.py --log FILE [--begin N] [--count N] [--table]

Trials have fixed numbers, and their moments follow from them. Each kills several times: daemon, recorder, a worker or all
at once, while a garment is filmed, while a take is replayed by the cameras, or while a job of 60 frames runs; or the disk
fills or fails. Each adds a line of JSON to the log, so a campaign can go on where it was stopped. The exit status is 1 when
a trial found a fault.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time

import job_campaign
from garment_cameras import FilmingCameras, make_garment
from live_studio import enter_network, set_up_network
from studio import processes_of, read, wait_for, weft
from take_disks import FullDisk, LoopDisk, can_have_loops, run_faulty, run_full
from take_studio import Commits, TakeStudio

FILM, REPLAY, JOB = "a take that films", "a take that replays", "a job of 60 frames"
FULL, LOOP, FAULTY = "a disk that fills", "ext4 on a full disk", "a disk with errors"
TRIALS = [FILM, REPLAY] * 25 + [JOB] * 10 + [FULL] * 10 + [LOOP] * 10 + [FAULTY] * 40 + [FILM, REPLAY] * 5 + [JOB] * 2
FPS = 5
SETS = 14  # of a take that is left alone, about
JOB_FRAMES = 60
JOB_KILLS = 9
HEARTBEAT_S = 3.2  # a camera belongs so long to a recorder that was killed


class Scene:
    """What all trials share: a garment, cameras that film it, cameras that replay a take, and the results of a job."""

    def __init__(self, folder):
        self.folder = folder
        self.garment = make_garment(folder, 8)
        self.cameras = None
        self.kind = None
        self.killed_at = 0.0
        self.replayed = os.path.join(folder, "replayed")
        self.job_take, self.expected = None, None

    def use(self, kind):
        """Cameras for this kind of trial."""
        kind = REPLAY if kind == REPLAY else FILM
        if self.kind == kind:
            return
        if self.cameras:
            self.cameras.close()
        if kind == REPLAY and not os.path.exists(self.replayed):
            cameras = FilmingCameras(self.folder, self.garment, self.garment, FPS)
            weft("take", "record", "--session", cameras.session, "--out", self.replayed, "--seconds", 2, "--no-disk-test",
                 check=0)
            cameras.close()
        self.cameras = FilmingCameras(self.folder, self.garment, self.replayed if kind == REPLAY else self.garment, FPS)
        self.kind = kind

    def wait_for_cameras(self):
        time.sleep(max(0, self.killed_at + HEARTBEAT_S - time.monotonic()))

    def use_job(self):
        if not self.job_take:
            self.job_take = make_garment(os.path.join(self.folder, "job"), JOB_FRAMES)
            self.expected, _ = job_campaign.undisturbed(self.job_take)

    def close(self):
        if self.cameras:
            self.cameras.close()


def kill_during_start(studio, choice):
    def disturb():
        time.sleep(choice.uniform(0, 0.06))
        studio.kill("daemon", choice)
        studio.restart()
    return disturb


def plan_of(choice):
    """(moment in frame sets, what to do), in order of time. The last kill may take the recorder."""
    plan = [(choice.uniform(0, SETS), choice.choice(["daemon", "worker"])) for _ in range(choice.choice([1, 2]))]
    last = choice.choice(["recorder", "all", "recorder", "all", None])
    if last:
        plan.append((choice.uniform(0.8, 1) * SETS if choice.random() < 0.7 else choice.uniform(0, SETS), last))
    return sorted([*plan, (1, "follow"), (SETS, "stop")], key=lambda step: step[0])


def carry_out(studio, plan, choice):
    """Until the take has ended. Returns whether its recorder was killed."""
    for moment, step in plan:
        studio.wait_for_sets(moment)
        if step == "follow":
            studio.follow(2)
        elif step == "stop":
            studio.stop_take()
        else:
            if step == "worker" and studio.job:
                wait_for(lambda: processes_of(studio.folder, "weft-worker") or not studio.recorder(), "a worker", 0.01)
            studio.kill(step, choice)
            if step in ("daemon", "all"):
                time.sleep(choice.choice([0, choice.uniform(0, 1)]))
                studio.restart()
        if step in ("recorder", "all", "stop"):
            return step != "stop"
    raise AssertionError("a plan without an end")


def run_take(number, kind, scene):
    choice = random.Random(number)
    scene.use(kind)
    scene.wait_for_cameras()
    with tempfile.TemporaryDirectory(prefix="weft-take-campaign-") as folder:
        studio = TakeStudio(folder, scene.cameras)
        faults = []
        try:
            studio.start_daemon()
            studio.start_take(kill_during_start(studio, choice) if choice.random() < 0.25 else lambda: None)
            dead = carry_out(studio, plan_of(choice), choice)
            if dead:
                scene.killed_at = time.monotonic()
            wait_for(lambda: not studio.shown().get("recorder_lives"), "the recorder to end", 0.1)
            expected = "RECORDER_PHASE_RECOVERED" if dead else "RECORDER_PHASE_ENDED"
            studio.ended = studio.shown()["state"]
            if studio.ended.get("phase") != expected:
                faults.append(f"the take is {studio.ended}, expected {expected}")
            faults += studio.faults_of_take(whole=not dead)
            if studio.job:
                faults += studio.faults_of_job(studio.job, studio.offline()) + studio.faults_of_replay()
        finally:
            left = studio.close()
        return studio, faults + left


def run_job(number, scene):
    choice = random.Random(number)
    scene.use_job()
    with tempfile.TemporaryDirectory(prefix="weft-take-campaign-") as folder:
        studio = TakeStudio(folder, argparse.Namespace(garment=scene.job_take))
        try:
            studio.start_daemon()
            job = studio.submit()
            studio.commits = Commits(studio.out)
            for moment in sorted(choice.sample(range(JOB_FRAMES), JOB_KILLS)):
                wait_for(lambda: processes_of(folder, "weft-worker") and studio.reported() >= moment
                         or studio.reported() == JOB_FRAMES, "some reports", pause_s=0.005)
                time.sleep(choice.uniform(0, 0.3))
                victim = choice.choice(["daemon", "worker", "all"])
                studio.kill(victim, choice)
                if victim != "worker":
                    studio.restart()
            faults = studio.faults_of_job(job, scene.expected)
        finally:
            left = studio.close()
        return studio, faults + left


def run_of_kind(number, kind, scene):
    if kind == JOB:
        return run_job(number, scene)
    if kind in (FILM, REPLAY):
        return run_take(number, kind, scene)
    scene.use(FILM)
    scene.wait_for_cameras()
    return run_faulty(number, scene) if kind == FAULTY else run_full(number, scene, LoopDisk if kind == LOOP else FullDisk)


def run_trial(number, kind, scene):
    """Returns a record."""
    begin = time.monotonic()
    record = {"trial": number, "kind": kind, "killed": [], "acknowledged": 0}
    try:
        studio, faults = run_of_kind(number, kind, scene)
        record |= {"killed": studio.killed, "acknowledged": studio.compared, "followed": bool(studio.job),
                   "fault": studio.fault, "retried": studio.retried, "wrong": faults,
                   "ended": f"{studio.ended.get('phase', '')}: {studio.ended.get('message', '')}"}
    except (AssertionError, subprocess.SubprocessError) as failed:
        scene.killed_at = time.monotonic()
        record["wrong"] = [str(failed)]
    return {**record, "seconds": round(time.monotonic() - begin, 1)}


def closing_table(records):
    lines = [f"{'':24}{'trials':>8}{'kills':>8}{'daemon':>8}{'recorder':>10}{'worker':>8}{'all':>6}{'with a fault':>14}"]
    for kind in dict.fromkeys(TRIALS):
        own = [record for record in records if record["kind"] == kind]
        kills = [victim for record in own for victim in record["killed"]]
        lines.append(f"{kind:24}{len(own):8}{len(kills):8}{kills.count('daemon'):8}{kills.count('recorder'):10}"
                     f"{kills.count('worker'):8}{kills.count('all'):6}{sum(bool(r['wrong']) for r in own):14}")
    lines.append(f"{sum(len(record['killed']) for record in records)} kills, "
                 f"{sum(record['acknowledged'] for record in records)} acknowledged sets compared")
    return "\n".join(lines)


def add_to_log(path, record):
    with open(path, "a", encoding="utf-8") as log:
        log.write(json.dumps(record) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--log", required=True, help="file of records, one line of JSON per trial")
    parser.add_argument("--begin", type=int, default=0, help="number of the first trial")
    parser.add_argument("--count", type=int, default=len(TRIALS), help="how many trials from there")
    parser.add_argument("--table", action="store_true", help="only print the table of the log")
    options = parser.parse_args()
    records = [json.loads(line) for line in read(options.log).splitlines()] if os.path.exists(options.log) else []
    if not options.table:
        set_up_network([])
        known = {record["trial"] for record in records}
        with tempfile.TemporaryDirectory(prefix="weft-scene-") as folder:
            scene = Scene(folder)
            try:
                for number in range(options.begin, min(options.begin + options.count, len(TRIALS))):
                    if number in known or (TRIALS[number] == LOOP and not can_have_loops()):
                        continue
                    records.append(run_trial(number, TRIALS[number], scene))
                    add_to_log(options.log, records[-1])
                    print(json.dumps(records[-1]), flush=True)
            finally:
                scene.close()
    print(closing_table(records))
    return 1 if any(record["wrong"] for record in records) else 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    enter_network()
    sys.exit(main())
