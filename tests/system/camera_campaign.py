"""Rigs with a fault must be named, right ones must not: the campaign behind the limits of services/formats/verdict/camera_checks.h.

   WEFT_BIN=build/dev/bin python3 tests/system/camera_campaign.py --work FOLDER [--exchanges N] [--takes N] [--table]
   WEFT_BIN=... python3 tests/system/camera_campaign.py --work FOLDER --take DUMP --rig R --board B --template T

Exchanges the places of two random cameras of the quick start's rig, N times, and registers; other faults follow: a ring of
three, a camera that is elsewhere or upside down, wrong focal lengths, scales. Then it simulates right takes: other presets
and seeds, 3 to 24 cameras, dark, noisy, blurred, small and cropped pictures, cameras that are late or slightly knocked.
With --take the exchanges are those of a recording that is there. Every trial is a line of JSON in FOLDER/trials.jsonl, so a
campaign goes on where it was stopped; the table prints what was found and how far from the limits the right takes are. The
exit status is 1 when an exchange was not named or a right take was blamed.
"""

import argparse
import copy
import json
import os
import random
import shutil
import sys

from studio import read, weft, write

QUICKSTART = ["--preset", "quickstart", "--frames", "1"]
CHECKS = ("register.cameras_agree", "register.lens", "register.scale", "register.cameras_known")


def right_takes():
    """Options of `weft simulate`, by name."""
    takes = {}
    for seed in range(8):
        takes[f"quickstart-{seed}"] = [*QUICKSTART, "--seed", str(seed)]
    for seed in range(6):
        takes[f"tiny-{seed}"] = ["--preset", "tiny", "--frames", "1", "--seed", str(seed)]
    for cameras in (3, 4, 5, 6, 7, 8, 10, 12, 20, 24):
        for seed in (0, 1):
            takes[f"{cameras}-cameras-{seed}"] = [*QUICKSTART, "--cameras", str(cameras), "--seed", str(seed)]
    looks = {"dark": ["--gain", "0.25"], "noisy": ["--read-noise", "60"], "blurred": ["--blur-px", "1.3"],
             "small": ["--width-px", "640", "--height-px", "800"], "late": ["--time-offset-ms", "4"],
             "shutter": ["--exposure-ms", "6"], "dropped": ["--drop-rate", "0.2"], "focus": ["--focus-error-mm", "150"],
             "pale": ["--color-variation", "0.1", "--exposure-variation", "0.3"]}
    for name, options in looks.items():
        for seed in (0, 1):
            takes[f"{name}-{seed}"] = [*QUICKSTART, *options, "--seed", str(10 + seed)]
    for preset in ("pleats", "gathers", "curls"):
        takes[preset] = ["--preset", preset, "--frames", "1"]
    for seed in range(5):
        takes[f"knocked-{seed}"] = [*QUICKSTART, "--seed", str(20 + seed)]
    return takes


class Studio:
    """A take with its rig, and results of registrations of it."""

    def __init__(self, take, rig=None, board=None, template=None, frames=None):
        self.take, self.rig = take, rig or os.path.join(take, "rig.json")
        self.board, self.template = board or os.path.join(take, "board.json"), template or os.path.join(take, "template")
        self.frames = frames

    def model(self):
        rig = json.loads(read(self.rig))
        rig.pop("hash", None)
        return rig

    def register(self, rig, folder):
        """The verdict with another rig."""
        shutil.rmtree(folder, ignore_errors=True)
        os.makedirs(folder)
        write(os.path.join(folder, "rig.json"), json.dumps(rig))
        done = weft("register", self.take, "--rig", os.path.join(folder, "rig.json"), "--board", self.board, "--template",
                    self.template, "--out", os.path.join(folder, "out"), "--frames-alone")
        verdict = json.loads(read(os.path.join(folder, "out", "job.json")))["verdict"]
        views = {}
        for frame in sorted(os.listdir(os.path.join(folder, "out"))):
            report = os.path.join(folder, "out", frame, "report.json")
            if os.path.exists(report):
                report = json.loads(read(report))
                views = {v["camera"]: v.get("agreement", {}) for v in report["views"]}
                views["scales"] = [report.get("cloud", {}).get(key) for key in ("print_scale", "template_scale")]
        shutil.rmtree(folder)
        return {"exit": done.returncode, "grade": verdict["grade"], "reason": verdict["reason"],
                "remedy": verdict.get("remedy", ""), "checks": {c["id"]: c["value"] for c in verdict.get("checks", [])},
                "failed": [c["id"] for c in verdict.get("checks", []) if c["grade"] != "GRADE_GOOD"], "views": views}


