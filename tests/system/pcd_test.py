"""PCD in and out, with weft-pcl and without it."""

import json
import os
import shutil
import subprocess
import unittest

from studio import BIN, LONG_S, StudioTest, read, results, weft, write

PCL = os.path.join(BIN, "weft-pcl")


def convert(task, source, target):
    with open(source, "rb") as file:
        done = subprocess.run([PCL, task], stdin=file, capture_output=True, timeout=LONG_S, check=True)
    write(target, done.stdout)


@unittest.skipUnless(os.path.exists(PCL), "this build has no PCL")
class WithPcl(StudioTest):
    def test_clouds_hold_what_those_of_ply_hold(self):
        self.register("--cloud-format", "pcd", check=0)
        for frame in self.frames:
            cloud = f"{self.out}/{frame}/cloud"
            convert("read", f"{cloud}.pcd", self.path("back.ply"))
            back, body = (read(path, "rb").split(b"end_header\n", 1)[1] for path in (self.path("back.ply"), f"{cloud}.ply"))
            self.assertEqual(back, body[:len(back)])  # rays of cells without a point follow
        self.assertIn("cloud.pcd", [file["name"] for file in json.loads(read(f"{self.out}/{self.frames[0]}/report.json"))["files"]])
        meshes = []
        for form in ("ply", "pcd"):
            weft("align", f"{self.out}/{self.frames[0]}/cloud.{form}", "--template", f"{self.take}/template", "--out",
                 self.path(f"{form}.ply"), "--set", "alignment.ray_reach_mm=0", check=0)
            meshes.append(read(self.path(f"{form}.ply"), "rb"))
        self.assertEqual(*meshes)

    def test_results_get_theirs_later_and_stay_as_they_are(self):
        self.register("--frames", "0:2", check=0)
        before = results(self.out)
        cloud = f"{self.out}/{self.frames[0]}/cloud.ply"
        written = os.stat(cloud).st_mtime_ns
        self.register("--frames", "0:2", "--cloud-format", "pcd", check=0)
        self.assertEqual(results(self.out), before)
        self.assertEqual(os.stat(cloud).st_mtime_ns, written, "the images were decoded again")
        for frame in self.frames[:2]:
            self.assertTrue(os.path.exists(f"{self.out}/{frame}/cloud.pcd"))

    def test_scans_count_as_those_of_ply_do(self):
        frame, outs = self.frames[0], []
        for form in ("ply", "pcd"):
            scans = self.path(f"scans {form}")
            os.mkdir(scans)
            shutil.copy(f"{self.take}/truth/{frame}/mesh.ply", f"{scans}/{frame}.ply")
            if form == "pcd":
                convert("write", f"{scans}/{frame}.ply", f"{scans}/{frame}.pcd")
                os.remove(f"{scans}/{frame}.ply")
            outs.append(self.path(form))
            self.register("--frames", "0:1", "--scans", scans, check=0, out=outs[-1])
        self.assertEqual(results(outs[0]), results(outs[1]))

    def test_file_that_makes_pcl_crash_is_refused(self):
        scan = self.path("scan.pcd")
        write(scan, "FIELDS\nDATA binary\n")
        self.register("--frames", "0:1", check=0)
        done = weft("align", f"{self.out}/{self.frames[0]}/cloud.ply", "--template", f"{self.take}/template", "--out",
                    self.path("mesh.ply"), "--scan", scan)
        self.assertIn(done.returncode, (1, 2), done.stdout + done.stderr)
        self.assertIn(f"weft: error: {scan}: ", done.stderr)


class WithoutPcl(StudioTest):
    """weft where no weft-pcl stands beside it."""

    def test_says_what_is_missing_before_it_begins(self):
        alone = shutil.copy(os.path.join(BIN, "weft"), self.folder)
        os.mkdir(self.path("scans"))
        write(self.path("scans", f"{self.frames[0]}.pcd"), "VERSION 0.7\n")
        for more in (("--cloud-format", "pcd"), ("--scans", self.path("scans"))):
            done = subprocess.run([alone, *self.register_arguments(), *more], capture_output=True, text=True,
                                  timeout=LONG_S, check=False)
            self.assert_refused(done, "no PCL", "libpcl-dev")


if __name__ == "__main__":
    unittest.main()
