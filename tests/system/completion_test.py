"""What shells complete after `weft`."""

import os
import shutil
import subprocess
import tempfile
import unittest

from studio import BIN, LONG_S, weft, write


class Completion(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft test ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.script = os.path.join(self.folder, "weft.bash")
        write(self.script, weft("completion", "bash", check=0).stdout)

    def complete(self, line):
        """What bash offers at the end of a line."""
        words = line.split(" ")
        program = ('. "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _weft; '
                   'printf "%s\\n" "${COMPREPLY[@]}"')
        done = subprocess.run(["bash", "-euc", program, "bash", self.script, *words], capture_output=True, text=True,
                              timeout=LONG_S, check=True)
        return [word for word in done.stdout.split("\n") if word]

    def test_commands_options_and_values_come_from_the_program(self):
        self.assertIn("register", self.complete("weft "))
        self.assertEqual(self.complete("weft reg"), ["register"])
        self.assertIn("verify", self.complete("weft take "))
        self.assertNotIn("register", self.complete("weft take "))
        self.assertEqual(self.complete("weft rig calibrate dump --tar"), ["--target"])
        self.assertIn("ffv1", self.complete("weft take export take --format "))
        self.assertEqual(self.complete("weft --quiet take record --sess"), ["--session"])
        self.assertIn("--quiet", self.complete("weft take info --"))

    def test_every_command_of_the_help_is_completed(self):
        listed = [line.split()[0] for line in weft("--help", check=0).stdout.split("Subcommands:")[1].splitlines()
                  if line.startswith("  ") and not line.startswith("   ")]
        self.assertGreater(len(listed), 10)
        self.assertEqual(sorted(set(listed) - set(self.complete("weft "))), [])

    def test_other_words_are_file_names(self):
        self.assertEqual(self.complete("weft take info "), [])
        self.assertIn("-o default", weft("completion", "bash", check=0).stdout)

    def test_zsh_reads_its_script(self):
        if not shutil.which("zsh"):
            self.skipTest("no zsh")
        script = os.path.join(self.folder, "_weft")
        write(script, weft("completion", "zsh", check=0).stdout)
        subprocess.run(["zsh", "-n", script], timeout=LONG_S, check=True)
        # The completion runs with the functions of zsh's own replaced by ones that print.
        program = ('compadd() { print -l -- "${@[2,-1]}" }; _describe() { local -a all; all=("${(@P)2}"); print -l -- "$all[@]" }; '
                   '_files() { print FILES }; f() { words=("$@"); CURRENT=$#; PREFIX=${words[-1]}; source "$SCRIPT" }; f "$@"')

        def complete(line):
            done = subprocess.run(["zsh", "-c", program, "zsh", *line.split(" ")], env={**os.environ, "SCRIPT": script},
                                  capture_output=True, text=True, timeout=LONG_S, check=True)
            return [word.split(":")[0] for word in done.stdout.split("\n") if word]
        self.assertIn("register", complete("weft "))
        self.assertIn("verify", complete("weft take "))
        self.assertIn("ffv1", complete("weft take export take --format "))
        self.assertIn("--session", complete("weft take record --"))
        self.assertEqual(complete("weft take info "), ["FILES"])

    def test_other_shells_are_refused(self):
        self.assertIn("fish", weft("completion", "fish", check=2).stderr)
        self.assertTrue(os.path.exists(os.path.join(BIN, "weft")))


if __name__ == "__main__":
    unittest.main()
