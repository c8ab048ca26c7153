"""Opens a result of Weft in Blender: the animated garment with its attributes, and the cameras of the rig.

As an add-on: Edit > Preferences > Add-ons > Install, choose this file, enable it; then File > Import > Weft result.
From a shell: blender --python weft_blender.py -- RESULT [--rig RIG.json] [--fps N] [--bake] [--save OUT.blend]

RESULT is the folder that `weft register` wrote. The object `garment` has the vertices in the template's order, in metres with
z up, and the attributes `state` (0 inferred, 1 observed, 2 observed by two views, 3 bridged, 4 driven), `sigma_mm`, `views`, and
`coverage`, the share of the frames in which a vertex was observed. Materials colour it by state, sigma or coverage. Meshes are
read as frames are shown, so the result must stay where it is and the add-on enabled; `bake` puts all frames into the file as
shape keys instead. Cameras have no lens distortion in Blender. Tried with Blender 3.4; needs NumPy, which Blender has.
"""

import argparse
import json
import os
import re
import sys

import bpy
import numpy as np
from bpy.app.handlers import persistent
from mathutils import Matrix

bl_info = {
    "name": "Weft result",
    "author": "The Weft maintainers",
    "version": (0, 2, 0),
    "blender": (3, 4, 0),
    "location": "File > Import > Weft result",
    "description": "Opens captured cloth with its attributes and cameras",
    "category": "Import-Export",
}

METRES_PER_MM = 0.001
# Weft's y points down and z away, as a camera's; Blender's z points up.
BLENDER_FROM_WORLD = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], dtype=np.float64)
TYPES = {"char": "i1", "uchar": "u1", "short": "<i2", "ushort": "<u2", "int": "<i4", "uint": "<u4", "float": "<f4",
         "double": "<f8"}
OBSERVED, TWO_VIEW = 1, 2
SENSOR_MM = 36.0
# Distinct for the colour-blind (Okabe and Ito): inferred, observed, observed by two views, bridged, driven.
STATE_COLORS = [(.90, .62, 0, 1), (0, .45, .70, 1), (.34, .71, .91, 1), (.80, .47, .65, 1), (.94, .89, .26, 1)]
RAMP_COLORS = [(0.27, 0.0, 0.33, 1), (0.13, 0.57, 0.55, 1), (0.99, 0.91, 0.14, 1)]
MATERIALS = ("state", "sigma_mm", "coverage")


class ResultError(Exception):
    """A file of the result that cannot be used; the text names it and the remedy."""


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


def set_attribute(mesh, name, kind, values):
    attribute = mesh.attributes.get(name) or mesh.attributes.new(name, kind, "POINT")
    attribute.data.foreach_set("value", values)


def set_attributes(mesh, vertex):
    set_attribute(mesh, "state", "INT", vertex["state"].astype(np.int32))
    set_attribute(mesh, "sigma_mm", "FLOAT", vertex["sigma_mm"].astype(np.float32))
    set_attribute(mesh, "views", "INT", vertex["views"].astype(np.int32))


def make_garment(result, names):
    tables = read_mesh(os.path.join(result, names[0], "mesh.ply"), with_faces=True)
    vertex, face = tables["vertex"], tables["face"]
    mesh = bpy.data.meshes.new("garment")
    mesh.from_pydata(positions(vertex).tolist(), [], face["vertex_indices"].tolist())
    if "s" in vertex.dtype.names:
        by_vertex = np.column_stack([vertex["s"], vertex["t"]])[face["vertex_indices"].ravel()]
        uv = face["texcoord"] if "texcoord" in face.dtype.names else by_vertex
        mesh.uv_layers.new(name="print").data.foreach_set("uv", np.ascontiguousarray(uv, dtype=np.float32).ravel())
    set_attributes(mesh, vertex)
    set_attribute(mesh, "coverage", "FLOAT", coverage_of(result, names))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), dtype=bool))
    garment = bpy.data.objects.new("garment", mesh)
    bpy.context.scene.collection.objects.link(garment)
    return garment


