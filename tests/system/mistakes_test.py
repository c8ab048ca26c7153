"""Deliberate mistakes, what Weft says of each, and that nothing of it is good.

A row of MISTAKES is a mistake, how it is made on a copy of a small take, the verdict or refusal that it gets, and words
that name it. The file is the table: `docs/verdicts.md` has the checks, this shows each of them at work.
"""

import json
import os
import re
import subprocess
import unittest

from studio import StudioTest, read, weft, write

REFUSED, BAD, USABLE = "refused", "bad", "usable"


def ffmpeg(filters):
    """Filters pictures in place: `filters` by path. One process for all, since its start takes longer than a picture."""
    inputs = [word for picture in filters for word in ("-i", picture)]
    outputs = [word for place, (picture, how) in enumerate(filters.items())
               for word in ("-map", f"{place}:v", "-vf", how, f"{picture}.new.png")]
    subprocess.run(["ffmpeg", "-v", "error", "-y", *inputs, *outputs], check=True)
    for picture in filters:
        os.replace(f"{picture}.new.png", picture)


class Studio(StudioTest):
    """How mistakes are made. Each returns what `weft` is called with."""

    def changed_rig(self, change):
        rig = json.loads(read(f"{self.take}/rig.json"))
        rig.pop("hash", None)
        change(rig["cameras"])
        write(self.path("rig.json"), json.dumps(rig))
        return self.register_arguments(rig=self.path("rig.json"))

    def pictures_of(self, camera, filters):
        ffmpeg({f"{self.take}/{frame}/{camera}.png": filters for frame in self.frames})
        return self.register_arguments()

    def picture_of(self, camera, filters):
        ffmpeg({f"{self.take}/{self.frames[1]}/{camera}.png": filters})
        return self.register_arguments()

    def all_pictures(self, filters):
        ffmpeg({f"{self.take}/{frame}/{name}": filters for frame in self.frames for name in self.images})
        return self.register_arguments()

    def cells(self):
        return [tuple(map(int, line.split())) for line in read(f"{self.take}/template/cells.txt").splitlines()]

    def template(self, change_cells=None, change_mesh=None, more=()):
        cells = self.cells()
        write(self.path("cells.txt"), "".join(f"{row} {col}\n" for row, col in (change_cells or list)(cells)))
        vertices, faces = read_ply(f"{self.take}/template/mesh.ply")
        vertices, faces = (change_mesh or (lambda v, f: (v, f)))(vertices, faces)
        write_ply(self.path("mesh.ply"), vertices, faces)
        return ["template", "import", "--mesh", self.path("mesh.ply"), "--cells", self.path("cells.txt"), "--board",
                f"{self.take}/board.json", "--out", self.path("template"), *more]

    def scan(self, change=lambda point: point):
        vertices, _ = read_ply(f"{self.take}/truth/{self.frames[0]}/mesh.ply")
        os.makedirs(self.path("scans"))
        for frame in self.frames:
            write_ply(self.path("scans", f"{frame}.ply"), [change(v) for v in vertices], [])
        return [*self.register_arguments(), "--scans", self.path("scans")]


FORMATS = {"float": "f", "double": "d", "int": "i", "uint": "I", "uchar": "B", "char": "b", "short": "h", "ushort": "H"}


def read_ply(path):
    """Positions and triangles of a binary PLY of ours."""
    import struct
    header, body = read(path, "rb").split(b"end_header\n", 1)
    elements, at = {}, None
    for line in header.decode().splitlines():
        words = line.split()
        if words[0] == "element":
            at = elements[words[1]] = {"count": int(words[2]), "properties": []}
        elif words[0] == "property":
            at["properties"].append(words[1:])
    vertex = elements["vertex"]
    row = struct.Struct("<" + "".join(FORMATS[kind] for kind, _ in vertex["properties"]))
    vertices = [values[:3] for values in row.iter_unpack(body[:row.size * vertex["count"]])]
    faces, offset = [], row.size * vertex["count"]
    for _ in range(elements.get("face", {"count": 0})["count"]):
        for kind in elements["face"]["properties"]:
            count = struct.unpack_from("<" + FORMATS[kind[1]], body, offset)[0]
            offset += struct.calcsize(FORMATS[kind[1]])
            values = struct.unpack_from("<" + FORMATS[kind[2]] * count, body, offset)
            offset += struct.calcsize("<" + FORMATS[kind[2]] * count)
            if kind[3] == "vertex_indices":
                faces.append(values)
    return vertices, faces


