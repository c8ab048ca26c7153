"""--config and --set: they change results, stand in the reports, and reach the workers of a daemon."""

import json
import os
import subprocess
import unittest

from studio import BIN, StudioTest, page_data, read, results, wait_for, weft, write

RADIUS = "triangulation.consensus.inlier_radius_mm"
EXAMPLES = os.path.join(os.environ["WEFT_SOURCE"], "config", "examples")


def value(options, path):
    for name in path.split("."):
        options = options[name]
    return options


def lines(path):
    return read(path).splitlines()


class Options(StudioTest):
    def options_of(self, frame=0, out=None):
        return json.loads(read(os.path.join(out or self.out, self.frames[frame], "report.json")))["options"]

    def register_frame(self, *more, **replaced):
        return self.register("--frames", "0:1", "--observations", *more, **replaced)

    def assert_job_tells(self, radius, out):
        job = json.loads(read(os.path.join(out, "job.json")))
        self.assertEqual(value(job["spec"]["options"]["pipeline"], RADIUS), radius)
        self.assertEqual(value(self.options_of(out=out)["pipeline"], RADIUS), radius)
        options = page_data(os.path.join(out, "report.html"))["job"]["options"]
        self.assertEqual([option["value"] for option in options if option["path"] == RADIUS], [str(radius)])

    def test_a_setting_changes_the_results_and_stands_in_the_reports(self):
        self.register_frame(check=0)
        before = results(self.out)
        self.assertEqual(value(self.options_of()["pipeline"], RADIUS), 1)
        other = self.path("other")
        self.register_frame("--set", f"{RADIUS}=0.05", out=other, check=0)
        after = results(other)
        self.assert_job_tells(0.05, other)
        self.assertNotEqual(before[f"{self.frames[0]}/cloud.ply"], after[f"{self.frames[0]}/cloud.ply"])
        # The same options again: nothing to be done; others: all of it.
        self.assertIn("1 kept", self.register_frame("--set", f"{RADIUS}=0.05", out=other, check=0).stdout)
        self.assertNotIn("kept", self.register_frame(out=other, check=0).stdout)
        self.assertEqual(results(other), before)

    def test_preset_then_files_then_settings(self):
        write(self.path("studio.txtpb"), "# ours\nalignment {\n  elastic { bending: 0.3 }\n  push { weight: 2 }\n}\n")
        write(self.path("more.txtpb"), "alignment { push { weight: 3 } }")
        self.register_frame("--preset", "paper", "--config", self.path("studio.txtpb"), "--config",
                            self.path("more.txtpb"), "--set", "alignment.push.depth_mm=2", check=0)
        alignment = self.options_of()["pipeline"]["alignment"]
        self.assertEqual(alignment["elastic"]["bending"], 0.3)
        self.assertEqual(alignment["push"], {"weight": 3, "depth_mm": 2})
        self.assertEqual(alignment["detection"]["filled_weight"], 1)  # paper
        self.assertFalse(self.options_of()["pipeline"]["second_pass"]["enabled"])
        self.assertEqual(self.options_of()["preset"], "paper")

    def test_mistakes_are_named_before_anything_is_written(self):
        self.assert_refused(self.register("--set", "triangulation.consensus.inlier_radius=1"),
                            "no such option", f"did you mean {RADIUS}?", "`weft options` lists all")
        self.assert_refused(self.register("--set", f"{RADIUS}=0"), f"{RADIUS}=0: must be a number above 0")
        self.assert_refused(self.register("--set", "template_build.openings=2"), "no stage template_build")
        studio = self.path("studio.txtpb")
        write(studio, "triangulation {\n  consensus {\n    inlier_radius_mm: -1\n  }\n}\n")
        self.assert_refused(self.register("--config", studio), f"{studio}:3: {RADIUS}: -1 must be above 0")
        self.assert_refused(self.register("--config", self.path("none.txtpb")), "none.txtpb")
        self.assertFalse(os.path.exists(self.out))

    def test_decode_takes_options(self):
        arguments = ["decode", self.image(0, 0), self.image(0, 1), "--board", f"{self.take}/board.json", "--json"]
        plain = json.loads(weft(*arguments, "--out", self.path("plain.csv"), check=0).stdout)
        changed = json.loads(weft(*arguments, "--out", self.path("changed.csv"), "--set", "decode.corners=false",
                                  check=0).stdout)
        self.assertGreater(plain["corners"], 0)
        self.assertEqual(changed["corners"], 0)
        self.assertEqual(plain["centers"], changed["centers"])
        self.assertFalse(changed["options"]["decode"]["corners"])
        self.assertEqual(list(changed["options"]), ["decode"])
        refused = weft(*arguments, "--out", self.path("no.csv"), "--set", f"{RADIUS}=1", check=2)
        self.assertIn("this command has no stage triangulation, it has decode", refused.stderr)

    def test_align_takes_options(self):
        self.register_frame("--frames-alone", "--single-pass", check=0)
        cloud = os.path.join(self.out, self.frames[0], "cloud.ply")
        arguments = ["align", cloud, "--template", f"{self.take}/template", "--json"]
        meshes = [self.path("plain.ply"), self.path("changed.ply")]
        weft(*arguments, "--out", meshes[0], check=0)
        changed = json.loads(weft(*arguments, "--out", meshes[1], "--set", "alignment.elastic.bending=1",
                                  check=0).stdout)
        self.assertEqual(changed["options"]["alignment"]["elastic"]["bending"], 1)
        self.assertNotEqual(read(meshes[0], "rb"), read(meshes[1], "rb"))
        # So it is in a registration; its cloud is the same.
        other = self.path("other")
        self.register_frame("--frames-alone", "--single-pass", "--set", "alignment.elastic.bending=1", out=other,
                            check=0)
        frame = self.frames[0]
        before, after = results(self.out), results(other)
        self.assertEqual(before[f"{frame}/cloud.ply"], after[f"{frame}/cloud.ply"])
        self.assertNotEqual(before[f"{frame}/mesh.ply"], after[f"{frame}/mesh.ply"])

    def test_template_build_takes_options_of_all_its_stages(self):
        arguments = ["template", "build", self.take, "--rig", f"{self.take}/rig.json", "--board",
                     f"{self.take}/board.json", "--samples", "1", "--json"]
        plain = json.loads(weft(*arguments, "--openings", "2", "--out", self.path("plain"), check=0).stdout)
        self.assertEqual(plain["options"]["template_build"]["openings"], 2)
        write(self.path("studio.txtpb"), f"triangulation {{ consensus {{ min_views: 4 }} }}\n"
                                         f"template_build {{ openings: 2 corners: true }}\nalignment {{ stretch_rings: 4 }}")
        built = json.loads(weft(*arguments, "--config", self.path("studio.txtpb"), "--out", self.path("built"),
                                check=0).stdout)
        self.assertEqual(sorted(built["options"]), ["decode", "template_build", "triangulation"])
        self.assertEqual(built["options"]["triangulation"]["consensus"]["min_views"], 4)
        self.assertGreater(built["vertices"], 1.5 * plain["vertices"])
        self.assertNotEqual(results(self.path("plain", "clouds")), results(self.path("built", "clouds")))
        refused = weft(*arguments, "--out", self.path("no"), "--set", "template_build.openings=5", check=2)
        self.assertIn("has 2 openings, expected were 5", refused.stderr)

    def test_a_daemon_hands_them_to_its_workers(self):
        self.register_frame("--set", f"{RADIUS}=0.05", check=0)
        address = self.start_daemon()
        remote = self.path("remote")
        self.register_frame("--server", address, "--set", f"{RADIUS}=0.05", out=remote, check=0)
        self.assertEqual(results(remote), results(self.out))
        self.assert_job_tells(0.05, remote)
        studio = self.path("studio.txtpb")
        write(studio, "alignment { push { weight: 1 } }\ntemplate_build { openings: 2 }\n")
        self.register_frame("--server", address, "--config", studio, out=self.path("file"), check=0)
        self.assertEqual(value(self.options_of(out=self.path("file"))["pipeline"], "alignment.push.weight"), 1)

    def start_daemon(self):
        address_file = self.path("address")
        log = open(self.path("weftd.log"), "w")
        self.addCleanup(log.close)
        daemon = subprocess.Popen(
            [os.path.join(BIN, "weftd"), "--listen", "127.0.0.1:0", "--address-file", address_file, "--state",
             self.path("state"), "--allow-path", self.folder, "--workers", "1"], stdout=log, stderr=log)
        self.addCleanup(daemon.wait)
        self.addCleanup(daemon.kill)
        return wait_for(lambda: os.path.exists(address_file) and read(address_file).strip(), "weftd to listen")

    def test_weft_options_lists_and_writes_files_that_config_reads(self):
        listed = weft("options", "triangulation.consensus", check=0).stdout
        self.assertIn(f"{RADIUS}=1  (mm; above 0, at most 1000)\n    Distance up to which a ray", listed)
        self.assertNotIn("alignment.", listed)
        listed = json.loads(weft("options", "--preset", "paper", "--json", check=0).stdout)["options"]
        push = next(option for option in listed if option["path"] == "alignment.push.weight")
        self.assertEqual((push["value"], push["default"]), ("1", "0"))
        text = weft("options", "--set", f"{RADIUS}=1.5", "--file", check=0).stdout
        write(self.path("studio.txtpb"), text)
        again = weft("options", "--config", self.path("studio.txtpb"), "--file", check=0).stdout
        self.assertEqual(text, again)
        self.assertIn(f"did you mean {RADIUS}?", weft("options", "inlier_radiusmm", check=2).stderr)

    def test_files_of_config_are_what_they_say(self):
        """config/best.txtpb is the default; every example can be read and changes something."""
        best = weft("options", "--file", check=0).stdout
        config = os.path.join(os.environ["WEFT_SOURCE"], "config")
        self.assertEqual(read(os.path.join(config, "best.txtpb")), best,
                         "after a change of a default: weft options --file > config/best.txtpb")
        paper = weft("options", "--preset", "paper", "--file", check=0).stdout
        self.assertEqual(weft("options", "--config", os.path.join(config, "paper.txtpb"), "--file", check=0).stdout,
                         paper)
        self.assertNotEqual(paper, best)
        examples = sorted(os.listdir(EXAMPLES))
        self.assertGreater(len(examples), 2)
        for name in examples:
            path = os.path.join(EXAMPLES, name)
            self.assertNotEqual(weft("options", "--config", path, "--file", check=0).stdout, best, name)
            # Commented: what it is for, before the first option.
            self.assertTrue(any(line.startswith("# ") and "proto-" not in line for line in lines(path)), name)


if __name__ == "__main__":
    unittest.main()
