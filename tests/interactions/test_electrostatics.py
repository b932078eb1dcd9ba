"""Charges: Madelung's constants, forces against a sum over images, what does not fit."""

import math

import numpy as np
import pytest

import particlesim as ps
from cases.images import images
from cases.worlds import equal_alone, goes_on_after_reset_and_save

pytest.importorskip("nvalchemiops", reason="extra electrostatics")
METHODS = ("ewald", "particle_mesh_ewald")
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


def salt(seed=0, count=60, box=(6.0, 7.0, 8.0), method="ewald", **options):
    """Charges anywhere in a box that is no cube, not too near each other."""
    rng = np.random.default_rng(seed)
    cells = ps.sample.lattice("sc", (4, 4, 4), 1.0)[rng.permutation(64)[:count]]
    x = (cells + rng.uniform(0.2, 0.8, cells.shape)) * np.array(box) / 4
    scene = ps.Scene(periodic=((0, 0, 0), box))
    scene.add_particles(x, charge=rng.permutation(np.resize([1.0, -1.0, 2.0, -2.0], count)))
    scene.add_interaction(ps.Electrostatics(method, **options))
    return scene


@pytest.mark.parametrize(
    "method", [pytest.param(k, marks=[pytest.mark.slow] * (k == "ewald")) for k in METHODS]
)
@pytest.mark.parametrize(("kind", "constant"), [("NaCl", NACL), ("CsCl", CSCL)])
def test_the_constants_of_madelung(kind, constant, method, device):
    """To 1e-6 at the default tolerance. By symmetry no force is more than rounding of 1e3 terms,
    or where the lattice is none of the mesh's than the tolerance of k q^2 / d^2 = 3.
    """
    x, q, side = crystal(kind)
    scene = ps.Scene(periodic=((0, 0, 0), (side,) * 3))
    scene.add_particles(x, charge=q)
    scene.add_interaction(ps.Electrostatics(method, constant=3.0))
    sim = simulate(scene, device)
    found = sim.diagnostics()
    assert -2 * found.potential[0] / len(q) / 3.0 == pytest.approx(constant, rel=1e-6)
    assert found.virial[0] == pytest.approx(found.potential[0], rel=1e-12)
    assert np.abs(sim.get("force")).max() < (1e-11 if method == "ewald" else 3e-6)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.slow
def test_the_crystal_of_wigner(method, device):
    """Charges of one sign in a uniform background, bcc: U / N = -0.895929255682 q^2 / a (Foldy
    1978), a the radius of a sphere of volume V / N. The background counts in full.
    """
    x = ps.sample.lattice("bcc", (3, 3, 3), 1.0)
    scene = ps.Scene(periodic=((0, 0, 0), (3.0,) * 3))
    scene.add_particles(x, charge=2.0)
    scene.add_interaction(ps.Electrostatics(method))
    a = (3.0 / (4.0 * math.pi * len(x) / 27.0)) ** (1.0 / 3.0)
    found = simulate(scene, device).diagnostics().potential[0] / len(x)
    assert found == pytest.approx(-0.895929255682 * 4.0 / a, rel=1e-6)


@pytest.mark.parametrize("options", [{"tolerance": 1e-4}, {"tolerance": 1e-9, "cutoff": 2.5}])
def test_forces_are_those_of_all_images(options, device):
    """To the tolerance, of the largest force; each part leaves out less than ten times as much."""
    scene = salt(**options)
    sim = simulate(scene, device)
    U, F = images(scene.position, scene.column("charge"), scene.periodic[1] - scene.periodic[0])
    allowed = 10 * options["tolerance"]
    np.testing.assert_allclose(sim.get("force"), F, rtol=0, atol=allowed * np.abs(F).max())
    assert sim.diagnostics().potential[0] == pytest.approx(U, rel=allowed)


@pytest.mark.parametrize(
    ("box", "tolerances"),
    [
        ((6.0, 7.0, 8.0), (1e-4, 1e-5, 1e-6)),
        *(
            pytest.param(box, (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8), marks=pytest.mark.slow)
            for box in [(6.0, 7.0, 8.0), (4.0, 4.0, 4.0), (3.0, 9.0, 6.0)]
        ),
    ],
)
def test_a_mesh_is_as_good_as_asked(box, tolerances, device):
    """Near pairs and the mesh leave out 2 (q^2 / d^2) sqrt(d / r_c) times the tolerance each, d the
    mean distance (Kolafa and Perram 1992): together less than it, of forces of about q^2 / d^2 at
    r_c > 8 d. Here r_c is 2 to 3 d, and forces are three times as large, as charges come close.
    """
    scene = salt(1, box=box)
    U, F = images(scene.position, scene.column("charge"), box)
    for tolerance in tolerances:
        sim = simulate(salt(1, box=box, method="particle_mesh_ewald", tolerance=tolerance), device)
        f = sim.get("force")
        assert np.sqrt(((f - F) ** 2).sum() / (F**2).sum()) < tolerance
        assert sim.diagnostics().potential[0] == pytest.approx(U, rel=tolerance)


