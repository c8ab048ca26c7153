#!/usr/bin/env python3
"""Plots how much of the cloth each frame of a result measured, and the drift of its correspondence.

Coverage comes from RESULT/<frame>/report.json; drift from the evaluation.json of `weft evaluate --out`, or of
submit_and_fetch.py --evaluate. Needs Debian's python3-matplotlib.

For example:  plot_coverage.py result --evaluation result/evaluation/evaluation.json --out coverage.png
"""

import argparse
import math
import os
import sys

import matplotlib

import weft

matplotlib.use("Agg")  # no display is needed
from matplotlib import pyplot  # noqa: E402


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("result", help="folder of the results of a job")
    parser.add_argument("--evaluation", help="its evaluation.json")
    parser.add_argument("--out", default="coverage.png", help="picture to write: .png, .pdf or .svg; default: coverage.png")
    return parser.parse_args()


def coverage_of(result):
    """Share of the cells that were measured, by frame."""
    reports = [weft.read_report(path) for name in sorted(os.listdir(result))
               if os.path.exists(path := os.path.join(result, name, "report.json"))]
    return {report.frame: report.mesh.coverage for report in reports}


def drift_of(path):
    """Median drift from a frame to the next in mm, where it could be measured."""
    frames = weft.read_evaluation(path).frames
    return {frame.frame: frame.measures.texture_drift_mm.median if frame.measures.HasField("texture_drift_mm") else math.nan
            for frame in frames}


def plot(series, out):
    """One plot below the other, of [(label, {frame: value})]."""
    figure, axes = pyplot.subplots(len(series), 1, sharex=True, squeeze=False, layout="constrained")
    for axis, (label, values) in zip(axes[:, 0], series, strict=True):
        axis.plot(list(values), list(values.values()), marker="o")
        axis.set_ylabel(label)
        axis.set_ylim(0, 1.1 * max((value for value in values.values() if value > 0), default=1))
        axis.grid(True)
    axes[-1, 0].set_xlabel("frame")
    figure.savefig(out)
    pyplot.close(figure)


def main():
    wanted = arguments()
    try:
        series = [("measured share of cells", coverage_of(wanted.result))]
        if wanted.evaluation:
            series.append(("drift to the next frame (mm)", drift_of(wanted.evaluation)))
    except (weft.WeftError, OSError) as error:
        sys.exit(f"plot_coverage: {error}")
    if not series[0][1]:
        sys.exit(f"plot_coverage: {wanted.result}: no frame has a report.json; give the folder of a job's results")
    plot(series, wanted.out)
    values = series[0][1].values()
    print(f"{wanted.out}: {len(values)} frames, coverage {min(values):.1%} to {max(values):.1%}")


if __name__ == "__main__":
    main()
