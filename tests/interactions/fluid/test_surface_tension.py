"""Surface tension between fluids: the force, what it conserves, its area, its limit."""

import numpy as np
import pytest

import particlesim as ps
from cases.worlds import equal_alone

SIGMA, SIZE = 0.7, 0.1
H = 2.0 * SIZE


def scene_of(x, inside, density=1.0, speed=0.0):
    """Fluids inside and outside, and nothing but the tension between them."""
    scene = ps.Scene()
    v = speed * np.random.default_rng(2).normal(size=x.shape)
    for name, own in (("drop", inside), ("air", ~inside)):
        scene.add_particles(x[own], velocity=v[own], mass=density * SIZE**3, group=name)
    fluids = ps.SPH(["drop", "air"], smoothing_length=H, rest_density=[1.0, 0.01],
                    equation_of_state=ps.Tait(10.0))  # fmt: skip
    scene.add_interaction(ps.SurfaceTension(fluids, SIGMA))
    return scene


def cloud(seed=1, **options):
    x = ps.sample.box((0, 0, 0), (0.5, 0.6, 0.4), SIZE, jitter=0.4, seed=seed)
    return scene_of(x, x[:, 1] + 0.3 * x[:, 0] < 0.35, **options)


def simulation(scene, device="cpu", **knobs):
    return ps.Simulation(scene, ps.Settings(dt=1e-2, precision="float64", **knobs), device=device)


def test_forces_are_those_of_the_stress():
    scene = cloud()
    x, other = scene.position, np.arange(scene.particle_count) < len(scene["drop"])
    W, x_ij = ps.WendlandC2(), x[:, None] - x
    r = np.linalg.norm(x_ij, axis=-1)
    slope = (W.derivative(r, H) / np.where(r > 0, r, 1.0))[..., None] * x_ij
    n = W.value(r, H).sum(axis=1)
    g = (slope * (other[:, None] != other)[..., None]).sum(axis=1) / n[:, None]
    g[np.linalg.norm(g, axis=1) * H < 1e-3] = 0.0  # where there is no surface
    size = np.linalg.norm(g, axis=1)
    eye = np.eye(3) * size[:, None, None]
    stress = SIGMA * (eye - g[:, :, None] * g[:, None] / np.maximum(size, 1e-9)[:, None, None])
    part = stress / n[:, None, None] ** 2
    force = np.einsum("ijab,ijb->ia", part[:, None] + part, slope)
    sim = simulation(scene)
    found = sim.get("force")
    # Sums of 100 terms in float64.
    np.testing.assert_allclose(found, force, atol=1e-12 * np.abs(force).max())
    assert np.abs(found.sum(axis=0)).max() < 1e-13 * np.abs(found).sum()
    assert sim.diagnostics().potential[0] == pytest.approx(SIGMA * (size / n).sum(), rel=1e-12)


def test_particles_count_the_area():
    """Of a ball of five spacings' radius, and what pulls on one half of a flat sheet."""
    x = ps.sample.box((-1, -1, -1), (1, 1, 1), SIZE)
    sim = simulation(scene_of(x, np.linalg.norm(x, axis=1) < 0.5))
    # A lattice's ball is rough by half a spacing, and the surface two h thick: (h / 2 R)^2 = 4 %.
    assert sim.diagnostics().potential[0] == pytest.approx(SIGMA * np.pi, rel=0.05)
    flat = simulation(scene_of(x, x[:, 1] < 0))
    force = flat.get("force")
    # Beyond two reaches from the rim of the sheet nothing pulls, and across the sheet sigma a
    # length, of which a fifth is next to a rim where numbers are halved.
    middle = np.abs(flat.position).max(axis=1) < 1 - 4 * H
    assert middle.any() and np.abs(force[middle]).max() < 1e-12
    assert force[flat.position[:, 0] < 0, 0].sum() == pytest.approx(2 * SIGMA, rel=0.1)


def test_it_turns_and_moves_with_the_fluids():
    scene = cloud()
    force = simulation(scene).get("force")
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    scene.position[:] = scene.position @ turn.T + [3.0, -1.0, 2.0]
    # Places of about 4 are told to 4e-16, slopes of 1 / h so much over h off.
    turned = simulation(scene).get("force")
    np.testing.assert_allclose(turned, force @ turn.T, atol=1e-11 * np.abs(force).max())


@pytest.mark.slow
def test_worlds_go_alone_as_together(device):
    scenes = [cloud(speed=0.1), cloud(seed=3, speed=0.1)]
    equal_alone(simulation, scenes, device, 10)


def test_capillary_waves_limit_the_step():
    (limit,) = simulation(cloud()).stability().limits
    assert limit.kind == "capillary"
    assert limit.dt == pytest.approx(np.sqrt(0.01 * H**3 / (2 * np.pi * SIGMA)), rel=1e-9)


def test_what_is_refused():
    one = ps.SPH(smoothing_length=1.0, rest_density=1.0, equation_of_state=ps.Tait(1.0))
    with pytest.raises(ValueError, match="several fluids"):
        ps.SurfaceTension(one, 1.0)
    with pytest.raises(TypeError, match="must be an SPH"):
        ps.SurfaceTension(ps.Gravity(), 1.0)