@pytest.mark.parametrize(
    ("tolerance", "rounding"), [pytest.param(1e-4, 0.0, marks=pytest.mark.slow), (1e-6, 1e-6)]
)
def test_a_mesh_in_single_precision(tolerance, rounding, device):
    """Places at 8 are rounded by 2.4e-7 of a distance of 1, by which forces differ threefold."""
    scene = salt(method="particle_mesh_ewald", tolerance=tolerance)
    f = simulate(scene, device, precision="float32").get("force")
    F = images(scene.position, scene.column("charge"), (6.0, 7.0, 8.0))[1]
    assert np.sqrt(((f - F) ** 2).sum() / (F**2).sum()) < tolerance + rounding


@pytest.mark.parametrize("method", METHODS)
def test_bonded_charges_do_not_feel_each_other(method):
    """As of all images, less the law of the pairs themselves: to the tolerance of both sums."""
    pairs = np.array([(0, 1), (1, 2), (10, 30)])
    tolerance = 1e-9
    sim = simulate(salt(method=method, tolerance=tolerance, cutoff=2.5, exclude=pairs))
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


def mixed(method):
    """Boxes, charges and meshes of their own."""
    others = {"count": 40, "box": (5.0, 5.0, 5.0), "tolerance": 1e-4}
    return [salt(0, method=method), salt(1, method=method, **others)]


@pytest.mark.parametrize("method", [pytest.param("ewald", marks=pytest.mark.slow), METHODS[1]])
def test_a_world_goes_as_it_goes_alone(method, device):
    """Bit for bit. The mesh keeps momentum as far as forces are right, within the tolerance."""
    knobs = {"dt": 1e-3, "substeps": 2}
    batch = equal_alone(simulate, mixed(method), device, 2, **knobs)
    error = 1e-13 if method == "ewald" else 1e-6 * 60
    kick = 2 * knobs["dt"] * np.abs(batch.get("force")).max()
    assert np.abs(batch.world(0).velocity.sum(axis=0)).max() < error * kick


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_a_world_goes_on(method, device, tmp_path):
    def run(scenes, device):
        return simulate(scenes, device, dt=1e-3, substeps=2)

    goes_on_after_reset_and_save(run, mixed(method), device, tmp_path / "run.npz")


def test_a_mesh_is_the_same_on_any_threads():
    """What is put on it is added up in whole numbers; 1331 charges are cut in pieces of 512."""
    x = ps.sample.lattice("sc", (12, 12, 12), 1.0)
    places = x + np.random.default_rng(0).normal(0, 0.1, x.shape)

    def run(**knobs):
        scene = ps.Scene(periodic=((0, 0, 0), (12.0,) * 3))
        scene.add_particles(places, charge=(-1.0) ** np.floor(x).sum(axis=1))
        scene.add_interaction(ps.Electrostatics("particle_mesh_ewald", tolerance=1e-3))
        sim = simulate(scene, dt=0.02, substeps=2, **knobs)
        sim.run(3)
        return sim.position

    one = run(threads=1, execution="graph")
    assert np.array_equal(one, run(threads=2, execution="threads"))
    assert np.abs(one - places).max() > 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_some_of_the_charges(method):
    """Of a group alone; what is left over is neutralised, and a run says so."""
    scene = salt(method=method)
    scene.interactions.clear()
    scene.add_particles([(0.1, 0.1, 0.1)], charge=5.0, group="guest")
    scene.add_interaction(ps.Electrostatics(method, scene.groups[0]))
    sim = simulate(scene)
    alone = simulate(salt(method=method))
    np.testing.assert_allclose(sim.get("force")[:-1], alone.get("force"), rtol=0, atol=1e-12)
    assert not sim.get("force")[-1].any()
    scene.interactions[:] = [ps.Electrostatics(method)]
    with pytest.warns(ps.StabilityWarning, match="charges must add up to 0"):
        simulate(scene, dt=1e-6, substeps=1).run(1)


@pytest.mark.slow
def test_charges_of_atoms_in_their_units():
    """In SI, where products of charges and of their fields leave single precision."""
    e, k, d = 1.602176634e-19, 8.9875517873681764e9, 2.8e-10
    x, q, side = crystal("NaCl")
    scene = ps.Scene(periodic=((0, 0, 0), (side * d,) * 3))
    scene.add_particles(x * d, charge=q * e, mass=1e-25, radius=1e-11)
    scene.add_interaction(ps.Electrostatics("particle_mesh_ewald", constant=k))
    sim = simulate(scene, precision="float32")
    found = -2 * sim.diagnostics().potential[0] / len(q) * d / (k * e * e)
    assert found == pytest.approx(NACL, rel=2e-6)  # the tolerance, and rounding of 60 pairs each


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
        (lambda: ps.Electrostatics("particle_mesh_ewald"), "scene must be periodic along all axes"),
        (lambda: ps.Electrostatics("damped_shifted_force", cutoff=-1.0), "cutoff must be above 0"),
    ],
)
def test_what_does_not_fit_is_refused(make, message):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)], charge=[1.0, -1.0])
    with pytest.raises(ValueError, match=message):
        scene.add_interaction(make())
        simulate(scene)