def material_of(attribute, scale, colors, interpolation):
    """Colours by an attribute times `scale`, from 0 to 1."""
    material = bpy.data.materials.new(f"Weft {attribute}")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    source, factor, ramp = nodes.new("ShaderNodeAttribute"), nodes.new("ShaderNodeMath"), nodes.new("ShaderNodeValToRGB")
    source.attribute_name = attribute
    factor.operation = "MULTIPLY"
    factor.inputs[1].default_value = scale
    ramp.color_ramp.interpolation = interpolation
    elements = ramp.color_ramp.elements
    steps = len(colors) if interpolation == "CONSTANT" else len(colors) - 1
    while len(elements) < len(colors):
        elements.new(1.0)
    for i, color in enumerate(colors):
        elements[i].position = max(0.0, i / steps - 1e-3) if interpolation == "CONSTANT" else i / steps
        elements[i].color = color
    links.new(source.outputs["Fac"], factor.inputs[0])
    links.new(factor.outputs["Value"], ramp.inputs["Fac"])
    links.new(ramp.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    return material


def add_materials(garment, largest_sigma_mm):
    for attribute in MATERIALS:
        scale = 1 / largest_sigma_mm if attribute == "sigma_mm" and largest_sigma_mm > 0 else 1.0
        material = (material_of(attribute, 1 / len(STATE_COLORS), STATE_COLORS, "CONSTANT") if attribute == "state" else
                    material_of(attribute, scale, RAMP_COLORS, "LINEAR"))
        garment.data.materials.append(material)


def color_by(garment, attribute):
    """Shows one of MATERIALS."""
    faces = garment.data.polygons
    faces.foreach_set("material_index", np.full(len(faces), MATERIALS.index(attribute), dtype=np.int32))
    garment.data.update()


def bake(garment, result, names, start):
    """Every frame as a shape key, full at its frame and off at the others."""
    garment.shape_key_add(name="rest", from_mix=False)
    for number, name in enumerate(names, start=start):
        key = garment.shape_key_add(name=f"frame {name}", from_mix=False)
        key.data.foreach_set("co", positions(read_mesh(os.path.join(result, name, "mesh.ply"))["vertex"]).ravel())
        for frame, value in ((number - 1, 0), (number, 1), (number + 1, 0)):
            key.value = value
            key.keyframe_insert("value", frame=frame)


def show(garment, frame):
    """Loads the mesh of a frame of the scene into the garment."""
    names = json.loads(garment["weft_frames"])
    name = names[min(max(frame - garment["weft_start"], 0), len(names) - 1)]
    if garment.get("weft_shown") == name:
        return
    vertex = read_mesh(os.path.join(garment["weft_result"], name, "mesh.ply"))["vertex"]
    mesh = garment.data
    if len(vertex) != len(mesh.vertices):
        raise ResultError(f"{garment['weft_result']}/{name}/mesh.ply: has other vertices than the garment; import it again")
    if mesh.shape_keys is None:
        mesh.vertices.foreach_set("co", positions(vertex).ravel())
    set_attributes(mesh, vertex)
    garment["weft_shown"] = name
    mesh.update()


@persistent
def on_frame(scene, _depsgraph=None):
    for thing in scene.objects:
        if "weft_result" in thing:
            try:
                show(thing, scene.frame_current)
            except ResultError as error:
                print(f"weft: error: {error}", file=sys.stderr)


def listen():
    if on_frame not in bpy.app.handlers.frame_change_post:
        bpy.app.handlers.frame_change_post.append(on_frame)


def add_camera(camera, collection):
    """A camera of rig.json. Lens distortion is left out, and pixels count as square."""
    width, height = camera["width_px"], camera["height_px"]
    data = bpy.data.cameras.new(camera["id"])
    data.sensor_fit, data.sensor_width = "HORIZONTAL", SENSOR_MM
    data.lens = camera["fx_px"] * SENSOR_MM / width
    # Pixel (0, 0) has its centre there; Blender counts from the corner.
    data.shift_x = (width / 2 - (camera["cx_px"] + 0.5)) / width
    data.shift_y = ((camera["cy_px"] + 0.5) - height / 2) / width
    thing = bpy.data.objects.new(camera["id"], data)
    camera_from_world = np.array(camera["rotation"], dtype=np.float64).reshape(3, 3)
    center_mm = -camera_from_world.T @ np.array(camera["translation_mm"], dtype=np.float64)
    # Blender's cameras look along -z, and y is up.
    axes = BLENDER_FROM_WORLD @ camera_from_world.T @ np.diag([1.0, -1.0, -1.0])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = axes, METRES_PER_MM * BLENDER_FROM_WORLD @ center_mm
    thing.matrix_world = Matrix(pose.tolist())
    thing["distortion"], thing["resolution_px"] = camera.get("distortion", []), [width, height]
    collection.objects.link(thing)
    return thing


def add_rig(path):
    collection = bpy.data.collections.new("rig")
    bpy.context.scene.collection.children.link(collection)
    try:
        return [add_camera(camera, collection) for camera in read_json(path)["cameras"]]
    except KeyError as error:
        raise ResultError(f"{path}: {error.args[0]}: is missing; choose a rig.json") from error


def open_result(result, rig="", fps=0.0, baked=False, start=1):
    """The garment, and a list of its cameras; `rig` empty: that of the job, where it is still there."""
    result = os.path.abspath(result)
    job, names = frames_of(result)
    garment = make_garment(result, names)
    add_materials(garment, float(np.percentile([value.value for value in garment.data.attributes["sigma_mm"].data], 99)))
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = start, start + len(names) - 1
    if fps > 0:
        scene.render.fps, scene.render.fps_base = max(1, round(fps)), max(1, round(fps)) / fps
    garment["weft_result"], garment["weft_frames"], garment["weft_start"] = result, json.dumps(names), start
    if baked:
        bake(garment, result, names, start)
    listen()
    cameras = []
    rig_of_job = job.get("spec", {}).get("rig", "")
    if rig or os.path.exists(rig_of_job):
        cameras = add_rig(rig or rig_of_job)
        scene.camera = cameras[0]
        scene.render.resolution_x, scene.render.resolution_y = cameras[0]["resolution_px"]
    scene.frame_set(start)
    return garment, cameras


class ImportResult(bpy.types.Operator):
    """Open a result of Weft as an animated object with attributes and cameras"""

    bl_idname = "import_scene.weft_result"
    bl_label = "Weft result"
    bl_options = {"REGISTER", "UNDO"}

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", description="job.json of the result, or its folder")
    filter_glob: bpy.props.StringProperty(default="job.json", options={"HIDDEN"})
    rig: bpy.props.StringProperty(name="Rig", description="rig.json; by default that of the job")
    fps: bpy.props.FloatProperty(name="Frames per second", min=0, description="Of the take; 0 leaves the scene's")
    bake: bpy.props.BoolProperty(name="Bake", description="All frames into the file, as shape keys")
    color: bpy.props.EnumProperty(name="Colour by", items=[(name, name, "") for name in MATERIALS])

    def execute(self, _context):
        path = self.filepath
        try:
            garment, _ = open_result(path if os.path.isdir(path) else os.path.dirname(path), self.rig, self.fps, self.bake)
        except ResultError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        color_by(garment, self.color)
        return {"FINISHED"}

    def invoke(self, context, _event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}


class ColorGarment(bpy.types.Operator):
    """Colour the garment of a Weft result by state, sigma or coverage"""

    bl_idname = "object.weft_color"
    bl_label = "Colour Weft garment"
    bl_options = {"REGISTER", "UNDO"}

    color: bpy.props.EnumProperty(name="Colour by", items=[(name, name, "") for name in MATERIALS])

    @classmethod
    def poll(cls, context):
        return context.object is not None and "weft_result" in context.object

    def execute(self, context):
        color_by(context.object, self.color)
        return {"FINISHED"}


def menu_entry(menu, _context):
    menu.layout.operator(ImportResult.bl_idname, text="Weft result (job.json)")


def register():
    bpy.utils.register_class(ImportResult)
    bpy.utils.register_class(ColorGarment)
    bpy.types.TOPBAR_MT_file_import.append(menu_entry)
    listen()


def unregister():
    if on_frame in bpy.app.handlers.frame_change_post:
        bpy.app.handlers.frame_change_post.remove(on_frame)
    bpy.types.TOPBAR_MT_file_import.remove(menu_entry)
    bpy.utils.unregister_class(ColorGarment)
    bpy.utils.unregister_class(ImportResult)


def main(arguments):
    parser = argparse.ArgumentParser(prog="weft_blender.py", description="Opens a result of Weft.")
    parser.add_argument("result", help="the folder that `weft register` wrote")
    parser.add_argument("--rig", default="", help="rig.json; that of the job by default")
    parser.add_argument("--fps", type=float, default=0, help="frames per second of the take")
    parser.add_argument("--bake", action="store_true", help="all frames into the file, as shape keys")
    parser.add_argument("--color", choices=MATERIALS, default="state")
    parser.add_argument("--save", default="", help="a .blend to write")
    options = parser.parse_args(arguments)
    register()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    try:
        garment, cameras = open_result(options.result, options.rig, options.fps, options.bake)
    except ResultError as error:
        sys.exit(f"weft: error: {error}")
    color_by(garment, options.color)
    scene = bpy.context.scene
    print(f"{options.result}: {len(garment.data.vertices)} vertices, frames {scene.frame_start} to {scene.frame_end}, "
          f"{len(cameras)} cameras")
    if options.save:
        bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath(options.save))


if __name__ == "__main__":
    if "--" in sys.argv:
        main(sys.argv[sys.argv.index("--") + 1:])
    else:
        register()
