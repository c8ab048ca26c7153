#!/usr/bin/env python3
"""Writes the samples of a version: one small file or folder of everything that Weft writes, in an archive.

Usage: make_samples.py BIN CAMERA_ENDS VERSION.tar.xz

BIN is the folder with weft, weftd and weft-worker of that version, CAMERA_ENDS its test program with cameras. Works in /srv/weft, which must not exist and is removed at the end: that path, and no other
of this machine, stands in the samples. Needs root, since takes need cameras and these a network of their own.
"""

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tarfile
import time

WORK = "/srv/weft"
BLOCK = 4096  # of the streams of a take
WAIT_S = 240
GENICAM = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../system/gige_emulator.xml")
CAMERAS = {"left": "127.0.0.2", "right": "127.0.0.3"}
JOB_INPUTS = ["--rig", "rig.json", "--board", "board/board.json", "--template", "template"]
# Few cells, few cameras, hardly any noise: what a sample says of its format, larger ones say again.
STUDIO = ["--preset", "tiny", "--cameras", "8", "--width-px", "128", "--height-px", "176",
          "--read-noise", "0", "--full-well", "1000000"]


def run(*arguments, check=True):
    done = subprocess.run([*map(str, arguments)], cwd=WORK, stdout=subprocess.PIPE, text=True, check=check)
    return done.stdout


def wait_for(condition, what):
    end = time.monotonic() + WAIT_S
    while not condition():
        if time.monotonic() > end:
            sys.exit(f"waited {WAIT_S} s for {what}")
        time.sleep(0.005)


def read(path):
    with open(os.path.join(WORK, path), encoding="utf-8") as file:
        return file.read()


def write(path, text):
    with open(os.path.join(WORK, path), "w", encoding="utf-8") as file:
        file.write(text)


def remove(*paths):
    for path in paths:
        full = os.path.join(WORK, path)
        if os.path.isdir(full):
            shutil.rmtree(full)
        else:
            os.remove(full)


def trim_reserve(take):
    """Leaves two blocks of the zeros that a crashed recorder had reserved behind its data."""
    streams = os.path.join(WORK, take, "streams")
    for name in os.listdir(streams):
        with open(os.path.join(streams, name), "r+b") as file:
            data = file.read().rstrip(b"\0")
            whole = (len(data) + BLOCK - 1) // BLOCK * BLOCK
            if name.endswith(".stream") and file.seek(0, os.SEEK_END) > whole + 2 * BLOCK:
                file.truncate(whole + 2 * BLOCK)


