"""Imports the exports of export_test.py in Blender, and stores the positions of their vertices in the world.

Usage: blender --background --python import_in_blender.py -- FOLDER FRAME...

FOLDER has a folder per format; FOLDER/<format>.npy gets [frames, vertices, 3].
"""

import os
import sys

import bpy
import numpy as np


def world_positions(thing, frame):
    bpy.context.scene.frame_set(frame)
    shown = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = shown.to_mesh()
    values = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", values)
    pose = np.array(shown.matrix_world)
    return values.reshape(-1, 3).astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]


def imported(load, path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = 50
    load(filepath=path)
    return next(thing for thing in bpy.data.objects if thing.type == "MESH")


def per_frame(load, folder, ending, frames):
    return np.array([world_positions(imported(load, os.path.join(folder, f"{frame}.{ending}")), 1) for frame in frames])


def of_glb(folder, frames):
    # With shading by normals the importer of Debian's Blender asks NumPy for something that it no longer has.
    def load(filepath):
        bpy.ops.import_scene.gltf(filepath=filepath, import_shading="SMOOTH")

    thing = imported(load, os.path.join(folder, "garment.glb"))
    # The time 0 is frame 0 of the scene.
    return np.array([world_positions(thing, i) for i in range(len(frames))])


def of_cache(folder, kind, frames):
    thing = imported(bpy.ops.wm.obj_import, os.path.join(folder, "garment.obj"))
    cache = thing.modifiers.new("cache", "MESH_CACHE")
    cache.cache_format, cache.filepath, cache.frame_start = kind.upper(), os.path.join(folder, f"garment.{kind}"), 0
    return np.array([world_positions(thing, i) for i in range(len(frames))])


def main():
    folder, *frames = sys.argv[sys.argv.index("--") + 1:]
    found = {"ply": per_frame(bpy.ops.import_mesh.ply, os.path.join(folder, "ply"), "ply", frames),
             "obj": per_frame(bpy.ops.wm.obj_import, os.path.join(folder, "obj"), "obj", frames),
             "glb": of_glb(os.path.join(folder, "glb"), frames),
             "mdd": of_cache(os.path.join(folder, "mdd"), "mdd", frames),
             "pc2": of_cache(os.path.join(folder, "pc2"), "pc2", frames)}
    for name, positions in found.items():
        np.save(os.path.join(folder, f"{name}.npy"), positions)


main()
