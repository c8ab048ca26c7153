#!/usr/bin/env python3
"""Draws mutants of the product and asks which of them the unit tests kill.

   python3 tests/mutants.py --list                      the mutants that seed 1 draws, as changed lines
   python3 tests/mutants.py --count 50 --seed 7         builds and tries them; goes on where it was stopped
   python3 tests/mutants.py --here --under services/work --count 20 --seed 3
                                                        those of one folder, in this tree and its build/gate

A mutant is one small fault in a source of services/ or animation/: a comparison, a logical or an arithmetic operator, a number,
a truth value, a condition, or a statement that is left out (DeMillo, Lipton, Sayward, Computer 11(4), 1978; operators of
Offutt et al., TOSEM 5(2), 1996). It is tried in a worktree of its own, build/mutants, or with --here in this one.

Its source alone is compiled, at -O1 and without warnings, so that a statement may be left out whose variable nothing else uses.
Sources of the same unity batch that may call it are compiled with it: the compiler may have put its functions into theirs.
The object is linked ahead of the libraries, with --allow-multiple-definition, into each test program that has the source, and
into the programs that a test starts. Tests that mirror the source come first, then those of its folder, then those of folders that
include its headers, the quickest first, until one fails. A mutant that does not compile does not count, and the next is drawn.

A test has killed if it fails, ends its program, or says nothing for HANG_S, with the mutant twice and without it not at all.
After LIMIT_S nothing more is tried. Mutants that live are printed with their change. A reader says which are equivalent, and
lists them in --equivalent FILE (a line for each: path:line: change).
Needs a build first, and then half a minute or so for each mutant. Draw them in a container: one may end processes of others.
Exit status 1 when fewer than --least percent are killed.
"""

import argparse
import json
import os
import random
import re
import resource
import signal
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
FOLDERS = ("services", "animation")
TREE = os.path.join(ROOT, "build", "mutants")
LIMIT_S = 300  # of all tests of a mutant
HANG_S = 90  # of a test that says nothing
SHARDS = 4  # of a test program at once: many tests wait for others
LIMIT_BYTES = 16 << 30  # of a test program's memory, and of a file that it writes: a mutant may never stop asking for more

# What stands in code, and what a mutant has in its place.
SWAPS = [
    (re.compile(r" (<=) "), " < "), (re.compile(r" (>=) "), " > "), (re.compile(r"(?<=[\w)\]]) (<) (?=[\w(])"), " <= "),
    (re.compile(r"(?<=[\w)\]]) (>) (?=[\w(])"), " >= "), (re.compile(r" (==) "), " != "), (re.compile(r" (!=) "), " == "),
    (re.compile(r" (&&) "), " || "), (re.compile(r" (\|\|) "), " && "), (re.compile(r"(?<=[\w)\]]) (\+) (?=[\w(])"), " - "),
    (re.compile(r"(?<=[\w)\]]) (-) (?=[\w(])"), " + "), (re.compile(r"(?<=[\w)\]]) (\*) (?=[\w(])"), " / "),
    (re.compile(r"(?<=[\w)\]]) (/) (?=[\w(])"), " * "), (re.compile(r"\b(true)\b"), "false"), (re.compile(r"\b(false)\b"), "true"),
    (re.compile(r"\bif \((!)"), "if ("),
]
RESERVE = re.compile(r"^\s+[\w.>()\[\]-]+(\.|->)reserve\(.*\);$")  # room ahead of time changes no result
NUMBER = re.compile(r"(?<![\w.\"'])(\d+)(?![\w.'])")
STATEMENT = re.compile(r"^\s+(?!return|const |constexpr |static |using |case |break|continue|auto |for |if |else|\}|//|#|public|private)"
                       r"[A-Za-z_*(][\w.:>()\[\]*-]*(?:\(| = | \+= | -= |\+\+).*;$")
IF = re.compile(r"\bif \((?!const |auto |absl::)(.*)\)( \{| return.*;| continue;| break;)?$")


def git(*arguments, folder=ROOT):
    return subprocess.run(["git", *arguments], cwd=folder, check=True, capture_output=True, text=True).stdout


def text_in(path):
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.read()


def code_lines(text):
    """(number, line) of lines that are code: no includes, comments, or lines within strings that go on."""
    for number, line in enumerate(text.splitlines()):
        if line.strip() and not re.match(r"\s*(//|#|\"|namespace|\})", line):
            yield number, line


def outside_strings(line, start):
    return line[:start].count('"') % 2 == 0 and "//" not in line[:start]


