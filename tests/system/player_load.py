#!/usr/bin/env python3
"""A long sequence in the console's 3D view: time to the first frame, decoding, drawing, memory.

Usage: WEFT_BIN=build/dev/bin WEFT_SOURCE=. python3 tests/system/player_load.py [--frames 300] [--side 316] [--seconds 30]

The result is that of export_load.py: a sheet of side x side vertices in waves, with noise in every place and a state, sigma and
number of cameras at random, which compress badly. Its job is carried out by the worker of tests, which registers nothing.
Chromium draws without a graphics card. Prints a table. The exit status is 1 when the first frame is drawn later than after 2 s,
decoding alone is below 60 frames a second, an error is 0.02 mm or more, or memory grows from one round to the next.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time

from browser import MODULES, PAGES, SOURCE, Browser, need_browser
from client_load import resident_mib
from console_test import Page, free_port
from export_load import make_result
from studio import BIN, read, wait_for, weft
from studio_load import processor_s

FIRST_FRAME_S, DECODED_PER_S, ERROR_MM = 2, 60, 0.02
MOST_GROWTH = 1.15  # of the browser's memory, from the second round to the last
DECODE = os.path.join(SOURCE, "tests", "system", "readers", "decode_meshes.mjs")


def start_daemon(folder):
    """A weftd beside a worker that only says that it is done; its programs lie in a folder of their own."""
    programs = os.path.join(folder, "bin")
    os.mkdir(programs)
    for name, source in (("weftd", "weftd"), ("weft-worker", "acting_worker"), ("weft-recorder", "weft-recorder")):
        shutil.copy(os.path.join(BIN, source), os.path.join(programs, name))
    os.mkdir(os.path.join(folder, "state"), mode=0o700)
    address, port = os.path.join(folder, "address"), free_port()
    log = open(os.path.join(folder, "weftd.log"), "w")
    daemon = subprocess.Popen([os.path.join(programs, "weftd"), "--listen", "127.0.0.1:0", "--state", os.path.join(folder, "state"),
                               "--allow-path", folder, "--console", f"127.0.0.1:{port}", "--console-files", PAGES, "--workers", "1",
                               "--address-file", address], stdout=log, stderr=log)
    server = wait_for(lambda: os.path.exists(address) and read(address).splitlines(), "weftd to listen")[0]
    return daemon, server, port


def make_job(folder, server, frames, side):
    """Id of a job whose meshes are made up, in the folder of its results."""
    scene = os.path.join(folder, "scene")
    weft("simulate", "--preset", "tiny", "--out", scene, check=0)
    pictures = sorted(name for name in os.listdir(scene) if name.isdigit())
    for k in range(frames):
        if not os.path.exists(frame := os.path.join(scene, f"{k:04}")):
            shutil.copytree(os.path.join(scene, pictures[0]), frame, copy_function=os.link)
    make_result(os.path.join(folder, "made"), frames, side)
    out = os.path.join(folder, "result")
    done = weft("register", scene, "--rig", f"{scene}/rig.json", "--board", f"{scene}/board.json", "--template", f"{scene}/template",
                "--server", server, "--out", out, "--detach", check=0)
    job = done.stdout.split()[-1]
    wait_for(lambda: "DONE" in weft("job", "show", job, "--server", server, "--json").stdout, "the job", 0.5)
    for k in range(frames):
        os.makedirs(f"{out}/{k:04}", exist_ok=True)
        os.replace(f"{folder}/made/{k:04}/mesh.ply", f"{out}/{k:04}/mesh.ply")
    return job


def memory_mib(browser):
    """Of all processes of the browser, shared pages by their share."""
    parents = {}
    for name in filter(str.isdigit, os.listdir("/proc")):
        try:
            parents[int(name)] = int(read(f"/proc/{name}/stat").rsplit(")", 1)[1].split()[1])
        except OSError:
            continue
    ours, total = {browser.process.pid}, 0
    while more := {child for child, parent in parents.items() if parent in ours} - ours:
        ours |= more
    for process in ours - {browser.process.pid}:
        try:
            total += sum(int(line.split()[1]) for line in read(f"/proc/{process}/smaps_rollup").splitlines() if line.startswith("Pss:"))
        except OSError:
            continue
    return total / 1024


def decoding_ms(page, folder, job, names):
    """Of a frame, in Node: nothing else is done meanwhile."""
    paths = []
    for name in names:
        answer, body = page.ask("GET", f"/mesh/{job}/{name}")
        assert answer.status == 200, body
        paths.append(os.path.join(folder, f"{name}.mesh"))
        with open(paths[-1], "wb") as file:
            file.write(body)
    done = subprocess.run(["node", DECODE, *paths], env={**os.environ, "WEFT_NODE_MODULES": MODULES}, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)["ms"]


def numbers(browser):
    return {name: float(browser.css(".player-stats", "getAttribute", f"data-{name}"))
            for name in ("first-ms", "drawn", "decode-ms", "frame-bytes", "error-mm", "held-bytes")}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--side", type=int, default=316)
    parser.add_argument("--seconds", type=float, default=30)
    asked = parser.parse_args()
    need_browser()
    folder = tempfile.mkdtemp(prefix="weft-player-")
    daemon = None
    try:
        daemon, server, port = start_daemon(folder)
        job = make_job(folder, server, asked.frames, asked.side)
        token = weft("access", "token", "anna", "--role", "viewer", "--state", f"{folder}/state", check=0).stdout.strip()
        time.sleep(1)
        return play(asked, folder, daemon, (port, job, token))
    finally:
        if daemon:
            daemon.terminate()
            daemon.wait()
        shutil.rmtree(folder)


def play(asked, folder, daemon, place):
    port, job, token = place
    page = Page(port)
    page.log_in(token)
    decode_ms = decoding_ms(page, folder, job, [f"{k:04}" for k in range(min(30, asked.frames))])
    browser = Browser(1440, 900)
    browser.page("goto", f"http://127.0.0.1:{port}/")
    browser.fill("Token", token)
    browser.press("Enter")
    browser.see("connected", ".connection")
    begin, used = time.monotonic(), processor_s(daemon.pid)
    browser.page("goto", f"http://127.0.0.1:{port}/#/jobs/{job}/player")
    browser.css(".player-stats", "waitFor")
    shown_s = time.monotonic() - begin
    wait_for(lambda: (browser.css(".player-stats", "innerText").split(" frames held")[0].endswith(f" {asked.frames}")
                      or numbers(browser)["held-bytes"] > 150e6), "the sequence", 0.5)
    daemon_s = processor_s(daemon.pid) - used
    browser.css("label:has-text('Speed') select", "selectOption", "0")
    browser.role("button", "Play")
    used_mib = []
    for _ in range(3):
        time.sleep(asked.seconds / 3)
        used_mib.append(memory_mib(browser))
    found = numbers(browser)
    browser.close()
    print(f"| {asked.side ** 2:,} vertices x {asked.frames} frames | |\n|---|---|")
    for name, value in (("first frame drawn after", f"{found['first-ms'] / 1000:.2f} s; {shown_s:.2f} s from the address"),
                        ("decoding alone", f"{decode_ms:.2f} ms a frame, {1000 / decode_ms:.0f} frames/s"),
                        ("drawn, without a graphics card", f"{found['drawn']:.1f} frames/s, decoding {found['decode-ms']:.1f} ms meanwhile"),
                        ("a frame", f"{found['frame-bytes'] / 1e3:.0f} kB; {8 * asked.side ** 2 / 1e3:.0f} kB before compression"),
                        ("error of a vertex, at most", f"{found['error-mm']:.4f} mm"),
                        ("encoded meshes held", f"{found['held-bytes'] / 1e6:.0f} MB"),
                        ("memory of the browser", ", ".join(f"{mib:.0f}" for mib in used_mib) + " MiB"),
                        ("the daemon", f"{1000 * daemon_s / asked.frames:.0f} ms of a core a frame, {resident_mib(daemon.pid):.0f} MiB")):
        print(f"| {name} | {value} |")
    return (found["first-ms"] > 1000 * FIRST_FRAME_S or 1000 / decode_ms < DECODED_PER_S or found["error-mm"] >= ERROR_MM
            or used_mib[-1] > MOST_GROWTH * used_mib[0])


if __name__ == "__main__":
    sys.exit(main())
