#!/usr/bin/env python3
"""What Slurm costs beside the local pool, and how far `weft job plan` is off: on a cluster of virtual nodes, as root.

Usage: WEFT_BIN=build/dev/bin WEFT_SOURCE=. python3 tests/system/slurm_load.py [--takes DIR] [--only-prepare] [overhead] [plan]

overhead   One take by the local pool on two cores, then by Slurm on two nodes of one core each, in tasks of half a minute.
           Prints both wall times; the goal is 1.08 for their ratio. Half an hour on two cores.
plan       A pilot of 20 frames of one take, on a node of the cluster; the plan for other takes, of other boards, rigs and
           motions, on 1, 2 and 4 nodes; and what these took. The goal is 20 %. A quarter of an hour.

The nodes of `plan` are cores of which the kernel gives a share (cluster.sh --cpu-percent), so four fit on two cores and leave
room for the daemon; the share is known to the planner as --core-speed. Takes are rendered before, and kept with --takes.
The exit status is 1 when results differ in a byte, between the pool and Slurm or between numbers of nodes.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time

from job_campaign import Studio, differing
from slurm_cluster import CLUSTER, why_no_cluster
from studio import BIN, results, wait_for, weft

NODE_PERCENT = 45  # of a core
ENDED = ("JOB_STATE_DONE", "JOB_STATE_FAILED", "JOB_STATE_CANCELLED")
SMALL = ["--preset", "tiny", "--cameras", 12, "--width-px", 256, "--height-px", 340]
# Takes are shown forwards and backwards until they have enough frames.
TAKES = {"overhead": {"large": ["--preset", "quickstart", "--frames", 36]},
         "plan": {"pilot": [*SMALL, "--frames", 40, "--motion", "breathing", "--seed", 1],
                  "second": [*SMALL, "--frames", 160, "--motion", "twist", "--seed", 2],
                  "third": [*SMALL, "--frames", 160, "--motion", "jogging", "--seed", 3]}}


def inputs_of(take):
    return [take, "--rig", f"{take}/rig.json", "--board", f"{take}/board.json", "--template", f"{take}/template"]


def frames_of(take):
    return sorted(name for name in os.listdir(take) if name.isdigit())


def repeat(take, out, frames):
    """A take of so many frames: those of `take` forwards and backwards, again and again."""
    names = frames_of(take)
    order = names + names[-2:0:-1]
    os.makedirs(out)
    for name in ("rig.json", "board.json", "board.png", "template"):
        subprocess.run(["cp", "-r", f"{take}/{name}", out], check=True)
    for k in range(frames):
        subprocess.run(["cp", "-rl", f"{take}/{order[k % len(order)]}", f"{out}/{k:04}"], check=True)


class Runs:
    """Jobs of daemons of their own, one after the other."""

    def __init__(self, folder):
        self.folder = folder
        self.count = 0

    def run(self, take, *options):
        """The job when it has ended, and its results."""
        self.count += 1
        folder = os.path.join(self.folder, f"run-{self.count}")
        os.makedirs(folder)
        studio = Studio(folder, take)
        studio.start_daemon(*(word.format(folder=folder) for word in options))
        try:
            job_id = studio.submit()
            while (job := next(job for job in studio.jobs() if job["id"] == job_id))["state"] not in ENDED:
                time.sleep(2)
        finally:
            studio.daemon.terminate()
            studio.daemon.wait()
        if job["state"] != "JOB_STATE_DONE" or job["frames"]["done"] != len(frames_of(take)):
            raise AssertionError(json.dumps(job, indent=1))
        return job, results(studio.out)


def wall_s(job):
    return (int(job["finished_unix_ns"]) - int(job["created_unix_ns"])) * 1e-9


def slurm_options(frames_per_task, *more):
    return ["--slurm-folder", "{folder}/slurm", "--slurm-frames-per-task", str(frames_per_task), "--slurm-memory-mib", "1000", *more]


def say_machine():
    with open("/proc/loadavg", encoding="ascii") as file:
        print(f"machine: {os.cpu_count()} cores, load {file.read().split()[0]} before the first run", flush=True)


def overhead(folder, takes, chunks, chunk_s):
    say_machine()
    take = os.path.join(takes, "large")
    plan = json.loads(weft("job", "plan", *inputs_of(take), "--pilot", 10, "--at-once", 2, "--json", check=0).stdout)
    per_task = math.ceil(chunk_s / plan["pilot"]["frame_core_s"])
    long_take = os.path.join(folder, "take")
    repeat(take, long_take, chunks * per_task)
    print(f"overhead: {chunks} tasks of {per_task} frames, {plan['pilot']['frame_core_s']:.2f} core-seconds a frame", flush=True)
    runs = Runs(folder)
    job, expected = runs.run(long_take)
    local_s = wall_s(job)
    print(f"  local pool, 2 workers   {local_s:8.1f} s, {job['usage']['core_s']:8.1f} core-s, {job['usage']['tasks']} tasks", flush=True)
    job, found = runs.run(long_take, *slurm_options(per_task))
    print(f"  Slurm, 2 nodes          {wall_s(job):8.1f} s, {job['usage']['core_s']:8.1f} core-s, {job['usage']['tasks']} tasks")
    idle_s = (2 * wall_s(job) - job["usage"]["worker_s"]) / job["usage"]["tasks"]
    print(f"  ratio                   {wall_s(job) / local_s:8.3f}  (goal 1.08); {idle_s:.2f} s a task in which a node had no worker")
    wrong = differing(found, expected)
    print(f"  files                   {len(expected)}, {len(wrong)} of them differ", flush=True)
    return not wrong


def pilot_on_a_node(folder, takes, frames):
    out = os.path.join(folder, "plan.json")
    words = [os.path.join(BIN, "weft"), "job", "plan", *inputs_of(os.path.join(takes, "pilot")), "--job-frames", frames,
             "--cores", 1, "--compare", 2, 4, "--cores-per-node", 1, "--core-speed", NODE_PERCENT / 100, "--json"]
    command = " ".join(f"'{word}'" for word in words)
    subprocess.run(["sbatch", "--wait", "--nodelist=w1", f"--output={out}", f"--error={out}.log", "--wrap", command], check=True,
                   stdout=subprocess.DEVNULL)
    with open(out, encoding="utf-8") as file:
        return json.load(file)


def plan(folder, takes, names, frames):
    say_machine()
    for name in names:
        repeat(os.path.join(takes, name), os.path.join(folder, name), frames)
    told = pilot_on_a_node(folder, takes, frames)
    pilot = told["pilot"]
    print(f"plan: {frames} frames; pilot of {pilot['frames_registered']} frames that count: {pilot['frame_s']:.3f} s, "
          f"{pilot['frame_core_s']:.3f} core-s a frame, {pilot['startup_s']:.2f} s to start", flush=True)
    rows = {1: told, **{row["cores"]: row for row in told["other_cores"]}}
    print("  take     nodes  frames a task   wall time, s            core-hours              processor hours")
    runs, good = Runs(folder), True
    for name in names:
        expected = None
        for nodes, row in rows.items():
            away = ",".join(f"w{k}" for k in range(nodes + 1, max(rows) + 1))
            job, found = runs.run(os.path.join(folder, name), *slurm_options(row["frames_per_task"]),
                                  *([f"--slurm-option=--exclude={away}"] if away else []))
            pairs = [(row["wall_s"], wall_s(job)), (row["core_hours"], job["usage"]["worker_s"] / 3600),
                     (row["processor_hours"], job["usage"]["core_s"] / 3600)]
            text = "  ".join(f"{said:8.4g} {took:8.4g} {said / took - 1:+4.0%}" for said, took in pairs)
            print(f"  {name:8} {nodes:5} {row['frames_per_task']:10}     {text}", flush=True)
            expected = expected or found
            good = good and not differing(found, expected)
    print(f"  each: predicted, measured, deviation (goal 20 %); files {'are the same' if good else 'DIFFER'}", flush=True)
    return good


def in_cluster(nodes, part, options, *more):
    return subprocess.run([CLUSTER, "--nodes", str(nodes), "--cpus", "1", *more, sys.executable, __file__, part, "--takes",
                           options.takes, "--chunks", str(options.chunks), "--chunk-s", str(options.chunk_s), "--frames",
                           str(options.frames)],
                          check=False).returncode == 0


def render(takes, parts):
    for part in parts:
        for name, words in TAKES[part].items():
            # Resumes what was stopped, and leaves what is complete.
            subprocess.run([os.path.join(BIN, "weft"), "-q", "simulate", *map(str, words), "--out", os.path.join(takes, name)],
                           check=True, stdout=subprocess.DEVNULL)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", default=["overhead", "plan"])
    parser.add_argument("--takes", help="folder of the takes, kept; by default a temporary one")
    parser.add_argument("--only-prepare", action="store_true", help="render the takes, no more")
    parser.add_argument("--chunks", type=int, default=40)
    parser.add_argument("--chunk-s", type=float, default=30)
    parser.add_argument("--frames", type=int, default=240, help="of the takes of `plan`")
    options = parser.parse_args()
    if why_no_cluster():
        sys.exit(f"no cluster: {why_no_cluster()}")
    with tempfile.TemporaryDirectory(prefix="weft-slurm-load-") as folder:
        if "WEFT_SLURM_STATE" in os.environ:
            wait_for(lambda: "idle" in subprocess.run(["sinfo"], capture_output=True, text=True, check=False).stdout, "idle nodes")
            if options.parts == ["overhead"]:
                return overhead(folder, options.takes, options.chunks, options.chunk_s)
            return plan(folder, options.takes, [name for name in TAKES["plan"] if name != "pilot"], options.frames)
        options.takes = os.path.abspath(options.takes or os.path.join(folder, "takes"))
        render(options.takes, options.parts)
        if options.only_prepare:
            return True
        done = [in_cluster(2, "overhead", options)] if "overhead" in options.parts else []
        if "plan" in options.parts:
            done.append(in_cluster(4, "plan", options, "--cpu-percent", str(NODE_PERCENT)))
        return all(done)


if __name__ == "__main__":
    sys.exit(0 if main() else 1)
