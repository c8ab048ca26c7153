"""What a studio asks of one machine: cameras are recorded by a daemon, registered live, and watched by many clients.

   WEFT_BIN=build/dev/bin python3 tests/system/studio_load.py [--seconds 600] [--watchers 100] [--live 15]

Four GigE cameras without hardware film a simulated garment, 30 frame sets a second. Prints what was recorded and lost,
the share of the processor that each program took, and how far live meshes were behind. Exit status 1 when a frame set was
lost, bytes differ from what was sent, or a client lost its stream.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

from garment_cameras import CAMERAS, FilmingCameras, make_garment
from live_studio import enter_network, read_ledger, set_up_network
from studio import BIN, LONG_S, processes_of, read, wait_for, weft
from take_studio import ADDRESS, TakeStudio

TICKS = os.sysconf("SC_CLK_TCK")
MOSAIC = "bayer_rg8"


def processor_s(pid, with_children=False):
    """User and system time of a process, and of its children that have ended."""
    fields = read(f"/proc/{pid}/stat").rsplit(")", 1)[1].split()
    return sum(map(int, fields[11:15 if with_children else 13])) / TICKS


class Shares:
    """The processor's time by program, since it was made. Workers end meanwhile: the daemon waits for them."""

    def __init__(self, studio, cameras, watchers):
        self.studio, self.programs = studio, {"cameras": cameras.process.pid, "weft-recorder": studio.recorder()[0],
                                              "weftd": studio.daemon.pid, "clients": watchers.pid}
        self.began = time.monotonic()
        self.before = self.now()

    def now(self):
        times = {name: processor_s(pid) for name, pid in self.programs.items()}
        daemon = self.studio.daemon.pid
        times["workers"] = processor_s(daemon, with_children=True) - times["weftd"]
        for worker in processes_of(self.studio.folder, "weft-worker"):
            try:
                times["workers"] += processor_s(worker)
            except FileNotFoundError:
                pass  # the next look has it among the daemon's children
        return times

    def measure(self):
        """Percent of one core, by program."""
        seconds = time.monotonic() - self.began
        return {name: 100 * (spent - self.before[name]) / seconds for name, spent in self.now().items()}


def middle(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else float("nan")


def run(options, folder):
    """Returns the measured figures."""
    garment = make_garment(folder, options.pictures, options.width, options.height, ["--readout", "mosaic"])
    pictures = os.path.join(folder, "pictures")  # a take of a mosaic, since a file of grey pixels does not say that it is one
    weft("take", "import", garment, "--mosaic", MOSAIC, "--out", pictures, check=0)
    cameras = FilmingCameras(folder, garment, pictures, options.fps, options.packet_bytes, queue_mib=options.queue_mib)
    studio = TakeStudio(os.path.join(folder, "studio"), cameras)
    os.mkdir(studio.folder)
    try:
        studio.start_daemon(workers=options.workers)
        studio.start_take()
        wait_for(studio.recorded, "the first frame set")
        studio.follow(options.live)
        with subprocess.Popen([os.path.join(BIN, "watchers"), ADDRESS, studio.id, studio.job, str(options.watchers)],
                              stdout=subprocess.PIPE, text=True) as watchers:
            shares = Shares(studio, cameras, watchers)
            time.sleep(options.seconds)
            share = shares.measure()
            studio.stop_take()
            weft("job", "cancel", studio.job, "--server", ADDRESS)  # the frames that are left are no live ones
            told = json.loads(watchers.communicate(timeout=LONG_S)[0])
        faults = studio.faults_of_take(whole=True, patience_s=LONG_S + options.seconds)
        state = studio.shown()["state"]
        ledger = read_ledger(studio.recording)
        dropped = sum(last - first + 1 for event, first, last, *_ in ledger if event == "dropped")
        return {"sets": len(studio.recorded()), "dropped": dropped, "missing": sum(line[0] == "missing" for line in ledger),
                "elapsed_s": state["elapsed_s"], "bytes": int(state["bytes_written"]), "share": share, "told": told,
                "faults": faults}
    finally:
        left = studio.close()
        cameras.close()
        if left:
            print("\n".join(left))


def print_table(figures, options):
    told, rate = figures["told"], figures["sets"] / figures["elapsed_s"]
    print(f"{CAMERAS} cameras of {options.width} x {options.height}, {options.fps} frame sets a second, "
          f"{figures['elapsed_s']:.0f} s")
    print(f"frame sets     {figures['sets']} recorded, {figures['dropped']} dropped, {figures['missing']} frames missing")
    print(f"rate           {rate:.2f} sets/s, {figures['bytes'] / figures['elapsed_s'] / 1e6:.1f} MB/s to the disk")
    for name, share in figures["share"].items():
        print(f"{name:14} {share:5.1f} % of a core")
    late, backlog = told["latency_s"], told["backlog"]
    print(f"live meshes    {len(late)} (every {options.live}th set); latency median {middle(late, 0.5):.2f} s, "
          f"95 % {middle(late, 0.95):.2f} s, worst {max(late, default=float('nan')):.2f} s")
    print(f"backlog        median {middle(backlog, 0.5)}, worst {max(backlog, default=0)} sets")
    ages = told["worst_age_s"]
    print(f"clients        {told['clients']}, {told['broken']} broke off; at least {told['least_take_updates']} updates of the "
          f"take and {told['least_job_updates']} of the job each; a state came "
          f"{statistics.median(told['age_s'] or [float('nan')]):.2f} s after it was written in the median, "
          f"{max(ages, default=float('nan')):.2f} s at worst")
    for fault in figures["faults"][:20]:
        print("FAULT", fault)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default, what in (("seconds", 60, "how long"), ("watchers", 100, "clients"), ("live", 15, "every so many sets"),
                                ("width", 640, "of the pictures"), ("height", 480, "of the pictures"),
                                ("fps", 30, "frame sets a second"), ("pictures", 12, "different ones"),
                                ("workers", 1, "of the daemon"), ("queue_mib", 512, "frames that may wait for the disk"),
                                ("packet_bytes", 9000, "of the network")):
        parser.add_argument("--" + name.replace("_", "-"), type=int, default=default, help=f"{what} (default {default})")
    options = parser.parse_args()
    set_up_network([])
    with tempfile.TemporaryDirectory(prefix="weft-load-") as folder:
        figures = run(options, folder)
    print_table(figures, options)
    told = figures["told"]
    sys.exit(1 if figures["faults"] or figures["dropped"] or figures["missing"] or told["broken"] else 0)


if __name__ == "__main__":
    enter_network()
    main()