def write_ply(path, vertices, faces):
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"] + [f"property double {axis}" for axis in "xyz"]
    if faces:
        lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    lines += ["end_header"] + ["%.9g %.9g %.9g" % tuple(v) for v in vertices] + [f"3 {a} {b} {c}" for a, b, c in faces]
    write(path, "\n".join(lines) + "\n")


def exchanged(cameras, *places):
    """Each camera of `places` has the id of the next."""
    ids = [cameras[place]["id"] for place in places]
    for place, name in zip(places, ids[1:] + ids[:1]):
        cameras[place]["id"] = name


def scaled(cameras, factor):
    for camera in cameras:
        camera["translation_mm"] = [factor * value for value in camera["translation_mm"]]


def longer(cameras, factor):
    for camera in cameras:
        camera["fx_px"] *= factor
        camera["fy_px"] *= factor


def aside(camera, by_mm):
    camera["translation_mm"][0] += by_mm


def rolled(values, by):
    return values[by:] + values[:by]


def swapped(values, a, b):
    values = list(values)
    values[a], values[b] = values[b], values[a]
    return values


def in_order(vertices, faces, order):
    """The same mesh with its vertices in another order."""
    place = {was: now for now, was in enumerate(order)}
    return [vertices[was] for was in order], [tuple(place[v] for v in face) for face in faces]


def of_rows_from_below(cells):
    last = max(row for row, _ in cells)
    return [(last - row, col) if row >= 0 else (row, col) for row, col in cells]


