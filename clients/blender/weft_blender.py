"""Opens a result of Weft in Blender: the animated garment with its attributes, and the cameras of the rig.

As an add-on: Edit > Preferences > Add-ons > Install, choose this file, enable it; then File > Import > Weft result.
From a shell: blender --python weft_blender.py -- RESULT [--help]

README.md beside this file says what the garment has, and what a saved .blend needs. Tried with Blender 3.4; needs NumPy, which
Blender has.
"""

import argparse
import importlib.util
import json
import os
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

SENSOR_MM = 36.0
RAMP_STEPS = 16
SCRIPT, READER = "weft_blender.py", "weft_result.py"
MATERIALS = ("state", "sigma_mm", "coverage")
PRINT = "print"  # the UV map, and the material that has a picture


def load_reader():
    """The module weft_result: from the file beside this one, else from the texts of the .blend that carries both."""
    path = os.path.join(os.path.dirname(os.path.abspath(__file__)), READER)
    if not os.path.exists(path):
        if READER in getattr(bpy.data, "texts", ()):
            return bpy.data.texts[READER].as_module()
        raise ImportError(f"{path}: is missing; install weft_blender.zip, which has both files of the add-on")
    spec = importlib.util.spec_from_file_location("weft_result", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


weft_result = load_reader()
STATE_COLORS = weft_result.STATE_COLORS
ResultError, positions, read_json, read_mesh = (weft_result.ResultError, weft_result.positions, weft_result.read_json,
                                                weft_result.read_mesh)


def set_attribute(mesh, name, kind, values):
    attribute = mesh.attributes.get(name) or mesh.attributes.new(name, kind, "POINT")
    attribute.data.foreach_set("vector" if kind == "FLOAT_VECTOR" else "value", values)


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
    set_attribute(mesh, "coverage", "FLOAT", weft_result.coverage_of(result, names))
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
    factor.operation, factor.inputs[1].default_value = "MULTIPLY", scale
    ramp.color_ramp.interpolation = interpolation
    elements = ramp.color_ramp.elements
    while len(elements) < len(colors):
        elements.new(1.0)
    for i, color in enumerate(colors):
        elements[i].position = max(0.0, i / len(colors) - 1e-3) if interpolation == "CONSTANT" else i / (len(colors) - 1)
        elements[i].color = color
    links.new(source.outputs["Fac"], factor.inputs[0])
    links.new(factor.outputs["Value"], ramp.inputs["Fac"])
    links.new(ramp.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    return material


def add_materials(garment, largest_sigma_mm):
    ramp = [weft_result.map_color(i / (RAMP_STEPS - 1)) for i in range(RAMP_STEPS)]
    for attribute in MATERIALS:
        scale = 1 / largest_sigma_mm if attribute == "sigma_mm" and largest_sigma_mm > 0 else 1.0
        material = (material_of(attribute, 1 / len(STATE_COLORS), [weft_result.linear(color) for color in STATE_COLORS], "CONSTANT")
                    if attribute == "state" else material_of(attribute, scale, ramp, "LINEAR"))
        garment.data.materials.append(material)


def add_print(garment, path):
    """A material with this picture on the UV map `print`. Cells of a board.png, a pixel each, keep their edges."""
    path = os.path.abspath(path)
    if PRINT not in garment.data.uv_layers:
        raise ResultError(f"{garment['weft_result']}: its meshes have no texture coordinates, so no picture can be put on")
    if not os.path.isfile(path):
        raise ResultError(f"{path}: no such file; give the picture to print on the garment")
    material = bpy.data.materials.new("Weft print")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    uv, texture = nodes.new("ShaderNodeUVMap"), nodes.new("ShaderNodeTexImage")
    uv.uv_map, texture.image = PRINT, bpy.data.images.load(path)
    texture.interpolation = "Closest" if max(texture.image.size) < 1024 else "Linear"
    links.new(uv.outputs["UV"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    garment.data.materials.append(material)


def color_by(garment, attribute):
    """Shows one of MATERIALS, or the print where the garment has one."""
    chosen = garment.data.materials.find("Weft print") if attribute == PRINT else MATERIALS.index(attribute)
    if chosen < 0:
        raise ResultError("the garment has no print; import it with a picture for it")
    faces = garment.data.polygons
    faces.foreach_set("material_index", np.full(len(faces), chosen, dtype=np.int32))
    garment.data.update()


def bake(garment, result, names, at, start):
    """Every frame as a shape key, which fades into the next one; attributes are those of all frames together: the state that
    most have, the mean of sigma and views."""
    garment.shape_key_add(name="rest", from_mix=False)
    states, sigma_mm, views = [], 0, 0
    for i, name in enumerate(names):
        vertex = read_mesh(os.path.join(result, name, "mesh.ply"))["vertex"]
        states.append(vertex["state"])
        sigma_mm, views = sigma_mm + vertex["sigma_mm"] / len(names), views + vertex["views"] / len(names)
        key = garment.shape_key_add(name=f"frame {name}", from_mix=False)
        key.data.foreach_set("co", positions(vertex).ravel())
        for frame, value in {at[max(i - 1, 0)]: 0, at[min(i + 1, len(at) - 1)]: 0, at[i]: 1}.items():
            key.value = value
            key.keyframe_insert("value", frame=start + frame)
        for point in garment.data.shape_keys.animation_data.action.fcurves[-1].keyframe_points:
            point.interpolation = "LINEAR"
    counts = np.array([np.sum(np.array(states) == state, axis=0) for state in range(len(STATE_COLORS))])
    set_attributes(garment.data, {"state": counts.argmax(axis=0), "sigma_mm": sigma_mm, "views": np.rint(views)})


def show(garment, frame):
    """Loads the mesh of a frame of the scene into the garment; between two of the take's, the earlier one."""
    names, at = json.loads(garment["weft_frames"]), json.loads(garment["weft_at"])
    i = max(int(np.searchsorted(at, frame - garment["weft_start"], side="right")) - 1, 0)
    if garment.get("weft_shown") == names[i]:
        return
    vertex = read_mesh(os.path.join(garment["weft_result"], names[i], "mesh.ply"))["vertex"]
    mesh = garment.data
    if len(vertex) != len(mesh.vertices):
        raise ResultError(f"{garment['weft_result']}/{names[i]}/mesh.ply: has other vertices than the garment; import it again")
    mesh.vertices.foreach_set("co", positions(vertex).ravel())
    velocities = weft_result.velocities(garment["weft_result"], names, at, i, garment["weft_fps"])  # Cycles blurs by them
    set_attribute(mesh, "velocity", "FLOAT_VECTOR", velocities.ravel())
    set_attributes(mesh, vertex)
    garment["weft_shown"] = names[i]
    mesh.update()


@persistent
def on_frame(scene, _depsgraph=None):
    for thing in scene.objects:
        if "weft_result" in thing and thing.data.shape_keys is None:
            try:
                show(thing, scene.frame_current)
            except ResultError as error:
                print(f"weft: error: {error}", file=sys.stderr)


def listen():
    """Once, also where both the add-on and the text in a file would."""
    if all(handler.__name__ != on_frame.__name__ for handler in bpy.app.handlers.frame_change_post):
        bpy.app.handlers.frame_change_post.append(on_frame)


def carry_along():
    """Puts the add-on into the file, where Blender runs it on loading if the user lets it: the garment moves without it."""
    for name in (READER, SCRIPT):
        path = os.path.join(os.path.dirname(os.path.abspath(__file__)), name)
        path = path if os.path.exists(path) else os.path.abspath(__file__)  # in an installed package this is __init__.py
        if name not in bpy.data.texts and os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                bpy.data.texts.new(name).write(file.read())
    if SCRIPT in bpy.data.texts:
        bpy.data.texts[SCRIPT].use_module = True


def add_camera(camera, collection):
    """A camera of rig.json. Lens distortion is left out, and pixels count as square."""
    data = bpy.data.cameras.new(camera["id"])
    data.sensor_fit, data.sensor_width = "HORIZONTAL", SENSOR_MM
    share, data.shift_x, data.shift_y, pose = weft_result.lens_and_pose(camera)
    data.lens = share * SENSOR_MM
    thing = bpy.data.objects.new(camera["id"], data)
    thing.matrix_world = Matrix(pose.tolist())
    thing["distortion"], thing["resolution_px"] = camera.get("distortion", []), [camera["width_px"], camera["height_px"]]
    collection.objects.link(thing)
    return thing


def add_rig(path):
    """Cameras of the rig; those of an earlier import of it go."""
    rig = read_json(path)
    name = os.path.abspath(path)
    collection = next((c for c in bpy.data.collections if c.get("weft_rig") == name), None)
    if collection is None:
        collection = bpy.data.collections.new("rig")
        collection["weft_rig"] = name
        bpy.context.scene.collection.children.link(collection)
    for thing in list(collection.objects):
        bpy.data.objects.remove(thing)
    try:
        return [add_camera(camera, collection) for camera in rig["cameras"]]
    except KeyError as error:
        raise ResultError(f"{path}: {error.args[0]}: is missing; choose a rig.json") from error


def add_backgrounds(cameras, folder, names, at, start):
    """Pictures behind what the cameras see: <folder>/<camera>/<frame>.jpg."""
    sequences = [weft_result.sequence_of(os.path.join(folder, thing.name), names, at) for thing in cameras]
    if not any(sequences):
        raise ResultError(f"{folder}: has no pictures <camera>/<frame>.jpg of the rig's cameras; `weft export RESULT --format jpg "
                          "--overlay none --undistort --out DIR` writes them")
    for thing, (path, number_at_start) in ((t, s) for t, s in zip(cameras, sequences) if s):
        background = thing.data.background_images.new()
        background.image, background.alpha = bpy.data.images.load(path), 1.0
        background.image.source = "SEQUENCE"
        shown = background.image_user
        # Blender shows the file whose number is: frame - frame_start + 1 + frame_offset.
        shown.frame_start, shown.frame_offset = start, number_at_start - 1
        shown.frame_duration, shown.use_auto_refresh = at[-1] + 1, True
        thing.data.show_background_images = True


def open_result(result, rig="", fps=0.0, baked=False, start=0, pictures="", printed=""):
    """The garment, and a list of its cameras; `rig` empty: that of the job, where it is still there. `fps` 0: that of the take,
    else the scene's. As in exports, a frame is shown at its time in the take, the first one at `start`. `pictures`: a folder of
    undistorted ones, behind what the cameras see; its rig.json goes before that of the job. `printed`: a picture for the garment."""
    result = os.path.abspath(result)
    job, names = weft_result.frames_of(result)
    garment = make_garment(result, names)
    add_materials(garment, float(np.percentile([value.value for value in garment.data.attributes["sigma_mm"].data], 99)))
    scene = bpy.context.scene
    rate, by_set = weft_result.take_times(job.get("spec", {}).get("dump", ""))
    at = weft_result.frame_numbers(names, by_set)
    scene.frame_start, scene.frame_end = start, start + at[-1]
    fps = fps or rate or scene.render.fps / scene.render.fps_base
    scene.render.fps, scene.render.fps_base = max(1, round(fps)), max(1, round(fps)) / fps
    garment["weft_result"], garment["weft_frames"], garment["weft_start"] = result, json.dumps(names), start
    garment["weft_at"], garment["weft_fps"] = json.dumps(at), fps
    if baked:
        bake(garment, result, names, at, start)
    else:
        carry_along()
    listen()
    cameras = []
    rig_of_pictures = os.path.join(pictures, "rig.json") if pictures else ""
    rig = rig or (rig_of_pictures if os.path.exists(rig_of_pictures) else job.get("spec", {}).get("rig", ""))
    if printed:
        add_print(garment, printed)
    if os.path.exists(rig):
        cameras = add_rig(rig)
        scene.camera = cameras[0]
        scene.render.resolution_x, scene.render.resolution_y = cameras[0]["resolution_px"]
    if pictures:
        add_backgrounds(cameras, os.path.abspath(pictures), names, at, start)
    scene.frame_set(start)
    return garment, cameras


def outcome(operator, action):
    """Of an operator; what is wrong with a file is told in Blender."""
    try:
        action()
    except ResultError as error:
        operator.report({"ERROR"}, str(error))
        return {"CANCELLED"}
    return {"FINISHED"}


class ImportResult(bpy.types.Operator):
    """Open a result of Weft as an animated object with attributes and cameras"""

    bl_idname = "import_scene.weft_result"
    bl_label = "Weft result"
    bl_options = {"REGISTER", "UNDO"}

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", description="job.json of the result, or its folder")
    filter_glob: bpy.props.StringProperty(default="job.json", options={"HIDDEN"})
    rig: bpy.props.StringProperty(name="Rig", description="rig.json; by default that of the job")
    fps: bpy.props.FloatProperty(name="Frames per second", min=0, description="Of the take; 0: as it tells")
    bake: bpy.props.BoolProperty(name="Bake", description="All frames into the file, as shape keys")
    pictures: bpy.props.StringProperty(name="Pictures", subtype="DIR_PATH",
                                       description="Of the cameras, by `weft export --overlay none --undistort`: behind what they see")
    printed: bpy.props.StringProperty(name="Print", subtype="FILE_PATH", description="A picture for the garment, e.g. board.png")
    color: bpy.props.EnumProperty(name="Colour by", items=[(name, name, "") for name in (*MATERIALS, PRINT)])

    def execute(self, _context):
        result = self.filepath if os.path.isdir(self.filepath) else os.path.dirname(self.filepath)
        return outcome(self, lambda: color_by(open_result(result, self.rig, self.fps, self.bake, pictures=self.pictures,
                                                          printed=self.printed)[0], self.color))

    def invoke(self, context, _event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}


class ColorGarment(bpy.types.Operator):
    """Colour the garment of a Weft result by state, sigma or coverage, or with its print"""

    bl_idname = "object.weft_color"
    bl_label = "Colour Weft garment"
    bl_options = {"REGISTER", "UNDO"}

    color: bpy.props.EnumProperty(name="Colour by", items=[(name, name, "") for name in (*MATERIALS, PRINT)])

    @classmethod
    def poll(cls, context):
        return context.object is not None and "weft_result" in context.object

    def execute(self, context):
        return outcome(self, lambda: color_by(context.object, self.color))


def menu_entry(menu, _context):
    menu.layout.operator(ImportResult.bl_idname, text="Weft result (job.json)")


def register():
    listen()
    if hasattr(bpy.types, "IMPORT_SCENE_OT_weft_result"):
        return  # the add-on is there, this is its copy in a file
    bpy.utils.register_class(ImportResult)
    bpy.utils.register_class(ColorGarment)
    bpy.types.TOPBAR_MT_file_import.append(menu_entry)


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
    parser.add_argument("--pictures", default="", help="undistorted ones of the cameras, DIR/<camera>/<frame>.jpg: behind what they see")
    parser.add_argument("--print", dest="printed", default="", help="a picture for the garment, e.g. board.png")
    parser.add_argument("--color", choices=(*MATERIALS, PRINT), default="", help="by default print where one is given, else state")
    parser.add_argument("--save", default="", help="a .blend to write")
    options = parser.parse_args(arguments)
    register()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    try:
        garment, cameras = open_result(options.result, options.rig, options.fps, options.bake, pictures=options.pictures,
                                       printed=options.printed)
        color_by(garment, options.color or (PRINT if options.printed else "state"))
    except ResultError as error:
        sys.exit(f"weft: error: {error}")
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
