#!/usr/bin/env python3
"""Draws mutants of the product and asks which of them the unit tests kill.

   python3 tests/mutants.py --list                      the mutants that seed 1 draws, as changed lines
   python3 tests/mutants.py --count 50 --seed 7         builds and tries them; goes on where it was stopped
   python3 tests/mutants.py --here --under services/work --count 20 --seed 3
                                                        those of one folder, in this tree and its build/gate

A mutant is one small fault in a source of services/ or animation/: a comparison, a logical or an arithmetic operator, a number,
a truth value, a condition, or a statement that is left out (DeMillo, Lipton, Sayward, Computer 11(4), 1978; operators of
Offutt et al., TOSEM 5(2), 1996). It is tried in a worktree of its own, build/mutants, or with --here in this one, against the unit tests of its folder and of the
folders that include headers of it. One that does not compile is drawn anew. Those that live are printed with their change: a
reader says which are equivalent, and lists them in --equivalent FILE (a line for each: path:line: change).
Needs a build from nothing first, and then a minute or two for each mutant. Exit status 1 when fewer than --least percent are killed.
"""

import argparse
import json
import os
import random
import re
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
FOLDERS = ("services", "animation")
TREE = os.path.join(ROOT, "build", "mutants")
TIMEOUT_S = 300

# What stands in code, and what a mutant has in its place.
SWAPS = [
    (re.compile(r" (<=) "), " < "), (re.compile(r" (>=) "), " > "), (re.compile(r"(?<=[\w)\]]) (<) (?=[\w(])"), " <= "),
    (re.compile(r"(?<=[\w)\]]) (>) (?=[\w(])"), " >= "), (re.compile(r" (==) "), " != "), (re.compile(r" (!=) "), " == "),
    (re.compile(r" (&&) "), " || "), (re.compile(r" (\|\|) "), " && "), (re.compile(r"(?<=[\w)\]]) (\+) (?=[\w(])"), " - "),
    (re.compile(r"(?<=[\w)\]]) (-) (?=[\w(])"), " + "), (re.compile(r"(?<=[\w)\]]) (\*) (?=[\w(])"), " / "),
    (re.compile(r"(?<=[\w)\]]) (/) (?=[\w(])"), " * "), (re.compile(r"\b(true)\b"), "false"), (re.compile(r"\b(false)\b"), "true"),
    (re.compile(r"\bif \((!)"), "if ("),
]
NUMBER = re.compile(r"(?<![\w.\"'])(\d+)(?![\w.'])")
STATEMENT = re.compile(r"^\s+(?!return|const |constexpr |static |using |case |break|continue|auto |for |if |else|\}|//|#|public|private)"
                       r"[A-Za-z_*(][\w.:>()\[\]*-]*(?:\(| = | \+= | -= |\+\+).*;$")
IF = re.compile(r"\bif \((?!const |auto |absl::)(.*)\)( \{| return.*;| continue;| break;)?$")


def git(*arguments, folder=ROOT):
    return subprocess.run(["git", *arguments], cwd=folder, check=True, capture_output=True, text=True).stdout


def code_lines(text):
    """(number, line) of lines that are code: no includes, comments, or lines within strings that go on."""
    for number, line in enumerate(text.splitlines()):
        if line.strip() and not re.match(r"\s*(//|#|\"|namespace|\})", line):
            yield number, line


def outside_strings(line, start):
    return line[:start].count('"') % 2 == 0 and "//" not in line[:start]


def mutations(line):
    """All faults that may be made of a line, as lines."""
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
        with open(os.path.join(ROOT, path), encoding="utf-8") as file:
            everywhere += [(path, number, line) for number, line in code_lines(file.read())]
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


def tests_of(path):
    """Names of the test programs for a source."""
    programs = []
    for folder in including_folders(path):
        parts = folder.split("/")
        for depth in range(len(parts), 0, -1):
            lists = os.path.join(ROOT, "tests", *parts[:depth], "CMakeLists.txt")
            if os.path.exists(lists):
                with open(lists, encoding="utf-8") as file:
                    programs += [name for name in re.findall(r"^weft_test\((\w+)", file.read(), re.MULTILINE) if name not in programs]
                break
    return [name for name in programs if name != "simulation_command_test"]


