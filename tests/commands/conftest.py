"""What tests of the commands share: scenes, and a stand-in for the engine."""

import textwrap

import pytest

import particlesim as ps
from particlesim import cli

SCENE = '''
    """A test scene.

    More about it.
    """
    import particlesim as ps

    settings = ps.Settings(dt=0.01, substeps=4)
    frames = 3

    def build(count=2, spacing=0.5, open=False, name="fluid"):
        return {"count": count, "spacing": spacing, "open": open, "name": name}

    def error(sim):
        return 0.125
'''


FALLING = '''
    """A particle that falls freely: after t it is 4.905 t^2 lower."""
    import particlesim as ps

    settings = ps.Settings(dt=0.1, substeps=2, precision="float64")
    frames = 2

    def build(height=10.0):
        scene = ps.Scene()
        scene.add_particles([(0, height, 0)], mass=1.0, radius=0.1)
        scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
        return scene

    def error(sim):
        # Symplectic Euler with n steps of h falls g h^2 n (n + 1) / 2.
        return float(abs(sim.position[0, 1] - 10.0 + 9.81 * 0.05**2 * 4 * 5 / 2))
'''


class Engine:
    """What the command line needs of Simulation; keeps the arguments of the last one."""

    last = None
    failure: BaseException | None = None
    particle_count = 1234

    def __init__(self, scene, settings, device=None, worlds=None):
        Engine.last = self
        self.scene, self.settings, self.device, self.worlds = scene, settings, device, worlds

    def run(self, frames, record, progress, overwrite, fields, history, checkpoint, resume):
        self.checkpoint, self.resume = checkpoint, resume
        self.frames, self.record, self.overwrite = frames, record, overwrite
        self.history = history
        self.fields = tuple(fields)
        for frame in range(1, frames + 1):
            progress(frame, frames)
            if self.failure and frame == 2:
                raise self.failure

    def explain(self):
        return "density [float32] is not here\n[bold]plain[/bold]"


@pytest.fixture
def engine(monkeypatch):
    for name in ps.__all__:
        getattr(ps, name)  # what is first imported under the patch would keep the stand-in
    monkeypatch.setattr("particlesim.simulation.simulation.Simulation", Engine)
    monkeypatch.setattr(Engine, "failure", None)
    monkeypatch.setattr(Engine, "last", None)
    return Engine


@pytest.fixture
def scene_file(tmp_path):
    def write(text=SCENE, name="tiny.py"):
        path = tmp_path / name
        path.write_text(textwrap.dedent(text))
        return str(path)

    return write


@pytest.fixture
def particlesim_fails(capsys):
    """Run the program; expect the exit code and one line on stderr, and return that line."""

    def run(code, *arguments):
        assert cli.main(arguments) == code
        lines = capsys.readouterr().err.splitlines()
        assert len(lines) == 1 and lines[0].startswith("error: "), lines
        return lines[0]

    return run


@pytest.fixture
def scene_text():
    """The source of a scene for the stand-in."""
    return SCENE


@pytest.fixture
def falling(scene_file):
    """The path of a scene for the engine itself."""
    return scene_file(FALLING, "falling.py")
