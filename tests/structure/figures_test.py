#!/usr/bin/env python3
"""figures.py counts what it says, on a small tree."""

import os
import shutil
import subprocess
import sys
import tempfile
import unittest

FIGURES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "figures.py")


def function(name, lines, inside="  // {\n"):
    return f"int {name}() {{\n" + inside + "  ;\n" * (lines - 2 - inside.count("\n")) + "}\n"


class Figures(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.write("capture/README.md", "May include nothing of Weft.\n")
        self.write("services/README.md", "Order: `ground`, `work`.\n\nMay include `capture`.\n")

    def write(self, path, content):
        path = os.path.join(self.folder.name, path)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(content)

    def git(self, *arguments):
        identity = ["-c", "user.name=test", "-c", "user.email=test@localhost", "-c", "commit.gpgsign=false"]
        subprocess.run(["git", "-C", self.folder.name, *identity, *arguments], check=True, capture_output=True)

    def figures(self, *options):
        done = subprocess.run([sys.executable, FIGURES, self.folder.name, *options], capture_output=True, text=True, check=False)
        self.out, self.error = done.stdout, done.stderr
        return done.returncode

    def assert_line(self, *words):
        """One line has these words and no others."""
        self.assertEqual([line.split() for line in self.out.splitlines()].count([str(word) for word in words]), 1, self.out)

    def test_names_functions_over_60_lines(self):
        self.write("capture/frame.cpp", function("Fits", 60) + function("Long", 61, '  R"(}\n}\n)";\n'))
        self.write("capture/frame.h", "class Frame {\n" + function("Inline", 70) + "};\n")
        self.write("tests/capture/frame_test.cpp", function("Test", 100))
        self.assertEqual(self.figures(), 0, self.error)
        self.assertIn("functions over 60 lines: 2\n", self.out)
        self.assert_line(61, "capture/frame.cpp:61", "Long")
        self.assert_line(70, "capture/frame.h:2", "Inline")

    def test_check_fails_beyond_three(self):
        for number in range(3):
            self.write(f"capture/part{number}.cpp", function("Long", 61))
        self.assertEqual(self.figures("--check"), 0, self.error)
        self.write("services/work/part.cpp", function("Long", 61))
        self.assertEqual(self.figures("--check"), 1)
        self.assert_line(61, "services/work/part.cpp:1", "Long")
        self.assertIn("at most 3", self.error)

    def test_counts_sources_with_a_test(self):
        self.write("capture/frame.h", "")
        for name in ("frame", "frame_kernel", "kernel", "main"):
            self.write(f"capture/{name}.cpp", "")
        self.write("services/work/job/job.cpp", "")
        self.write("tests/services/work/job/job_test.cpp", "")
        self.assertEqual(self.figures(), 0, self.error)
        self.assert_line("capture", 0, "of", 3, "0.0", "%")
        self.assert_line("services/work", 1, "of", 1, "100.0", "%")
        self.write("tests/capture/frame_test.cpp", "")
        self.assertEqual(self.figures(), 0, self.error)
        self.assert_line("capture", 2, "of", 3, "66.7", "%")
        self.assert_line("all", 3, "of", 4, "75.0", "%")

    @unittest.skipUnless(shutil.which("git"), "git is missing")
    def test_compares_rooms_with_those_of_a_commit(self):
        self.write("services/job/job.cpp", "// 1\n// 2\n")
        self.write("services/rig/rig.cpp", "// 1\n")
        self.git("init")
        self.git("add", ".")
        self.git("commit", "-m", "before wings")
        for room in ("job", "rig"):
            shutil.rmtree(os.path.join(self.folder.name, "services", room))
        self.write("services/work/job/deep/job.cpp", "// 1\n// 2\n// 3\n// 4\n// 5\n")
        self.write("services/ground/process/run.h", "// 1\n")
        self.assertEqual(self.figures("--against", "HEAD"), 0, self.error)
        self.assert_line("work", 5, "+3")
        self.assert_line("work/job", 5, "+3")
        self.assert_line("ground/process", 1, "+1")
        self.assert_line("rig,", "gone", 0, "-1")
        self.assert_line("all", 6, "+3")
        self.assertEqual(self.figures("--against", "nothing"), 1)
        self.assertIn("nothing", self.error)


if __name__ == "__main__":
    unittest.main()
