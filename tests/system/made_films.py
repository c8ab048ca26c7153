"""Films whose pictures tell which moment they show, and changes of their files as other programs make them."""

import re
import struct
import subprocess

from studio import read, write

SIZE = (160, 120)
DARKEST, STEP = 20, 2  # grey of the first picture, and how much lighter each next one is
H264 = ("-c:v", "libx264", "-preset", "veryfast", "-crf", "10", "-g", "15", "-bf", "2")


def ffmpeg(*arguments):
    subprocess.run(["ffmpeg", "-v", "error", "-y", *map(str, arguments)], check=True)


def film(path, *options, rate="30000/1001", frames=90, first=0):
    """Even grey pictures; that of moment i has the level DARKEST + STEP * i."""
    raw = b"".join(bytes([DARKEST + STEP * (first + i)]) * (SIZE[0] * SIZE[1]) for i in range(frames))
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pixel_format", "gray", "-video_size",
                    f"{SIZE[0]}x{SIZE[1]}", "-framerate", rate, "-i", "-", "-pix_fmt", "yuv420p", *options, path],
                   input=raw, check=True)
    return path


def moving(path, *options, rate=30, seconds=3, size="160x120"):
    """Pictures with detail and motion."""
    ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={size}:r={rate}:d={seconds}", *options, path)
    return path


def shown(path):
    """Time in seconds by the file, and number of the moment, of each picture that ffmpeg shows."""
    told = subprocess.run(["ffmpeg", "-hide_banner", "-copyts", "-i", path, "-map", "0:v:0", "-vf",
                           "scale=out_range=pc,format=gray,showinfo", "-fps_mode", "passthrough", "-f", "null", "-"],
                          capture_output=True, text=True, check=True).stderr
    return [(float(time), (float(level) - DARKEST) / STEP)
            for time, level in re.findall(r"pts_time:(\S+) .* mean:\[(\d+)", told)]


def packets(path):
    """Place and size in the file of each coded picture, in its order."""
    told = subprocess.run(["ffprobe", "-v", "error", "-select_streams", "v:0", "-show_entries", "packet=pos,size", "-of",
                           "compact=p=0:nk=0", path], capture_output=True, text=True, check=True).stdout
    return [(int(re.search(r"pos=(\d+)", line)[1]), int(re.search(r"size=(\d+)", line)[1]))
            for line in told.split() if "pos=" in line]


def damage(source, path, picture, count, at=0.5):
    """Changes `count` bytes from this share of a coded picture on."""
    data = bytearray(read(source, "rb"))
    place, size = packets(source)[picture]
    for i in range(place + int(size * at), min(place + int(size * at) + count, len(data))):
        data[i] ^= 0x5A
    write(path, bytes(data))
    return path


def cut_off(source, path, share):
    data = read(source, "rb")
    write(path, bytes(data[:int(len(data) * share)]))
    return path


def lose(source, path, which, *options):
    """A copy without some coded pictures: `which` of their numbers n, as ffmpeg's expression."""
    ffmpeg("-copyts", "-i", source, "-map", "0:v", "-c", "copy", "-bsf:v", f"noise=drop='{which}'", *options, path)
    return path


def atoms(data, begin, end):
    while begin + 8 <= end:
        size, kind = struct.unpack(">I4s", data[begin:begin + 8])
        yield kind, begin, size
        begin += size


def atom(data, path, begin, end):
    """Place and size of the first atom of this path; None without one."""
    for kind, at, size in atoms(data, begin, end):
        if kind == path[0]:
            return (at, size) if len(path) == 1 else atom(data, path[1:], at + 8, at + size)
    return None


def edit(source, path, cut_s=None, wait_s=None, parts_s=None):
    """Edit lists anew, the samples stay: tracks of a kind (b"vide", b"tmcd") begin `cut_s` later in what they hold, and are
    shown `wait_s` later. Or all tracks show parts, from one moment to another. The file's `moov` is its last atom."""
    data = bytearray(read(source, "rb"))
    moov_at, moov_size = atom(data, [b"moov"], 0, len(data))
    movie = bytes(data[moov_at + 8:moov_at + moov_size])
    scale = struct.unpack(">I", data[(at := atom(data, [b"moov", b"mvhd"], 0, len(data))[0]) + 20:at + 24])[0]
    new = b""
    for kind, at, size in atoms(movie, 0, len(movie)):
        part = movie[at:at + size]
        new += edited_track(part, scale, cut_s or {}, wait_s or {}, parts_s) if kind == b"trak" else part
    write(path, bytes(data[:moov_at] + struct.pack(">I4s", 8 + len(new), b"moov") + new + data[moov_at + moov_size:]))
    return path


def edited_track(track, movie_scale, cut_s, wait_s, parts_s):
    at = atom(track, [b"mdia", b"hdlr"], 8, len(track))[0]
    kind = track[at + 16:at + 20]
    if kind not in cut_s and kind not in wait_s and not parts_s:
        return track
    at = atom(track, [b"mdia", b"mdhd"], 8, len(track))[0]
    scale = struct.unpack(">I", track[at + 20:at + 24])[0]
    at = atom(track, [b"tkhd"], 8, len(track))[0]
    length = struct.unpack(">I", track[at + 28:at + 32])[0]
    old = atom(track, [b"edts", b"elst"], 8, len(track))
    begin = struct.unpack(">i", track[old[0] + 20:old[0] + 24])[0] if old else 0
    cut, wait = cut_s.get(kind, 0), wait_s.get(kind, 0)
    entries = [(round(wait * movie_scale), -1)] if wait else []
    entries.append((length - round(cut * movie_scale), begin + round(cut * scale)))
    if parts_s:
        entries = [(round((end - first) * movie_scale), begin + round(first * scale)) for first, end in parts_s]
    table = struct.pack(">I4sII", 16 + 12 * len(entries), b"elst", 0, len(entries))
    table += b"".join(struct.pack(">IiI", duration, media, 1 << 16) for duration, media in entries)
    parts = [track[at:at + size] for name, at, size in atoms(track, 8, len(track)) if name != b"edts"]
    parts.insert(1, struct.pack(">I4s", 8 + len(table), b"edts") + table)
    return struct.pack(">I4s", 8 + sum(map(len, parts)), b"trak") + b"".join(parts)


def set_timecode(source, path, number, flags=None):
    """Another first number of a timecode track, which may be negative, and other flags."""
    data = bytearray(read(source, "rb"))
    moov_at, moov_size = atom(data, [b"moov"], 0, len(data))
    for kind, at, size in atoms(data, moov_at + 8, moov_at + moov_size):
        if kind != b"trak" or data[(hdlr := atom(data, [b"mdia", b"hdlr"], at + 8, at + size)[0]) + 16:hdlr + 20] != b"tmcd":
            continue
        table = [b"mdia", b"minf", b"stbl"]
        stco = atom(data, [*table, b"stco"], at + 8, at + size)[0]
        place = struct.unpack(">I", data[stco + 16:stco + 20])[0]
        data[place:place + 4] = struct.pack(">i", number)
        stsd = atom(data, [*table, b"stsd"], at + 8, at + size)[0]
        if flags is not None:
            data[stsd + 36:stsd + 40] = struct.pack(">I", flags)
    write(path, bytes(data))
    return path


def with_false_sei(source, path, mark=b"x264 - core"):
    """SEI messages that claim 40 more bytes than they have, as cheap cameras write them."""
    data = bytearray(read(source, "rb"))
    at = data.find(mark)
    while at >= 0:
        data[at - 17] += 40  # behind it: 16 bytes of an id, then the text
        at = data.find(mark, at + 1)
    write(path, bytes(data))
    return path

