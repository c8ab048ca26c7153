#!/usr/bin/env python3
"""Makes the pictures of README.md, docs/pictures/*, from a simulated T-shirt.

Usage: readme_pictures.py [WEFT [WORK]]

WEFT is the program (build/release/bin/weft), WORK a folder for the take and its registration (a temporary one). A take
in WORK is used again. Needs the Debian packages chromium and ffmpeg, and three minutes.
"""

import base64
import csv
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PICTURES = os.path.join(ROOT, "docs", "pictures")
sys.path.insert(0, os.path.join(ROOT, "deploy", "examples"))
from read_mesh import read_ply  # noqa: E402

FRAME, CAMERA = "0000", "c00"
WHOLE = (310, 140, 680, 680)  # of the view in pixels: left, top, width, height
DETAIL = (395, 205, 136, 136)
SIDE = 500  # of a panel on the page
LIGHT = (-0.62, -0.45, -0.64)  # direction to the light in the camera's axes
MAX_BYTES = 200_000

PAGE = """<!doctype html><meta charset=utf-8><style>
body { margin: 0; background: #fff; display: flex; gap: 8px }
canvas { width: %(side)dpx; height: %(side)dpx; border-radius: 6px }
</style><canvas id=a></canvas><canvas id=b></canvas><script>
const view = new Image();
function panel(id, box, smooth) {
  const canvas = document.getElementById(id), size = 2 * %(side)d, scale = size / box[2];
  canvas.width = canvas.height = size;
  const c = canvas.getContext('2d');
  c.imageSmoothingEnabled = smooth;
  c.drawImage(view, ...box, 0, 0, size, size);
  c.scale(scale, scale);
  c.translate(-box[0], -box[1]);
  c.lineJoin = 'round';
  return c;
}
function polygon(c, points) {
  c.beginPath();
  points.forEach((p, i) => i ? c.lineTo(...p) : c.moveTo(...p));
  c.closePath();
}
view.onload = () => { %(draw)s };
view.src = '%(image)s';
</script>"""


def project(camera, point):
    """World point in mm to pixel, with OpenCV's distortion."""
    r, t = camera["rotation"], camera["translation_mm"]
    x, y, z = (sum(r[3 * row + k] * point[k] for k in range(3)) + t[row] for row in range(3))
    a, b = x / z, y / z
    k1, k2, p1, p2, k3 = camera["distortion"][:5]
    s = a * a + b * b
    radial = 1 + s * (k1 + s * (k2 + s * k3))
    u = a * radial + 2 * p1 * a * b + p2 * (s + 2 * a * a)
    v = b * radial + p1 * (s + 2 * b * b) + 2 * p2 * a * b
    return (camera["fx_px"] * u + camera["cx_px"], camera["fy_px"] * v + camera["cy_px"]), z


def rounded(points):
    return [[round(x, 2), round(y, 2)] for x, y in points]


def decoded_cells(observations):
    """[corners of the cell or none, centre, column] of every cell of the view."""
    nodes = {"center": {}, "corner": {}}
    with open(observations, encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["image"] == CAMERA:
                at = int(row["board_row"]), int(row["board_col"])
                nodes[row["kind"]][at] = float(row["x_px"]), float(row["y_px"])
    cells = []
    for (row, col), centre in nodes["center"].items():
        corners = [nodes["corner"].get((row + i, col + j)) for i, j in ((0, 0), (0, 1), (1, 1), (1, 0))]
        cells.append([rounded(corners) if all(corners) else [], rounded([centre])[0], col])
    return cells


def visible_faces(mesh, camera):
    """[three pixels, brightness] of the faces that face the camera, the farthest first."""
    vertices = list(zip(*(mesh["vertex"][axis] for axis in "xyz")))
    faces = []
    for face in mesh["face"]["vertex_indices"]:
        p = [vertices[v] for v in face]
        seen = [project(camera, q) for q in p]
        (ax, ay), (bx, by), (cx, cy) = (pixel for pixel, _ in seen)
        if (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) >= 0:
            continue  # seen from inside: y points down in images, so outer faces turn the other way
        e, f = [p[1][k] - p[0][k] for k in range(3)], [p[2][k] - p[0][k] for k in range(3)]
        n = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]]
        toward_light = [sum(LIGHT[row] * camera["rotation"][3 * row + k] for row in range(3)) for k in range(3)]
        light = max(0, sum(a * b for a, b in zip(n, toward_light)) / (math.hypot(*n) or 1))
        faces.append([max(depth for _, depth in seen), rounded(pixel for pixel, _ in seen), round(light, 3)])
    faces.sort(key=lambda face: -face[0])
    return [face[1:] for face in faces]


