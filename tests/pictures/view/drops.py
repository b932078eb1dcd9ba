"""What the tests of the live view share: drops that fall, and questions to a server."""

import http.client
import json
import struct
import time

import numpy as np

import particlesim as ps
from particlesim.output import colors
from particlesim.pictures.view.packet import FORMATS

FRAMES, WORLDS, DROPS = 6, 4, 8
COLOR = (0.1, 0.4, 0.9)


def build():
    """Drops that fall in a box, and a rope of two beads."""
    scene = ps.Scene()
    rng = np.random.default_rng(1)
    radii = np.linspace(0.01, 0.02, DROPS)
    scene.add_particles(
        rng.uniform(0.2, 0.8, (DROPS, 3)), velocity=rng.normal(0, 1, (DROPS, 3)), radius=radii,
        group="drops", color=COLOR,
    )  # fmt: skip
    rope = scene.add_particles([(0.4, 0.9, 0.5), (0.6, 0.9, 0.5)], radius=0.05, group="rope")
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_constraint(ps.Distance(rope.indices[None]))
    scene.add_constraint(ps.BoxBoundary((0, 0, 0), (1, 1, 1)))
    return scene


def simulation(worlds=None):
    return ps.Simulation(build(), ps.Settings(dt=0.02, substeps=2), device="cpu", worlds=worlds)


def ask(server, path, method="GET", **headers):
    """Status, kind and body of an answer; the path is sent as it is."""
    connection = http.client.HTTPConnection("127.0.0.1", port_of(server), timeout=30)
    try:
        connection.putrequest(method, path, skip_host="Host" in headers)
        for name, value in headers.items():
            if value is not None:
                connection.putheader(name, value)
        connection.endheaders()
        answer = connection.getresponse()
        return answer.status, answer.getheader("Content-Type"), answer.read()
    finally:
        connection.close()


def port_of(server):
    return int(server.url.rstrip("/").rpartition(":")[2])


def get(server, path, method="GET"):
    """JSON of a good answer."""
    status, kind, body = ask(server, path, method)
    assert (status, kind) == (200, "application/json"), body
    return json.loads(body)


def unpacked(packet):
    """Header and arrays of a packet, by name."""
    size = 4 + struct.unpack_from("<I", packet)[0]
    header = json.loads(packet[4:size])
    dtypes = {name: code for code, name in FORMATS.items()}
    arrays = {}
    for name, each in header["arrays"].items():
        shape = each["count"], each["width"]
        at, dtype = size + each["offset"], dtypes[each["type"]]
        arrays[name] = np.frombuffer(packet, dtype, shape[0] * shape[1], at).reshape(shape)
    return header, arrays


def packet(server, path):
    status, kind, body = ask(server, path)
    assert (status, kind) == (200, "application/octet-stream"), body
    return unpacked(body)


def refusal(server, path, status):
    """The words of a refusal."""
    found, kind, body = ask(server, path)
    assert (found, kind) == (status, "application/json"), body
    return json.loads(body)["error"]


def srgb(linear):
    return np.rint(255 * colors.encoded(np.asarray(linear))).astype(int)


def wait_for(condition, seconds=60.0):
    """Until something is so, or the time is up."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it took too long"
        time.sleep(0.01)
