"""Runs inside an interpreter with ``bpy``, as a script: renders frames of a USD file by Cycles.

It is given the path of a JSON file (see ``particlesim.pictures.render.cycles``), and prints a line
for every picture it has written. It imports nothing of this package, which that interpreter may
not have.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

DONE = "done: "
NO_BPY = 3  # exit code
COPY = "particlesim_value"


def main(path: str) -> int:
    """Render a job, and return the exit code."""
    try:
        import bpy
    except ImportError as error:
        print(error, file=sys.stderr)
        return NO_BPY
    job = json.loads(Path(path).read_text())
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="cycles")
    if "FINISHED" not in bpy.ops.wm.usd_import(
        filepath=job["file"], import_cameras=False, import_lights=False, set_frame_range=False,
        apply_unit_conversion_scale=False,
    ):  # fmt: skip
        print("the file could not be imported", file=sys.stderr)
        return 1
    _remove_what_is_no_body(bpy, job)
    if job["color_by"]:
        _color(bpy, job)
    _light(bpy, job)
    _camera(bpy, job)
    _render(bpy, job)
    return 0


def turned(job: dict[str, Any], vector: list[float]) -> tuple[float, float, float]:
    """A direction or point of the stage in Blender's space, whose up is z."""
    x, y, z = vector
    return (x, y, z) if job["z_up"] else (x, -z, y)


def _remove_what_is_no_body(bpy: Any, job: dict[str, Any]) -> None:
    """Outlines cast no shadows; clear walls go, for they are noise unless samples are many, and so
    do plain planes of boundaries, for the ground."""
    for thing in list(bpy.data.objects):
        names = [thing.name.partition(".")[0]]
        parent = thing.parent
        while parent is not None:
            names.append(parent.name.partition(".")[0])
            parent = parent.parent
        if thing.type in ("CURVES", "CURVE") and {"boundaries", "periodic_box"} & set(names):
            thing.visible_shadow = False
        elif thing.type == "MESH" and "boundaries" in names:
            is_plane = len(thing.data.vertices) == 4 and job["ground"] is not None
            if is_plane or "displayOpacity" in thing.data.attributes:
                bpy.data.objects.remove(thing)


def _color(bpy: Any, job: dict[str, Any]) -> None:
    """Colour whatever has the values by a ramp."""
    material = bpy.data.materials.new("by_value")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    attribute = nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = COPY
    spread = nodes.new("ShaderNodeMapRange")
    low, high = job["color_range"]
    spread.inputs["From Min"].default_value = low
    spread.inputs["From Max"].default_value = high if high > low else low + 1.0
    ramp = nodes.new("ShaderNodeValToRGB")
    stops = ramp.color_ramp.elements
    for k, color in enumerate(job["ramp"]):
        at = k / (len(job["ramp"]) - 1)
        stop = stops[0] if k == 0 else stops[-1] if at == 1.0 else stops.new(at)
        stop.color = (*color, 1.0)
    body = nodes["Principled BSDF"]
    links.new(attribute.outputs["Fac"], spread.inputs["Value"])
    links.new(spread.outputs["Result"], ramp.inputs["Fac"])
    links.new(ramp.outputs["Color"], body.inputs["Base Color"])
    for thing in bpy.data.objects:
        there = getattr(thing.data, "attributes", {})
        name, part = job["color_by"], 1.0
        if name == "speed" and name not in there:
            name, part = "velocity", 1.0 / job["velocity_scale"]
        if name in there:
            kind = there[name].data_type
            copier = _copier(bpy, name, kind == "FLOAT_VECTOR", part, material)
            thing.modifiers.new("copy", "NODES").node_group = copier