def mutations(line):
    """All faults that may be made of a line, as lines."""
    if RESERVE.match(line):
        return
    for pattern, new in SWAPS:
        for found in pattern.finditer(line):
            if outside_strings(line, found.start()) and "template" not in line and "#include" not in line:
                yield line[:found.start()] + new + line[found.end():]
    for found in NUMBER.finditer(line):
        if outside_strings(line, found.start()):
            yield line[:found.start()] + str(int(found.group(1)) + 1) + line[found.end():]
    if STATEMENT.match(line):
        yield re.match(r"\s*", line).group(0) + ";"
    condition = IF.search(line)
    if condition and line.count("(") == line.count(")"):
        yield line[:condition.start(1)] + f"!({condition.group(1)})" + line[condition.end(1):]


def draw(seed, folders=FOLDERS):
    """Mutants without end: path, number of the line, and what stands there instead."""
    chance = random.Random(seed)
    sources = [path for path in git("ls-files", *folders).splitlines() if path.endswith(".cpp") and not path.endswith("main.cpp")]
    everywhere = []  # each line of code is as likely as any other
    for path in sources:
        everywhere += [(path, number, line) for number, line in code_lines(text_in(os.path.join(ROOT, path)))]
    seen = set()
    while True:
        path, number, line = chance.choice(everywhere)
        possible = sorted(set(mutations(line)) - {line})
        if not possible:
            continue
        mutant = (path, number, chance.choice(possible))
        if mutant not in seen:
            seen.add(mutant)
            yield mutant


def text_of(mutant):
    path, number, new = mutant
    return f"{path}:{number + 1}: {new.strip()}"


def including_folders(path):
    """The folder of a source and those whose sources include its headers, the own one first."""
    folder = os.path.dirname(path)
    including = {os.path.dirname(file) for file in git("grep", "-l", f'#include "{folder}/', "--", "*.cpp", "*.h").splitlines()}
    return [folder] + sorted(f for f in including if f != folder and not f.startswith("tests"))


def tests_of(path, seconds):
    """Names of the test programs for a source: those of its folder, then the others, each by their seconds."""
    ranks = {}
    for rank, folder in enumerate(including_folders(path)):
        parts = folder.split("/")
        for depth in range(len(parts), 0, -1):
            lists = os.path.join(ROOT, "tests", *parts[:depth], "CMakeLists.txt")
            if os.path.exists(lists):
                for name in re.findall(r"^weft_test\((\w+)", text_in(lists), re.MULTILINE):
                    ranks.setdefault(name, rank > 0)
                break
    ranks.pop("simulation_command_test", None)
    return sorted(ranks, key=lambda name: (ranks[name], seconds.get(name, 0)))


def own_tests(tree, path):
    """What the tests that mirror a source are called, as --gtest_filter has it; empty without any."""
    mirror = os.path.join(tree, "tests", path[:-len(".cpp")] + "_test.cpp")
    if not os.path.exists(mirror):
        return ""
    suites = set(re.findall(r"^(?:TYPED_)?TEST(?:_F|_P)?\((\w+),", text_in(mirror), re.MULTILINE))
    return ":".join(f"{suite}.*:{suite}/*:*/{suite}.*" for suite in sorted(suites))


def includes_of(tree, path, known):
    """All headers of the tree that a file includes, itself or through others."""
    if path not in known:
        known[path] = set()
        for name in re.findall(r'^#include "([^"]+)"', text_in(os.path.join(tree, path)), re.MULTILINE):
            if os.path.exists(os.path.join(tree, name)):
                known[path] |= {name} | includes_of(tree, name, known)
    return known[path]


def callers_of(tree, path, batch):
    """Sources of a batch that include the header of a source, which may call it."""
    header = path[:-len(".cpp")] + ".h"
    known = {}
    headers = {header} if os.path.exists(os.path.join(tree, header)) else includes_of(tree, path, known)
    return [other for other in batch if other != path and headers & includes_of(tree, other, known)]


def is_in(command, link):
    """Whether a program has the object of a command that compiles, itself or in its library."""
    compiled = re.search(r" -o (\S+) -c", command).group(1)
    library = re.sub(r"CMakeFiles/([^/]+)\.dir/.*", r"lib\1.a", compiled)
    return bool({compiled, library} & set(link.split()))


def blamed(output):
    """The test that failed, or else the last that began, by what a program said; empty if it said nothing."""
    failed, begun = (re.findall(rf"^\[ {word} \] (\w[\w./]*)", text_in(output), re.MULTILINE) for word in (" FAILED ", "RUN     "))
    return (failed or begun[-1:] or [""])[0]


