"""What mutants.py makes of a line, against what it would try it, and what comes of it in a small tree."""

import itertools
import os
import subprocess
import tempfile
import time
import unittest
from unittest import mock

import mutants


class Mutations(unittest.TestCase):
    def of(self, line):
        return {mutant.strip() for mutant in mutants.mutations(line)}

    def test_are_one_fault_each(self):
        self.assertEqual(self.of("  if (a <= b && !c) return 3;"),
                         {"if (a < b && !c) return 3;", "if (a <= b || !c) return 3;", "if (a <= b && !c) return 4;",
                          "if (!(a <= b && !c)) return 3;"})
        self.assertEqual(self.of("  out.push_back(x * y);"), {"out.push_back(x / y);", ";"})
        self.assertEqual(self.of("  total_ += 2;"), {"total_ += 3;", ";"})
        self.assertEqual(self.of("  bool found = true;"), {"bool found = false;"})

    def test_leave_texts_types_and_declarations_alone(self):
        self.assertEqual(self.of('  return absl::StrCat("a && b <= 3");'), set())
        self.assertEqual(self.of("  std::vector<int> counts;"), set())
        self.assertEqual(self.of("  counts.reserve(2 * values.size());"), set())
        self.assertEqual(self.of("  const std::string name = NameOf(path);"), set())
        self.assertEqual(list(mutants.code_lines('#include "a.h"\n// a < b\n\nint x = 1;\n')), [(3, "int x = 1;")])

    def test_are_drawn_from_a_seed(self):
        def first(seed):
            return [mutants.text_of(mutant) for mutant in itertools.islice(mutants.draw(seed), 20)]
        self.assertEqual(first(1), first(1))
        self.assertNotEqual(first(1), first(2))

    def test_are_tried_by_their_own_tests_and_those_of_including_folders(self):
        programs = mutants.tests_of("services/work/job/job_frames.cpp", {})
        self.assertEqual(programs[0], "job_test")
        self.assertIn("daemon_test", programs)
        self.assertNotIn("alignment_test", programs)

    def test_are_tried_by_the_quickest_other_programs_first(self):
        programs = mutants.tests_of("services/work/job/job_frames.cpp", {"job_test": 1000, "daemon_test": 200, "daemon_parts_test": 20})
        self.assertEqual(programs[0], "job_test")
        self.assertEqual(programs[-2:], ["daemon_parts_test", "daemon_test"])

    def test_are_tried_by_the_tests_that_mirror_their_source_first(self):
        self.assertEqual(mutants.own_tests(mutants.ROOT, "services/work/job/job_frames.cpp"), "JobFrames.*:JobFrames/*:*/JobFrames.*")
        self.assertEqual(mutants.own_tests(mutants.ROOT, "services/work/job/none.cpp"), "")


# A library of three sources in one batch: the compiler puts Sum into Twice and Ends.
SMALL_TREE = {
    "CMakeLists.txt": """cmake_minimum_required(VERSION 3.25)
project(small CXX)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_UNITY_BUILD ON)
set(CMAKE_CXX_FLAGS "-O2 -Wall -Wextra -Werror -I${CMAKE_SOURCE_DIR}")
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
add_library(small STATIC sum.cpp twice.cpp apart.cpp)
add_executable(small_test small_test.cpp)
target_link_libraries(small_test small)
add_executable(flaky_test flaky_test.cpp)
target_link_libraries(flaky_test small)
add_executable(other_test other_test.cpp)
""",
    "sum.h": "int Sum(int a, int b);\n",
    "sum.cpp": '#include "sum.h"\nint Sum(int a, int b) {\n  int sum = a;\n  sum += b;\n  return sum;\n}\n',
    "twice.h": '#include "sum.h"\nint Twice(int a);\nbool Ends(int a);\n',
    "twice.cpp": '#include "twice.h"\nint Twice(int a) { return Sum(a, a); }\n'
                 "bool Ends(int a) {\n  while (a < 100) a = Sum(a, 1);\n  return true;\n}\n",
    "apart.cpp": "int Apart() { return 1; }\n",
    "small_test.cpp": '#include <cstdio>\n#include "twice.h"\nint Apart();\n'
                      "int main() {\n  if (Twice(3) == 6 && Ends(98) && Apart() == 1) return 0;\n"
                      '  std::puts("[  FAILED  ] Small.Sums (0 ms)");\n  return 1;\n}\n',
    "flaky_test.cpp": '#include <cstdio>\n#include <unistd.h>\n#include "twice.h"\n'
                      'int main() {\n  if (access("seen", F_OK) == 0) return Twice(3) == 7;\n  std::fclose(std::fopen("seen", "w"));\n'
                      '  std::puts("[  FAILED  ] Flaky.Once (0 ms)");\n  return 1;\n}\n',
    "other_test.cpp": "int main() { return 1; }\n",
}


