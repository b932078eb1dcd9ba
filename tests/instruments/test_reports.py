"""Results show themselves readably at a prompt and in notebooks."""

import html

import numpy as np

import particlesim as ps
from particlesim.engine.report import Report, grid


def falling(worlds=None):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)], mass=2.0, velocity=(1.0, 0, 0))
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    return ps.Simulation(scene, ps.Settings(ledger=True), device="cpu", worlds=worlds)


def test_a_prompt_and_a_notebook_show_the_text():
    sim = falling()
    sim.run(1)
    for each in (sim.diagnostics(), sim.explain(), sim.stability(), sim.ledger()):
        assert repr(each) == str(each) and "array(" not in repr(each)
        assert html.escape(str(each)) in each._repr_html_()


def test_markup_is_text():
    class Words(Report):
        def __str__(self):
            return grid([("[red]", "left")], [("a <b>",)])[-1]

    assert grid([("[red]", "left")], [("a <b>",)])[0] == "[red]"
    assert repr(Words()) == "a <b>" and "a &lt;b&gt;" in Words()._repr_html_()


def test_diagnostics_show_every_quantity_of_the_first_worlds():
    sim = falling()
    lines = str(sim.diagnostics()).splitlines()
    heads = "mass kinetic potential energy virial temperature pressure momentum angular momentum"
    assert lines[0].split() == heads.split()
    numbers = [float(word) for word in lines[2].split()]
    found = sim.diagnostics()
    wanted = [found.mass, found.kinetic, found.potential, found.energy, found.virial]
    wanted += [found.temperature, found.pressure]
    wanted = np.concatenate([*wanted, found.momentum[0], found.angular_momentum[0]])
    np.testing.assert_allclose(numbers, wanted, rtol=1e-4)  # five digits are shown
    many = str(falling(worlds=25).diagnostics())
    assert "world" in many and many.endswith("and 5 more worlds")
