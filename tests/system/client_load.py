"""What many clients at once ask of a daemon, beside a server that only echoes.

   WEFT_BIN=build/dev/bin python3 tests/system/client_load.py [--clients 200] [--seconds 300]

Each client has connections with TLS and a token of its own. 4 of 10 watch a job that runs, 3 submit and cancel jobs of 900
frames, 3 fetch meshes. Meanwhile all ask for a job, 5 seconds at the echo and 5 at the daemon in turn: open loop, at half of what
the echo bears. Prints a table. Exit status 1 when a call failed, or memory grew without bound.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time

from studio import BIN, LONG_S, read, wait_for, weft, write
from studio_load import processor_s

FRAMES = 900
MOST_GROWTH = 1.3  # of the daemon's memory, from the end of the load's first quarter to its end


def resident_mib(pid):
    pages = int(read(f"/proc/{pid}/statm").split()[1])
    return pages * os.sysconf("SC_PAGESIZE") / 2**20


def make_studio(folder, clients):
    """A daemon with TLS, its clients' tokens, a take of many frames; its addresses, its certificate, key and state folder, and
    certificates of clients that it lets in for nothing."""
    data, state = os.path.join(folder, "data"), os.path.join(folder, "state")
    os.mkdir(data)
    os.mkdir(state)
    scene = os.path.join(data, "scene")
    weft("simulate", "--preset", "tiny", "--out", scene, check=0)
    first = sorted(name for name in os.listdir(scene) if name.isdigit())
    for i in range(len(first), FRAMES):  # a job that lasts: the same frames again and again
        shutil.copytree(os.path.join(scene, first[i % len(first)]), os.path.join(scene, f"{i:0{len(first[0])}d}"), copy_function=os.link)
    made = subprocess.run([os.path.join(BIN, "make_certificates"), folder], capture_output=True, text=True, check=True)
    authority, certificate, key, revocations, *strangers = made.stdout.split()
    for path in (authority, *strangers):
        os.chmod(path, 0o644)
    write(os.path.join(folder, "ca.pem"), read(authority))
    for i in range(clients):
        token = weft("access", "token", f"client-{i}", "--role", "client", "--state", state, check=0)
        write(os.path.join(folder, f"token-{i}"), token.stdout)
    log = open(os.path.join(folder, "weftd.log"), "w")
    address = os.path.join(folder, "address")
    daemon = subprocess.Popen([os.path.join(BIN, "weftd"), "--listen", "0.0.0.0:0", "--listen", "127.0.0.1:0", "--tls-cert", certificate,
                               "--tls-key", key, "--tls-client-ca", authority, "--tls-client-crl", revocations, "--address-file", address,
                               "--state", state, "--allow-path", data, "--workers", "1", "--threads-per-worker", "1"],
                              stdout=log, stderr=log)
    network, local = wait_for(lambda: os.path.exists(address) and read(address).split("\n")[:2], "weftd to listen")
    return daemon, "127.0.0.1:" + network.rsplit(":", 1)[1], local, (certificate, key, state), [authority, *strangers[:6]]


def submit(folder, local, frames, name):
    scene = os.path.join(folder, "data", "scene")
    done = weft("register", scene, "--rig", os.path.join(scene, "rig.json"), "--board", os.path.join(scene, "board.json"),
                "--template", os.path.join(scene, "template"), "--frames", frames, "--server", local, "--detach",
                "--out", os.path.join(folder, "data", name), check=0)
    return done.stdout.split()[0]


def watch_memory(pid, stop, samples):
    began = time.monotonic()
    while not stop.wait(1):
        samples.append((time.monotonic() - began, resident_mib(pid)))


def row(name, figures):
    return f"{name:34} {figures['n']:>8} {figures['p50']:>9.2f} {figures['p99']:>9.2f} {figures['max']:>9.2f}"


def show(found, memory, daemon_cpu):
    print(f"{'':34} {'calls':>8} {'p50 ms':>9} {'p99 ms':>9} {'max ms':>9}")
    for name, key in (("GetJob, echo", "echo"), ("GetJob, weftd", "daemon"), ("SubmitJob", "submit"), ("CancelJob", "cancel"),
                      ("fsync of 4 KiB", "fsync"), ("FetchResult, a mesh", "fetch"), ("WatchJob, to the first update", "first_update")):
        print(row(name, found[key]))
    print(f"saturation: echo {found['echo_saturation_per_s']:.0f} calls/s, weftd {found['daemon_saturation_per_s']:.0f}; "
          f"open loop at {found['open_loop_per_s']:.0f}/s")
    print(f"p99 of reads, weftd to echo: {found['daemon']['p99'] / found['echo']['p99']:.2f}")
    print(f"p99 of submissions less that of fsync, to the echo's: {(found['submit']['p99'] - found['fsync']['p99']) / found['echo']['p99']:.2f}")
    print(f"cores: clients {found['client_cpu_cores']:.2f}, weftd {daemon_cpu:.2f}")
    print(f"weftd's memory: {memory[0][1]:.0f} MiB at first, {max(m for _, m in memory):.0f} MiB at most, {memory[-1][1]:.0f} MiB at last")
    print(f"failed calls: {json.dumps(found['errors'])}")


def start_echo(folder, network, job, identity):
    """A server that only echoes, and its address."""
    environment = {**os.environ, "WEFT_TOKEN_FILE": os.path.join(folder, "token-0"), "WEFT_TLS_CA": os.path.join(folder, "ca.pem")}
    echo = subprocess.Popen([os.path.join(BIN, "echo_server"), network, job, *identity], env=environment, stdin=subprocess.PIPE,
                            stdout=subprocess.PIPE, text=True)
    return echo, echo.stdout.readline().strip()


def load(daemon, *arguments):
    """What the clients found, if they ended well, and the daemon's memory by time."""
    memory, stop = [], threading.Event()
    with subprocess.Popen([os.path.join(BIN, "client_load"), *map(str, arguments)], stdout=subprocess.PIPE, text=True) as clients:
        watcher = threading.Thread(target=watch_memory, args=(daemon.pid, stop, memory))
        watcher.start()
        line = clients.stdout.readline()
        stop.set()
        watcher.join()
    return json.loads(line) if line else None, memory


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clients", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=300)
    parser.add_argument("--per-second", type=float, help="rate of the open loop, to compare two daemons at the same one")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="weft-load-") as folder:
        daemon, network, local, identity, _ = make_studio(folder, options.clients)
        try:
            done = submit(folder, local, ":0001", "done")
            weft("job", "watch", done, "--server", local, check=0)
            echo, echo_address = start_echo(folder, network, done, identity)
            watched = submit(folder, local, "0003:", "watched")
            cpu, began = processor_s(daemon.pid), time.monotonic()
            found, memory = load(daemon, folder, network, echo_address, options.clients, options.seconds, watched, done,
                                 *filter(None, [options.per_second]))
            daemon_cpu = (processor_s(daemon.pid) - cpu) / (time.monotonic() - began)
            echo.stdin.close()
            echo.wait()
            if found is None:
                print(read(os.path.join(folder, "weftd.log"))[-2000:], file=sys.stderr)
                return 1
            show(found, memory, daemon_cpu)
            loaded = [m for t, m in memory if t > memory[-1][0] - 0.75 * options.seconds]
            return 1 if found["errors"] or loaded[-1] > MOST_GROWTH * loaded[0] else 0
        finally:
            daemon.terminate()
            daemon.wait()


if __name__ == "__main__":
    sys.exit(main())