class Build:
    """A build tree: how a source is compiled, what links a program, and how long its tests take."""

    def __init__(self, tree):
        self.tree, self.gate = tree, os.path.join(tree, "build", "gate")
        self.folder = os.path.join(self.gate, "mutant")
        os.makedirs(self.folder, exist_ok=True)
        self.commands, self.batches = {}, {}  # of a source: what compiles it, and the sources that are compiled with it
        for entry in json.loads(text_in(os.path.join(self.gate, "compile_commands.json"))):
            batch = [entry["file"]]
            if "/Unity/" in entry["file"]:
                batch = re.findall(r'^#include "([^"]+)"', text_in(entry["file"]), re.MULTILINE)
            batch = [os.path.relpath(source, tree) for source in batch]
            for source in batch:
                self.commands[source], self.batches[source] = entry["command"], batch
        self.links = {}
        self.relinked = []
        self.seconds = {}  # that test programs took at the last time
        for name in os.listdir(self.program("")):  # a run before this one was ended
            if name.endswith(".clean"):
                os.replace(self.program(name), self.program(name[:-len(".clean")]))

    def program(self, name):
        return os.path.join(self.gate, "bin", name)

    def compile(self, mutant):
        """The mutant's object file; none if it does not compile."""
        path, number, new = mutant
        lines = text_in(os.path.join(self.tree, path)).splitlines()
        lines[number] = new
        source, together, compiled = (os.path.join(self.folder, name) for name in (os.path.basename(path), "mutant.cxx", "mutant.o"))
        with open(source, "w", encoding="utf-8") as file:
            file.write("\n".join(lines) + "\n")
        callers = callers_of(self.tree, path, self.batches[path])
        with open(together, "w", encoding="utf-8") as file:
            for name in [name for name in self.batches[path] if name == path or name in callers]:
                file.write(f'#include "{source if name == path else os.path.join(self.tree, name)}"\n')
        command = re.sub(r" -o \S+ -c \S+$", f" -O1 -w -Wno-error -o {compiled} -c {together}", self.commands[path])
        done = subprocess.run(command, shell=True, cwd=self.gate, capture_output=True, check=False)
        return compiled if done.returncode == 0 else None

    def links_of(self, name):
        """What links a test program and the programs that it starts, by their names."""
        if name not in self.links:
            commands = subprocess.run(["ninja", "-t", "commands", f"bin/{name}"], cwd=self.gate, capture_output=True, text=True,
                                      check=True)
            links = [command.split(" && ")[1] for command in commands.stdout.splitlines() if " -o bin/" in command]
            self.links[name] = {re.search(r" -o bin/(\S+)", link).group(1): link for link in links}
        return self.links[name]

    def has(self, name, path):
        """Whether a test program, or one that it starts, has a source."""
        return any(is_in(self.commands[path], link) for link in self.links_of(name).values())

    def relink(self, name, path, compiled):
        """Links an object ahead of the source's own into a test program and those that it starts."""
        for program, link in self.links_of(name).items():
            if program not in self.relinked and is_in(self.commands[path], link):
                os.replace(self.program(program), self.program(program + ".clean"))
                self.relinked.append(program)
                link = link.replace(" -o bin/", f" {compiled} -Wl,--allow-multiple-definition -o bin/", 1)
                subprocess.run(link, shell=True, cwd=self.gate, check=True)

    def restore(self):
        for program in self.relinked:
            os.replace(self.program(program + ".clean"), self.program(program))
        self.relinked = []

    def start(self, name, tests, shard, shards):
        """A process of some tests of a program, and the file of what it says."""

        def limit():
            for kind in (resource.RLIMIT_AS, resource.RLIMIT_FSIZE):
                resource.setrlimit(kind, (LIMIT_BYTES, LIMIT_BYTES))

        output = os.path.join(self.folder, f"output-{shard}")
        environment = {**os.environ, "GTEST_TOTAL_SHARDS": str(shards), "GTEST_SHARD_INDEX": str(shard)}
        with open(output, "w", encoding="utf-8") as file:
            command = [self.program(name), "--gtest_fail_fast", f"--gtest_filter={tests}"]
            return subprocess.Popen(command, stdout=file, stderr=subprocess.STDOUT, cwd=self.tree, env=environment,
                                    start_new_session=True, preexec_fn=limit), output

    def run(self, name, tests, until):
        """The first test that a program fails, ends in or hangs in; empty if none does until then."""
        shards = SHARDS if tests == "*" else 1
        started = [self.start(name, tests, shard, shards) for shard in range(shards)]
        said = {output: (0, time.monotonic()) for _, output in started}
        try:
            while time.monotonic() < until:
                statuses = [process.poll() for process, _ in started]
                for (_, output), status in zip(started, statuses):
                    if os.path.getsize(output) != said[output][0]:
                        said[output] = (os.path.getsize(output), time.monotonic())
                    if status or status is None and time.monotonic() > said[output][1] + HANG_S:
                        return blamed(output) or tests
                if None not in statuses:
                    break
                time.sleep(0.05)
            return ""
        finally:
            for process, _ in started:
                try:
                    os.killpg(process.pid, signal.SIGKILL)  # and what it started
                except ProcessLookupError:
                    pass
                process.wait()

    def fails(self, name, mutant, compiled, tests, until):
        """The first test of a program that the mutant fails, each time, and that passes without it; empty if none does."""
        self.relink(name, mutant[0], compiled)
        test = self.run(name, tests, until)
        if not test:
            return ""
        self.restore()
        if self.run(name, test, time.monotonic() + LIMIT_S):
            return ""
        self.relink(name, mutant[0], compiled)
        return test if self.run(name, test, time.monotonic() + LIMIT_S) else ""


