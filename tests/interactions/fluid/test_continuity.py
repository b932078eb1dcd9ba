"""Density by continuity: rates, diffusion and sound."""

import itertools

import numpy as np
import pytest

import particlesim as ps
from cases.continuity import SOUND, H, loose, simulate, stirred

# Rates --------------------------------------------------------------------------------------------


def summed(x, held, count=8):
    """sum_j m_j W_ij over particles and their images, mirrored or shifted."""
    images = [-x, x] if held else [x - 1, x, x + 1]
    total = 0.0
    for a, b in itertools.product(images, images):
        r = np.hypot(x[:, None, 0] - a[None, :, 0], x[:, None, 1] - b[None, :, 1])
        q = np.minimum(r * count / 2, 2.0)
        total = total + ((1 - q / 2) ** 4 * (1 + 2 * q)).sum(axis=1)
    return 7 / (4 * np.pi) / 4 * total  # of Wendland's C2, m / h^2 = 1/4


@pytest.mark.parametrize(
    "held, integrator",
    [
        (True, "symplectic_euler"),
        pytest.param(False, "symplectic_euler", marks=pytest.mark.slow),
        pytest.param(False, "velocity_verlet", marks=pytest.mark.slow),
    ],
)
@pytest.mark.slow
def test_adds_up_to_what_a_sum_changes_by(held, integrator):
    """d/dt sum_j m_j W_ij = sum_j m_j v_ij . grad_i W_ij, also of images, to second order."""
    errors = []
    for substeps in (10, 20):
        sim = simulate(stirred(ps.ContinuityDensity(0.0), held), substeps, integrator=integrator)
        before = summed(sim.position, held)
        sim.run(3)
        sim.forces(sim.settings.substep)  # where the particles are now
        change = summed(sim.position, held) - before
        assert np.abs(change).max() > 3e-3
        errors.append(np.abs(sim.get("density") - 1.0 - change).max())
    # The middle of an interval is off by (v dt / h)^2 / 24 of a change, 0.5 * 2e-3 / 0.25.
    assert errors[0] < 1e-5
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def test_energy_and_momentum(cloud):
    """The force is the gradient of an energy whose densities go on by the continuity's rate."""
    x, v, m = cloud(200)
    rho = np.random.default_rng(1).uniform(1.0, 1.3, len(x))
    scene = loose(x, v, m, rho, diffusion=0.0)
    changes = []
    for substeps in (40, 80):
        sim = simulate(scene, substeps, integrator="velocity_verlet")
        before = sim.diagnostics()
        sim.run(5)
        after = sim.diagnostics()
        assert abs(after.kinetic[0] - before.kinetic[0]) > 0.1 * before.kinetic[0]
        changes.append(abs(after.energy[0] - before.energy[0]))
        # Of 200 particles of speeds of 1, each in 400 substeps.
        momentum = np.abs(after.momentum - before.momentum).max()
        assert momentum < 400 * 200 * 2.2e-16
    # What is off falls with the second order of the step, a fourth of it; and (omega dt)^2 / 12 at
    # omega = c / h is 4e-6.
    assert changes[1] < 0.3 * changes[0]
    assert changes[0] < 2e-5 * before.energy[0]


def lattice(strain):
    """Densities in the middle of a lattice that moves as x' = strain x, over a second."""
    spacing = 0.2
    x = ps.sample.box((-1.6, -1.6, -1.6), (1.6, 1.6, 1.6), spacing)
    scene = loose(x, x @ strain.T, spacing**3, h=2 * spacing, sound=1e-6)
    sim = simulate(scene, 20, 1.0)
    sim.step()
    sim.forces(sim.settings.substep)
    return sim.get("density")[np.abs(x).max(axis=1) < 0.5]


@pytest.mark.slow
@pytest.mark.parametrize(
    "strain", [[[-0.2, 0.1, 0], [0, -0.1, 0], [0, 0, 0]], [[0.3, 0, 0], [0, -0.3, 0], [0, 0, 0]]]
)
def test_density_of_a_lattice_that_is_strained(strain):
    """rho = 1 / det F, F = 1 + strain t: what is as dense as it was, and 40 % denser."""
    strain = np.array(strain)
    expected = 1 / np.linalg.det(np.eye(3) + strain)
    # Sums of W over the lattice are 1 to 0.2 % at h = 2 spacings, and to 0.7 % where these are
    # drawn out to h = 1.5 of them.
    np.testing.assert_allclose(lattice(strain), expected, rtol=0.01)


# Diffusion ----------------------------------------------------------------------------------------