# Mistake, how it is made, what it gets, words that name it.
MISTAKES = [
    ("two cameras of the rig exchanged", lambda s: s.changed_rig(lambda c: exchanged(c, 1, 7)), USABLE, r"c01 and c07 are exchanged"),
    ("three cameras in a ring", lambda s: s.changed_rig(lambda c: exchanged(c, 0, 4, 9)), USABLE, r"exchanged"),
    ("a camera that stands elsewhere", lambda s: s.changed_rig(lambda c: aside(c[3], 400)), USABLE, r"c03"),
    ("a camera that was knocked", lambda s: s.changed_rig(lambda c: aside(c[3], 2)), USABLE, r"c03"),
    ("a camera upside down", lambda s: s.pictures_of("c05", "hflip,vflip"), USABLE, r"c05.*upside down"),
    ("all pictures mirrored", lambda s: s.all_pictures("hflip"), BAD, r"board|mirror|cells"),
    ("a rig of five of twelve cameras", lambda s: s.changed_rig(lambda c: c.__delitem__(slice(5, 12))), BAD, r"not in the rig"),
    ("a rig that lacks one camera", lambda s: s.changed_rig(lambda c: c.__delitem__(11)), USABLE, r"c11"),
    ("focal lengths 8 % off", lambda s: s.changed_rig(lambda c: longer(c, 1.08)), USABLE, r"focal lengths|print"),
    ("a rig 6 % too large", lambda s: s.changed_rig(lambda c: scaled(c, 1.06)), USABLE, r"scale|print"),
    ("a rig in metres", lambda s: s.changed_rig(lambda c: scaled(c, 0.001)), BAD, r"metre|units|print"),
    ("a rig in inches", lambda s: s.changed_rig(lambda c: scaled(c, 1 / 25.4)), BAD, r"inch|units|print"),
    ("vertices in reverse order", lambda s: s.template(change_mesh=lambda v, f: in_order(v, f, range(len(v) - 1, -1, -1))), REFUSED, r"order|board"),
    ("vertices shifted by one", lambda s: s.template(change_cells=lambda c: rolled(c, 1)), REFUSED, r"order|board"),
    ("two vertices exchanged", lambda s: s.template(change_cells=lambda c: swapped(c, 40, 700)), REFUSED, r"order|board"),
    ("rows counted from below", lambda s: s.template(change_cells=of_rows_from_below), REFUSED, r"mirror|row"),
    ("col row instead of row col", lambda s: s.template(change_cells=lambda c: [(col, row) for row, col in c]), REFUSED, r"col|mirror|board"),
    ("a template in metres", lambda s: s.template(change_mesh=lambda v, f: ([[x / 1000 for x in p] for p in v], f)), REFUSED, r"metre"),
    ("a template 10 % too large", lambda s: s.template(change_mesh=lambda v, f: ([[1.1 * x for x in p] for p in v], f)), REFUSED, r"1\.1|10"),
    ("a template of half the size", lambda s: s.template(change_mesh=lambda v, f: ([[0.5 * x for x in p] for p in v], f)), REFUSED, r"0\.49|0\.5"),
    ("a template stretched along x", lambda s: s.template(change_mesh=lambda v, f: ([[1.3 * p[0], p[1], p[2]] for p in v], f)), REFUSED, r"print|large|size"),
    ("a line of the map too few", lambda s: s.template(change_cells=lambda c: c[:-1]), REFUSED, r"lines|vert"),
    ("a folder of scans that is not there", lambda s: [*s.register_arguments(), "--scans", s.path("nowhere")], REFUSED, r"nowhere"),
    ("scans in metres", lambda s: s.scan(lambda p: [x / 1000 for x in p]), REFUSED, r"metre"),
    ("start meshes that are not there", lambda s: [*s.register_arguments(), "--start-from", s.path("nowhere")], REFUSED, r"nowhere"),
    ("pictures twelve times too dark", lambda s: s.all_pictures("lutrgb=r=val/12:g=val/12:b=val/12"), USABLE, r"dark|grey levels|expos"),
    ("pictures of another size", lambda s: s.all_pictures("scale=96:128"), BAD, r"size|96"),
    ("a picture that ends in the middle", lambda s: cut(s), USABLE, r"c00|images"),
    ("a camera without pictures", lambda s: gone(s, "c06"), USABLE, r"c06|images"),
    ("a camera with its cap on", lambda s: s.pictures_of("c05", "lutrgb=r=5:g=5:b=5"), USABLE, r"c05 sees nothing of the cloth"),
    ("one black picture", lambda s: s.picture_of("c05", "lutrgb=r=5:g=5:b=5"), USABLE, r"1 of 36 images shows nothing .* camera c05 in frame 0001"),
    ("one black picture, saved as grey", lambda s: s.picture_of("c05", "lutrgb=r=5:g=5:b=5,format=gray"), USABLE, r"c05.png: a grey image that shows nothing"),
    ("one camera mirrored", lambda s: s.pictures_of("c05", "hflip"), USABLE, r"c05.*(mirrored|sees)"),
    ("one camera out of focus", lambda s: s.pictures_of("c05", "gblur=sigma=9"), USABLE, r"c05 sees (nothing|little) of the cloth"),
    ("one camera a frame late", lambda s: late(s, "c05"), USABLE, r"c05.*another moment"),
    ("half of the cameras a frame late", lambda s: half_late(s), USABLE, r"of another moment"),
    ("one camera that stands still", lambda s: frozen(s, "c05"), USABLE, r"c05 stood still"),
    ("every frame twice", lambda s: doubled(s), USABLE, r"stood still|frame before"),
    ("files of two cameras exchanged", lambda s: files_exchanged(s, "c02", "c08"), USABLE, r"c02 and c08 are exchanged"),
    ("files of two cameras with pictures of different sizes", lambda s: cropped_exchanged(s, 2, 8), USABLE, r"c02 and c08 are exchanged"),
    ("places of two cameras exchanged", lambda s: s.changed_rig(lambda c: places_exchanged(c, 2, 8)), USABLE, r"c02 and c08 are exchanged"),
    ("rotations the other way round", lambda s: s.changed_rig(transposed), BAD, r"rays hardly meet|agree"),
    ("frames that the take lacks", lambda s: [*s.register_arguments(), "--frames", "100:200"], REFUSED, r"frames"),
    ("a folder without pictures", lambda s: empty(s), REFUSED, r"empty|no (frame|image|picture)"),
    ("the board of another print", lambda s: other_board(s), REFUSED, r"board"),
    ("a rig given as a board", lambda s: s.register_arguments(board=f"{s.take}/rig.json"), REFUSED, r"rig"),
    ("a board given as a rig", lambda s: s.register_arguments(rig=f"{s.take}/board.json"), REFUSED, r"board"),
    ("a preset misspelt", lambda s: [*s.register_arguments(), "--preset", "bset"], REFUSED, r"did you mean best"),
    ("an option misspelt", lambda s: [*s.register_arguments(), "--framse", "0:1"], REFUSED, r"did you mean --frames"),
]


