#!/usr/bin/env python3
"""Shows a driven garment beside the truth: a film or a sheet of pictures, with sigma and the error as colour.

FOLDER is that of one take and number of cameras below `weft evaluate SOURCE --avatar AVATAR --meshes OUT`: in each frame's
folder lie mesh.ply, with sigma, and truth.ply. A film needs ffmpeg. Needs Debian's python3-matplotlib.

For example:  watch_driving.py OUT/test-unseen-squat-401-2 --out squat.mp4
              watch_driving.py OUT/test-unseen-squat-401-2 --every 20 --out squat.png
"""

import argparse
import os
import sys

import matplotlib
import numpy as np

import weft

matplotlib.use("Agg")  # no display is needed
from matplotlib import animation, collections, pyplot  # noqa: E402

# Directions from which the garment is looked at, in the axes of a studio: x right, y down, -z towards the front.
SIDES = {"front": (np.array([1.0, 0, 0]), np.array([0, 0, -1.0])), "back": (np.array([-1.0, 0, 0]), np.array([0, 0, 1.0])),
         "left": (np.array([0, 0, 1.0]), np.array([1.0, 0, 0])), "right": (np.array([0, 0, -1.0]), np.array([-1.0, 0, 0]))}
DOWN = np.array([0, 1.0, 0])


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", help="folder with a folder for each frame")
    parser.add_argument("--out", default="driving.mp4", help="film (.mp4), or sheet of pictures (.png); default: driving.mp4")
    parser.add_argument("--side", choices=sorted(SIDES), default="front", help="from which to look; default: front")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="every Nth frame; default: each")
    parser.add_argument("--most-mm", type=float, default=30, help="sigma and error of the last colour; default: 30")
    parser.add_argument("--fps", type=float, default=15, help="of the film; default: 15")
    return parser.parse_args()


class Frame:
    """A frame's meshes, and how far the driven one is off."""

    def __init__(self, folder):
        self.name = os.path.basename(folder)
        self.driven = weft.read_mesh(os.path.join(folder, "mesh.ply"))
        self.truth = weft.read_mesh(os.path.join(folder, "truth.ply"))
        self.error_mm = np.linalg.norm(self.driven.vertices_mm - self.truth.vertices_mm, axis=1)

    def title(self):
        sigma = self.driven.sigma_mm
        return (f"{self.name}: error {self.error_mm.mean():.1f} mm, worst {self.error_mm.max():.0f}, "
                f"{np.mean(self.error_mm < sigma):.0%} within sigma")


def polygons(mesh, side, values, most):
    """Triangles as seen from a side, the near ones last: outlines in mm and colours."""
    right, towards = SIDES[side]
    corners = mesh.vertices_mm[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    order = np.argsort(corners.mean(axis=1) @ towards)
    shade = 0.35 + 0.65 * np.abs(normals @ towards)
    if values is None:
        colours = np.repeat(0.9 * shade[:, None], 3, axis=1)
    else:
        colours = matplotlib.colormaps["turbo"](np.clip(values[mesh.faces].mean(axis=1) / most, 0, 1))[:, :3] * shade[:, None]
    return np.stack([corners @ right, -(corners @ DOWN)], axis=-1)[order], colours[order]


def draw(axes, frame, wanted):
    panels = (("truth", frame.truth, None), ("driven, sigma", frame.driven, frame.driven.sigma_mm),
              ("driven, error", frame.driven, frame.error_mm))
    for axis, (name, mesh, values) in zip(axes, panels, strict=True):
        axis.clear()
        axis.set_axis_off()
        axis.set_aspect("equal")
        outlines, colours = polygons(mesh, wanted.side, values, wanted.most_mm)
        axis.add_collection(collections.PolyCollection(outlines, facecolors=colours, edgecolors="none", antialiaseds=False))
        middle = frame.truth.vertices_mm.mean(axis=0)
        x, y = middle @ SIDES[wanted.side][0], -(middle @ DOWN)
        axis.set_xlim(x - 550, x + 550)
        axis.set_ylim(y - 550, y + 550)
        axis.set_title(f"{name} (0 to {wanted.most_mm:g} mm)" if values is not None else name, fontsize=8)
    axes[0].text(0, -0.02, frame.title(), transform=axes[0].transAxes, fontsize=8)


def film(frames, wanted):
    figure, axes = pyplot.subplots(1, 3, figsize=(12, 4.4), layout="constrained")
    writer = animation.FFMpegWriter(fps=wanted.fps)
    with writer.saving(figure, wanted.out, dpi=100):
        for frame in frames:
            draw(axes, frame, wanted)
            writer.grab_frame()
    pyplot.close(figure)


def sheet(frames, wanted):
    frames = list(frames)
    figure, axes = pyplot.subplots(len(frames), 3, figsize=(9, 3.1 * len(frames)), squeeze=False, layout="constrained")
    for row, frame in zip(axes, frames, strict=True):
        draw(row, frame, wanted)
    figure.savefig(wanted.out, dpi=70)
    pyplot.close(figure)


def main():
    wanted = arguments()
    try:
        names = sorted(name for name in os.listdir(wanted.folder)
                       if os.path.exists(os.path.join(wanted.folder, name, "truth.ply")))[:: max(1, wanted.every)]
        if not names:
            sys.exit(f"watch_driving: {wanted.folder}: no frame has a truth.ply; `weft evaluate --avatar --meshes` writes them")
        frames = (Frame(os.path.join(wanted.folder, name)) for name in names)
        (sheet if wanted.out.endswith(".png") else film)(frames, wanted)
    except (weft.WeftError, OSError) as error:
        sys.exit(f"watch_driving: {error}")
    print(f"{wanted.out}: {len(names)} frames")


if __name__ == "__main__":
    main()
