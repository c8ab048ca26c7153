"""What mutants.py makes of a line, and against what it would try it."""

import itertools
import unittest

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
        self.assertEqual(self.of("  const std::string name = NameOf(path);"), set())
        self.assertEqual(list(mutants.code_lines('#include "a.h"\n// a < b\n\nint x = 1;\n')), [(3, "int x = 1;")])

    def test_are_drawn_from_a_seed(self):
        def first(seed):
            return [mutants.text_of(mutant) for mutant in itertools.islice(mutants.draw(seed), 20)]
        self.assertEqual(first(1), first(1))
        self.assertNotEqual(first(1), first(2))

    def test_are_tried_by_their_own_tests_and_those_of_including_folders(self):
        programs = mutants.tests_of("services/work/job/job_frames.cpp")
        self.assertEqual(programs[0], "job_test")
        self.assertIn("daemon_test", programs)
        self.assertNotIn("alignment_test", programs)


if __name__ == "__main__":
    unittest.main()