DRAW_CELLS = """const cells = %s, whole = panel('a', %s, true), detail = panel('b', %s, true);
for (const [corners, at, col] of cells) {
  whole.fillStyle = `hsla(${col * 360 / 60}, 90%%, 60%%, .62)`;
  if (corners.length) { polygon(whole, corners); whole.fill(); }
  if (corners.length) {
    polygon(detail, corners);
    detail.strokeStyle = 'rgba(255, 255, 255, .9)'; detail.lineWidth = .35; detail.stroke();
  }
  detail.beginPath(); detail.arc(...at, .55, 0, 7);
  detail.fillStyle = '#fff'; detail.fill();
  detail.strokeStyle = '#000'; detail.lineWidth = .2; detail.stroke();
}
whole.strokeStyle = '#fff'; whole.lineWidth = 2; whole.strokeRect(...%s);"""

DRAW_MESH = """const faces = %s, whole = panel('a', %s, true), detail = panel('b', %s, true);
for (const c of [whole, detail]) for (const [p, light] of faces) {
  const tone = 22 + 62 * light;
  polygon(c, p);
  c.fillStyle = c.strokeStyle = `hsl(212, 45%%, ${tone}%%)`;
  c.lineWidth = .3; c.fill(); c.stroke();
  if (c === detail) { c.strokeStyle = 'rgba(10, 25, 60, .55)'; c.lineWidth = .18; c.stroke(); }
}
whole.strokeStyle = '#fff'; whole.lineWidth = 2; whole.strokeRect(...%s);"""


def screenshot(page, out, width, height, scale):
    """A page as a picture, PNG or JPEG by the name of `out`."""
    with tempfile.TemporaryDirectory() as folder:
        png = os.path.join(folder, "page.png")
        subprocess.run(["chromium", "--headless=new", "--no-sandbox", "--hide-scrollbars", f"--screenshot={png}",
                        f"--window-size={width},{height}", f"--force-device-scale-factor={scale}",
                        f"--user-data-dir={folder}/profile", "--virtual-time-budget=10000", f"file://{page}"],
                       check=True, capture_output=True)
        ending = ["-q:v", "7"] if out.endswith(".jpg") else ["-vf", "split[a][b];[a]palettegen[p];[b][p]paletteuse"]
        subprocess.run(["ffmpeg", "-loglevel", "error", "-y", "-i", png, *ending, out], check=True)
    size = os.path.getsize(out)
    print(f"{os.path.relpath(out, ROOT)}: {size / 1000:.0f} kB")
    if size > MAX_BYTES:
        sys.exit(f"{out}: larger than {MAX_BYTES} bytes")


def overlay(work, name, draw):
    """A view beside a detail of it, both drawn over."""
    with open(f"{work}/take/{FRAME}/{CAMERA}.png", "rb") as file:
        image = "data:image/png;base64," + base64.b64encode(file.read()).decode()
    page = f"{work}/{name}.html"
    with open(page, "w", encoding="utf-8") as file:
        file.write(PAGE % {"side": SIDE, "draw": draw, "image": image})
    screenshot(page, f"{PICTURES}/{name}.jpg", 2 * SIDE + 8, SIDE, 1.25)


def record_and_register(weft, work):
    take = f"{work}/take"
    shutil.rmtree(f"{work}/result", ignore_errors=True)
    subprocess.run([weft, "simulate", "--preset", "tshirt-24", "--seed", "1", "--frames", "1", "--cameras", "12",
                    "--out", take], check=True)
    subprocess.run([weft, "register", take, "--rig", f"{take}/rig.json", "--board", f"{take}/board.json", "--template",
                    f"{take}/template", "--out", f"{work}/result", "--observations"], check=True)


def main():
    weft = os.path.abspath(sys.argv[1] if len(sys.argv) > 1 else os.path.join(ROOT, "build/release/bin/weft"))
    with tempfile.TemporaryDirectory() as temporary:
        work = os.path.abspath(sys.argv[2]) if len(sys.argv) > 2 else temporary
        os.makedirs(work, exist_ok=True)
        os.makedirs(PICTURES, exist_ok=True)
        record_and_register(weft, work)
        boxes = json.dumps(WHOLE), json.dumps(DETAIL), json.dumps(DETAIL)
        overlay(work, "decoded", DRAW_CELLS % (json.dumps(decoded_cells(f"{work}/result/{FRAME}/observations.csv")), *boxes))
        with open(f"{work}/take/rig.json", encoding="utf-8") as file:
            camera = next(c for c in json.load(file)["cameras"] if c["id"] == CAMERA)
        mesh = read_ply(f"{work}/result/{FRAME}/mesh.ply")
        overlay(work, "mesh", DRAW_MESH % (json.dumps(visible_faces(mesh, camera)), *boxes))
        screenshot(f"{work}/result/report.html", f"{PICTURES}/report.png", 1200, 862, 1)


if __name__ == "__main__":
    main()
