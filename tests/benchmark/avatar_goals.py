#!/usr/bin/env python3
"""Compares an evaluation of sparse-view driving with the goals of avatar_goals.json.

    weft evaluate shirt-drive --avatar shirt.avatar --cameras 2,3,4,8 --json > evaluation.json
    python3 tests/benchmark/avatar_goals.py evaluation.json [--avatar shirt.avatar]

Prints a row for each goal whose scores are there: those of the splits test-known and test-unseen of a data set, and of the
avatar's size. Exit status 1 when one is missed.

A goal says the largest `must` and `aim` of a `value` of the score of a `method` ("driven" if none is named) before so many
`cameras`. `over` another method, or `over_value`, makes it a ratio; `off_percent` a distance from a share. Cameras: "most", or
"each" over the number before it, the worst. "avatar_mb" is the size of the folder.
"""

import argparse
import json
import os
import sys

GOALS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "avatar_goals.json")


def score_of(scores, split, cameras, method):
    for score in scores:
        if (score["split"], score["cameras"], score["method"]) == (split, cameras, method) and score["frames"] > 0:
            return score
    return None


def value_of(goal, scores, split):
    """The value of a goal in a split; None where its scores are not there."""
    field, method = goal["value"], goal.get("method", "driven")
    of_method = sorted((s for s in scores if s["split"] == split and s["method"] == method and s["frames"] > 0),
                       key=lambda score: score["cameras"])
    if goal["cameras"] == "each":
        ratios = [after[field] / before[field] for before, after in zip(of_method, of_method[1:]) if before[field] > 0]
        return max(ratios, default=None)
    if goal["cameras"] == "most":
        there = [score for score in of_method if field in score]
        return there[-1][field] if there else None
    score = score_of(scores, split, goal["cameras"], method)
    if score is None or ("threads" in goal and score["threads"] != goal["threads"]):
        return None
    value = float(score[field])  # 64-bit integers are text in JSON
    if "off_percent" in goal:
        return abs(100 * value - goal["off_percent"])
    if "over" in goal or "over_value" in goal:
        other = score_of(scores, split, goal["cameras"], goal["over"]) if "over" in goal else score
        below = other[goal.get("over_value", field)] if other else 0
        return value / below if value > 0 and below > 0 else None
    return value


def rows(scores, goals):
    """(id, what, value, must, aim) of the goals whose scores are there."""
    for goal in goals:
        for split in goal.get("splits", []):
            value = value_of(goal, scores, split)
            if value is not None:
                cameras = f", {goal['cameras']} cameras" if isinstance(goal["cameras"], int) else ""
                yield goal["id"], f"{goal['what']}, {split}{cameras}", value, goal["must"], goal["aim"]


def megabytes(folder):
    return sum(entry.stat().st_size for entry in os.scandir(folder) if entry.is_file()) / 1e6


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("evaluation", help="what `weft evaluate SOURCE --avatar AVATAR --json` printed")
    parser.add_argument("--avatar", help="the folder of the avatar, for its size")
    options = parser.parse_args()
    with open(options.evaluation, encoding="utf-8") as file:
        scores = json.load(file)["scores"]
    with open(GOALS, encoding="utf-8") as file:
        goals = json.load(file)
    table = list(rows(scores, goals))
    if options.avatar:
        table += [(goal["id"], goal["what"], megabytes(options.avatar), goal["must"], goal["aim"])
                  for goal in goals if goal["value"] == "avatar_mb"]
    if not table:
        sys.exit(f"{options.evaluation}: has no scores that a goal is about; evaluate the splits of a data set")
    print(f"{'goal':4}  {'what, at most':66}  {'value':>8}  {'must':>8}  {'aim':>8}")
    for name, what, value, must, aim in table:
        verdict = "missed" if value > must else "met, with the aim" if value <= aim else "met"
        print(f"{name:4}  {what:66}  {value:8.3f}  {must:8.3g}  {aim:8.3g}  {verdict}")
    missed = sum(value > must for _, _, value, must, _ in table)
    print(f"{missed} of {len(table)} goals are missed")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
