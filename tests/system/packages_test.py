"""deploy/install-packages.sh beside another program that installs packages, with an apt that is played."""

import os
import subprocess
import tempfile
import unittest

from studio import read, write

SCRIPT = os.path.join(os.environ["WEFT_SOURCE"], "deploy", "install-packages.sh")
# Says of the first calls what stands in `busy`, a line each.
APT = """#!/bin/sh
dir=$(dirname "$0")
echo "$*" >> "$dir/calls"
words=$(head -n 1 "$dir/busy")
[ -z "$words" ] && exit 0
sed -i 1d "$dir/busy"
echo "$words" >&2
exit 100
"""


class Packages(unittest.TestCase):
    def run_with(self, busy, patience_s=60):
        folder = tempfile.TemporaryDirectory(prefix="weft packages ")
        self.addCleanup(folder.cleanup)
        for name, text in {"apt-get": APT, "dpkg-query": "#!/bin/sh\necho not-installed\n",
                           "sudo": "#!/bin/sh\nexec \"$@\"\n"}.items():
            write(f"{folder.name}/{name}", text)
            os.chmod(f"{folder.name}/{name}", 0o755)
        write(f"{folder.name}/busy", "".join(f"{line}\n" for line in busy))
        done = subprocess.run(["bash", SCRIPT], capture_output=True, text=True, check=False, timeout=120,
                              env={**os.environ, "PATH": f"{folder.name}:{os.environ['PATH']}", "WEFT_APT_PATIENCE_S": str(patience_s)})
        return done, read(f"{folder.name}/calls").splitlines()

    def test_waits_for_the_lock_of_another(self):
        done, calls = self.run_with(["E: Could not get lock /var/lib/apt/lists/lock. It is held by process 812 (apt-get)",
                                     "E: Unable to lock directory /var/lib/apt/lists/"])
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout.count("waiting until it is through"), 1, done.stdout)
        self.assertEqual([call.split()[2] for call in calls], ["update", "update", "update", "install"])

    def test_a_lock_that_stays_is_said(self):
        done, _ = self.run_with(["E: Could not get lock /var/lib/dpkg/lock-frontend"] * 5, patience_s=0)
        self.assertEqual(done.returncode, 1)
        self.assertIn("lock-frontend", done.stderr)

    def test_other_failures_end_at_once(self):
        done, calls = self.run_with(["E: Unable to locate package libnothing"])
        self.assertEqual(done.returncode, 1)
        self.assertIn("libnothing", done.stderr)
        self.assertEqual(len(calls), 1)


if __name__ == "__main__":
    unittest.main()
