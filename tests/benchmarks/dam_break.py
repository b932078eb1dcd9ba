"""dam_break whole, as the README runs it, with its recording: a process from start to end."""

import sys

import particlesim as ps
from particlesim.accuracy.bench.case import Case, Command, Entry, Place
from particlesim.scenes import dam_break

EARLY = 36  # frames after which the front is still on its way, so that its error is known


class Run(Command):
    """``particlesim run dam_break``; what is asked at the end is found by a run beside."""

    def __init__(self, place: Place, frames: int, spacing: float, precision: str):
        knobs = {"threads": place.threads, "spacing": spacing, "precision": precision}
        self.place, self.spacing, self.precision, self.work = place, spacing, precision, frames
        super().__init__(
            [
                sys.executable, "-m", "particlesim.cli", "run", "dam_break", "--frames",
                str(frames), "--out", "dam_break.usda", "--device", place.device,
                *(word for name, value in knobs.items() for word in ("--set", f"{name}={value}")),
            ]
        )  # fmt: skip

    def answers(self) -> dict[str, float]:
        settings = dam_break.settings.replace(threads=self.place.threads, precision=self.precision)
        scene = dam_break.build(spacing=self.spacing)
        sim = ps.Simulation(scene, settings, device=self.place.device)
        sim.run(EARLY)
        return {"1 + error": 1.0 + dam_break.error(sim)}


def case(frames: int = dam_break.frames, spacing: float = 0.025) -> Case:
    """``spacing``: of the particles [m]."""
    both = ("float32", "float64")
    return Case(
        title=f"dam_break, {frames} frames recorded as USD, spacing {spacing:g}",
        unit="frames",
        ours={
            f"run, {each}": Entry(lambda place, each=each: Run(place, frames, spacing, each), each)
            for each in both
        },
        # Chaos of the splash moves the front by 1 % of its way by then.
        agree={"1 + error": 0.02},
        warm=1,
        repeats=3,
    )