def _copier(bpy: Any, name: str, is_vector: bool, part: float, material: Any) -> Any:
    """Geometry nodes that give a value, or length, a name of our own, and set the material.

    Cycles takes some names (density, temperature) for those of volumes, and finds nothing.
    """
    group = bpy.data.node_groups.new("copy", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    nodes, links = group.nodes, group.links
    start, end = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    value = nodes.new("GeometryNodeInputNamedAttribute")
    value.data_type = "FLOAT_VECTOR" if is_vector else "FLOAT"
    value.inputs["Name"].default_value = name
    times = nodes.new("ShaderNodeMath")
    times.operation = "MULTIPLY"
    times.inputs[1].default_value = part
    store = nodes.new("GeometryNodeStoreNamedAttribute")
    store.data_type, store.domain = "FLOAT", "POINT"
    store.inputs["Name"].default_value = COPY
    paint = nodes.new("GeometryNodeSetMaterial")
    paint.inputs["Material"].default_value = material
    links.new(start.outputs[0], store.inputs["Geometry"])
    number = value.outputs["Attribute"]
    if is_vector:
        size = nodes.new("ShaderNodeVectorMath")
        size.operation = "LENGTH"
        links.new(number, size.inputs[0])
        number = size.outputs["Value"]
    links.new(number, times.inputs[0])
    links.new(times.outputs[0], store.inputs["Value"])
    links.new(store.outputs[0], paint.inputs["Geometry"])
    links.new(paint.outputs[0], end.inputs[0])
    return group


def _light(bpy: Any, job: dict[str, Any]) -> None:
    """A sky that lights evenly, the key light, and the ground."""
    from mathutils import Vector

    scene = bpy.context.scene
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    sky = world.node_tree.nodes["Background"]
    sky.inputs["Color"].default_value = (*job["background"], 1.0)
    sky.inputs["Strength"].default_value = 0.6
    # What the camera sees of it is as bright as in the quick previews.
    nodes, links = world.node_tree.nodes, world.node_tree.links
    plain = nodes.new("ShaderNodeBackground")
    plain.inputs["Color"].default_value = (*job["background"], 1.0)
    path, mix = nodes.new("ShaderNodeLightPath"), nodes.new("ShaderNodeMixShader")
    links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    links.new(sky.outputs[0], mix.inputs[1])
    links.new(plain.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], nodes["World Output"].inputs[0])
    scene.world = world
    key = bpy.data.objects.new("key", bpy.data.lights.new("key", "SUN"))
    key.data.energy, key.data.angle = 2.2, math.radians(4.0)
    to_light = Vector(turned(job, job["key"]))
    key.rotation_euler = to_light.to_track_quat("Z", "Y").to_euler()
    scene.collection.objects.link(key)
    if job["ground"] is not None:
        foot = [job["ground"] * u for u in job["up"]]
        bpy.ops.mesh.primitive_plane_add(size=200.0 * job["size"], location=turned(job, foot))
        bpy.context.object.is_shadow_catcher = True


def _camera(bpy: Any, job: dict[str, Any]) -> None:
    from mathutils import Matrix

    data = bpy.data.cameras.new("view")
    data.sensor_fit, data.angle = "VERTICAL", math.radians(job["angle"])
    data.clip_start, data.clip_end = 1e-4 * job["size"], 1e3 * job["size"]
    right, up, back = (turned(job, axis) for axis in job["axes"])
    at = turned(job, job["positions"][0])
    rows = [[right[k], up[k], back[k], at[k]] for k in range(3)]
    camera = bpy.data.objects.new("view", data)
    camera.matrix_world = Matrix([*rows, [0.0, 0.0, 0.0, 1.0]])
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera


def _render(bpy: Any, job: dict[str, Any]) -> None:
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = job["samples"]
    scene.cycles.use_denoising = job["samples"] >= 8
    scene.render.resolution_x, scene.render.resolution_y = job["width"], job["height"]
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGB"
    scene.view_settings.view_transform = "Standard"
    for number, frame in enumerate(job["frames"]):
        scene.frame_set(int(frame), subframe=frame - int(frame))
        scene.camera.location = turned(job, job["positions"][number])
        scene.render.filepath = str(Path(job["folder"]) / f"picture.{number:06d}.png")
        bpy.ops.render.render(write_still=True)
        print(f"\n{DONE}{scene.render.filepath}", flush=True)


if __name__ == "__main__":
    del sys.path[0]  # the script's folder: Blender's own modules have names of files in it
    sys.exit(main(sys.argv[1]))
