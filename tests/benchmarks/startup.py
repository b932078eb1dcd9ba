"""Starting up, whole processes: help, and a frame with a warm and with an empty kernel cache."""

import sys

from particlesim.accuracy.bench.case import Case, Command, Entry

PROGRAM = [sys.executable, "-m", "particlesim.cli"]


def command(*words: str, cold: bool = False) -> Entry:
    """The program with these words, as a whole process."""
    return Entry(lambda place: Command([*PROGRAM, *words, *on(words, place)], cold), precision="-")


def on(words: tuple[str, ...], place) -> list[str]:
    """Where a run is to run."""
    return ["--device", place.device] if words[0] == "run" else []


def case(scene: str = "pendulum", heavy: str = "dam_break") -> Case:
    """``scene``, ``heavy``: a ready scene with few kernels, and one with many."""
    return Case(
        title="processes from start to end",
        unit="processes",
        ours={
            "--help": command("--help"),
            f"{scene}, a frame, warm": command("run", scene, "--frames", "1"),
            f"{scene}, a frame, cold": command("run", scene, "--frames", "1", cold=True),
            f"{heavy}, a frame, warm": command("run", heavy, "--frames", "1"),
            f"{heavy}, a frame, cold": command("run", heavy, "--frames", "1", cold=True),
        },
        warm=1,
        repeats=3,
    )
