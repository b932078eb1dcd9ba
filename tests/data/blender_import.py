"""Run by a Python that has Blender: import a USD file, and say in JSON what Blender made of it.

python blender_import.py FILE FRAME PICTURE
"""

import collections
import json
import sys

import bpy
import numpy as np

COUNTS = {"POINTCLOUD": "points", "CURVES": "points", "MESH": "vertices"}
VALUES = {"FLOAT": ("value", 1), "INT": ("value", 1), "FLOAT_VECTOR": ("vector", 3),
          "FLOAT_COLOR": ("color", 4)}  # fmt: skip


def values(attribute):
    """Numbers of an attribute, as lists."""
    name, width = VALUES[attribute.data_type]
    flat = np.zeros(len(attribute.data) * width, dtype=np.float32)
    attribute.data.foreach_get(name, flat)
    return (
        flat.reshape(-1, width).squeeze(-1).tolist()
        if width == 1
        else flat.reshape(-1, width).tolist()
    )


def described(thing, graph):
    """An object's data at the present frame."""
    data = thing.evaluated_get(graph).data
    result = {
        "type": thing.type, "at": list(thing.matrix_world.translation),
        "count": len(getattr(data, COUNTS[thing.type])),
    }  # fmt: skip
    if thing.type == "POINTCLOUD":
        result["attributes"] = {a.name: values(a) for a in data.attributes if a.data_type in VALUES}
    return result


def rendered(scene, path):
    """Share of the picture that the point clouds alone cover, and how much it varies."""
    for thing in bpy.data.objects:
        thing.hide_render = thing.type in ("MESH", "CURVES")
    scene.render.engine, scene.cycles.samples = "CYCLES", 4
    scene.render.resolution_x, scene.render.resolution_y = 160, 90
    scene.render.resolution_percentage, scene.render.film_transparent = 100, True
    scene.camera = next(thing for thing in bpy.data.objects if thing.type == "CAMERA")
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    pixels = np.array(bpy.data.images.load(path).pixels[:]).reshape(-1, 4)
    seen = pixels[pixels[:, 3] > 0.5]
    return {
        "share": len(seen) / len(pixels),
        "spread": float(seen[:, :3].std()) if len(seen) else 0,
    }


def main(path, frame, picture):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=path, set_frame_range=True)
    scene = bpy.context.scene
    scene.frame_set(int(frame))
    graph = bpy.context.evaluated_depsgraph_get()
    things = list(bpy.data.objects)
    report = {
        "range": [scene.frame_start, scene.frame_end],
        "types": collections.Counter(thing.type for thing in things),
        "objects": [described(thing, graph) | {"name": thing.name} for thing in things
                    if thing.type in COUNTS],
        "instances": sum(each.is_instance for each in graph.object_instances),
        "picture": rendered(scene, picture),
    }  # fmt: skip
    print("REPORT" + json.dumps(report))


main(*sys.argv[1:])
