#!/usr/bin/env python3
"""The checks of check_structure.py find what they are for."""

import os
import subprocess
import sys
import tempfile
import unittest

CHECK = os.path.join(os.path.dirname(os.path.abspath(__file__)), "check_structure.py")


class StructureCheck(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.write("capture/image/frame.h", "#pragma once\n")
        self.write("capture/README.md", "Order: `image`, `camera` and `take`.\n\nMay include nothing of Weft.\n")
        self.write("pattern/README.md", "# pattern\n\nMay include `capture`.\nOrder: `observation.h`, `image`,\n`fit`.\n")
        self.write("alignment/README.md", "May include `capture` and `pattern`.\n")
        self.write("services/README.md", "Order: `ground`, `work`, `tools`.\nMay include `capture`, `pattern`, `proto`.\n")
        self.write("services/ground/README.md", "Order: `process`, `files`.\n")
        self.write("services/work/README.md", "Order: `job`, `worker`, `slurm`.\n")
        self.write("services/work/slurm/README.md", "May include `services/ground`, `services/work/worker/event.h`.\n")

    def write(self, path, content):
        path = os.path.join(self.folder.name, path)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(content)

    def run_rule(self, rule):
        done = subprocess.run([sys.executable, CHECK, self.folder.name, rule], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout

    def assert_refused(self, path, include, why):
        """The include is what is wrong with the file, which is fine without it."""
        self.write(path, "")
        self.assertEqual(self.run_rule("includes"), (0, ""))
        self.write(path, f'#include "{include}"\n')
        status, out = self.run_rule("includes")
        self.assertEqual(status, 1)
        self.assertEqual(len(out.splitlines()), 1, out)
        self.assertIn(f'may not include "{include}"{why}', out)
        self.write(path, "")

    def test_accepts_what_readmes_allow_only(self):
        self.write("pattern/decoder.h", '#include "capture/image/frame.h"\n')
        self.assertEqual(self.run_rule("includes"), (0, ""))
        self.assert_refused("capture/image/rig.h", "pattern/decoder.h", "; its README says what it may")
        self.assert_refused("pattern/decoder.cpp", "alignment/align.h", "; its README says what it may")

    def test_accepts_earlier_rooms_only(self):
        self.write("pattern/fit/cell.h", '#include "pattern/image/ink.h"\n#include "pattern/observation.h"\n')
        self.write("pattern/decoder.h", '#include "pattern/fit/cell.h"\n')
        self.assertEqual(self.run_rule("includes"), (0, ""))
        self.assert_refused("pattern/image/ink.h", "pattern/fit/cell.h", ", which comes later in the order of its README")
        self.assert_refused("pattern/observation.h", "pattern/image/ink.h", ", which comes later")
        self.assert_refused("pattern/fit/cell.cpp", "pattern/decoder.h", ", which comes later")

    def test_accepts_earlier_wings_only(self):
        self.write("services/work/job/job.h", '#include "services/ground/files/ply.h"\n')
        self.write("services/tools/cli.cpp", '#include "services/work/job/job.h"\n')
        self.assertEqual(self.run_rule("includes"), (0, ""))
        self.assert_refused("services/ground/files/ply.cpp", "services/work/job/job.h", ", which comes later")
        self.assert_refused("services/ground/process/help.cpp", "services/ground/files/ply.h", ", which comes later")

    def test_rooms_of_services_may_be_stricter_about_services(self):
        self.write("services/work/slurm/a.cpp", '#include "services/ground/files/ply.h"\n#include "services/work/worker/event.h"\n'
                                                '#include "capture/image/frame.h"\n#include "services/work/slurm/a.h"\n')
        self.assertEqual(self.run_rule("includes"), (0, ""))
        self.assert_refused("services/work/slurm/b.cpp", "services/work/worker/task.h", "; its README says what it may")

    def test_rejects_generated_code_where_no_readme_allows_it(self):
        self.write("services/ground/files/rig_file.cpp", '#include "weft/v1/rig.pb.h"\n')
        self.assertEqual(self.run_rule("includes"), (0, ""))
        self.assert_refused("pattern/scene.cpp", "weft/v1/rig.pb.h", "; its README says what it may")

    def test_rejects_sources_whose_readme_says_nothing(self):
        self.write("figure/pose.cpp", "")
        self.write("tests/figure/pose_test.cpp", "")
        status, out = self.run_rule("includes")
        self.assertEqual(status, 1)
        self.assertIn("figure/README.md: says not what its sources may include", out)

    def test_rejects_heavy_headers_in_stage_headers(self):
        self.write("pattern/detector.cpp", "#include <opencv2/core.hpp>\n")
        self.assertEqual(self.run_rule("headers"), (0, ""))
        self.write("pattern/detector.h", "#include <opencv2/core.hpp>\n")
        self.assertEqual(self.run_rule("headers")[0], 1)

    def test_rejects_sources_that_do_not_begin_with_their_own_header(self):
        self.write("capture/image/frame.cpp", '// What it is.\n#include "capture/image/frame.h"\n\n#include <vector>\n')
        self.write("capture/main.cpp", "#include <vector>\n")
        self.assertEqual(self.run_rule("first"), (0, ""))
        self.write("capture/image/frame.cpp", '#include <vector>\n#include "capture/image/frame.h"\n')
        self.assertEqual(self.run_rule("first"), (1, 'capture/image/frame.cpp: include "capture/image/frame.h" before anything else\n'))

    def test_rejects_two_types_of_one_name(self):
        self.write("pattern/result.h", "struct Result;\nstruct Result {\n};\nclass Other : public Result {\n};\n")
        self.assertEqual(self.run_rule("names"), (0, ""))
        self.write("alignment/result.h", "struct Result {\n};\n")
        status, out = self.run_rule("names")
        self.assertEqual(status, 1)
        self.assertIn("Result is already defined in", out)

    def test_rejects_long_files(self):
        self.write("capture/long.cpp", "\n" * 400)
        self.assertEqual(self.run_rule("length"), (0, ""))
        self.write("capture/long.cpp", "\n" * 401)
        self.assertEqual(self.run_rule("length")[0], 1)

    def test_rejects_two_unnamed_functions_of_one_name_in_a_library(self):
        first = "namespace weft {\nnamespace {\nint Size(int a) { return a; }\n}\n}\n"
        self.write("capture/a.cpp", first)
        self.write("services/ground/files/b.cpp", first)
        self.write("capture/c.cpp", "namespace weft {\nnamespace {\nstruct S {\n  int Size(float);\n};\n}\nint Size();\n}\n")
        self.assertEqual(self.run_rule("unnamed"), (0, ""))
        self.write("capture/d.cpp", "namespace {\nusing T = int;\nconstexpr int kA = 1;\ndouble Size(float a) { return a; }\n}\n")
        status, out = self.run_rule("unnamed")
        self.assertEqual(status, 1)
        self.assertIn("capture/d.cpp: Size is a name in capture/a.cpp", out)
        self.write("capture/e.cpp", "namespace {\nconst char kA[] = \"};\";\n}\n")
        self.assertIn("kA is a name in", self.run_rule("unnamed")[1])
        self.write("capture/f.cpp", "namespace {\nconstexpr int kB = 1, kC = 2;\n}\n")
        self.write("capture/g.cpp", "namespace {\nconstexpr double kC = 2;\n}\n")
        self.assertIn("kC is a name in", self.run_rule("unnamed")[1])

    def test_rejects_two_unnamed_functions_of_one_name_in_the_tests_of_a_folder(self):
        first = "namespace weft {\nnamespace {\nTEST(A, B) {}\nint Size(int a) { return a; }\nvoid PrintTo(int, char*) {}\n}\n}\n"
        for path in ("tests/capture/take/a_test.cpp", "tests/capture/calibration/a_test.cpp", "tests/services/ground/files/a_test.cpp",
                     "tests/services/ground/job/a_test.cpp", "tests/fuzz/fuzz_a.cpp", "tests/fuzz/fuzz_b.cpp"):
            self.write(path, first)
        self.assertEqual(self.run_rule("unnamed"), (0, ""))
        self.write("tests/capture/image/b_test.cpp", first)
        status, out = self.run_rule("unnamed")
        self.assertEqual(status, 1)
        self.assertEqual(out.splitlines()[0].count("Size is a name in"), 1)
        self.assertEqual(len(out.splitlines()), 1)

    def test_rejects_dead_links(self):
        self.write("README.md", "[here](docs/there.md)\n")
        self.assertEqual(self.run_rule("links")[0], 1)
        self.write("docs/there.md", "")
        self.assertEqual(self.run_rule("links")[0], 0)

    def test_rejects_links_to_headings_that_are_missing(self):
        self.write("docs/there.md", "# A page\n## `weft take`: who, when?\n## Twice\n## Twice\n## A [link](there.md)\n## rig_a.json\n"
                   "```\n# a comment\n```\n")
        good = ("a-page", "weft-take-who-when", "twice", "twice-1", "a-link", "rig_ajson")
        bad = ("A-page", "twice-2", "a-comment", "weft-take")
        self.write("README.md", "".join(f"[here](docs/there.md#{anchor})\n" for anchor in good + bad))
        self.assertEqual(self.run_rule("links"), (1, "".join(f"README.md: docs/there.md has no heading for #{anchor}\n" for anchor in bad)))
        self.write("README.md", "# Here\n[up](#here)\n")
        self.assertEqual(self.run_rule("links"), (0, ""))
        self.write("README.md", "# Here\n[up](#there)\n")
        self.assertEqual(self.run_rule("links"), (1, "README.md: the page has no heading for #there\n"))

    def test_refuses_a_folder_without_sources(self):
        with tempfile.TemporaryDirectory() as empty:
            done = subprocess.run([sys.executable, CHECK, empty, "includes"], capture_output=True, check=False)
            self.assertNotEqual(done.returncode, 0)


if __name__ == "__main__":
    unittest.main()