def cut(studio):
    for frame in studio.frames:
        picture = read(f"{studio.take}/{frame}/c00.png", "rb")
        write(f"{studio.take}/{frame}/c00.png", picture[:len(picture) // 2])
    return studio.register_arguments()


def gone(studio, camera):
    for frame in studio.frames:
        os.remove(f"{studio.take}/{frame}/{camera}.png")
    return studio.register_arguments()


def late(studio, camera):
    pictures = [read(f"{studio.take}/{frame}/{camera}.png", "rb") for frame in studio.frames]
    for frame, picture in zip(studio.frames[1:], pictures):
        write(f"{studio.take}/{frame}/{camera}.png", picture)
    os.remove(f"{studio.take}/{studio.frames[0]}/{camera}.png")
    return studio.register_arguments()


def half_late(studio):
    cameras = [name.removesuffix(".png") for name in studio.images]
    for camera in cameras[1::2]:
        late(studio, camera)
    for camera in cameras[::2]:
        os.remove(f"{studio.take}/{studio.frames[0]}/{camera}.png")
    os.rmdir(f"{studio.take}/{studio.frames[0]}")
    return studio.register_arguments()


def frozen(studio, camera):
    for frame in studio.frames[1:]:
        write(f"{studio.take}/{frame}/{camera}.png", read(f"{studio.take}/{studio.frames[0]}/{camera}.png", "rb"))
    return studio.register_arguments()


def doubled(studio):
    for name in studio.images:
        write(f"{studio.take}/{studio.frames[1]}/{name}", read(f"{studio.take}/{studio.frames[0]}/{name}", "rb"))
    return studio.register_arguments()


def files_exchanged(studio, one, other):
    for frame in studio.frames:
        os.rename(f"{studio.take}/{frame}/{one}.png", f"{studio.take}/{frame}/between.png")
        os.rename(f"{studio.take}/{frame}/{other}.png", f"{studio.take}/{frame}/{one}.png")
        os.rename(f"{studio.take}/{frame}/between.png", f"{studio.take}/{frame}/{other}.png")
    return studio.register_arguments()


def cropped_exchanged(studio, one, other):
    """Pictures cut as published rigs often are, the rig with them."""
    rig = json.loads(read(f"{studio.take}/rig.json"))
    rig.pop("hash", None)
    for place, camera in enumerate(rig["cameras"]):
        camera["width_px"] -= 2 * place
    ffmpeg({f"{studio.take}/{frame}/{camera['id']}.png": f"crop={camera['width_px']}:{camera['height_px']}:0:0"
            for camera in rig["cameras"] for frame in studio.frames})
    write(studio.path("rig.json"), json.dumps(rig))
    files_exchanged(studio, f"c{one:02}", f"c{other:02}")
    return studio.register_arguments(rig=studio.path("rig.json"))


def places_exchanged(cameras, one, other):
    for field in ("rotation", "translation_mm"):
        cameras[one][field], cameras[other][field] = cameras[other][field], cameras[one][field]


def transposed(cameras):
    for camera in cameras:
        r = camera["rotation"]
        camera["rotation"] = [r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]]


def empty(studio):
    os.mkdir(studio.path("nothing"))
    return [studio.path("nothing") if argument == studio.take else argument for argument in studio.register_arguments()]


def other_board(studio):
    weft("pattern", "generate", "--rows", 24, "--cols", 48, "--cell-mm", 20, "--seed", 99, "--out", studio.path("board"), check=0)
    return studio.register_arguments(board=studio.path("board", "board.json"))


class Mistakes(Studio):
    def outcome(self, done):
        found = re.search(r"^(good|usable|bad)\b", done.stdout, re.MULTILINE)
        return REFUSED if done.returncode == 2 else found.group(1) if found else f"exit {done.returncode}"

    def check(self, make, expected, words):
        done = weft(*make(self))
        said = done.stdout + done.stderr
        self.assertEqual(self.outcome(done), expected, said)
        self.assertEqual(done.returncode, {REFUSED: 2, BAD: 1, USABLE: 0}[expected], said)
        self.assertRegex(said, re.compile(words, re.IGNORECASE))

    def test_the_take_itself_is_good(self):
        done = self.register()
        self.assertEqual(self.outcome(done), "good", done.stdout + done.stderr)


def add_test(number, mistake, make, expected, words):
    name = "test_%02d_%s" % (number, re.sub(r"\W+", "_", mistake))
    setattr(Mistakes, name, lambda self: self.check(make, expected, words))


for number, row in enumerate(MISTAKES, 1):
    add_test(number, *row)

if __name__ == "__main__":
    unittest.main()
