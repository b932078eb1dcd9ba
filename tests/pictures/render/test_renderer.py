"""How shapes are lit, that pictures are the same everywhere, and files of them."""

import io

import numpy as np
import pytest
from PIL import Image as Pillow

import particlesim as ps
from particlesim.output import colors
from particlesim.pictures.render import look as looks
from particlesim.pictures.render import screen
from particlesim.pictures.render.geometry import Geometry
from particlesim.pictures.render.image import Image
from particlesim.pictures.render.look import Look
from particlesim.pictures.render.renderer import Renderer

from .shapes import CAMERA, FOCUS, HEIGHT, PLAIN, WHITE, WIDTH, shapes, spheres


def lit(normal, up=(0, 1, 0), key=1.0, axes=CAMERA.axes):
    """Light on a white surface, by the formula, linear."""
    height = 0.5 + 0.5 * np.dot(normal, up)
    sky = (1 - height) * np.array(looks.BOUNCE) + height * np.array(looks.SKY)
    towards = Look(up=up).key_direction(axes)
    return sky + key * max(np.dot(normal, towards), 0.0) * np.array(looks.KEY)


@pytest.mark.parametrize("pixel", [(120, 160), (100, 150), (130, 175), (110, 180)])
def test_a_sphere_is_lit_by_its_normal(draw, pixel):
    picture = draw(spheres((0, 0, 0), 1.5, (0.8, 0.5, 0.3)), Look(**PLAIN))
    row, column = pixel
    ray = np.array([column + 0.5 - WIDTH / 2, HEIGHT / 2 - row - 0.5, -FOCUS]) / FOCUS
    # |o + s d|^2 = r^2 from o = (0, 0, 10).
    b, a = ray @ CAMERA.position, ray @ ray
    s = (-b - np.sqrt(b**2 - a * (100 - 1.5**2))) / a
    normal = (CAMERA.position + s * ray) / 1.5
    expected = 255 * colors.encoded(np.clip(np.array([0.8, 0.5, 0.3]) * lit(normal), 0, 1))
    np.testing.assert_allclose(picture.array[row, column], expected, atol=0.6)  # rounded to whole


def test_a_shadow_leaves_the_sky_only(draw):
    camera = ps.Camera((0, 8, 6), (0, 0, 0), field_of_view=40.0)
    ground = Look(ground=-1.0, occlusion=False, gloss=0.0)
    picture = draw(spheres((0, 0.5, 0), 0.5), ground, camera=camera).array
    towards = ground.key_direction(camera.axes)
    up, center = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.5, 0.0])
    shadow = center - towards * 1.5 / towards[1]
    for place, key in ((shadow, 0.0), (shadow + np.array([-2.0, 0, 0]), 1.0)):
        x, y, z = camera.axes @ (place - camera.position)
        row, column = int(HEIGHT / 2 + y / z * FOCUS), int(WIDTH / 2 - x / z * FOCUS)
        # The ground fades between 1.2 and 4 radii of what is around the shapes.
        off = (np.linalg.norm(place - center) / (2.0 * np.sqrt(3.0)) - 0.3) / 0.7
        fade = np.clip(off, 0, 1) ** 2 * (3 - 2 * np.clip(off, 0, 1))
        seen = np.array(looks.GROUND) * lit(up, key=key, axes=camera.axes)
        expected = (1 - fade) * seen + fade * np.array(looks.BACKGROUND)
        # A pixel's middle is up to half a pixel, 0.02, from the place; fading is 0.5 a unit.
        found = colors.decoded(picture[row, column] / 255.0)
        np.testing.assert_allclose(found, expected, atol=0.015)


def test_only_what_has_neighbours_is_closed_in(draw):
    one = spheres((0, 0, 0), 1.0)
    dark, light = ({"shadows": False, "occlusion": on} for on in (True, False))
    np.testing.assert_array_equal(draw(one, Look(**dark)).array, draw(one, Look(**light)).array)
    two = spheres([(-1, 0, 0), (1, 0, 0)], 1.0)
    with_it, without = (draw(two, Look(**each)).array.astype(int) for each in (dark, light))
    assert (with_it <= without).all()
    middle = with_it[115:125, 156:164] - without[115:125, 156:164]
    side = with_it[115:125, 96:104] - without[115:125, 96:104]
    assert middle.min() < -10 and (side == 0).all()