def exchanged(rig, ids):
    """Each of the cameras with the place of the next one."""
    rig = copy.deepcopy(rig)
    of = {camera["id"]: camera for camera in rig["cameras"]}
    models = [dict(of[i]) for i in ids]
    for k, i in enumerate(ids):
        of[i].clear()
        of[i].update(models[(k + 1) % len(ids)], id=i)
    return rig


def with_focal(rig, factor, ids=None):
    rig = copy.deepcopy(rig)
    for camera in rig["cameras"]:
        if ids is None or camera["id"] in ids:
            camera["fx_px"] *= factor
            camera["fy_px"] *= factor
    return rig


def with_scale(rig, factor):
    rig = copy.deepcopy(rig)
    for camera in rig["cameras"]:
        camera["translation_mm"] = [factor * t for t in camera["translation_mm"]]
    return rig


def turned(rig, camera_id, row, angle):
    """A camera that turned about one of its axes by a small angle (rad), or by a large one."""
    import math
    rig = copy.deepcopy(rig)
    camera = next(c for c in rig["cameras"] if c["id"] == camera_id)
    a, b = [r for r in range(3) if r != row]
    c, s = math.cos(angle), math.sin(angle)
    old = [camera["rotation"][3 * r:3 * r + 3] for r in range(3)]
    moved = [list(r) for r in old]
    moved[a] = [c * x - s * y for x, y in zip(old[a], old[b])]
    moved[b] = [s * x + c * y for x, y in zip(old[a], old[b])]
    camera["rotation"] = [x for r in moved for x in r]
    t = list(camera["translation_mm"])
    camera["translation_mm"][a], camera["translation_mm"][b] = c * t[a] - s * t[b], s * t[a] + c * t[b]
    return rig


def names(trial, ids):
    """Whether the verdict says that these cameras are exchanged, and no others."""
    reason = trial["reason"]
    listed = f"{ids[0]} and {ids[1]}" if len(ids) == 2 else ", ".join(ids[:-1]) + f" and {ids[-1]}"
    return "are exchanged" in reason and f"cameras {listed} are exchanged" in reason and "; " not in reason


