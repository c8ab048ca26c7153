"""The files of a result, as the Blender add-on shows them: meshes, frames with their times, colours. Needs NumPy, not Blender."""

import json
import os
import re

import numpy as np

METRES_PER_MM = 0.001
# Weft's y points down and z away, as a camera's; Blender's z points up.
BLENDER_FROM_WORLD = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], dtype=np.float64)
TYPES = {"char": "i1", "uchar": "u1", "short": "<i2", "ushort": "<u2", "int": "<i4", "uint": "<u4", "float": "<f4",
         "double": "<f8"}
OBSERVED, TWO_VIEW = 1, 2
# By state, in sRGB: inferred, observed, observed by two views, bridged, driven; those of services/results/report/mesh_colors.cpp.
STATE_COLORS = [(.90, .62, .00), (.34, .71, .91), (.00, .62, .45), (.55, .25, .50), (.94, .89, .26)]


class ResultError(Exception):
    """A file of the result that cannot be used; the text names it and the remedy."""


def linear(srgb):
    """RGBA as nodes take it; colours on screens are sRGB."""
    return (*(c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in srgb), 1.0)


def map_color(t):
    """From low to high, 0 to 1: MapColor of services/results/report/mesh_colors.cpp, as linear RGBA."""
    hue, chroma = np.radians(285 - 180 * t), 0.092 + 0.065 * t**3
    light, a, b = 0.36 + 0.55 * t, chroma * np.cos(hue), chroma * np.sin(hue)
    lms = np.array([light + 0.3963377774 * a + 0.2158037573 * b, light - 0.1055613458 * a - 0.0638541728 * b,
                    light - 0.0894841775 * a - 1.2914855480 * b])**3
    rgb = np.array([[4.0767416621, -3.3077115913, 0.2309699292], [-1.2684380046, 2.6097574011, -0.3413193965],
                    [-0.0041960863, -0.7034186147, 1.7076147010]]) @ lms
    return (*np.clip(rgb, 0, 1).tolist(), 1.0)


def natural_key(name):
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", name)]


def read_json(path):
    try:
        with open(path, encoding="utf-8") as file:
            return json.load(file)
    except FileNotFoundError as error:
        raise ResultError(f"{path}: no such file; choose the folder that `weft register` wrote") from error
    except ValueError as error:
        raise ResultError(f"{path}: is no JSON ({error})") from error


def read_header(file):
    """[(element, rows, [(property, its type, None or the type of its count)])]"""
    elements = []
    if file.readline() != b"ply\n" or file.readline() != b"format binary_little_endian 1.0\n":
        raise ResultError(f"{file.name}: is no PLY file as Weft writes it")
    for line in iter(file.readline, b"end_header\n"):
        words = line.decode("utf-8", "replace").split()
        if not words:
            raise ResultError(f"{file.name}: the header has no end")
        if words[0] == "element":
            elements.append((words[1], int(words[2]), []))
        elif words[:2] == ["property", "list"]:
            elements[-1][2].append((words[4], TYPES[words[3]], TYPES[words[2]]))
        elif words[0] == "property":
            elements[-1][2].append((words[2], TYPES[words[1]], None))
    return elements


def row_type(properties):
    """The rows of an element; each list has three items, u v of three corners six."""
    fields = []
    for name, kind, count in properties:
        if count is None:
            fields.append((name, kind))
        else:
            fields += [(f"{name}_count", count), (name, kind, (6 if name == "texcoord" else 3,))]
    return np.dtype(fields)


def read_mesh(path, with_faces=False):
    """Vertices and, on request, faces of a mesh.ply as structured arrays."""
    try:
        with open(path, "rb") as file:
            tables = {}
            for element, rows, properties in read_header(file):
                if element == "face" and not with_faces:
                    break
                kind = row_type(properties)
                tables[element] = np.frombuffer(file.read(rows * kind.itemsize), dtype=kind)
                if len(tables[element]) != rows:
                    raise ResultError(f"{path}: ends within its {element} rows; register the frame again")
    except OSError as error:
        raise ResultError(f"{path}: {error.strerror}; the result must stay where it was opened") from error
    return tables


def positions(vertex):
    """[vertices, 3], metres, z up."""
    world_mm = np.column_stack([vertex[axis].astype(np.float64) for axis in "xyz"])
    return (METRES_PER_MM * world_mm @ BLENDER_FROM_WORLD.T).astype(np.float32)


def velocities(result, names, at, i, fps):
    """[vertices, 3] in metres a second, of the i-th frame: between those before and after."""
    before, after = max(i - 1, 0), min(i + 1, len(names) - 1)
    ends = [positions(read_mesh(os.path.join(result, names[k], "mesh.ply"))["vertex"]) for k in (before, after)]
    return (ends[1] - ends[0]) * np.float32(fps / max(at[after] - at[before], 1))


