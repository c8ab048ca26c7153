#!/usr/bin/env python3
"""Watches a take while it is recorded: frame sets, what is lost and why, and how much of the cloth live meshes see.

For example:  watch_take.py --server studio:7411
"""

import argparse
import sys

import weft


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("take", nargs="?", help="id of the take; default: the newest one")
    parser.add_argument("--server", help="HOST:PORT or unix:PATH; default: WEFT_SERVER")
    return parser.parse_args()


def newest(client):
    takes = client.takes.list(limit=1).takes
    if not takes:
        raise weft.NotFound("the daemon has no take; start one with `weft take start --session session.json`")
    return takes[0].id


def main():
    wanted = arguments()
    try:
        with weft.Client(wanted.server) as client, client.takes.watch(wanted.take or newest(client)) as states:
            for take in states:
                for event in take.events:
                    print(f"{event.event} sets {event.first_set} to {event.last_set} {event.camera}: {event.cause}")
                state = take.state
                line = f"{take.id}: {state.elapsed_s:.1f} s, {state.sets_recorded} sets, {state.sets_dropped} dropped"
                if take.live_job_id:
                    seen = f"{take.live.coverage:.1%} of the cloth seen, " if take.live.coverage else ""  # none of driven frames
                    line += f"; {seen}{take.live.latency_s:.1f} s after its recording"
                print(line, flush=True)
    except KeyboardInterrupt:
        print("the take goes on")
    except weft.WeftError as error:
        sys.exit(f"watch_take: {error}")


if __name__ == "__main__":
    main()
