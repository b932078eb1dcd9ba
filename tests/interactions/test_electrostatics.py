"""Charges: Madelung's constants, forces against a sum over images, what does not fit."""

import math

import numpy as np
import pytest

import particlesim as ps
from cases.worlds import equal_alone

pytest.importorskip("nvalchemiops", reason="extra electrostatics")
NACL, CSCL = 1.747564594633182, 1.76267477307099  # of the distance of nearest neighbours


def simulate(scenes, device="cpu", **knobs):
    return ps.Simulation(scenes, ps.Settings(**{"precision": "float64", **knobs}), device=device)


def crystal(kind):
    """Charges of 1 and -1 at a nearest distance of 1, and the side of their box."""
    if kind == "NaCl":
        x = ps.sample.lattice("sc", (4, 4, 4), 1.0)
        return x, (-1.0) ** np.round(x).sum(axis=1), 4.0
    a = 2.0 / math.sqrt(3.0)
    x = ps.sample.lattice("sc", (3, 3, 3), a)
    return np.concatenate([x, x + 0.5 * a]), np.repeat([1.0, -1.0], 27), 3 * a


def salt(seed=0, count=60, box=(6.0, 7.0, 8.0), **options):
    """Charges anywhere in a box that is no cube, not too near each other."""
    rng = np.random.default_rng(seed)
    cells = ps.sample.lattice("sc", (4, 4, 4), 1.0)[rng.permutation(64)[:count]]
    x = (cells + rng.uniform(0.2, 0.8, cells.shape)) * np.array(box) / 4
    scene = ps.Scene(periodic=((0, 0, 0), box))
    scene.add_particles(x, charge=rng.permutation(np.resize([1.0, -1.0, 2.0, -2.0], count)))
    scene.add_interaction(ps.Electrostatics("ewald", **options))
    return scene


def images(x, q, box, far=1.2):
    """Energy and forces by Ewald's sum in NumPy, both parts to 1e-14."""
    box, a = np.asarray(box), 6.0 / (0.5 * far * min(box))
    d = x[:, None] - x
    F, U = np.zeros_like(x), 0.0
    for n in np.ndindex(3, 3, 3):
        s = d + (np.array(n) - 1) * box
        r = np.linalg.norm(s, axis=2)
        r[r == 0] = np.inf
        near = np.vectorize(math.erfc)(a * r) / r
        U += 0.5 * (q[:, None] * q * near).sum()
        slope = (near + 2 * a / math.sqrt(math.pi) * np.exp(-((a * r) ** 2))) / r**2
        slope[~np.isfinite(r)] = 0.0
        F += ((q[:, None] * q * slope)[:, :, None] * s).sum(axis=1)
    most = np.ceil(12.0 * a * box / (2 * math.pi)).astype(int)
    n = np.stack(np.meshgrid(*(np.arange(-m, m + 1) for m in most), indexing="ij"), -1)
    k = (2 * math.pi * n / box).reshape(-1, 3)
    k2 = (k**2).sum(axis=1)
    k, k2 = k[(k2 > 0) & (k2 < (12.0 * a) ** 2)], k2[(k2 > 0) & (k2 < (12.0 * a) ** 2)]
    weight = 2 * math.pi / np.prod(box) * np.exp(-k2 / (4 * a * a)) / k2
    wave = q * np.exp(1j * k @ x.T)
    S = wave.sum(axis=1)
    U += float((weight * np.abs(S) ** 2).sum()) - a / math.sqrt(math.pi) * float((q**2).sum())
    F += 2.0 * (np.imag(np.conj(S)[:, None] * wave) * weight[:, None]).T @ k
    return U, F


@pytest.mark.parametrize(("kind", "constant"), [("NaCl", NACL), ("CsCl", CSCL)])
def test_the_constants_of_madelung(kind, constant, device):
    """To 1e-6 at the default tolerance; by symmetry no force is more than rounding of 1e3 terms."""
    x, q, side = crystal(kind)
    scene = ps.Scene(periodic=((0, 0, 0), (side,) * 3))
    scene.add_particles(x, charge=q)
    scene.add_interaction(ps.Electrostatics("ewald", constant=3.0))
    sim = simulate(scene, device)
    found = sim.diagnostics()
    assert -2 * found.potential[0] / len(q) / 3.0 == pytest.approx(constant, rel=1e-6)
    assert found.virial[0] == pytest.approx(found.potential[0], rel=1e-12)
    assert np.abs(sim.get("force")).max() < 1e-11


