#!/usr/bin/env python3
"""Registers a recording on a daemon, and fetches meshes, clouds and reports.

For example:  submit_and_fetch.py TAKE --rig rig.json --board board.json --template shirt --out result --upload --evaluate
"""

import argparse
import os
import sys

import numpy as np

import weft


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dump", help="folder of the recording, take:ID, or library:NAME")
    parser.add_argument("--rig", required=True, help="rig.json, or library:NAME")
    parser.add_argument("--board", required=True, help="board.json or board.png, or library:NAME")
    parser.add_argument("--template", required=True, help="folder of the template, or library:NAME")
    parser.add_argument("--frames", default="", help="one frame by its name, or a range: 0120:0180; default: all")
    parser.add_argument("--out", required=True, help="folder of this machine for the results")
    parser.add_argument("--upload", action="store_true", help="send the inputs, where the daemon does not see their folders")
    parser.add_argument("--evaluate", action="store_true", help="also measure the result: OUT/evaluation/evaluation.json")
    parser.add_argument("--server", help="HOST:PORT or unix:PATH; default: WEFT_SERVER")
    return parser.parse_args()


def submit(client, wanted):
    spec = weft.v1.RegistrationSpec(dump=wanted.dump, rig=wanted.rig, board=wanted.board, garment=wanted.template,
                                    frames=wanted.frames)
    spec.options.write_observations = True  # so that the evaluation knows the residuals
    if wanted.upload:
        spec = client.jobs.upload_inputs(spec)
    return client.jobs.submit(spec)


def follow(client, job_id):
    shown = ""
    for update in client.jobs.watch(job_id):
        counts = update.job.frames
        line = f"job {job_id}: {counts.done + counts.degraded + counts.failed} of {counts.total} frames"
        if line != shown:
            print(line, flush=True)
        shown = line
    return client.jobs.get(job_id)


def evaluate(client, job_id, folder):
    spec = weft.operation_spec("evaluate", {"result": f"job:{job_id}"}, {"no-truth": ""}, "evaluation")
    operation = client.operations.wait(client.operations.start(spec).id)
    if operation.state != weft.v1.JOB_STATE_DONE:
        raise weft.WeftError(f"the evaluation failed: {operation.message}")
    client.operations.fetch(operation.id, folder)


def show(out):
    """Results are numpy arrays."""
    for frame in sorted(name for name in os.listdir(out) if os.path.exists(os.path.join(out, name, "mesh.ply"))):
        mesh = weft.read_mesh(os.path.join(out, frame, "mesh.ply"))
        low, high = mesh.vertices_mm.min(axis=0), mesh.vertices_mm.max(axis=0)
        sigma_mm = np.median(mesh.sigma_mm[mesh.observed]) if mesh.observed.any() else float("nan")
        print(f"frame {frame}: {len(mesh.vertices_mm)} vertices, {mesh.observed.mean():.1%} of them measured to "
              f"{sigma_mm:.2f} mm, {np.round(high - low)} mm large")


def main():
    wanted = arguments()
    try:
        with weft.Client(wanted.server) as client:
            job = follow(client, submit(client, wanted).id)
            client.jobs.fetch(job.id, wanted.out)
            if wanted.evaluate:
                evaluate(client, job.id, wanted.out)
    except weft.WeftError as error:
        sys.exit(f"submit_and_fetch: {error}")
    print(job.message or job.verdict.reason or weft.v1.JobState.Name(job.state))
    show(wanted.out)
    return 0 if job.state == weft.v1.JOB_STATE_DONE else 1


if __name__ == "__main__":
    sys.exit(main())
