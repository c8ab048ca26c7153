"""Runs the fuzz targets with libFuzzer, which follows coverage, and with address and undefined-behaviour sanitizers.

   python3 tests/fuzz/run.py                            all targets, 1 M inputs or 30 minutes of the processor each
   python3 tests/fuzz/run.py requests --seconds 60      one of them, for a minute
   python3 tests/fuzz/run.py --keep                     keeps what reached new code in tests/fuzz/corpus

Builds the preset `fuzz` first, which needs clang 16 (deploy/install-packages.sh --with-fuzz). A run replays the target's seeds and
its corpus, and starts from them. What fails is left as a file in build/fuzz/failures; the program repeats it:
build/fuzz/bin/fuzz_TARGET FILE. Exit status 1 when one failed.
"""

import argparse
import concurrent.futures
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BUILD = os.path.join(ROOT, "build", "fuzz")
LARGEST_KEPT_BYTES = 2048
MOST_KEPT = 150
INTERRUPTED, TIMEOUT = 72, 70  # libFuzzer's exit statuses after SIGINT and -timeout
SECONDS_FOR_ONE = 60
SECONDS_TO_END = 20
SANITIZERS = {"LSAN_OPTIONS": f"print_suppressions=0:suppressions={ROOT}/tests/fuzz/lsan_suppressions.txt",
              "ASAN_SYMBOLIZER_PATH": shutil.which("llvm-symbolizer-16") or ""}


def targets():
    folder = os.path.dirname(os.path.abspath(__file__))
    return sorted(name[5:-4] for name in os.listdir(folder) if name.startswith("fuzz_") and name.endswith(".cpp"))


def corpus_of(target):
    return os.path.join(ROOT, "tests", "fuzz", "corpus", target)


def processor_s(pid):
    with open(f"/proc/{pid}/stat", encoding="utf-8") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")


def interrupt(process):
    """Its time is over: it prints its figures and ends. libFuzzer's handler allocates, so it waits for itself for ever where
    the signal came within an allocation."""
    process.send_signal(signal.SIGINT)
    try:
        process.wait(SECONDS_TO_END)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def fuzz(program, folder, arguments, limit_s=None, **environment):
    """Runs a target with libFuzzer's arguments, at most so long of the processor; returns exit status, output and
    seconds of the processor."""
    spent_s = 0
    with tempfile.TemporaryFile("w+", errors="replace") as output:
        with subprocess.Popen([program, *arguments], cwd=folder, env={**os.environ, **SANITIZERS, **environment},
                              stdout=output, stderr=subprocess.STDOUT) as process:
            while process.poll() is None:
                spent_s = processor_s(process.pid)
                if limit_s is not None and spent_s >= limit_s:
                    interrupt(process)
                time.sleep(0.2)
        output.seek(0)
        stopped = process.returncode == -signal.SIGKILL and limit_s is not None and spent_s >= limit_s
        return INTERRUPTED if stopped else process.returncode, output.read(), spent_s


def keep(program, folder, target):
    """Replaces the kept corpus by the smallest set of small inputs that reaches the same code."""
    small, fewest = os.path.join(folder, "small"), os.path.join(folder, "fewest")
    for made in (small, fewest):
        os.mkdir(made)
    found = os.path.join(folder, "found")
    for source in (corpus_of(target), found):
        for name in os.listdir(source) if os.path.isdir(source) else ():
            if os.path.getsize(os.path.join(source, name)) <= LARGEST_KEPT_BYTES:
                shutil.copy(os.path.join(source, name), small)
    status, output, _ = fuzz(program, folder, ["-merge=1", fewest, small])
    if status != 0 or not os.listdir(fewest):
        print(f"{target}: the corpus stays as it is, since no smaller one could be made\n{output[-2000:]}")
        return
    shutil.rmtree(corpus_of(target), ignore_errors=True)
    os.makedirs(corpus_of(target))
    by_size = sorted(os.listdir(fewest), key=lambda name: (os.path.getsize(os.path.join(fewest, name)), name))
    for name in by_size[:MOST_KEPT]:
        shutil.copy(os.path.join(fewest, name), corpus_of(target))