class Campaign:
    def __init__(self, work):
        self.work, self.log = work, os.path.join(work, "trials.jsonl")
        os.makedirs(work, exist_ok=True)
        self.trials = {}
        if os.path.exists(self.log):
            for line in read(self.log).splitlines():
                trial = json.loads(line)
                self.trials[trial["name"]] = trial

    def run(self, name, studio, rig, is_right):
        if name in self.trials:
            return
        trial = {"name": name, **studio.register(rig, os.path.join(self.work, "trial"))}
        trial["right"] = bool(is_right(trial))
        self.trials[name] = trial
        with open(self.log, "a") as log:
            log.write(json.dumps(trial) + "\n")
        print("ok  " if trial["right"] else "FAIL", name, trial["grade"], trial["reason"][:200], flush=True)

    def simulate(self, name, options):
        take = os.path.join(self.work, "takes", name)
        if not os.path.exists(os.path.join(take, "rig.json")) or not os.path.exists(os.path.join(take, "whole")):
            weft("simulate", *options, "--out", take, check=0)
            write(os.path.join(take, "whole"), "")
        return Studio(take)

    def exchange(self, studio, count, label):
        rig = studio.model()
        cameras = [camera["id"] for camera in rig["cameras"]]
        rng = random.Random(label)
        for i in range(count):
            pair = sorted(rng.sample(cameras, 2))
            self.run(f"{label} exchange {i} {'-'.join(pair)}", studio, exchanged(rig, pair), lambda t: names(t, pair))
        return rig, cameras, rng

    def faults(self, studio, label):
        rig, cameras, rng = studio.model(), [c["id"] for c in studio.model()["cameras"]], random.Random(label + "faults")

        def says(*words):
            return lambda t: all(word in t["reason"] for word in words)
        for i in range(3):
            ring = rng.sample(cameras, 3)
            self.run(f"{label} ring {i} {'-'.join(ring)}", studio, exchanged(rig, ring), says("are exchanged", *ring))
            four = rng.sample(cameras, 4)
            self.run(f"{label} two pairs {i} {'-'.join(four)}", studio, exchanged(exchanged(rig, four[:2]), four[2:]),
                     says("are exchanged", *four))
            one = rng.choice(cameras)
            self.run(f"{label} elsewhere {i} {one}", studio, turned(rig, one, 1, 0.1), says(one, "agrees with no other"))
            self.run(f"{label} upside down {i} {one}", studio, turned(rig, one, 2, 3.14159265358979), says(one))
            self.run(f"{label} zoom {i} {one}", studio, with_focal(rig, 1.05, [one]), says(one))
        for factor in (0.9, 0.95, 0.97, 1.03, 1.05, 1.1):
            self.run(f"{label} focal {factor}", studio, with_focal(rig, factor), says("lenses of the rig"))
        for factor in (0.001, 1 / 25.4, 0.1, 0.95, 1.05, 10, 25.4, 1000):
            self.run(f"{label} scale {factor:.4g}", studio, with_scale(rig, factor), says("size"))

    def right(self, count):
        def is_right(trial):
            return not set(trial["failed"]) & set(CHECKS) and "too large" not in trial["reason"] and \
                "too small" not in trial["reason"]
        for name, options in list(right_takes().items())[:count]:
            studio = self.simulate(name, options)
            rig = studio.model()
            if name.startswith("knocked"):
                seed = int(name[-1])
                rig = turned(rig, rig["cameras"][2 * seed + 1]["id"], seed % 3, (0.0005, 0.001, 0.002, 0.003, 0.004)[seed])
            self.run(f"right {name}", studio, rig, is_right)

    def table(self):
        kinds = {}
        for name, trial in self.trials.items():
            words = name.split()
            kind = "right" if words[0] == "right" else " ".join(w for w in words[:3] if w.isalpha() or w == words[0])
            kinds.setdefault(kind, []).append(trial)
        for kind, trials in sorted(kinds.items()):
            print(f"{kind:30} {sum(t['right'] for t in trials)} of {len(trials)}")
        shares, lens, scales = [], [], []
        for trial in self.trials.values():
            if not trial["name"].startswith("right"):
                continue
            for camera, agreement in trial["views"].items():
                if camera != "scales" and agreement.get("compared", 0) >= 50:
                    shares.append((agreement.get("agreeing", 0) / agreement["compared"], trial["name"], camera))
            lens.append((float(trial["checks"].get("register.lens", "0").split()[0]), trial["name"]))
            scales.append((float(trial["checks"].get("register.scale", "0").split()[0]), trial["name"]))
        if shares:
            print("right takes: least share that agrees", min(shares), "largest lens", max(lens), "largest scale", max(scales))
        return all(trial["right"] for trial in self.trials.values() if
                   trial["name"].startswith("right") or " exchange " in trial["name"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", required=True)
    parser.add_argument("--exchanges", type=int, default=20)
    parser.add_argument("--takes", type=int, default=60)
    parser.add_argument("--no-faults", action="store_true", help="exchanges and right takes alone")
    parser.add_argument("--table", action="store_true", help="print the table of the trials that are there")
    for name in ("take", "rig", "board", "template"):
        parser.add_argument(f"--{name}")
    options = parser.parse_args()
    campaign = Campaign(options.work)
    if not options.table:
        if options.take:
            campaign.exchange(Studio(options.take, options.rig, options.board, options.template), options.exchanges, "take")
        else:
            studio = campaign.simulate("quickstart", [*QUICKSTART, "--seed", "100"])
            campaign.exchange(studio, options.exchanges, "quickstart")
            if not options.no_faults:
                campaign.faults(studio, "quickstart")
            campaign.right(options.takes)
    return 0 if campaign.table() else 1


if __name__ == "__main__":
    sys.exit(main())