@contextlib.contextmanager
def cameras(program):
    for address in CAMERAS.values():
        subprocess.run(["ip", "address", "add", address + "/8", "dev", "lo"], check=True)
    process = subprocess.Popen([program, GENICAM, *(f"{name}={at}" for name, at in CAMERAS.items())],
                               stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    process.stdout.readline()
    try:
        yield
    finally:
        process.kill()
        process.wait()


def record_takes(weft, gige_emulators):
    """A closed take, raw, with readings of the clocks; one whose recorder was killed."""
    features = ["Width=64", "Height=48", "PixelFormat=BayerRG8"]
    write("session.json", json.dumps({
        "cameras": [{"id": name, "gige": {"device": address, "packet_size_bytes": 1500, "features": features}}
                    for name, address in CAMERAS.items()],
        "fps": 10, "tolerance_ms": 2, "max_wait_ms": 5000, "low_disk_gib": 0.01, "ptp": True}, indent=1) + "\n")
    with cameras(gige_emulators):
        run(weft, "take", "record", "--session", "session.json", "--out", "takes/closed", "--seconds", "2.2",
            "--no-disk-test")
        recorder = subprocess.Popen([weft, "take", "record", "--session", "session.json", "--out", "takes/crashed",
                                     "--no-disk-test"], cwd=WORK, stdout=subprocess.DEVNULL)
        ledger = os.path.join(WORK, "takes/crashed/ledger.csv")
        wait_for(lambda: os.path.exists(ledger) and read("takes/crashed/ledger.csv").count("recorded") >= 3, "3 sets")
        recorder.kill()
        recorder.wait()
    trim_reserve("takes/crashed")


def calibrate(weft):
    """rigs/: target.json, a rig that was calibrated, with its page and report, the same in other formats."""
    run(weft, "rig", "target", "--rows", 4, "--cols", 3, "--tag-mm", 60, "--out", "target")
    run(weft, "rig", "rehearse", "--target", "target/target.json", "--cameras", 6, "--frames", 48, "--width-px", 640,
        "--height-px", 480, "--out", "boards")
    run(weft, "rig", "calibrate", "boards", "--target", "target/target.json", "--out", "rigs/calibrated.json")
    run(weft, "rig", "export", "rigs/calibrated.json", "--format", "krt", "--out", "rigs/KRT")
    run(weft, "rig", "export", "rigs/calibrated.json", "--format", "opencv", "--out", "rigs/cameras.yml")
    run(weft, "rig", "export", "rigs/calibrated.json", "--format", "colmap", "--out", "rigs/colmap")
    run(weft, "rig", "import", "--krt", "rigs/KRT", "--width-px", 640, "--height-px", 480, "--out",
        "rigs/imported.json")
    shutil.copy(f"{WORK}/target/target.json", f"{WORK}/rigs/target.json")
    remove("target", "boards")


def film(weft):
    """A garment: its take, compressed, and all that belongs to it."""
    run(weft, "simulate", *STUDIO, "--readout", "mosaic", "--out", "film")
    os.makedirs(f"{WORK}/board")
    for name in ("board.json", "board.png", "panels.png"):
        os.rename(f"{WORK}/film/{name}", f"{WORK}/board/{name}")
    os.rename(f"{WORK}/film/rig.json", f"{WORK}/rig.json")
    os.rename(f"{WORK}/film/template", f"{WORK}/template")
    run(weft, "take", "import", "film", "--mosaic", "bayer_rg8", "--fps", 30, "--compress", "--out", "takes/garment")
    os.makedirs(f"{WORK}/truth/0000")
    os.rename(f"{WORK}/film/truth/0000/mesh.ply", f"{WORK}/truth/0000/mesh.ply")
    remove("film")


def register(weft):
    run(weft, "register", "takes/garment", *JOB_INPUTS, "--observations", "--out", "result")
    remove("result/report.html")
    run(weft, "evaluate", "result", "--quick", "--out", "evaluation")
    remove("evaluation/report.html")
    run(weft, "rig", "refine", "result", "--rig", "rig.json", "--out", "rigs/refined.json")
    run(weft, "rig", "plan", "--rig", "rig.json", "--template", "template", "--out", "plan", check=False)
    remove("plan/report.html")


def make_templates(weft):
    """templates/: by hand, from a take, and with corners."""
    run(weft, "template", "import", "--mesh", "template/mesh.ply", "--cells", "template/cells.txt", "--board",
        "board/board.json", "--out", "templates/imported")
    for name, more in (("built", []), ("corners", ["--corners"])):
        run(weft, "template", "build", "takes/garment", "--rig", "rig.json", "--board", "board/board.json", "--openings",
            2, "--samples", 1, *more, "--out", f"templates/{name}")
        remove(f"templates/{name}/report.html")


@contextlib.contextmanager
def daemon(bin_folder):
    """Its address; it is killed in the end, so that the catalogue is that of a crash."""
    process = subprocess.Popen(
        [f"{bin_folder}/weftd", "--listen", "127.0.0.1:0", "--address-file", f"{WORK}/address", "--state", f"{WORK}/state",
         "--allow-path", WORK, "--workers", "1", "--threads-per-worker", "1"], cwd=WORK, stderr=subprocess.DEVNULL)
    wait_for(lambda: os.path.exists(f"{WORK}/address") and read("address").strip(), "weftd to listen")
    try:
        yield read("address").strip()
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
        remove("address")


def fill_catalogue(weft, bin_folder):
    """state/: jobs that are done, failed, cancelled, running and queued as their daemon is killed."""
    shutil.copy(f"{WORK}/rig.json", f"{WORK}/moved_away.json")
    with daemon(bin_folder) as server:
        def submit(out, rig="rig.json"):
            return run(weft, "register", f"{WORK}/takes/garment", "--rig", f"{WORK}/{rig}", "--board",
                       f"{WORK}/board/board.json", "--template", f"{WORK}/template", "--out", f"{WORK}/jobs/{out}", "--server",
                       server, "--detach").strip()

        def state(job):
            return json.loads(run(weft, "job", "show", job, "--server", server, "--json"))["job"]["state"]

        done, failing = submit("done"), submit("failed", "moved_away.json")
        remove("moved_away.json")
        cancelled = submit("cancelled")
        run(weft, "job", "cancel", cancelled, "--server", server)
        wait_for(lambda: state(done) == "JOB_STATE_DONE" and state(failing) == "JOB_STATE_FAILED", "two jobs")
        running = submit("running")
        for number in range(3):
            submit(f"queued_{number}")
        wait_for(lambda: state(running) == "JOB_STATE_RUNNING", "a job that runs")
        jobs = {job["id"]: job["state"] for job in json.loads(run(weft, "job", "list", "--server", server, "--json"))["jobs"]}
    time.sleep(1)  # workers die with their daemon
    remove("jobs")
    return jobs


def write_expected(weft, jobs):
    """expected.json: what tests compare with."""
    takes = {}
    for name in ("closed", "garment"):
        replay = json.loads(run(weft, "take", "replay", f"takes/{name}", "--fastest", "--json"))
        takes[name] = {"sets": int(replay["sets"]), "checksum": replay["checksum"]}
    last = [line.split(",")[2] for line in read("takes/crashed/ledger.csv").splitlines() if line.startswith("recorded")][-1]
    takes["crashed"] = {"acknowledged": int(last) + 1}
    templates = {name: json.loads(run(weft, "template", "check", name, "--json"))["hash"]
                 for name in ("template", "templates/imported", "templates/built", "templates/corners")}
    write("expected.json", json.dumps({"takes": takes, "templates": templates, "jobs": jobs}, indent=1) + "\n")


def check_no_paths(out):
    """No path of this machine but WORK."""
    paths = re.compile(rb"/(?:home|work|root|usr|var|tmp|mnt|etc)/[\w./-]+")
    for base, _, names in os.walk(out):
        for name in names:
            with open(os.path.join(base, name), "rb") as file:
                found = paths.search(file.read())
            if found:
                sys.exit(f"{base}/{name} names {found.group().decode()}")


def anonymous(member):
    member.uid = member.gid = 0
    member.uname = member.gname = ""
    return member


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    if "WEFT_IN_NAMESPACE" not in os.environ:
        os.environ["WEFT_IN_NAMESPACE"] = "1"
        os.execvp("unshare", ["unshare", "--net", sys.executable, *sys.argv])
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    bin_folder, gige_emulators, out = map(os.path.abspath, sys.argv[1:])
    weft = os.path.join(bin_folder, "weft")
    for folder in ("takes", "rigs"):
        os.makedirs(os.path.join(WORK, folder))
    record_takes(weft, gige_emulators)
    calibrate(weft)
    film(weft)
    register(weft)
    make_templates(weft)
    write_expected(weft, fill_catalogue(weft, bin_folder))
    check_no_paths(WORK)
    with tarfile.open(out, "w:xz", preset=9) as archive:
        for name in sorted(os.listdir(WORK)):
            archive.add(os.path.join(WORK, name), name, filter=anonymous)
    shutil.rmtree(WORK)


if __name__ == "__main__":
    main()
