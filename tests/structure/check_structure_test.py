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

    def write(self, path, content):
        path = os.path.join(self.folder.name, path)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(content)

    def run_rule(self, rule):
        done = subprocess.run([sys.executable, CHECK, self.folder.name, rule], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout

    def test_accepts_includes_against_the_flow_of_data_only(self):
        self.write("pattern/decoder.h", '#include "capture/image/frame.h"\n')
        self.assertEqual(self.run_rule("includes"), (0, ""))
        self.write("capture/rig/rig.h", '#include "pattern/decoder.h"\n')
        status, out = self.run_rule("includes")
        self.assertEqual(status, 1)
        self.assertIn('capture/ may not include "pattern/decoder.h"', out)

    def test_rejects_later_steps_of_decoding(self):
        self.write("pattern/surface/growth.h", '#include "pattern/fit/cell.h"\n')
        self.write("pattern/decoder.h", '#include "pattern/surface/growth.h"\n')
        self.write("pattern/image/palette.h", '#include "pattern/observation.h"\n')
        self.assertEqual(self.run_rule("includes"), (0, ""))
        self.write("pattern/seeds/patches.h", '#include "pattern/surface/growth.h"\n')
        status, out = self.run_rule("includes")
        self.assertEqual(status, 1)
        self.assertIn('pattern/seeds/ may not include "pattern/surface/growth.h"', out)

    def test_rejects_cameras_that_know_of_takes(self):
        self.write("capture/take/replay.h", '#include "capture/camera/camera_source.h"\n')
        self.write("capture/calibration/target.h", '#include "capture/take/replay.h"\n')
        self.assertEqual(self.run_rule("includes"), (0, ""))
        self.write("capture/camera/camera_source.h", '#include "capture/take/replay.h"\n')
        status, out = self.run_rule("includes")
        self.assertEqual(status, 1)
        self.assertIn('capture/camera/ may not include "capture/take/replay.h"', out)

    def test_rejects_a_daemon_that_links_the_command_line(self):
        self.write("services/daemon/main.cpp", '#include "services/process/help.h"\n')
        self.write("services/cli/main.cpp", '#include "services/process/help.h"\n')
        self.assertEqual(self.run_rule("includes"), (0, ""))
        self.write("services/daemon/main.cpp", '#include "services/cli/progress.h"\n')
        self.assertEqual(self.run_rule("includes")[0], 1)

    def test_rejects_shared_parts_that_use_what_stands_on_them(self):
        self.write("services/process/help.cpp", '#include "services/pipeline/registration.h"\n')
        self.assertEqual(self.run_rule("includes")[0], 1)

    def test_rejects_generated_code_outside_services(self):
        self.write("services/files/rig_file.cpp", '#include "weft/v1/rig.pb.h"\n')
        self.assertEqual(self.run_rule("includes")[0], 0)
        self.write("simulation/scene.cpp", '#include "weft/v1/rig.pb.h"\n')
        self.assertEqual(self.run_rule("includes")[0], 1)

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
        self.write("services/files/b.cpp", first)
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
        for path in ("tests/capture/take/a_test.cpp", "tests/capture/calibration/a_test.cpp", "tests/services/files/a_test.cpp",
                     "tests/services/job/a_test.cpp", "tests/fuzz/fuzz_a.cpp", "tests/fuzz/fuzz_b.cpp"):
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

    def test_refuses_a_folder_without_sources(self):
        with tempfile.TemporaryDirectory() as empty:
            done = subprocess.run([sys.executable, CHECK, empty, "includes"], capture_output=True, check=False)
            self.assertNotEqual(done.returncode, 0)


if __name__ == "__main__":
    unittest.main()