@pytest.mark.parametrize("options", [{"tolerance": 1e-4}, {"tolerance": 1e-9, "cutoff": 2.5}])
def test_forces_are_those_of_all_images(options, device):
    """To the tolerance, of the largest force; each part leaves out less than ten times as much."""
    scene = salt(**options)
    sim = simulate(scene, device)
    U, F = images(scene.position, scene.column("charge"), scene.periodic[1] - scene.periodic[0])
    allowed = 10 * options["tolerance"]
    np.testing.assert_allclose(sim.get("force"), F, rtol=0, atol=allowed * np.abs(F).max())
    assert sim.diagnostics().potential[0] == pytest.approx(U, rel=allowed)


def test_bonded_charges_do_not_feel_each_other():
    """As of all images, less the law of the pairs themselves: to the tolerance of both sums."""
    pairs = np.array([(0, 1), (1, 2), (10, 30)])
    tolerance = 1e-9
    sim = simulate(salt(tolerance=tolerance, cutoff=2.5, exclude=pairs))
    scene = sim.scenes[0]
    x, q, box = scene.position, scene.column("charge"), np.array([6.0, 7.0, 8.0])
    U, F = images(x, q, box)
    for i, j in pairs:
        d = x[i] - x[j]
        d -= box * np.round(d / box)
        r = np.linalg.norm(d)
        U -= q[i] * q[j] / r
        F[i] -= q[i] * q[j] * d / r**3
        F[j] += q[i] * q[j] * d / r**3
    allowed = 10 * tolerance
    np.testing.assert_allclose(sim.get("force"), F, rtol=0, atol=allowed * np.abs(F).max())
    found = sim.diagnostics()
    assert found.potential[0] == pytest.approx(U, rel=allowed)
    assert found.virial[0] == pytest.approx(U, rel=allowed)


@pytest.mark.slow
def test_a_world_goes_as_it_goes_alone(device):
    """Boxes and charges of their own."""
    scenes = [salt(0), salt(1, count=40, box=(5.0, 5.0, 5.0))]
    knobs = {"dt": 1e-3, "substeps": 2}
    batch = equal_alone(simulate, scenes, device, 3, **knobs)
    momentum = batch.world(0).velocity.sum(axis=0)
    assert np.abs(momentum).max() < 1e-12


@pytest.mark.slow
def test_some_of_the_charges():
    """Of a group alone; what is left over is neutralised, and a run says so."""
    scene = salt()
    scene.interactions.clear()
    scene.add_particles([(0.1, 0.1, 0.1)], charge=5.0, group="guest")
    scene.add_interaction(ps.Electrostatics("ewald", scene.groups[0]))
    sim = simulate(scene)
    alone = simulate(salt())
    np.testing.assert_allclose(sim.get("force")[:-1], alone.get("force"), rtol=0, atol=1e-12)
    assert not sim.get("force")[-1].any()
    scene.interactions[:] = [ps.Electrostatics("ewald")]
    with pytest.warns(ps.StabilityWarning, match="charges must add up to 0"):
        simulate(scene, dt=1e-6, substeps=1).run(1)


def test_other_methods_are_coulombs(device):
    def force(part):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (1, 0, 0), (0, 2, 1)], charge=[1.0, -2.0, 0.5])
        scene.add_interaction(part)
        return simulate(scene, device).get("force")

    cut = {"cutoff": 3.0, "damping": 0.2}
    for part, same in [
        (ps.Electrostatics(constant=2.0), ps.Coulomb(constant=2.0)),
        (ps.Electrostatics("damped_shifted_force", **cut), ps.Coulomb(**cut)),
    ]:
        assert np.array_equal(force(part), force(same))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ps.Electrostatics("mesh"), "method must be one of"),
        (lambda: ps.Electrostatics(cutoff=2.0), "cutoff must be left out with method='all_pairs'"),
        (lambda: ps.Electrostatics("damped_shifted_force"), "cutoff must be given"),
        (lambda: ps.Electrostatics("ewald", tolerance=0.0), "tolerance must be above 0"),
        (lambda: ps.Electrostatics("ewald", damping=0.1), "damping must be left out"),
        (lambda: ps.Electrostatics("ewald"), "scene must be periodic along all axes"),
        (lambda: ps.Electrostatics("damped_shifted_force", cutoff=-1.0), "cutoff must be above 0"),
    ],
)
def test_what_does_not_fit_is_refused(make, message):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)], charge=[1.0, -1.0])
    with pytest.raises(ValueError, match=message):
        scene.add_interaction(make())
        simulate(scene)
