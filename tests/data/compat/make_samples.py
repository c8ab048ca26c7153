#!/usr/bin/env python3
"""Writes the samples of a version: one small file or folder of everything that Weft writes, in an archive.

Usage: make_samples.py BIN CAMERAS VERSION.tar.xz

BIN is the folder with weft, weftd and weft-worker of that version. CAMERAS is its test program with cameras: gige_emulators, up
to 0.2.0 camera_ends. The samples hold no path of this machine but /srv/weft, where they are made. Needs root: cameras get a
network of their own, and /srv is an empty disk in memory that no other process sees.
"""

import contextlib
import glob
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
CAMERAS = {"left": "127.0.0.2", "right": "127.0.0.3"}
JOB_INPUTS = ["--rig", "rig.json", "--board", "board/board.json", "--template", "template"]
# Few cells, few cameras, hardly any noise: what a sample says of its format, larger ones say again. Four neighbours
# of 16 cameras see a patch of the tube in the middle of their images.
STUDIO = ["--preset", "tiny", "--read-noise", "0", "--full-well", "1000000", "--readout", "mosaic"]
RING = ["--cameras", "16", "--width-px", "128", "--height-px", "176"]
SEEN_BY, SEEN_WIDTH_PX, SEEN_HEIGHT_PX = 4, 88, 72
FRAMES = ["0000", "0001"]
OPENINGS = 1


def run(*arguments, check=True):
    done = subprocess.run([*map(str, arguments)], cwd=WORK, stdout=subprocess.PIPE, text=True, check=check)
    return done.stdout


