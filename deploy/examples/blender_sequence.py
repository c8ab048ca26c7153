"""A result as an animated object of Blender, with its texture coordinates and the print as its material.

Usage: blender --background --python blender_sequence.py -- RESULT PRINT OUT.blend

RESULT is the folder that `weft register` wrote. PRINT is the picture that the texture coordinates are of: board.png for a
template that was imported, "" for none. Every frame becomes a shape key that is full at its frame and off at the others.
Blender's own importer of PLY files takes the vertices' coordinates; those of the faces, which are right at seams as well,
are taken here. Tried with Blender 3.4.
"""

import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from read_mesh import frames, read_ply  # noqa: E402  it lies beside this file

SCALE = 0.001  # mm to Blender's metres


def places(vertex):
    """Flat list of coordinates; Weft's y points down and z away, as a camera's, Blender's z up."""
    return [SCALE * c for x, y, z in zip(vertex["x"], vertex["y"], vertex["z"]) for c in (x, z, -y)]


def make_object(ply):
    vertex, face = ply["vertex"], ply["face"]
    coordinates = places(vertex)
    mesh = bpy.data.meshes.new("garment")
    mesh.from_pydata(list(zip(*[iter(coordinates)] * 3)), [], face["vertex_indices"])
    if "s" in vertex:
        if "texcoord" in face:
            uv = [c for corners in face["texcoord"] for c in corners]
        else:
            uv = [c for corners in face["vertex_indices"] for v in corners for c in (vertex["s"][v], vertex["t"][v])]
        mesh.uv_layers.new(name="print").data.foreach_set("uv", uv)
    garment = bpy.data.objects.new("garment", mesh)
    bpy.context.scene.collection.objects.link(garment)
    return garment


def add_print(garment, picture):
    material = bpy.data.materials.new("print")
    material.use_nodes = True
    image = material.node_tree.nodes.new("ShaderNodeTexImage")
    image.image = bpy.data.images.load(os.path.abspath(picture))
    image.interpolation = "Closest"  # a pixel is a cell
    shader = material.node_tree.nodes["Principled BSDF"]
    material.node_tree.links.new(image.outputs["Color"], shader.inputs["Base Color"])
    garment.data.materials.append(material)


def add_frame(garment, number, vertex):
    key = garment.shape_key_add(name=f"frame {number}", from_mix=False)
    key.data.foreach_set("co", places(vertex))
    for frame, value in ((number - 1, 0), (number, 1), (number + 1, 0)):
        key.value = value
        key.keyframe_insert("value", frame=frame)


def main():
    result, picture, out = sys.argv[sys.argv.index("--") + 1:]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    garment = None
    for number, name in enumerate(frames(result), start=1):
        ply = read_ply(os.path.join(result, name, "mesh.ply"))
        if garment is None:
            garment = make_object(ply)
            if picture:
                add_print(garment, picture)
            garment.shape_key_add(name="rest", from_mix=False)
        add_frame(garment, number, ply["vertex"])
        bpy.context.scene.frame_end = number
    bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath(out))
    print(f"{out}: {len(garment.data.vertices)} vertices, {bpy.context.scene.frame_end} frames")


main()