def lens_and_pose(camera):
    """Of a camera of rig.json, as Blender has them: focal length and shifts over the sensor's width, and the pose, [4, 4]."""
    width, height = camera["width_px"], camera["height_px"]
    # Pixel (0, 0) has its centre there; Blender counts from the corner.
    shift_x, shift_y = (width / 2 - (camera["cx_px"] + 0.5)) / width, ((camera["cy_px"] + 0.5) - height / 2) / width
    camera_from_world = np.array(camera["rotation"], dtype=np.float64).reshape(3, 3)
    center_mm = -camera_from_world.T @ np.array(camera["translation_mm"], dtype=np.float64)
    pose = np.eye(4)
    # Blender's cameras look along -z, and y is up.
    pose[:3, :3] = BLENDER_FROM_WORLD @ camera_from_world.T @ np.diag([1.0, -1.0, -1.0])
    pose[:3, 3] = METRES_PER_MM * BLENDER_FROM_WORLD @ center_mm
    return camera["fx_px"] / width, shift_x, shift_y, pose


def frames_of(result):
    """The job, and the names of its frames with a mesh, in their order."""
    job = read_json(os.path.join(result, "job.json"))
    names = sorted((name for name in os.listdir(result) if os.path.exists(os.path.join(result, name, "mesh.ply"))),
                   key=natural_key)
    if job.get("first_frame") and job.get("last_frame"):
        first, last = natural_key(job["first_frame"]), natural_key(job["last_frame"])
        names = [name for name in names if first <= natural_key(name) <= last]
    if not names:
        raise ResultError(f"{result}: holds no mesh; the job has not ended, or no frame was registered")
    return job, names


def take_times(dump):
    """Of the job's recording, as far as it tells: frames per second or 0, and whether frames are named by their frame sets."""
    periods_ns = []
    streams = os.path.join(dump, "streams")
    for name in os.listdir(streams) if os.path.isdir(streams) else ():
        if name.endswith(".index"):
            records = np.fromfile(os.path.join(streams, name), dtype="<i8")
            records = records[:len(records) // 9 * 9].reshape(-1, 9)[1:]  # after a header of the same size
            there = records[records[:, 7] == 0]
            sets = np.diff(there[:, 2])
            periods_ns += (np.diff(there[:, 3])[sets > 0] // sets[sets > 0]).tolist()
    if periods_ns:
        return whole_rate(1e9 / max(float(np.median(periods_ns)), 1.0)), True
    times_ns = {}
    try:
        with open(os.path.join(dump, "truth", "pictures.csv"), encoding="utf-8") as file:
            for fields in (line.split(",") for line in file.readlines()[1:]):
                times_ns.setdefault(fields[1], []).append(float(fields[2]))
    except (OSError, ValueError, IndexError):
        return 0.0, False
    times = next(iter(times_ns.values()), [])
    return (whole_rate(1e9 * (len(times) - 1) / (times[-1] - times[0])) if len(times) > 1 and times[-1] > times[0] else 0.0), False


def frame_numbers(names, by_set):
    """Where frames are on the time line of the take, as in exports: 0 for the first; without gaps unless names are frame sets."""
    if not by_set or not all(name.isdigit() for name in names):
        return list(range(len(names)))
    return [int(name) - int(names[0]) for name in names]


PICTURES = (".jpg", ".jpeg", ".png", ".tif", ".tiff")


def sequence_of(folder, names, at):
    """The first picture of FOLDER/<frame>.jpg, as `weft export --overlay` writes them, and its number; None where there is none.
    Blender counts the numbers in the names, so these must go on as frames do in the scene."""
    if not os.path.isdir(folder):
        return None
    endings = {os.path.splitext(name)[0]: name for name in sorted(os.listdir(folder)) if name.lower().endswith(PICTURES)}
    there = [(i, name) for i, name in enumerate(names) if name in endings]
    if not there:
        return None
    numbers = [re.search(r"(\d+)$", name) for name in names]
    if any(n is None or int(n[1]) - int(numbers[0][1]) != at[i] for i, n in enumerate(numbers)):
        raise ResultError(f"{folder}: frames {names[0]} to {names[-1]} are not numbered as the scene's are, which Blender's image "
                          "sequences need; export them as videos (--format mp4)")
    i, name = there[0]
    return os.path.join(folder, endings[name]), int(numbers[i][1]) - at[i]


def whole_rate(fps):
    """Without the rounding of times to nanoseconds."""
    return next((rate for rate in (round(fps), round(1.001 * fps) / 1.001) if abs(rate - fps) < 1e-6 * fps), fps)


def coverage_of(result, names):
    """[vertices], the share of the frames in which each was observed."""
    seen = None
    for name in names:
        state = read_mesh(os.path.join(result, name, "mesh.ply"))["vertex"]["state"]
        if seen is None:
            seen = np.zeros(len(state), dtype=np.float32)
        if len(state) != len(seen):
            raise ResultError(f"{result}/{name}/mesh.ply: has {len(state)} vertices, the frames before it {len(seen)}")
        seen += (state == OBSERVED) | (state == TWO_VIEW)
    return seen / len(names)
