#!/usr/bin/env python3
"""Live view of many cameras for long: what it costs the recorder, and whether browser or daemon grow.

Usage: WEFT_BIN=build/dev/bin WEFT_SOURCE=. python3 tests/system/console_load.py [--cameras 16] [--fps 5] [--minutes 60] [--control-s 60]

First a take that nobody looks at, then takes of up to ten minutes beneath the page with all cameras. Prints memory as it goes and a
table. The exit status is 1 when the watched takes lost a larger share of their frames than the first one, or memory grew by more
than a fifth from the end of the first quarter to the end of the last.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time

from browser import PAGES, Browser, need_browser
from client_load import resident_mib
from console_test import Page, free_port
from live_studio import enter_network, set_up_network
from player_load import memory_mib
from studio import BIN, read, wait_for, weft, write
from studio_load import processor_s

TAKE_S = 600
MOST_GROWTH = 1.2


class Studio:
    """A daemon with its console, cameras, and an operator's token."""

    def __init__(self, folder, cameras, fps):
        self.folder, self.port = folder, free_port()
        self.session = os.path.join(folder, "session.json")
        self.cameras = subprocess.Popen([os.path.join(BIN, "weft"), "camera", "fake", "--cameras", str(cameras), "--fps", str(fps),
                                         "--session", self.session], stdout=subprocess.PIPE, text=True)
        self.cameras.stdout.readline()
        write(self.session, json.dumps({**json.loads(read(self.session)), "max_wait_ms": 3000}))
        state, address = os.path.join(folder, "state"), os.path.join(folder, "address")
        os.mkdir(state, mode=0o700)
        log = open(os.path.join(folder, "weftd.log"), "w")
        self.daemon = subprocess.Popen([os.path.join(BIN, "weftd"), "--listen", "127.0.0.1:0", "--state", state, "--allow-path", folder,
                                        "--console", f"127.0.0.1:{self.port}", "--console-files", PAGES, "--workers", "1",
                                        "--address-file", address], stdout=log, stderr=log)
        wait_for(lambda: os.path.exists(address) and read(address), "weftd to listen")
        self.token = weft("access", "token", "anna", "--role", "operator", "--state", state, check=0).stdout.strip()
        time.sleep(1)
        self.page = Page(self.port)
        self.page.log_in(self.token)

    def call(self, name, request=None):
        status, answer = self.page.call(name, request)
        assert status == 200, answer
        return answer

    def takes(self):
        return self.call("Takes/ListTakes", {"limit": 100}).get("takes", [])

    def end(self):
        for process in (self.daemon, self.cameras):
            process.terminate()
            process.wait()


def losses(take):
    """Of a take's state: frames that are missing, and of how many."""
    state = take["state"]
    cameras = len(state.get("cameras", []))
    missing = int(state.get("framesMissing", 0)) + cameras * int(state.get("setsDropped", 0))
    return missing, cameras * (int(state.get("setsRecorded", 0)) + int(state.get("setsDropped", 0)))


def is_over(take):
    return take["state"]["phase"] not in ("RECORDER_PHASE_STARTING", "RECORDER_PHASE_RECORDING")


def record_alone(studio, seconds):
    take = studio.call("Takes/StartTake", {"recording": {"session": json.loads(read(studio.session)), "seconds": seconds}})
    wait_for(lambda: is_over(studio.call("Takes/GetTake", {"takeId": take["id"]})), "the take that nobody watches", 1)
    return losses(studio.call("Takes/GetTake", {"takeId": take["id"]}))


def open_page(studio):
    browser = Browser(1440, 900)
    browser.page("goto", f"http://127.0.0.1:{studio.port}/")
    browser.fill("Token", studio.token)
    browser.press("Enter")
    browser.see("connected", ".connection")
    browser.press("g", "c", "n")
    browser.order(find=["getByLabel", "From a file instead (session.json)", {"exact": True}], do="setInputFiles", args=[studio.session])
    browser.css("dialog button.main", "click")
    browser.see("focus", ".measures")
    browser.css(".take-control select", "selectOption", "0")
    return browser


def record_watched(studio, browser, seconds, samples):
    known = {take["id"] for take in studio.takes()}
    browser.role("button", "Start a take")
    browser.see("sets", ".running")
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(min(20, max(0.1, end - time.monotonic())))
        samples.append((time.monotonic(), memory_mib(browser), resident_mib(studio.daemon.pid)))
        print(f"{samples[-1][0] - samples[0][0]:.0f} s: browser {samples[-1][1]:.0f} MiB, daemon {samples[-1][2]:.0f} MiB", flush=True)
    pictures = browser.evaluate("document.querySelectorAll('.picture canvas').length")
    browser.role("button", "Stop")
    browser.role("button", "Start a take", "waitFor")
    mine = [take for take in studio.takes() if take["id"] not in known]
    return losses(mine[0]), pictures


def grew(values):
    """From the end of the first quarter to the end: medians of some samples, since garbage is collected now and then."""
    some = max(1, len(values) // 8)
    early, late = sorted(values[len(values) // 4:][:some]), sorted(values[-some:])
    return late[len(late) // 2] / early[len(early) // 2]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--cameras", type=int, default=16)
    parser.add_argument("--fps", type=float, default=5)
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--control-s", type=float, default=60)
    asked = parser.parse_args()
    enter_network()
    need_browser()
    set_up_network([])
    folder = tempfile.mkdtemp(prefix="weft-console-load-")
    studio = Studio(folder, asked.cameras, asked.fps)
    try:
        return watch(asked, studio)
    finally:
        studio.end()
        shutil.rmtree(folder, ignore_errors=True)


def watch(asked, studio):
    alone, of_alone = record_alone(studio, asked.control_s)
    browser = open_page(studio)
    begin, used, samples, missing, total = time.monotonic(), processor_s(studio.daemon.pid), [], 0, 0
    while (left := 60 * asked.minutes - (time.monotonic() - begin)) > 1:
        (lost, of), pictures = record_watched(studio, browser, min(TAKE_S, left), samples)
        missing, total = missing + lost, total + of
    daemon_share = (processor_s(studio.daemon.pid) - used) / (time.monotonic() - begin)
    troubles = [text for text in browser.troubles() if "401" not in text]  # before somebody logged in
    browser.close()
    growth = [grew([sample[k] for sample in samples]) for k in (1, 2)]
    print(f"| {asked.cameras} cameras at {asked.fps:g} fps, {asked.minutes:g} min | |\n|---|---|")
    for name, value in (("lost without a page", f"{alone} of {of_alone:,} frames"), ("lost beneath the page", f"{missing} of {total:,} frames"),
                        ("pictures shown", pictures), ("daemon", f"{100 * daemon_share:.0f} % of a core"),
                        ("memory of the browser, first and last", f"{samples[0][1]:.0f} and {samples[-1][1]:.0f} MiB, x {growth[0]:.2f}"),
                        ("memory of the daemon, first and last", f"{samples[0][2]:.0f} and {samples[-1][2]:.0f} MiB, x {growth[1]:.2f}"),
                        ("complaints of the page", len(troubles))):
        print(f"| {name} | {value} |")
    return missing * max(1, of_alone) > alone * max(1, total) or max(growth) > MOST_GROWTH


if __name__ == "__main__":
    sys.exit(main())
