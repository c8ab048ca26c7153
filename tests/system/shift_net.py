"""A net that answers the same everywhere: cloth that no ray holds moves 3 mm."""

import json
import os
import re
import shutil
import struct

from studio import read, weft, write

SIDE, FEATURES, ANSWER = 8, 27, (1.5, 0, -0.5, -1)


def write_shift_net(folder):
    """net.onnx and sample.bin."""
    shutil.copy(os.path.join(os.environ["WEFT_SOURCE"], "tests", "data", "nets", "shift.onnx"), f"{folder}/net.onnx")
    sizes = [struct.pack("<3I", channels, SIDE, SIDE) for channels in (FEATURES, len(ANSWER))]
    image = struct.pack("<f", 0.5) * FEATURES * SIDE ** 2
    answer = b"".join(struct.pack("<f", value) * SIDE ** 2 for value in ANSWER)
    write(f"{folder}/sample.bin", b"weftnet1" + sizes[0] + image + sizes[1] + answer)


def describe_file(avatar, about, name, key):
    """What avatar.json says of a file of the net becomes true."""
    about["net"].update({f"{key}_bytes": 0, f"{key}_checksum": "0"})
    write(f"{avatar}/avatar.json", json.dumps(about))
    said = weft("avatar", "show", avatar, check=1).stderr  # the refusal tells what is right
    size, checksum = re.search(rf"{name}: has (\d+) bytes and checksum (\w+)", said).groups()
    about["net"].update({f"{key}_bytes": size, f"{key}_checksum": checksum})
    write(f"{avatar}/avatar.json", json.dumps(about))


def with_shift_net(avatar, out):
    """A copy of the avatar that has this net."""
    shutil.copytree(avatar, out)
    write_shift_net(out)
    about = json.loads(read(f"{out}/avatar.json"))
    about["net"] = {"atlas_level": 1, "atlas_gutter": 3}
    for name, key in (("net.onnx", "onnx"), ("sample.bin", "sample")):
        describe_file(out, about, name, key)
    weft("avatar", "show", out, check=0)
    return out


def put_net(avatar, onnx):
    """An avatar of a stranger, whose files fit each other."""
    write(f"{avatar}/net.onnx", onnx)
    describe_file(avatar, json.loads(read(f"{avatar}/avatar.json")), "net.onnx", "onnx")
