"""Makes anew what tests of avatars share: shirt_studio.py FOLDER.

A shirt that was learnt from motions without pictures (`twist-1`, `shirt.avatar`), and `take`, another motion of it before
three cameras. Nobody changes them.
"""

import os
import shutil
import sys

from studio import weft

CELL_MM = 20


def make_shirt_studio(folder):
    def path(name):
        return os.path.join(folder, name)
    pictures = ["--cameras", 3, "--width-px", 480, "--height-px", 384]
    for seed, frames, out, more in ((1, 60, "twist-1", ["--no-pictures"]), (2, 12, "take", pictures)):
        motion = path(f"twist-{seed}.motion")
        weft("motion", "make", "--kind", "twist", "--seconds", 4, "--seed", seed, "--out", motion, check=0)
        weft("simulate", "--preset", "shirt-drive", "--cell-mm", CELL_MM, "--motion", motion, "--frames", frames, *more,
             "--out", path(out), check=0, patience_s=600)
    weft("avatar", "train", path("twist-1"), "--components", 12, "--out", path("shirt.avatar"), check=0)


if __name__ == "__main__":
    shutil.rmtree(sys.argv[1], ignore_errors=True)
    os.makedirs(sys.argv[1])
    make_shirt_studio(sys.argv[1])
