"""The README's pictures come out of the commands that stand under them."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from particlesim.cli import main

Image = pytest.importorskip("PIL.Image")
ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
# An image, and the indented block of commands that follows it.
PICTURES = re.findall(r"!\[[^\]]*\]\((\S+\.png)\)\n\n((?:    .+\n)+)", README)
SLOW = {"dam_break", "star_collision", "tradeoff"}  # minutes on a machine that is busy


def picture(path):
    """A picture as blocks of 20 x 20 pixels, (h, w, 3) in 0..1."""
    with Image.open(path) as image:
        small = image.convert("RGB").resize((32, 18), Image.Resampling.BOX)
    return np.asarray(small, dtype=float) / 255


@pytest.mark.parametrize(
    ("path", "commands"),
    [
        pytest.param(
            path, commands, id=Path(path).stem,
            marks=[pytest.mark.slow] * any(name in path for name in SLOW),
        )
        for path, commands in PICTURES
    ],
)  # fmt: skip
def test_a_picture_is_made_by_its_command(path, commands, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for line in commands.splitlines():
        program, *words = shlex.split(line)
        assert program == "particlesim"
        assert main(words) == 0
    made = tmp_path / Path(path).name
    with Image.open(made) as new, Image.open(ROOT / path) as old:
        assert new.size == old.size
    # Machines round differently, and what is chaotic ends differently in detail.
    assert np.abs(picture(made) - picture(ROOT / path)).mean() < 0.02


def test_pictures_are_small_and_all_shown():
    shown = {path for path, _ in PICTURES}
    there = {str(path.relative_to(ROOT)) for path in (ROOT / "scenes" / "pictures").iterdir()}
    assert shown == there
    assert sum((ROOT / path).stat().st_size for path in shown) < 1_000_000