def test_a_veil_lets_part_through(draw):
    geometry = shapes(spheres=([(0, 0, 0)], 1.0, WHITE))
    square = np.array([[-9, -9, 3], [9, -9, 3], [9, 9, 3], [-9, 9, 3]])
    for height, opacity in ((0.0, 0.25), (-6.0, 0.9)):  # the second is behind the sphere
        geometry.add_triangles(
            square + np.array([0, 0, height]), [(0, 1, 2), (0, 2, 3)], (1, 0, 0), None, opacity
        )
    picture = colors.decoded(draw(geometry).array / 255.0)
    middle, corner = picture[HEIGHT // 2, WIDTH // 2], picture[5, 5]
    # Levels of 255 are up to 0.009 apart in the light.
    np.testing.assert_allclose(middle, [1.0, 0.75, 0.75], atol=0.005)
    np.testing.assert_allclose(corner, [1 - 0.75 * 0.1, 0, 0], atol=0.005)


@pytest.fixture(scope="module")
def crowd():
    """Spheres, cones and triangles in one another's way, and veils."""
    rng = np.random.default_rng(0)
    geometry = spheres(
        rng.uniform(-3, 3, (3000, 3)), rng.uniform(0.01, 0.3, 3000), rng.random((3000, 3))
    )
    geometry.add_cones(
        *rng.uniform(-3, 3, (2, 100, 3)), rng.uniform(0, 0.2, (100, 2)), (0.5, 0.2, 0.1)
    )
    geometry.add_cones([(-3, -3, -3)], [(3, 3, 3)], 0.05, (0, 0, 0), casts_shadow=False)
    geometry.add_triangles(
        rng.uniform(-3, 3, (60, 3)), np.arange(60).reshape(-1, 3), (0.1, 0.6, 0.3)
    )
    geometry.add_triangles(
        rng.uniform(-3, 3, (9, 3)), np.arange(9).reshape(-1, 3), WHITE, None, 0.3
    )
    return geometry


def test_the_picture_is_the_same_on_any_number_of_threads(crowd, draw, monkeypatch):
    look = Look(ground=-3.0)
    reference = draw(crowd, look).array
    assert np.ptp(reference) > 150
    for threads in (1, 2, 5):
        other = Renderer("cpu", threads)
        np.testing.assert_array_equal(
            other.draw(crowd, CAMERA, WIDTH, HEIGHT, look).array, reference
        )
        other.close()
    monkeypatch.setattr(screen, "MOST_PAIRS", 500)  # many parts, the last pictures' veils too
    np.testing.assert_array_equal(draw(crowd, look).array, reference)


def test_the_picture_is_the_same_on_every_device(crowd, draw, device):
    other = Renderer(device).draw(crowd, CAMERA, WIDTH, HEIGHT, Look(ground=-3.0)).array
    # Roundings differ, and may turn a sample at an edge to the other shape.
    differs = np.abs(other.astype(int) - draw(crowd, Look(ground=-3.0)).array).max(axis=2) > 2
    assert differs.mean() < 1e-3


@pytest.mark.parametrize("supersample", [1, 2, 4])
@pytest.mark.parametrize("size", [(1, 1), (17, 33), (33, 17)])
def test_any_size_can_be_drawn(crowd, draw, size, supersample):
    width, height = size
    picture = draw(crowd, Look(supersample=supersample), width=width, height=height)
    assert picture.array.shape == (height, width, 3)


def test_a_png_holds_the_picture(crowd, draw, tmp_path, refused):
    picture = draw(crowd, Look())
    picture.save(tmp_path / "a.png")
    for source in (tmp_path / "a.png", io.BytesIO(picture._repr_png_())):
        np.testing.assert_array_equal(np.asarray(Pillow.open(source)), picture.array)
    with refused("exists", FileExistsError):
        picture.save(tmp_path / "a.png")
    picture.save(tmp_path / "a.png", overwrite=True)
    with refused("png"):
        picture.save(tmp_path / "a.bmp")
    with refused("folder", FileNotFoundError):
        picture.save(tmp_path / "none" / "a.png")
    assert [each.name for each in tmp_path.iterdir()] == ["a.png"]


def test_a_missing_pillow_is_named(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "PIL", None)
    with pytest.raises(ImportError, match=r"particlesim\[render\]"):
        Image(np.zeros((2, 2, 3), dtype=np.uint8))._repr_png_()


@pytest.mark.parametrize(
    "arguments",
    [{"supersample": 3}, {"background": (2, 0, 0)}, {"up": (0, 0, 0)}, {"gloss": -1}],
)
def test_a_look_refuses_what_makes_no_sense(arguments, refused):
    with refused(next(iter(arguments))):
        Look(**arguments)


def test_sizes_are_refused(draw, refused):
    with refused("width"):
        draw(Geometry(), width=0)
    with refused("height must be at most 8192"):
        draw(Geometry(), height=9000)


@pytest.mark.slow
def test_a_preview_of_50_000_spheres_is_quick():
    import time

    rng = np.random.default_rng(0)
    geometry = spheres(rng.uniform(0, 1, (50_000, 3)) * (2, 1, 1), 0.017, rng.random((50_000, 3)))
    camera = ps.Camera.around(geometry.points()[0], (0, 1, 0), 16 / 9)
    renderer, times = Renderer("cpu"), []
    for _ in range(8):
        start = time.process_time()
        renderer.draw(geometry, camera, 1280, 720, Look(ground=0.0))
        times.append(time.process_time() - start)
    assert min(times) < 2 * 0.3  # of all threads together: 0.3 s on two cores
