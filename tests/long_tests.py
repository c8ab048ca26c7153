#!/usr/bin/env python3
"""The tests that take hours, one after the other; called by deploy/test.sh --long.

Usage: long_tests.py [STEP...]

Each step's output goes to build/long/STEP.log as it comes; a table closes the run. A step that fails does not stop the
others. The exit status is 1 when one failed.
"""

import argparse
import os
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
LOGS = os.path.join(ROOT, "build", "long")
PYTHON = sys.executable


def ctest(name, **environment):
    return ["ctest", "--preset", "dev", "-V", "-R", f"^{name}$"], environment


def fuzz_names():
    names = sorted(os.listdir(os.path.join(ROOT, "tests", "fuzz")))
    return [name[len("fuzz_"):-len(".cpp")] for name in names if name.startswith("fuzz_") and name.endswith(".cpp")]


def steps():
    """What each step runs, the shortest first: its command and its environment."""
    found = {f"fuzz_{name}": ([PYTHON, "tests/fuzz/run.py", name, "--no-build", "--inputs", "1000000000", "--seconds", "3600"], {})
             for name in fuzz_names()}
    found["endurance"] = ctest("System.endurance", WEFT_ENDURANCE_S="600")
    found["v4l2"] = ctest("System.v4l2", WEFT_ENDURANCE_S="600")
    found["job_campaign"] = ([PYTHON, "tests/system/job_campaign.py", "--log", os.path.join(LOGS, "job_campaign.json")],
                             {"WEFT_BIN": "build/dev/bin"})
    found["studio_load"] = ([PYTHON, "tests/system/studio_load.py", "--seconds", "60"],
                            {"WEFT_BIN": "build/dev/bin"})
    # Debian's Python has numpy.
    found["export_load"] = (["/usr/bin/python3", "tests/system/export_load.py"], {"WEFT_BIN": "build/dev/bin"})
    found["player_load"] = (["/usr/bin/python3", "tests/system/player_load.py"], {"WEFT_BIN": "build/dev/bin", "WEFT_SOURCE": "."})
    found["hostile_load"] = ([PYTHON, "tests/system/hostile_load.py"], {"WEFT_BIN": "build/dev/bin"})
    found["hostile_crowd"] = ([PYTHON, "tests/system/hostile_crowd.py"], {"WEFT_BIN": "build/dev/bin"})
    found["client_load"] = ([PYTHON, "tests/system/client_load.py", "--seconds", "300"], {"WEFT_BIN": "build/dev/bin"})
    found["console_load"] = (["/usr/bin/python3", "tests/system/console_load.py"], {"WEFT_BIN": "build/dev/bin", "WEFT_SOURCE": "."})
    found["take_campaign"] = ([PYTHON, "tests/system/take_campaign.py", "--log", os.path.join(LOGS, "take_campaign.json")],
                              {"WEFT_BIN": "build/dev/bin", "WEFT_DISK_FAULTS": "build/dev/tests/system/libdisk_faults.so"})
    found["loss_campaign"] = ([PYTHON, "tests/system/loss_campaign.py", "--log", os.path.join(LOGS, "loss_campaign.json")],
                              {"WEFT_BIN": "build/dev/bin", "WEFT_DISK_FAULTS": "build/dev/tests/system/libdisk_faults.so",
                               "WEFT_WRONG_CLOCK": "build/dev/tests/system/libwrong_clock.so"})
    found["take_damage"] = ctest("System.take_damage", WEFT_DAMAGE_ROUNDS="1000")
    found["crash"] = ctest("System.crash", WEFT_CRASH_STATES="1000", WEFT_CRASH_CALLS="all")
    found["job_crash"] = ctest("System.job_crash", WEFT_CRASH_STATES="100", WEFT_FAILED_CALLS="300")
    found["bare_root"] = (["bash", "deploy/tour-in-bare-root.sh"], {})
    found["container"] = (["bash", "deploy/container/make-image.sh", "--check", os.path.join(LOGS, "weft-image.tar")], {})
    return found


def run(name, command, environment):
    """Whether the step passed, and its seconds."""
    path = os.path.join(LOGS, name + ".log")
    print(f"{name}: {' '.join(command)}, output in {os.path.relpath(path, ROOT)}", flush=True)
    begin = time.monotonic()
    with open(path, "w", encoding="utf-8") as log:
        status = subprocess.run(command, cwd=ROOT, env={**os.environ, **environment}, stdout=log,
                                stderr=subprocess.STDOUT, check=False).returncode
    return status == 0, time.monotonic() - begin


def last_line(name):
    with open(os.path.join(LOGS, name + ".log"), encoding="utf-8", errors="replace") as log:
        lines = [line.strip() for line in log if line.strip()]
    return lines[-1] if lines else ""


def main():
    every = steps()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("step", nargs="*", help="one of " + ", ".join(every))
    chosen = parser.parse_args().step or list(every)
    for name in chosen:
        if name not in every:
            parser.error(f"{name}: no such step; choose from {', '.join(every)}")
    os.makedirs(LOGS, exist_ok=True)
    results = {name: run(name, *every[name]) for name in chosen}
    for name, (passed, seconds) in results.items():
        print(f"{'passed' if passed else 'FAILED'}  {seconds:7.0f} s  {name:20} {last_line(name)}")
    failed = sum(not passed for passed, _ in results.values())
    print(f"{len(results) - failed} of {len(results)} long tests passed")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
