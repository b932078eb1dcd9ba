"""Files that are in the form of a checkpoint and hold nonsense cost little, and are refused."""

import json
import tracemalloc
import zipfile

import numpy as np
import pytest

import particlesim as ps

from ..runs import sim
from .checkpoints import pair


@pytest.fixture
def saved(tmp_path):
    path = tmp_path / "run.npz"
    made = ps.Simulation(pair(), device="cpu")
    made.run(2)
    made.save(path)
    return path


def rewritten(path, change=None, arrays=None, compression=zipfile.ZIP_STORED):
    """A checkpoint with another header, and with other bytes for some of its arrays."""
    other = path.with_name("other.npz")
    with zipfile.ZipFile(path) as archive, zipfile.ZipFile(other, "w", compression) as made:
        for entry in archive.namelist():
            if entry == "header.npy":
                with np.load(path) as file:
                    header = json.loads(file["header"].tobytes())
                (change or (lambda header: None))(header)
                content = np.frombuffer(json.dumps(header).encode(), np.uint8)
                with made.open(entry, "w") as opened:
                    np.lib.format.write_array(opened, content)
            else:
                name = entry.removesuffix(".npy")
                made.writestr(entry, (arrays or {}).get(name, archive.read(entry)))
    return other


def npy(shape, dtype="<f4", content=b""):
    """The bytes of an array file that says it has this shape."""
    text = str({"descr": dtype, "fortran_order": False, "shape": shape})
    text = text + " " * (-(len(text) + 11) % 64) + "\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode() + content


def of_incident(**changes):
    made = {
        "kind": "escaped", "world": 0, "particle": 0, "frame": 0, "start": 0.0, "stop": 0.1,
        "substep": 1, "of": 1, "part": None, "position": [0, 0, 0], "velocity": [0, 0, 0],
        "limit": "", "action": "stop", "substeps": 1,
    }  # fmt: skip
    return {**made, **changes}


HEADERS = {
    "frame -1": lambda header: header.update(frame=-1),
    "frame 1.5": lambda header: header.update(frame=1.5),
    "frame True": lambda header: header.update(frame=True),
    "frame 10000000000": lambda header: header.update(frame=10**30),
    r"frozen \[7\]": lambda header: header.update(frozen=[7]),
    r"frozen \[-1\]": lambda header: header.update(frozen=[-1]),
    "unknown_forces": lambda header: header.update(unknown_forces=[1]),
    "scenes": lambda header: header["scenes"].update(worlds=[3]),
    "scenes ": lambda header: header["scenes"].update(worlds=[]),
    "KeyError: 'kinds'": lambda header: header["scenes"].pop("kinds"),
    "incidents": lambda header: header.update(incidents=[of_incident(world=3)]),
    "TypeError": lambda header: header.update(incidents=[of_incident(more=3)]),
    "settings": lambda header: header.update(settings=[]),
    "copies": lambda header: header.update(copies=3),
    "arrays": lambda header: header.update(arrays=header["arrays"] * 2),
    "run": lambda header: header.update(run={"recorded": 3, "arguments": {}}),
    "KeyError: 'frame'": lambda header: header.pop("frame"),
}


@pytest.mark.parametrize("told", HEADERS)
def test_headers(saved, refused, told):
    ps.Simulation.load(rewritten(saved), pair(), device="cpu")
    with refused(rf"be a whole checkpoint .*other.npz' \(.*{told}"):
        ps.Simulation.load(rewritten(saved, HEADERS[told]), pair(), device="cpu")


ARRAYS = {
    "has float32": npy((3, 3), content=bytes(36)),
    "has float64": npy((2, 3), "<f8", bytes(48)),
    r"is float32 \(1000000000000000, 3\) in": npy((10**15, 3), content=bytes(24)),
    r"is float32 \(-2, -3\) in": npy((-2, -3), content=bytes(24)),
    "is object": npy((2,), "|O", bytes(16)),
    "magic": b"nothing at all",
    "Header": npy((1,) * 9000),
}


@pytest.mark.parametrize("told", ARRAYS)
def test_arrays(saved, refused, told):
    other = rewritten(saved, arrays={"state/velocity": ARRAYS[told]})
    with refused(told):
        ps.Simulation.load(other, pair(), device="cpu")


def refused_cheaply(refused, told, path):
    """Within a few megabytes, whatever the file says that it unpacks to."""
    tracemalloc.start()
    try:
        with refused(told):
            ps.Simulation.load(path, pair(), device="cpu")
        assert tracemalloc.get_traced_memory()[1] < 2e7
    finally:
        tracemalloc.stop()


def test_files_that_unpack_to_much_more_than_they_are(saved, refused):
    size = 300_000_000
    bomb = npy((size // 4,), content=bytes(size))
    for name in ("state/velocity", "of nobody"):
        other = rewritten(saved, arrays={name: bomb}, compression=zipfile.ZIP_DEFLATED)
        if name == "of nobody":
            with zipfile.ZipFile(other, "a", zipfile.ZIP_DEFLATED) as archive:
                archive.writestr("bomb.npy", bomb)
        assert other.stat().st_size < 1e6
        refused_cheaply(refused, "it unpacks to 30.,...,... bytes", other)


def test_large_files_of_other_arrays(saved, refused):
    other = rewritten(saved, arrays={"state/velocity": npy((10**7, 3), content=bytes(12 * 10**7))})
    refused_cheaply(refused, r"has float32 \(10000000, 3\) for float32 \(2, 3\)", other)


def test_worlds_without_their_particles(saved, refused):
    other = rewritten(saved, lambda header: header["scenes"].update(worlds=[0] * 10**5))
    refused_cheaply(refused, r"has positions \(2,\) in 100000 worlds", other)


def test_a_run_is_as_it_was_when_its_checkpoint_is_damaged(tmp_path, refused):
    path, kept = tmp_path / "out.npz", tmp_path / "out.checkpoint.npz"
    sim().run(3, record=path)
    with np.load(kept) as file:
        velocity = file["state/velocity"].tobytes()
    content = bytearray(kept.read_bytes())
    content[content.rindex(velocity)] ^= 1
    kept.write_bytes(content)
    run = sim()
    before = run.position
    with refused("be a whole checkpoint .*Bad CRC-32"):
        run.run(5, record=path, resume=True)
    assert run.frame == 0 and run.position.tobytes() == before.tobytes()
