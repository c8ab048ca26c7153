"""The avatar of deploy/examples follows a walk that it never saw, by the commands of its README."""

import json
import os
import re
import shlex
import subprocess
import tempfile
import unittest

from studio import BIN, LONG_S, read, weft

EXAMPLE = os.path.join(os.environ["WEFT_SOURCE"], "deploy", "examples", "tshirt")


class ShippedAvatar(unittest.TestCase):
    def test_every_command_works_as_written(self):
        folder = tempfile.TemporaryDirectory(prefix="weft tshirt ")
        self.addCleanup(folder.cleanup)
        os.symlink(f"{EXAMPLE}/tshirt.avatar", f"{folder.name}/tshirt.avatar")
        environment = {**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"}
        for line in read(f"{EXAMPLE}/README.md").split("```")[1].strip().splitlines():
            done = subprocess.run(shlex.split(line), cwd=folder.name, env=environment, capture_output=True, text=True,
                                  timeout=LONG_S, check=False)
            self.assertEqual(done.returncode, 0, f"{line}\n{done.stdout}{done.stderr}")
        self.assertRegex(done.stdout, r"driven")
        frames = [name for name in os.listdir(f"{folder.name}/driven") if name.isdigit()]
        self.assertEqual(len(frames), 8)
        scores = json.loads(weft("evaluate", f"{folder.name}/take", "--avatar", f"{EXAMPLE}/tshirt.avatar", "--cameras", "3",
                                 "--json", check=0).stdout)["scores"]
        mean_mm = {score["method"]: score["mean_mm"] for score in scores}
        self.assertLess(mean_mm["driven"], 3)
        self.assertLess(mean_mm["driven"], mean_mm["carrier"])

    def test_is_as_small_as_its_readme_says(self):
        about = json.loads(weft("avatar", "show", f"{EXAMPLE}/tshirt.avatar", "--json", check=0).stdout)
        size = sum(os.path.getsize(f"{EXAMPLE}/tshirt.avatar/{name}") for name in os.listdir(f"{EXAMPLE}/tshirt.avatar"))
        text = read(f"{EXAMPLE}/README.md")
        self.assertEqual(re.findall(r"([\d.]+) MB", text), [f"{size / 1e6:.1f}"])
        self.assertIn(f"{about['components']} shapes of {about['vertices']:,} vertices", text)
        self.assertLess(size, 10e6)


if __name__ == "__main__":
    unittest.main()
