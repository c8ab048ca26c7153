#!/usr/bin/env python3
"""Makes the pictures of docs/console-tour.md, docs/pictures/console/*, by the tests that drive the console.

Usage: console_pictures.py [BUILD [SHOTS]]

BUILD is the folder of a build (build/dev), SHOTS one with pictures that the tests kept (WEFT_SCREENSHOTS); without it they run,
which takes some minutes. Needs the Debian packages chromium and ffmpeg.
"""

import os
import re
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PICTURES = os.path.join(ROOT, "docs", "pictures", "console")
TESTS = ["console_story_test.py", "console_work_test.py"]
WIDTH_PX, QUALITY = 1080, 75
MOST_BYTES = 800_000


def names():
    with open(os.path.join(ROOT, "docs", "console-tour.md"), encoding="utf-8") as file:
        return re.findall(r"\(pictures/console/([a-z-]+)\.webp\)", file.read())


def run_tests(build, shots):
    environment = {**os.environ, "WEFT_BIN": os.path.join(os.path.abspath(build), "bin"), "WEFT_SOURCE": ROOT,
                   "WEFT_SCREENSHOTS": shots, "PYTHONDONTWRITEBYTECODE": "1"}
    for test in TESTS:
        subprocess.run([sys.executable, os.path.join(ROOT, "tests", "system", test)], env=environment, check=True)


def convert(shots):
    os.makedirs(PICTURES, exist_ok=True)
    for name in names():
        subprocess.run(["ffmpeg", "-loglevel", "error", "-y", "-i", os.path.join(shots, f"{name}.png"), "-vf", f"scale={WIDTH_PX}:-1",
                        "-quality", str(QUALITY), os.path.join(PICTURES, f"{name}.webp")], check=True)
    size = sum(entry.stat().st_size for entry in os.scandir(PICTURES))
    print(f"{len(names())} pictures, {size / 1e3:.0f} kB, in {os.path.relpath(PICTURES)}")
    return size <= MOST_BYTES


def main():
    build = sys.argv[1] if len(sys.argv) > 1 else os.path.join(ROOT, "build", "dev")
    if len(sys.argv) > 2:
        return not convert(sys.argv[2])
    with tempfile.TemporaryDirectory() as shots:
        run_tests(build, shots)
        return not convert(shots)


if __name__ == "__main__":
    sys.exit(main())