def knows(weft, *words):
    """Whether this version has a command, or the command an option."""
    if not words[-1].startswith("--"):
        return re.search(rf"^ +{words[0]} ", run(weft, "--help"), re.MULTILINE) is not None
    return words[-1] in run(weft, *words[:-1], "--help").split()


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
    process = subprocess.Popen([program, *(f"{name}={at}" for name, at in CAMERAS.items())],
                               stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    process.stdout.readline()
    try:
        yield
    finally:
        process.kill()
        process.wait()


def record_takes(weft, camera_program):
    """A closed take, raw, with readings of the clocks; one whose recorder was killed, and the same recovered."""
    features = ["Width=64", "Height=48", "PixelFormat=BayerRG8"]
    write("session.json", json.dumps({
        "cameras": [{"id": name, "gige": {"device": address, "packet_size_bytes": 1500, "features": features}}
                    for name, address in CAMERAS.items()],
        "fps": 10, "tolerance_ms": 2, "max_wait_ms": 5000, "low_disk_gib": 0.01, "ptp": True}, indent=1) + "\n")
    with cameras(camera_program):
        run(weft, "take", "record", "--session", "session.json", "--out", "takes/closed", "--seconds", "2.2",
            "--no-disk-test")
        recorder = subprocess.Popen([weft, "take", "record", "--session", "session.json", "--out", "takes/crashed",
                                     "--no-disk-test"], cwd=WORK, stdout=subprocess.DEVNULL)
        ledger = os.path.join(WORK, "takes/crashed/ledger.csv")
        wait_for(lambda: os.path.exists(ledger) and read("takes/crashed/ledger.csv").count("recorded") >= 3, "3 sets")
        recorder.kill()
        recorder.wait()
    trim_reserve("takes/crashed")
    shutil.copytree(f"{WORK}/takes/crashed", f"{WORK}/takes/recovered")
    run(weft, "take", "recover", "takes/recovered")


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
    remove("target", "boards", "rigs/calibrated.report.html")


def rig_of_a_patch(weft):
    """Writes seen.json: cameras beside each other, cropped to the middle of their images."""
    run(weft, "simulate", *STUDIO, *RING, "--frames", 1, "--out", "ring")
    rig = json.loads(read("ring/rig.json"))
    rig.pop("hash", None)
    rig["cameras"] = rig["cameras"][:SEEN_BY]
    for camera in rig["cameras"]:
        camera["cx_px"] -= (camera["width_px"] - SEEN_WIDTH_PX) // 2
        camera["cy_px"] -= (camera["height_px"] - SEEN_HEIGHT_PX) // 2
        camera["width_px"], camera["height_px"] = SEEN_WIDTH_PX, SEEN_HEIGHT_PX
    write("seen.json", json.dumps(rig))
    remove("ring")


def film(weft):
    """A patch of a garment: its take, compressed, and all that belongs to it."""
    rig_of_a_patch(weft)
    run(weft, "simulate", *STUDIO, "--rig", "seen.json", "--frames", len(FRAMES), "--out", "film")
    for folder in ("board", "templates"):
        os.makedirs(f"{WORK}/{folder}")
    for name in ("board.json", "board.png", "panels.png"):
        os.rename(f"{WORK}/film/{name}", f"{WORK}/board/{name}")
    os.rename(f"{WORK}/film/rig.json", f"{WORK}/rig.json")
    run(weft, "take", "import", "film", "--mosaic", "bayer_rg8", "--fps", 30, "--compress", "--out", "takes/garment")
    run(weft, "template", "import", "--mesh", "film/template/mesh.ply", "--cells", "film/template/cells.txt", "--board",
        "board/board.json", "--out", "templates/imported")
    remove("film", "seen.json")


def make_templates(weft):
    """templates/: built from the take, and with corners; template/: the first of them."""
    for name, more in (("built", []), ("corners", ["--corners"])):
        run(weft, "template", "build", "takes/garment", "--rig", "rig.json", "--board", "board/board.json", "--openings",
            OPENINGS, "--samples", 1, *more, "--out", f"templates/{name}")
        remove(f"templates/{name}/report.html")
    shutil.copytree(f"{WORK}/templates/built", f"{WORK}/template")


def register(weft):
    """result/, evaluation/, rigs/refined.json, plan/; where there are options, options.txtpb."""
    run(weft, "register", "takes/garment", *JOB_INPUTS, "--observations", "--out", "result")
    remove("result/report.html")
    run(weft, "evaluate", "result", "--quick", "--out", "evaluation")
    remove("evaluation/report.html")
    run(weft, "rig", "refine", "result", "--rig", "rig.json", "--out", "rigs/refined.json")
    run(weft, "rig", "plan", "--rig", "rig.json", "--template", "template", "--out", "plan", check=False)
    remove("plan/report.html")
    os.makedirs(f"{WORK}/scans")
    for frame in FRAMES:
        shutil.copy(f"{WORK}/result/{frame}/cloud.ply", f"{WORK}/scans/{frame}.ply")
    if knows(weft, "options"):
        write("options.txtpb", run(weft, "options", "--file"))


def stop_children(process_id):
    """Those of any of its threads."""
    for path in glob.glob(f"/proc/{process_id}/task/*/children"):
        with open(path, encoding="utf-8") as file:
            for child in file.read().split():
                os.kill(int(child), signal.SIGSTOP)


@contextlib.contextmanager
def daemon(bin_folder):
    """Its address and process; it is killed in the end, so that the catalogue is that of a crash."""
    process = subprocess.Popen(
        [f"{bin_folder}/weftd", "--listen", "127.0.0.1:0", "--address-file", f"{WORK}/address", "--state", f"{WORK}/state",
         "--allow-path", WORK, "--workers", "1", "--threads-per-worker", "1"], cwd=WORK, stderr=subprocess.DEVNULL)
    wait_for(lambda: os.path.exists(f"{WORK}/address") and read("address").strip(), "weftd to listen")
    try:
        yield read("address").strip(), process.pid
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
        remove("address")


class Jobs:
    """Jobs of a daemon, with results in jobs/ or, where the daemon shares no folder with the client, in its state."""

    def __init__(self, weft, server):
        self.weft, self.server = weft, server
        self.second_pass_off = "--single-look" if knows(weft, "register", "--single-look") else "--single-pass"

    def submit(self, out, *more, rig="rig.json", shared=True):
        command = [self.weft, "register", f"{WORK}/takes/garment", "--rig", f"{WORK}/{rig}", "--board",
                   f"{WORK}/board/board.json", "--template", f"{WORK}/template", "--out", f"{WORK}/jobs/{out}", *more,
                   "--server", self.server, "--detach"]
        os.makedirs(f"{WORK}/jobs", exist_ok=True)
        if not shared:
            command = ["unshare", "--mount", "sh", "-c", f'mount -t tmpfs tmpfs {WORK}/jobs && exec "$@"', "sh", *command]
        return run(*command).strip()

    def show(self, job):
        return json.loads(run(self.weft, "job", "show", job, "--server", self.server, "--json"))

    def state(self, job):
        return self.show(job)["job"]["state"]

    def submit_some_that_end(self):
        done, failing = self.submit("done"), self.submit("failed", rig="moved_away.json")
        remove("moved_away.json")
        stored = self.submit("elsewhere", "--observations", shared=False)
        cancelled = self.submit("cancelled")
        run(self.weft, "job", "cancel", cancelled, "--server", self.server, check=False)  # it may take longer than it is waited for
        wait_for(lambda: [self.state(job) for job in (done, stored, failing, cancelled)] ==
                 [*["JOB_STATE_DONE"] * 2, "JOB_STATE_FAILED", "JOB_STATE_CANCELLED"], "four jobs")

    def submit_some_that_wait(self):
        """Each with other options."""
        self.submit("with_start", "--start-from", f"{WORK}/result", "--frames-alone")
        self.submit("with_scans", "--scans", f"{WORK}/scans", self.second_pass_off)
        self.submit("of_one_frame", "--frames", f"{FRAMES[-1]}", shared=False)
        if knows(self.weft, "register", "--set"):
            self.submit("with_options", "--set", "triangulation.consensus.inlier_radius_mm=1.5", "--preset", "paper")


def fill_catalogue(weft, bin_folder):
    """state/ and jobs/ as SIGKILL leaves them: jobs done, failed, cancelled, running after their first frame, queued."""
    shutil.copy(f"{WORK}/rig.json", f"{WORK}/moved_away.json")
    with daemon(bin_folder) as (server, process_id):
        jobs = Jobs(weft, server)
        jobs.submit_some_that_end()
        jobs.submit("running", "--observations")
        wait_for(lambda: os.path.exists(f"{WORK}/jobs/running/{FRAMES[0]}/report.json"), "a job's first frame")
        stop_children(process_id)
        jobs.submit_some_that_wait()
        listed = json.loads(run(weft, "job", "list", "--server", server, "--json"))["jobs"]
        shown = {job["id"]: jobs.show(job["id"]) for job in listed}
    time.sleep(1)  # workers die with their daemon
    for folder in glob.glob(f"{WORK}/jobs/*") + glob.glob(f"{WORK}/state/results/*"):
        for page in glob.glob(f"{folder}/report.html"):
            os.remove(page)
    return shown


def write_expected(weft, jobs):
    """expected.json: what tests compare with."""
    takes = {}
    for name in ("closed", "recovered", "garment"):
        replay = json.loads(run(weft, "take", "replay", f"takes/{name}", "--fastest", "--json"))
        takes[name] = {"sets": int(replay["sets"]), "checksum": replay["checksum"]}
    last = [line.split(",")[2] for line in read("takes/crashed/ledger.csv").splitlines() if line.startswith("recorded")][-1]
    takes["crashed"] = {"acknowledged": int(last) + 1}
    templates = {name: json.loads(run(weft, "template", "check", name, "--json"))["hash"]
                 for name in ("template", "templates/imported", "templates/built", "templates/corners")}
    write("expected.json", json.dumps({
        "takes": takes, "templates": templates, "frames": FRAMES, "openings": OPENINGS,
        "jobs": {id: shown["job"]["state"] for id, shown in jobs.items()}, "shown": jobs}, indent=1) + "\n")


def check_no_paths(out):
    """No path of this machine but WORK."""
    paths = re.compile(rb"/(?:home|work|root|usr|var|tmp|mnt|etc)/[\w./-]+")
    for base, _, names in os.walk(out):
        for name in names:
            with open(os.path.join(base, name), "rb") as file:
                found = paths.search(file.read())
            if found:
                sys.exit(f"{base}/{name} names {found.group().decode()}")


def hide_machine():
    """A network of its own, an empty /srv, a host without a name and id of its own."""
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    subprocess.run(["mount", "-t", "tmpfs", "tmpfs", os.path.dirname(WORK)], check=True)
    os.mkdir(WORK)
    subprocess.run(["hostname", "studio"], check=True)
    machine_id = os.path.join(os.path.dirname(WORK), "machine-id")
    with open(machine_id, "w", encoding="utf-8") as file:
        file.write("0" * 32 + "\n")
    if os.path.exists("/etc/machine-id"):
        subprocess.run(["mount", "--bind", machine_id, "/etc/machine-id"], check=True)


def anonymous(member):
    member.uid = member.gid = 0
    member.uname = member.gname = ""
    return member


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    if "WEFT_IN_NAMESPACE" not in os.environ:
        os.environ["WEFT_IN_NAMESPACE"] = "1"
        os.execvp("unshare", ["unshare", "--net", "--mount", "--uts", sys.executable, *sys.argv])
    hide_machine()
    bin_folder, camera_program, out = map(os.path.abspath, sys.argv[1:])
    weft = os.path.join(bin_folder, "weft")
    for folder in ("takes", "rigs"):
        os.makedirs(os.path.join(WORK, folder))
    record_takes(weft, camera_program)
    calibrate(weft)
    film(weft)
    make_templates(weft)
    register(weft)
    write_expected(weft, fill_catalogue(weft, bin_folder))
    check_no_paths(WORK)
    with tarfile.open(out, "w:xz", preset=9) as archive:
        for name in sorted(os.listdir(WORK)):
            archive.add(os.path.join(WORK, name), name, filter=anonymous)


if __name__ == "__main__":
    main()
