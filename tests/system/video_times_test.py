"""Videos of one scene by many cameras, files and timecodes: the import finds by how much their times differ, to a tenth of a
frame. Their pictures tell the truth."""

import glob
import json
import os
import re
import statistics
import subprocess
import tempfile
import unittest
from fractions import Fraction

from made_films import DARKEST, H264, STEP, damage, edit, ffmpeg, film, lose, set_timecode, shown
from studio import read, weft, write

NDF, DF = "23:59:59:10", "23:59:59;10"


class VideoTimesTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def copy(self, source, name, *options, first=()):
        ffmpeg(*first, "-i", source, "-map", "0:v", "-c", "copy", *options, self.path(name))
        return self.path(name)

    def with_track(self, pictures, track, name):
        """The pictures of one file beside the timecode track of another one."""
        ffmpeg("-i", pictures, "-i", track, "-map", "0:v", "-map", "1:d", "-c", "copy", "-write_tmcd", "0", self.path(name))
        return self.path(name)

    def compare(self, films):
        """`films`: name, file, rate of its pictures. All are of one scene, whose moment 0 is at the same time."""
        cameras = [word for name, path, _ in films for word in ("--camera", f"{name}={path}")]
        done = json.loads(weft("take", "import", *cameras, "--sync", "timecode", "--out", self.path("take"), "--json",
                               check=0).stdout)
        found = {camera["id"]: camera["sync"].get("offset_s", 0) for camera in done["take"]["cameras"]}
        true = {}
        for name, path, fps in films:
            # By all pictures: those before the first key frame are not what they were.
            true[name] = statistics.median(moment / fps - time for time, moment in shown(path)[-30:])
        reference = films[0][0]
        for name, _, fps in films:
            error_s = found[name] - found[reference] - true[name] + true[reference]
            with self.subTest(name):
                self.assertLess(abs(error_s) * fps, 0.1, f"{name}: {1e3 * error_s:.1f} ms off")
        return done

    def test_files_of_one_film(self):
        """Around midnight, with dropped numbers."""
        whole = film(self.path("whole.mov"), *H264, "-timecode", DF)
        fps = 30000 / 1001
        films = [
            ("whole", whole),
            # A player's trim keeps all samples; both tracks begin later, or the pictures alone.
            ("trimmed", edit(whole, self.path("trimmed.mov"), cut_s={b"vide": 1.001, b"tmcd": 1.001})),
            ("trimmed_within", edit(whole, self.path("within.mov"), cut_s={b"vide": 0.5, b"tmcd": 0.5})),
            ("waits", edit(whole, self.path("waits.mov"), wait_s={b"vide": 0.4, b"tmcd": 0.4})),
            ("without_edits", self.copy(whole, "without.mov", "-use_editlist", "0", "-timecode", DF)),
            ("negative_times", self.copy(whole, "negative.mov", "-movflags", "negative_cts_offsets", "-timecode", DF)),
            ("fragments", self.copy(whole, "frag.mov", "-movflags", "frag_keyframe+empty_moov", "-timecode", DF)),
            ("tag_of_mp4", self.copy(whole, "tag.mp4", "-write_tmcd", "0", "-movflags", "use_metadata_tags",
                                     "-metadata", f"timecode={DF}")),
            ("tag_of_mkv", self.copy(whole, "tag.mkv", "-metadata", f"timecode={DF}")),
            ("day_later", self.copy(whole, "later.mkv", "-metadata", "timecode=47:59:59;10")),
            ("begins_later", film(self.path("late.mkv"), *H264, "-timecode", "00:00:00;02", first=22, frames=60)),
            # Its key frame is at picture 15 of the film, six before the one with which it shall begin.
            ("from_between", self.copy(whole, "ss.mov", "-timecode", "00:00:00;01", first=("-ss", "0.7007"))),
            # The first pictures cannot be decoded; the label is of the first one, not of the first that can.
            ("without_key", lose(whole, self.path("nokey.mov"), "lt(n,1)", "-timecode", DF)),
            ("broken_key", lose(whole, self.path("nokey.mkv"), "lt(n,7)", "-metadata", "timecode=23:59:59;17")),
            ("mxf", film(self.path("m.mxf"), "-c:v", "mpeg2video", "-q:v", "2", "-g", "15", "-bf", "2", "-timecode", DF)),
            ("hevc", film(self.path("hevc.mov"), "-c:v", "libx265", "-preset", "veryfast", "-crf", "8", "-x265-params",
                          "log-level=error:keyint=15:bframes=2:open-gop=1", "-timecode", DF)),
        ]
        self.compare([(name, path, fps) for name, path in films])

    def test_labels_that_are_not_those_of_the_film(self):
        """Tracks that count each second picture, and one that begins before midnight."""
        slow, fast = film(self.path("s.mov"), *H264, "-timecode", NDF), film(self.path("f.mp4"), *H264, rate="60000/1001")
        later = film(self.path("l.mov"), *H264, "-timecode", "00:00:00:04", frames=5)
        negative = set_timecode(slow, self.path("n.mov"), -20, flags=4)
        self.compare([("a", slow, 30000 / 1001), ("b", self.with_track(fast, slow, "b.mov"), 60000 / 1001),
                      ("c", negative, 30000 / 1001)])
        # 24 labels later, each of which lasts two pictures of the film.
        os.rename(self.path("take"), self.path("first"))
        copy = json.loads(weft("take", "import", "--camera", f"a={self.path('b.mov')}", "--camera",
                               f"b={self.with_track(fast, later, 'd.mov')}", "--sync", "timecode", "--out", self.path("take"),
                               "--json", check=0).stdout)
        a, b = (camera["sync"].get("offset_s", 0) for camera in copy["take"]["cameras"])
        self.assertAlmostEqual(b - a, 24 * 1.001 / 30, delta=1e-4)

    def test_rates(self):
        """Whole numbers, and the thousandth less; a phone whose mean rate is no one's."""
        for rates in (("24", "25", "30", "48", "50", "60"), ("24000/1001", "30000/1001", "48000/1001", "60000/1001")):
            films = []
            for i, rate in enumerate(rates):
                fps, name = float(Fraction(rate)), f"c{rate.partition('/')[0]}"
                ending = ("mov", "mkv")[i % 2]
                films.append((name, film(self.path(f"{name}.{ending}"), *H264, "-timecode", "10:22:33:00", rate=rate, frames=45),
                              fps))
            self.compare(films)
            os.rename(self.path("take"), self.path(f"of {len(films)}"))
        even = self.path("c30.mov")
        ffmpeg("-i", even, "-vf", "settb=1/600,setpts='N*20+if(gte(N,30),3,0)'", "-fps_mode", "passthrough", "-enc_time_base",
               "1/600", *H264, "-bf", "0", "-video_track_timescale", "600", self.path("uneven.mp4"))
        phone = self.copy(self.path("uneven.mp4"), "phone.mov", "-timecode", "10:22:33:00")
        copy = json.loads(weft("take", "import", "--camera", f"a={even}", "--camera", f"b={phone}", "--sync", "timecode", "--out",
                               self.path("take"), "--json", check=0).stdout)
        a, b = (camera["sync"].get("offset_s", 0) for camera in copy["take"]["cameras"])
        self.assertAlmostEqual(a, b, delta=0.003)

    def levels(self, camera):
        """The moment that each picture of a camera shows, by frame set of the exported take."""
        files = sorted(glob.glob(self.path(f"pictures/*/{camera}.png")))
        told = subprocess.run(["ffmpeg", "-hide_banner", "-pattern_type", "glob", "-i", self.path(f"pictures/*/{camera}.png"), "-vf",
                               "format=gray,showinfo", "-f", "null", "-"], capture_output=True, text=True, check=True).stderr
        found = [(float(level) - DARKEST) / STEP for level in re.findall(r"mean:\[(\d+)", told)]
        self.assertEqual(len(found), len(files), camera)
        return {os.path.basename(os.path.dirname(file)): moment for file, moment in zip(files, found)}

    def test_other_containers_and_codes(self):
        """All pictures of a frame set are of one moment, though some containers say in which order pictures are decoded alone,
        begin at other times, lack pictures, or are damaged."""
        whole = film(self.path("whole.mov"), *H264, "-timecode", DF)
        tag = ("-metadata", f"timecode={DF}")
        mpeg2 = ("-c:v", "mpeg2video", "-q:v", "2", "-g", "12", "-bf", "2")
        jpeg = ("-c:v", "mjpeg", "-q:v", "2", "-pix_fmt", "yuvj420p")
        broken = bytearray(read(whole, "rb"))
        at = broken.index(b"mdat") + 200
        broken[at:at + 500] = bytes(500)
        write(self.path("broken.mov"), bytes(broken))
        ffmpeg("-i", whole, "-vf", "select='not(between(n,20,24)+eq(n,50))'", "-fps_mode", "vfr", *H264, "-timecode", DF,
               self.path("lost.mov"))
        ffmpeg("-f", "lavfi", "-i", "sine=d=3", "-i", whole, "-map", "1:v", "-map", "0:a", "-c:v", "copy", "-c:a", "aac", "-timecode",
               DF, self.path("sound.mov"))
        films = {
            "whole": whole,
            "avi_jpeg": film(self.path("jpeg.avi"), *jpeg, *tag),
            "avi_h264": film(self.path("h264.avi"), *H264, *tag),
            "avi_copy": self.copy(whole, "copy.avi", *tag),
            "avi_mpeg4": film(self.path("mpeg4.avi"), "-c:v", "mpeg4", "-q:v", "2", "-bf", "2", *tag),
            "mxf_h264": film(self.path("h264.mxf"), *H264, "-timecode", DF),
            "mxf_mpeg2": film(self.path("mpeg2.mxf"), *mpeg2, "-timecode", DF),
            "webm_late": film(self.path("late.webm"), "-c:v", "libvpx-vp9", "-crf", "10", "-b:v", "0", "-deadline", "realtime", *tag,
                              "-output_ts_offset", "5"),
            "copied_later": self.copy(whole, "later.mov", "-movie_timescale", "600", "-timecode", "00:00:00;02",
                                      first=("-ss", "0.734")),
            "tag_of_stream": self.copy(whole, "stream.mkv", "-metadata:s:v", f"timecode={DF}"),
            "lost": self.path("lost.mov"),
            "broken": self.path("broken.mov"),
            "sound": self.path("sound.mov"),
        }
        cameras = [word for name, path in films.items() for word in ("--camera", f"{name}={path}")]
        done = json.loads(weft("take", "import", *cameras, "--sync", "timecode", "--out", self.path("take"), "--json",
                               check=0).stdout)
        weft("take", "export", self.path("take"), "--out", self.path("pictures"), check=0)
        whole_of_set = self.levels("whole")
        for name in films:
            found = self.levels(name)
            with self.subTest(name):
                self.assertEqual(len(found), {"copied_later": 68, "lost": 84, "broken": 76}.get(name, 90))
                off = max(abs(moment - whole_of_set[number]) for number, moment in found.items())
                self.assertLess(off, 0.6, f"{name}: {off} frames")  # levels are rounded: half a step is no frame
                is_damaged = any(text.startswith(f"{name} (") and "it is damaged" in text for text in done["warnings"])
                self.assertEqual(is_damaged, name == "broken", done["warnings"])

    def test_other_rates_and_tracks(self):
        """Of one scene that begins at 10:22:33:00, in labels that drop no numbers."""
        label = ("-timecode", "10:22:33:00")
        wide = ("-vf", "scale=256:120", "-c:v", "dnxhd", "-profile:v", "dnxhr_lb", "-pix_fmt", "yuv422p")
        slow = film(self.path("slow.mov"), *H264, *label)
        fast = film(self.path("fast.mp4"), *H264, rate="120000/1001")
        prores = film(self.path("prores.mov"), "-c:v", "prores", *label, rate="24000/1001")
        self.compare([
            ("slow", slow, 30000 / 1001),
            ("op_atom", film(self.path("a.mxf"), *wide, "-f", "mxf_opatom", *label, rate="24000/1001"), 24000 / 1001),
            ("prores", edit(prores, self.path("p.mov"), cut_s={b"vide": 1.001, b"tmcd": 1.001}), 24000 / 1001),
            ("hevc", film(self.path("h.mov"), "-c:v", "libx265", "-preset", "veryfast", "-crf", "8", "-x265-params",
                          "log-level=error:keyint=30:bframes=3", *label, rate="60000/1001"), 60000 / 1001),
            ("every_fourth", self.with_track(fast, slow, "f.mov"), 120000 / 1001),
            ("base_of_48", film(self.path("b.mov"), *H264, *label, rate="48000/1001"), 48000 / 1001),
        ])

    def test_refuses_what_loses_its_times(self):
        """A cut within the recording, and damage where nothing tells which pictures it concerns."""
        whole = film(self.path("whole.mov"), *H264, "-timecode", DF)
        period_s = 1.001 / 30
        cut = edit(whole, self.path("cut.mov"), parts_s=[(10 * period_s, 40 * period_s), (60 * period_s, 90 * period_s)])
        again = edit(whole, self.path("again.mov"), parts_s=[(10 * period_s, 40 * period_s), (40 * period_s, 90 * period_s)])
        damaged = damage(film(self.path("h264.avi"), *H264, "-metadata", f"timecode={DF}"), self.path("damaged.avi"), 20, 60)
        for path, words in ((cut, "its edit list has a cut 1.001 s after its begin"), (damaged, "not when they are shown")):
            refused = weft("take", "import", whole, path, "--sync", "timecode", "--out", self.path("take"), check=2)
            self.assertIn(words, refused.stderr)
        # Parts that follow each other are no cut.
        weft("take", "import", whole, again, "--sync", "timecode", "--out", self.path("take"), check=0)

    def test_says_what_times_cannot_tell(self):
        """Fields, times that come twice, timecodes that part."""
        fields = self.path("fields.mp4")
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=160x120:r=50:d=1", "-vf", "tinterlace=interleave_top,setfield=tff", "-c:v", "libx264",
               "-preset", "veryfast", "-pix_fmt", "yuv420p", "-flags", "+ildct+ilme", "-x264opts", "tff=1", fields)
        # The header says that they are whole pictures.
        hidden = self.path("hidden.mkv")
        ffmpeg("-i", fields, "-c", "copy", "-field_order", "progressive", hidden)
        film(self.path("even.mkv"), "-c:v", "ffv1", rate="25", frames=25)
        twice = self.path("twice.mkv")
        ffmpeg("-i", self.path("even.mkv"), "-c", "copy", "-bsf:v", "setts=pts=PTS-if(eq(N\\,7)\\,40\\,0):dts=DTS-if(eq(N\\,7)\\,40\\,0)",
               twice)
        copy = json.loads(weft("take", "import", fields, hidden, twice, self.path("even.mkv"), "--sync", "together", "--out",
                               self.path("take"), "--json", check=0).stdout)
        text = "\n".join(copy["warnings"])
        for words in ("fields.mp4): it is interlaced: 25 of its 25 pictures", "hidden.mkv): it is interlaced: 25 of its 25 pictures",
                      "twice.mkv): 1 of its pictures have the time of the one before"):
            self.assertIn(words, text)
        self.assertNotIn("even.mkv): it is", text)
        slow = film(self.path("slow.mov"), *H264, "-timecode", "10:00:00:00")
        drops = film(self.path("drops.mov"), *H264, "-timecode", "10:00:00;00")
        copy = json.loads(weft("take", "import", slow, drops, "--sync", "timecode", "--out", self.path("mixed"), "--json",
                               check=0).stdout)
        self.assertIn("count at different speeds", "\n".join(copy["warnings"]))


if __name__ == "__main__":
    unittest.main()
