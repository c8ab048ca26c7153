"""What `cmake --install` installs: programs that run there, the tour, examples that read results."""

import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest

from studio import BIN, LONG_S, read, write

SOURCE = os.environ["WEFT_SOURCE"]
CHECK_IN_BLENDER = """
import bpy, sys
garment = bpy.data.objects["garment"]
uv = garment.data.uv_layers[0].data
smeared = sum(max((uv[i].uv - uv[j].uv).length for i in face.loop_indices for j in face.loop_indices) > 0.2
              for face in garment.data.polygons)
print("CHECK", len(garment.data.vertices), len(garment.data.shape_keys.key_blocks), smeared, len(garment.data.materials))
"""


class Installed(unittest.TestCase):
    """One installation and one tour for all tests."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="weft installed ")
        cls.addClassCleanup(folder.cleanup)
        cls.prefix = os.path.join(folder.name, "usr")
        subprocess.run(["cmake", "--install", os.path.dirname(BIN), "--prefix", cls.prefix], capture_output=True,
                       timeout=LONG_S, check=True)
        cls.share = os.path.join(cls.prefix, "share")
        cls.tour = os.path.join(folder.name, "tour")
        cls.done = subprocess.run(
            [f"{cls.share}/weft/tour.sh", cls.tour], capture_output=True, text=True, timeout=LONG_S, check=False,
            env={**os.environ, "PATH": f"{cls.prefix}/bin:{os.environ['PATH']}", "WEFT_TOUR_PRESET": "tiny"})

    def test_has_what_users_look_for(self):
        for name in ("bin/weft", "bin/weftd", "bin/weft-worker", "bin/weft-recorder", "bin/weft-video", "share/weft/LICENSE", "share/weft/README.md",
                     "share/weft/docs/tour.md", "share/weft/docs/guide/README.md", "share/weft/config/best.txtpb",
                     "share/weft/config/examples/few-cameras.txtpb", "share/weft/examples/read_mesh.py", "share/weft/examples/tshirt/tshirt.avatar/space.bin",
                     "share/weft/blender/weft_blender.py", "share/weft/blender/weft_result.py", "share/weft/blender/weft_blender.zip",
                     "share/doc/weft/copyright", "share/weft/config/weftd.txtpb", "lib/systemd/system/weftd.service",
                     "lib/sysusers.d/weft.conf", "lib/tmpfiles.d/weft.conf",
                     "share/bash-completion/completions/weft", "share/zsh/vendor-completions/_weft"):
            self.assertGreater(os.path.getsize(os.path.join(self.prefix, name)), 0, name)
        pages = "share/weft/console/index.html"
        self.assertEqual(os.path.exists(f"{self.prefix}/{pages}"), os.path.exists(os.path.join(BIN, "..", "console/dist/index.html")))
        for name in ("weft-pcl", "weft-train", "accuracy_decode", "accuracy_drive", "film_layers", "refit_decode"):
            self.assertEqual(os.path.exists(f"{self.prefix}/bin/{name}"), os.path.exists(f"{BIN}/{name}"))
        self.assertIn("version 3", read(f"{self.share}/doc/weft/copyright"))
        for shell, name in (("bash", "bash-completion/completions/weft"), ("zsh", "zsh/vendor-completions/_weft")):
            said = subprocess.run([f"{self.prefix}/bin/weft", "completion", shell], capture_output=True, text=True,
                                  timeout=LONG_S, check=True).stdout
            self.assertEqual(read(f"{self.share}/{name}"), said)

    def test_bill_of_materials_names_what_programs_load(self):
        bill = json.loads(read(f"{self.share}/doc/weft/weft.cdx.json"))
        self.assertEqual((bill["bomFormat"], bill["metadata"]["component"]["name"]), ("CycloneDX", "weft"))
        parts = {part["name"]: part for part in bill["components"]}
        # An independent look: what the dynamic linker of weftd names, and the package that has it.
        library = re.search(r"libgrpc\+\+\S* => (\S+)", subprocess.run(["ldd", f"{self.prefix}/bin/weftd"], capture_output=True,
                                                                       text=True, check=True).stdout).group(1)
        name, version = subprocess.run(["dpkg-query", "--show", "--showformat", "${Package} ${Version}", "libgrpc++1.51"],
                                       capture_output=True, text=True, check=True).stdout.split()
        self.assertTrue(os.path.exists(library))
        self.assertEqual(parts[name]["version"], version)
        self.assertIn("three", parts)
        self.assertTrue(all(part["purl"].startswith(("pkg:deb/debian/", "pkg:npm/")) for part in parts.values()))
        self.assertIn("Report a fault", read(f"{self.share}/doc/weft/SECURITY.md"))

    def test_tour_gets_to_the_end(self):
        self.assertEqual(self.done.returncode, 0, self.done.stdout + self.done.stderr)
        self.assertIn("3 of 3 frames registered", self.done.stdout)
        pages = re.findall(r"(/.*\.html)$", self.done.stdout.split("== Done")[1], re.MULTILINE)
        self.assertEqual(len(pages), 4)
        for page in pages:
            self.assertIn("</html>", read(page))

    def test_tour_is_what_its_page_says(self):
        shown = re.findall(r"^weft .*", read(f"{SOURCE}/docs/tour.md"), re.MULTILINE)
        run = [line.removeprefix("run ").replace('"${WEFT_TOUR_PRESET:-quickstart}"', "quickstart") for line in
               re.findall(r"^run weft .*", read(f"{SOURCE}/deploy/tour.sh"), re.MULTILINE)]
        self.assertEqual(shown, run)

    def test_python_example_reads_a_result(self):
        done = subprocess.run(["python3", f"{self.share}/weft/examples/read_mesh.py", f"{self.tour}/result"],
                              capture_output=True, text=True, timeout=LONG_S, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        lines = done.stdout.splitlines()
        self.assertEqual([line.split(":")[0] for line in lines], ["0000", "0001", "0002"])
        for line in lines[1:]:
            vertices, seen, moved_mm = re.search(r"(\d+) vertices, ([\d.]+)% seen, moved ([\d.]+) mm", line).groups()
            self.assertGreater(int(vertices), 1000)
            self.assertGreater(float(seen), 80)
            self.assertGreater(float(moved_mm), 0)
            self.assertLess(float(moved_mm), 20)

    def test_blender_shows_a_result_with_its_texture(self):
        if not shutil.which("blender"):
            self.skipTest("blender is not installed")
        out, check = f"{self.tour}/garment.blend", f"{self.tour}/check.py"
        blender = ["blender", "--background", "--python-exit-code", "1"]
        done = subprocess.run([*blender, "--python", f"{self.share}/weft/examples/blender_sequence.py", "--",
                               f"{self.tour}/result", f"{self.tour}/studio/board.png", out], capture_output=True, text=True,
                              timeout=LONG_S, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        write(check, CHECK_IN_BLENDER)
        shown = subprocess.run([*blender, out, "--python", check], capture_output=True, text=True, timeout=LONG_S,
                               check=True).stdout
        vertices, keys, smeared, materials = map(int, re.search(r"CHECK (\d+) (\d+) (\d+) (\d+)", shown).groups())
        self.assertGreater(vertices, 1000)
        self.assertEqual((keys, smeared, materials), (4, 0, 1))  # the rest shape and three frames


if __name__ == "__main__":
    unittest.main()