def reference(x, v, m, rho, delta):
    """d rho/dt by the sums of the papers, W being Wendland's C2 in three dimensions."""
    away = x[:, None] - x[None]
    r = np.linalg.norm(away, axis=2)
    q = np.minimum(r / H, 2.0)
    slope = 21 / (16 * np.pi * H**3) * (-5 * (1 - q / 2) ** 3) / H**2  # W'/r
    np.fill_diagonal(slope, 0.0)
    grad = slope[..., None] * away
    rate = (m * ((v[:, None] - v[None]) * grad).sum(axis=2)).sum(axis=1)
    volume, uneven = m / rho, rho[None] - rho[:, None]
    M = np.einsum("j,ija,ijb->iab", volume, -away, grad) + 1e-4 * np.eye(3)
    g = np.linalg.solve(M, np.einsum("j,ij,ija->ia", volume, uneven, grad)[..., None])[..., 0]
    c = SOUND * np.maximum(rho, 1.0) ** 3  # Tait's, of exponent 7
    psi = -2 * uneven * slope - ((g[:, None] + g[None]) * grad).sum(axis=2)
    return rate + delta * H * ((0.5 * (c[:, None] + c[None])) * volume * psi).sum(axis=1)


@pytest.mark.parametrize("precision", ["float64", pytest.param("float32", marks=pytest.mark.slow)])
def test_rates_are_those_of_the_papers(cloud, precision):
    """Monaghan's and Antuono's, over a random cloud of random densities."""
    x, v, m = cloud(200)
    rho = np.random.default_rng(1).uniform(0.8, 1.3, len(x))
    dt = 1e-5
    sim = simulate(loose(x, v, m, rho), 1, dt, precision=precision)
    np.testing.assert_allclose(sim.get("density"), rho, rtol=1e-6)  # so it starts
    sim.step()
    sim.forces(dt)
    now = sim.get("density") - sim.scenes[0].column("start_density")
    expected = reference(x, v, m, rho, 0.2) * dt
    # Positions and velocities are off by parts of dt, 1e-5 of accelerations of 1000 h; rounding is
    # that of densities, 1.
    scale, eps = np.abs(expected).max(), np.finfo(precision).eps
    np.testing.assert_allclose(now, expected, atol=5e-3 * scale + 4 * eps)


def test_diffusion_leaves_what_is_linear_alone():
    """At rest, where densities are linear in space nothing changes, at a surface neither."""
    x = ps.sample.box((0, 0, 0), (3, 2, 2), 0.5, jitter=0.2, seed=1)
    changes = []
    for noise in (0.0, 0.01):
        rho = 1.0 + 0.03 * x[:, 0] - 0.02 * x[:, 1]
        rho += noise * np.random.default_rng(2).normal(size=len(x))
        sim = simulate(loose(x, 0.0, 0.125, rho), 1, 1e-5)
        sim.step()
        sim.forces(1e-5)
        changes.append(np.abs(sim.get("density") - rho).max())
    # Of what is linear, 0.036 H from particle to particle, there changes that part of 1e-4 over M
    # that keeps gradients finite; in a corner M is an eighth.
    assert changes[0] < 0.036 * H * 8e-4 / 0.01 * changes[1]


@pytest.mark.slow
def test_sound_and_noise():
    """A wave has the sound of its lattice; noise from particle to particle is gone in L / c."""
    count = 16
    source, h = stirred(None, count=count), 2 / count
    x = source.position
    wave, noise = np.cos(2 * np.pi * x[:, 0]), (-1.0) ** np.arange(len(x))
    # omega = c sum_j V_j sin(k x_j) |dW/dx_j|, of rho' = -div v and v' = -c^2 grad rho.
    n = np.arange(-4, 5) / count
    a, b = np.meshgrid(n, n, indexing="ij")
    q = np.minimum(np.hypot(a, b) / h, 2.0)
    slope = 7 / (4 * np.pi * h**2) * 5 * (1 - q / 2) ** 3 / h**2
    omega = SOUND * (slope * a * np.sin(2 * np.pi * a)).sum() / count**2
    assert omega == pytest.approx(2 * np.pi * SOUND, rel=0.1)
    left = {}
    for delta in (0.0, 0.1):
        scene = ps.Scene(periodic=((0, 0, None), (1, 1, None)))
        scene.add_particles(x, mass=source.mass, start_density=1 + 1e-5 * wave + 2e-6 * noise)
        scene.add_interaction(
            ps.SPH(smoothing_length=h, rest_density=1.0, dimension=2,
                   equation_of_state=ps.Tait(SOUND, negative_pressure=True),
                   density=ps.ContinuityDensity(delta))
        )  # fmt: skip
        sim = simulate(scene, 80, 1 / SOUND, integrator="velocity_verlet")
        sim.step()
        sim.forces(0.0)
        excess = sim.get("density") - 1
        left[delta] = 2 * (excess * wave).mean() / 1e-5, (excess * noise).mean() / 2e-6
    # Steps of omega dt = 0.08 make the phase 2 pi (omega dt)^2 / 24 wrong; of what alternates from
    # particle to particle gradients see nothing.
    assert left[0.0] == pytest.approx((np.cos(omega / SOUND), 1.0), abs=0.002)
    assert 0.95 < left[0.1][0] / left[0.0][0] < 1 and abs(left[0.1][1]) < 0.01