class Relinking(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.tree = cls.folder.name
        for name, text in SMALL_TREE.items():
            with open(os.path.join(cls.tree, name), "w", encoding="utf-8") as file:
                file.write(text)
        gate = os.path.join(cls.tree, "build", "gate")
        subprocess.run(["cmake", "-G", "Ninja", "-S", cls.tree, "-B", gate], check=True, stdout=subprocess.DEVNULL)
        subprocess.run(["ninja", "-C", gate], check=True, stdout=subprocess.DEVNULL)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def try_line(self, number, new, path="sum.cpp", programs=("other_test", "small_test")):
        build = mutants.Build(self.tree)
        with mock.patch.object(mutants, "tests_of", lambda path, seconds: programs), mock.patch.object(mutants, "HANG_S", 0.5):
            came = mutants.try_one((path, number, new), build)
        self.assertEqual(self.run_clean(build), "", "the program is as it was")
        return came

    def run_clean(self, build):
        return build.run("small_test", "*", time.monotonic() + 10)

    def test_kills_in_the_callers_of_a_batch(self):
        self.assertEqual(self.try_line(3, "  sum -= b;"), "killed by small_test: Small.Sums")
        self.assertEqual(mutants.callers_of(self.tree, "sum.cpp", ["sum.cpp", "twice.cpp", "apart.cpp"]), ["twice.cpp"])
        self.assertEqual(self.try_line(0, "int Apart() { return 2; }", "apart.cpp"), "killed by small_test: Small.Sums")

    def test_kills_what_does_not_end(self):
        self.assertEqual(self.try_line(3, "  while (a < 100) a = Sum(a, 0);", "twice.cpp"), "killed by small_test: *")

    def test_lets_live_what_changes_nothing(self):
        self.assertEqual(self.try_line(3, "  sum = b + sum;"), "lives in small_test")

    def test_tries_what_only_warns_and_nothing_that_does_not_compile(self):
        self.assertEqual(self.try_line(3, "  ;"), "killed by small_test: Small.Sums")
        self.assertEqual(self.try_line(3, "  sum += ;"), "does not compile")

    def test_restores_the_programs_of_a_run_that_was_ended(self):
        program = os.path.join(self.tree, "build", "gate", "bin", "small_test")
        os.rename(program, program + ".clean")
        with open(program, "w", encoding="utf-8") as file:
            file.write("a mutant")
        self.assertEqual(self.run_clean(mutants.Build(self.tree)), "")

    def test_believes_no_test_that_fails_now_and_then(self):
        self.assertEqual(self.try_line(3, "  sum = b + sum;", programs=["flaky_test", "small_test"]), "lives in flaky_test, small_test")

    def test_tries_nothing_after_its_time(self):
        with mock.patch.object(mutants, "LIMIT_S", 0):
            self.assertEqual(self.try_line(3, "  sum -= b;"), "lives until small_test, which had no time")


if __name__ == "__main__":
    unittest.main()