def try_one(mutant, build):
    """"killed by NAME: TEST", "lives" or "does not compile"."""
    path = mutant[0]
    compiled = build.compile(mutant)
    if not compiled:
        return "does not compile"
    programs = [name for name in tests_of(path, build.seconds) if build.has(name, path)]
    mirror = own_tests(build.tree, path)
    rounds = [(name, mirror) for name in programs[:1] if mirror] + [(name, "*") for name in programs]
    until = time.monotonic() + LIMIT_S
    try:
        for name, tests in rounds:
            began = time.monotonic()
            test = build.fails(name, mutant, compiled, tests, until)
            if test:
                return f"killed by {name}: {test}"
            if time.monotonic() >= until:
                return f"lives until {name}, which had no time"
            if tests == "*":
                build.seconds[name] = time.monotonic() - began
        return f"lives in {', '.join(programs)}" if programs else "lives, as no unit test has it"
    finally:
        build.restore()


def prepare(here):
    """The build that mutants are tried in, with the tests as they are."""
    tree = ROOT if here else TREE
    if here and git("status", "--porcelain", "--untracked-files=no"):
        sys.exit("mutants are tried in a tree without changes; commit them first")
    if not here:
        if not os.path.exists(tree):
            git("worktree", "add", "--detach", tree, "HEAD")
        git("checkout", "--quiet", "--detach", git("rev-parse", "HEAD").strip(), folder=tree)
        git("checkout", "--quiet", "--", ".", folder=tree)
        subprocess.run(["cmake", "--preset", "gate"], cwd=tree, check=True, stdout=subprocess.DEVNULL)
    print("builds the tests as they are", flush=True)
    done = subprocess.run(["cmake", "--build", os.path.join(tree, "build", "gate"), "--target", "fast_tests"], capture_output=True,
                          text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"the tests do not build without a mutant:\n{done.stdout[-2000:]}")
    return Build(tree)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=50, help="of mutants that compile (default 50)")
    parser.add_argument("--seed", type=int, default=1, help="another one draws others (default 1)")
    parser.add_argument("--least", type=float, default=85, help="percent that are to be killed (default 85)")
    parser.add_argument("--equivalent", help="a file that lists mutants that change nothing")
    parser.add_argument("--record", help="a file of what came of each mutant (default build/mutants-COMMIT-SEED.jsonl)")
    parser.add_argument("--list", action="store_true", help="only draw them")
    parser.add_argument("--under", action="append", help="a folder that they are drawn from (default services and animation)")
    parser.add_argument("--here", action="store_true", help="tries them in this tree, which has no changes, and its build/gate")
    options = parser.parse_args()
    folders = options.under or FOLDERS
    if options.list:
        for mutant, _ in zip(draw(options.seed, folders), range(options.count)):
            print(f"{text_of(mutant)}    [{', '.join(tests_of(mutant[0], {}))}]")
        return 0
    equivalent = set()
    if options.equivalent:
        equivalent = {line.strip() for line in text_in(options.equivalent).splitlines() if line.strip()}
    build = prepare(options.here)
    record = options.record or os.path.join(ROOT, "build", f"mutants-{git('rev-parse', '--short', 'HEAD').strip()}-{options.seed}.jsonl")
    known = {}
    if os.path.exists(record):
        known = dict(json.loads(line) for line in text_in(record).splitlines())
    tried, killed, alive = 0, 0, []
    for mutant in draw(options.seed, folders):
        if tried == options.count:
            break
        text, began = text_of(mutant), time.monotonic()
        if text in equivalent:
            continue
        if text not in known:
            known[text] = try_one(mutant, build)
            with open(record, "a", encoding="utf-8") as file:
                file.write(json.dumps([text, known[text]]) + "\n")
        if known[text] == "does not compile":
            continue
        tried += 1
        killed += known[text].startswith("killed")
        if known[text].startswith("lives"):
            before = text_in(os.path.join(ROOT, mutant[0])).splitlines()[mutant[1]].strip()
            alive.append(f"{text}    in place of {before}")
        print(f"{tried:3}  {time.monotonic() - began:5.0f} s  {known[text]:40}  {text}", flush=True)
    share = 100 * killed / max(1, tried)
    print(f"{killed} of {tried} mutants are killed, {share:.0f} %")
    for text in alive:
        print(f"lives: {text}")
    return 0 if share >= options.least else 1


if __name__ == "__main__":
    sys.exit(main())