def build(tree, *targets):
    done = subprocess.run(["cmake", "--build", os.path.join(tree, "build", "gate"), "--target", *targets], capture_output=True, text=True,
                          check=False)
    return done.returncode == 0, done.stdout[-2000:]


def try_one(mutant, tree):
    """"killed by NAME", "lives" or "does not compile"."""
    path, number, new = mutant
    file = os.path.join(tree, path)
    with open(file, encoding="utf-8") as source:
        before = source.read()
    lines = before.splitlines()
    lines[number] = new
    with open(file, "w", encoding="utf-8") as source:
        source.write("\n".join(lines) + "\n")
    try:
        programs = tests_of(path)
        for name in programs:
            is_built, _ = build(tree, name)
            if not is_built:
                return "does not compile"
            program = os.path.join(tree, "build", "gate", "bin", name)
            try:
                done = subprocess.run([program, "--gtest_brief=1"], capture_output=True, timeout=TIMEOUT_S, cwd=tree, check=False)
            except subprocess.TimeoutExpired:
                return f"killed by {name}, which does not end"
            if done.returncode != 0:
                return f"killed by {name}"
        return "lives" if programs else "lives, as no unit test is of it"
    finally:
        with open(file, "w", encoding="utf-8") as source:
            source.write(before)


def prepare(here):
    """The tree that mutants are tried in, with the tests built as they are."""
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
    is_built, output = build(tree, "fast_tests")
    if not is_built:
        sys.exit(f"the tests do not build without a mutant:\n{output}")
    return tree


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=50, help="of mutants that compile (default 50)")
    parser.add_argument("--seed", type=int, default=1, help="another one draws others (default 1)")
    parser.add_argument("--least", type=float, default=85, help="percent that are to be killed (default 85)")
    parser.add_argument("--equivalent", help="a file that lists mutants that change nothing")
    parser.add_argument("--list", action="store_true", help="only draw them")
    parser.add_argument("--under", action="append", help="a folder that they are drawn from (default services and animation)")
    parser.add_argument("--here", action="store_true", help="tries them in this tree, which has no changes, and its build/gate")
    options = parser.parse_args()
    folders = options.under or FOLDERS
    if options.list:
        for mutant, _ in zip(draw(options.seed, folders), range(options.count)):
            print(f"{text_of(mutant)}    [{', '.join(tests_of(mutant[0]))}]")
        return 0
    equivalent = set()
    if options.equivalent:
        with open(options.equivalent, encoding="utf-8") as file:
            equivalent = {line.strip() for line in file if line.strip()}
    tree = prepare(options.here)
    record = os.path.join(ROOT, "build", f"mutants-{git('rev-parse', '--short', 'HEAD').strip()}-{options.seed}.jsonl")
    known = {}
    if os.path.exists(record):
        with open(record, encoding="utf-8") as file:
            known = dict(json.loads(line) for line in file)
    tried, killed, alive = 0, 0, []
    for mutant in draw(options.seed, folders):
        if tried == options.count:
            break
        text, began = text_of(mutant), time.monotonic()
        if text in equivalent:
            continue
        if text not in known:
            known[text] = try_one(mutant, tree)
            with open(record, "a", encoding="utf-8") as file:
                file.write(json.dumps([text, known[text]]) + "\n")
        if known[text] == "does not compile":
            continue
        tried += 1
        killed += known[text].startswith("killed")
        if known[text].startswith("lives"):
            alive.append(text)
        print(f"{tried:3}  {time.monotonic() - began:5.0f} s  {known[text]:40}  {text}", flush=True)
    share = 100 * killed / max(1, tried)
    print(f"{killed} of {tried} mutants are killed, {share:.0f} %")
    for text in alive:
        print(f"lives: {text}")
    return 0 if share >= options.least else 1


if __name__ == "__main__":
    sys.exit(main())
