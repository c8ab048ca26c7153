"""refit_constants.py with programs that film nothing and print constants as told."""

import os
import stat
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
SCRIPT = os.path.join(HERE, "refit_constants.py")
sys.path.insert(0, HERE)
import refit_constants  # noqa: E402

FILM = """#!/bin/sh
echo "$0 $@" >> "$LOG"
while [ "$1" != --out ]; do shift; done
mkdir "$2"
"""
# What it fits depends on what it was built with: half way to 5.
FIT = f"""#!{sys.executable}
import os, re, sys
with open(os.environ["LOG"], "a") as log:
    print(*sys.argv, file=log)
with open(os.environ["SOURCE_FILE"]) as source:
    old = float(re.search(r"kSigmaFactor = ([0-9.]+)f;", source.read())[1])
print(f"// all takes\\ninline constexpr float kSigmaFactor = {{(old + 5) / 2:.3f}}f;")
"""


class RefitConstants(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft refit ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.log, self.takes = self.path("log"), self.path("takes")
        self.source = self.path("pattern/fit/cell_fitter.h")
        os.makedirs(os.path.dirname(self.source))
        self.write(self.source, "// Comment.\ninline constexpr float kSigmaFactor = 4.9f;\nint other;\n")
        os.makedirs(self.path("bin"))
        for name, text in (("weft", FILM), ("film_layers", FILM), ("refit_decode", FIT)):
            self.write(self.path("bin", name), text)
            os.chmod(self.path("bin", name), stat.S_IRWXU)

    def path(self, *parts):
        return os.path.join(self.folder, *parts)

    @staticmethod
    def write(path, text):
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)

    def refit(self, *arguments, check=0):
        environment = {**os.environ, "LOG": self.log, "SOURCE_FILE": self.source}
        done = subprocess.run([sys.executable, SCRIPT, *arguments, "--takes", self.takes, "--programs", self.path("bin"),
                               "--source", self.folder], capture_output=True, text=True, env=environment, check=False)
        self.assertEqual(done.returncode, check, done.stdout + done.stderr)
        return done

    def logged(self):
        with open(self.log, encoding="utf-8") as file:
            return file.read().splitlines()

    def test_films_what_is_missing_once(self):
        os.makedirs(os.path.join(self.takes, "tube"))
        os.makedirs(os.path.join(self.takes, "skirt.unfinished"))
        self.refit("sigma")
        films = [line for line in self.logged() if "simulate" in line]
        self.assertEqual(len(films), 13 + 6 - 1)
        self.assertTrue(any("--seed 13" in line for line in films), "an unfinished one is filmed anew")
        self.refit("sigma")
        self.assertEqual(len([line for line in self.logged() if "simulate" in line]), 18)
        fit = [line for line in self.logged() if "refit_decode" in line][-1]
        self.assertEqual(fit.split(" --held-out ")[0].count("/takes/"), 13)
        self.assertEqual(fit.split(" --held-out ")[1].count("/takes/"), 6)

    def test_leaves_the_source_alone_unless_asked(self):
        before = os.stat(self.source).st_mtime_ns
        self.assertIn("kSigmaFactor = 4.950f", self.refit("sigma").stdout)
        self.assertEqual(os.stat(self.source).st_mtime_ns, before)

    def test_puts_constants_into_the_source_until_they_stay(self):
        told = self.refit("sigma", "--apply", check=1)
        self.assertIn("build refit_decode and repeat", told.stderr)
        with open(self.source, encoding="utf-8") as file:
            self.assertEqual(file.read(), "// Comment.\ninline constexpr float kSigmaFactor = 4.950f;\nint other;\n")
        for _ in range(2):
            self.refit("sigma", "--apply", check=1)
        # From 4.987 to 4.994: less than fits differ that are repeated.
        self.refit("sigma", "--apply", check=0)

    def test_every_constant_stands_where_the_table_says(self):
        for constant, (fitted, held_out, source, names) in refit_constants.CONSTANTS.items():
            with open(os.path.join(refit_constants.ROOT, source), encoding="utf-8") as file:
                text = file.read()
            for name in names:
                self.assertGreater(len(refit_constants.numbers_in(refit_constants.definition_of(name, text)[0])), 0, name)
            self.assertFalse(set(fitted.values()) & set(held_out.values()), constant)
        self.assertEqual(len(refit_constants.TAKES), 13)
        self.assertEqual(len(refit_constants.CONSTANTS["confidence"][0]), 21)


if __name__ == "__main__":
    unittest.main()
