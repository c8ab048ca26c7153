#!/usr/bin/env python3
"""Prints figures of the source tree: long functions, sources with a unit test, lines of services/.

Usage: figures.py [ROOT] [--against COMMIT] [--check]

Functions of the product's C++ over 60 lines: that of folders whose README says what they may include, so neither tests/
nor clients/. Universal Ctags parses them (Debian package universal-ctags). A function's lines are those from its name to
its closing brace; a lambda is part of the function around it.

Sources with a unit test: X.cpp has one where tests/<folder>/X_test.cpp exists. A source without a header of its name
implements part of another one: it counts by the test of the longest name that begins its own and has a header in its
folder, daemon_listen.cpp by daemon_test.cpp. main.cpp does not count.

Lines of services/: of .h and .cpp, comments and blank lines included, by wing and room. --against COMMIT adds the
difference to a commit. A room keeps its name when it moves: services/<wing>/<room> was services/<room> before wings.

--check prints the long functions alone and fails where they are more than 3.
"""

import argparse
import collections
import io
import json
import os
import shutil
import subprocess
import sys
import tarfile

from check_structure import rules_of, stage_files, text

LONG_LINES = 60
MOST_LONG = 3
Function = collections.namedtuple("Function", "lines path line name")


def sources(root, endings):
    """Paths of the product's sources, relative to `root`."""
    return [path.replace(os.sep, "/") for _, path in stage_files(root, endings)]


def functions(root):
    ctags = shutil.which("ctags-universal")
    if not ctags:
        sys.exit("figures.py: Universal Ctags is missing (Debian package universal-ctags)")
    done = subprocess.run(
        [ctags, "--options=NONE", "--language-force=C++", "--kinds-C++=f", "--fields=+ne", "--output-format=json",
         "-f", "-", "-L", "-"],
        cwd=root, input="\n".join(sources(root, (".h", ".cpp"))), capture_output=True, text=True, check=True)
    for line in done.stdout.splitlines():
        tag = json.loads(line)
        yield Function(tag["end"] - tag["line"] + 1, tag["path"], tag["line"], tag["name"])


def long_functions(root):
    return sorted((f for f in functions(root) if f.lines > LONG_LINES), key=lambda f: (-f.lines, f.path, f.line))


def tested_name(path, headers):
    """The path, without ending, whose test is that of a source."""
    if path in headers:
        return path
    beginnings = [path[:i] for i in range(len(path)) if path[i] == "_"]
    return max((name for name in beginnings if name in headers), key=len, default=path)


def folder_of(path):
    """That of a row of the table: a top folder, or a wing of services/."""
    return "/".join(path.split("/")[: 2 if path.startswith("services/") else 1])


def unit_tests(root):
    """By folder, sources with a test and all."""
    headers = {path[: -len(".h")] for path in sources(root, (".h",))}
    counts = collections.defaultdict(lambda: [0, 0])
    for path in sources(root, (".cpp",)):
        if os.path.basename(path) == "main.cpp":
            continue
        test = os.path.join(root, "tests", tested_name(path[: -len(".cpp")], headers) + "_test.cpp")
        counts[folder_of(path)][0] += os.path.exists(test)
        counts[folder_of(path)][1] += 1
    return counts


def room_of(path, wings):
    """Of a source below services/, wherever a version has it."""
    folders = path.split("/")[1:-1]
    return folders[1 if folders[0] in wings and len(folders) > 1 else 0] if folders else ""


def lines_now(root):
    """By wing and room."""
    wings, lines = rules_of(root, "services").order, collections.Counter()
    for path in sources(root, (".h", ".cpp")):
        if path.startswith("services/"):
            lines[path.split("/")[1], room_of(path, wings)] += text(root, path).count("\n")
    return lines


def lines_at(root, commit):
    """By room."""
    done = subprocess.run(["git", "-C", root, "archive", "--format=tar", commit, "services"], capture_output=True, check=False)
    if done.returncode != 0:
        sys.exit(f"figures.py: {done.stderr.decode().strip()}")
    wings, lines = rules_of(root, "services").order, collections.Counter()
    with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
        for member in archive:
            if member.isfile() and member.name.endswith((".h", ".cpp")):
                lines[room_of(member.name, wings)] += archive.extractfile(member).read().count(b"\n")
    return lines


def print_long(root):
    found = long_functions(root)
    print(f"functions over {LONG_LINES} lines: {len(found)}")
    for function in found:
        print(f"  {function.lines:4}  {function.path}:{function.line}  {function.name}")
    return found


def print_tests(root):
    print("sources with a unit test")
    counts = unit_tests(root)
    rows = sorted(counts.items()) + [("all", [sum(column) for column in zip(*counts.values())])]
    for folder, (tested, every) in rows:
        print(f"  {folder:24} {tested:4} of {every:4}  {100 * tested / every:5.1f} %")


def print_lines(root, commit):
    print("lines of services/" + (f", and the difference to {commit}" if commit else ""))
    now, before = lines_now(root), lines_at(root, commit) if commit else None

    def row(name, lines, earlier):
        print(f"  {name:24} {lines:7}" + (f"  {lines - earlier:+7}" if before is not None else ""))

    def earlier_of(rooms):
        return sum(before[room] for room in rooms) if before is not None else 0

    for wing in sorted({wing for wing, _ in now}):
        rooms = sorted(room for of, room in now if of == wing)
        row(wing, sum(now[wing, room] for room in rooms), earlier_of(rooms))
        for room in rooms:
            row(f"{wing}/{room}", now[wing, room], earlier_of([room]))
    gone = sorted(set(before or ()) - {room for _, room in now})
    for room in gone:
        row(f"{room}, gone", 0, before[room])
    row("all", sum(now.values()), earlier_of(before or ()))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    here = os.path.dirname(os.path.abspath(__file__))
    parser.add_argument("root", nargs="?", metavar="ROOT", default=os.path.dirname(os.path.dirname(here)))
    parser.add_argument("--against", metavar="COMMIT")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    found = print_long(options.root)
    if options.check:
        sys.exit(f"at most {MOST_LONG}; split some where it makes them clearer" if len(found) > MOST_LONG else 0)
    print_tests(options.root)
    print_lines(options.root, options.against)


if __name__ == "__main__":
    main()