def was_kept_waiting(program, folder, output):
    """Whether the input that took too long is quick by the processor: libFuzzer counts the clock on the wall, which
    goes on while a full machine lets the program wait."""
    slow = re.search(r"Test unit written to (\S*timeout-\S+)", output)
    if not slow:
        return False
    status, _, cpu_s = fuzz(program, folder, ["-timeout=1200", "-rss_limit_mb=8192", slow.group(1)], SECONDS_FOR_ONE)
    if status != 0:
        return False
    print(f"{os.path.basename(slow.group(1))} took over {SECONDS_FOR_ONE} s, {cpu_s:.1f} of the processor when repeated: "
          "the machine was full")
    os.remove(slow.group(1))
    return True


def run(target, options):
    """Prints the line of one target; whether nothing failed."""
    program = os.path.join(options.programs, f"fuzz_{target}")
    failures = os.path.join(BUILD, "failures")
    os.makedirs(failures, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="weft-fuzz-") as folder:
        for name in ("found", "seeds"):
            os.mkdir(os.path.join(folder, name))
        fuzz(program, folder, ["-runs=0"], WEFT_FUZZ_SEEDS=os.path.join(folder, "seeds"))
        folders = ["found", "seeds"] + ([corpus_of(target)] if os.path.isdir(corpus_of(target)) else [])
        limits = [f"-seed={options.seed}", "-max_len=65536", f"-timeout={SECONDS_FOR_ONE}", "-rss_limit_mb=8192",
                  "-print_final_stats=1", f"-artifact_prefix={failures}/{target}-"]
        began, cpu_s = time.monotonic(), 0
        # All of the corpus, however little time there is.
        status, output, _ = fuzz(program, folder, ["-runs=0", *limits, *folders])
        if status == 0:
            status, output, cpu_s = fuzz(program, folder, [f"-runs={options.inputs}", *limits, *folders], options.seconds)
        seconds = time.monotonic() - began
        inputs = re.findall(r"stat::number_of_executed_units:\s*(\d+)", output)
        reached = re.findall(r"cov: (\d+) ft: (\d+) corp: (\d+)", output) or [("?", "?", "?")]
        passed = status in (0, INTERRUPTED) or (status == TIMEOUT and was_kept_waiting(program, folder, output))
        print(f"{target:14}  {int(inputs[0]) if inputs else 0:10,}  {seconds:8.0f}  {cpu_s:8.0f}  {reached[-1][0]:>6}"
              f"  {reached[-1][2]:>6}  {'pass' if passed else 'FAIL'}", flush=True)
        if not passed:
            with open(os.path.join(failures, f"{target}.log"), "w") as log:
                log.write(output)
            print("\n".join(output.splitlines()[-30:]))
        if options.keep:
            keep(program, folder, target)
    return passed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=f"of {', '.join(targets())}; all by default")
    parser.add_argument("--inputs", type=int, default=1_000_000, help="for each target (default 1,000,000)")
    parser.add_argument("--seconds", type=int, default=1800, help="of the processor for each target at most (default 1800)")
    parser.add_argument("--seed", type=int, default=0, help="of the mutations; another each time by default")
    parser.add_argument("--keep", action="store_true", help="keep inputs that reach new code in tests/fuzz/corpus")
    parser.add_argument("--no-build", action="store_true", help="run what is built")
    parser.add_argument("--programs", default=os.path.join(BUILD, "bin"), help="where targets are built (default build/fuzz/bin)")
    parser.add_argument("--at-once", type=int, default=1, metavar="N", help="so many targets (default 1)")
    options = parser.parse_args()
    unknown = [target for target in options.targets if target not in targets()]
    if unknown:
        parser.error(f"no target {', '.join(unknown)}; there are {', '.join(targets())}")
    if not options.no_build:
        subprocess.run(["cmake", "--preset", "fuzz"], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
        subprocess.run(["cmake", "--build", "--preset", "fuzz"], cwd=ROOT, check=True)
    print(f"{'target':14}  {'inputs':>10}  {'s':>8}  {'CPU s':>8}  {'edges':>6}  {'corpus':>6}")
    with concurrent.futures.ThreadPoolExecutor(options.at_once) as pool:
        results = list(pool.map(lambda target: run(target, options), options.targets or targets()))
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
