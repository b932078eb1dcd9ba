"""Study: a scene to be simulated in many ways, always over the same simulated time."""

from __future__ import annotations

import dataclasses
import inspect
import itertools
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from .. import validate
from ..engine.model import batch
from ..instruments.stability import automatic
from ..output.progress import label
from ..scene.scene import Scene
from ..scene.settings import Settings
from ..simulation.simulation import Simulation

FRAMES = 240  # where neither the caller nor the scene's module says how many
KNOBS = tuple(field.name for field in dataclasses.fields(Settings))
SEED = "seed"  # the option of build that makes another of the same kind


@dataclass(frozen=True)
class Plan:
    """One way to simulate a scene: the values that vary, and what they lead to."""

    values: dict[str, Any]
    options: dict[str, Any]
    settings: Settings
    frames: int


class Study:
    """A scene that is to be simulated in many ways.

    Args:
        owner: Whom errors name.
        build: ``build(**options) -> Scene``. If it is the ``build`` of a scene module, that
            module's ``settings``, ``frames`` and ``error`` hold where nothing else is given.
        settings: The knobs that do not vary.
        options: Options of ``build`` that do not vary.
        frames: Of ``settings.dt``; where dt varies, the simulated time stays.
        device, worlds: As for Simulation.
        seeds: How many seeds errors are of, or which, where ``build`` has an option ``seed`` that
            is not given; otherwise there is one.
    """

    def __init__(
        self,
        owner: str,
        build: Callable[..., Any],
        settings: Settings | None = None,
        options: Mapping[str, Any] | None = None,
        frames: int | None = None,
        device: Any = None,
        worlds: int | None = None,
        seeds: int | Iterable[int] = 1,
    ):
        if not callable(build):
            raise TypeError(
                f"{owner}: build must be a function that returns a Scene, got {build!r}; "
                "pass the function itself."
            )
        module = sys.modules.get(getattr(build, "__module__", None) or "")
        if getattr(module, "build", None) is not build:
            module = None
        self.owner, self.build, self.device, self.worlds = owner, build, device, worlds
        self.label = label(build if module is None else module)
        self.given = getattr(module, "settings", Settings()) if settings is None else settings
        if not isinstance(self.given, Settings):
            raise TypeError(
                f"{owner}: settings must be a Settings, got {self.given!r}; use Settings(...)."
            )
        self.options = self.split(options or {}, "options", knobs=())[0]
        self.seeds = self._seeds(seeds)
        self.settings = self._chosen(self.given, self.options)
        wanted = getattr(module, "frames", FRAMES)
        self.frames = validate.whole(owner, "frames", wanted if frames is None else frames)
        self.duration = self.frames * self.settings.dt
        # The scene's answer is known for the scene's own frames.
        self.known = getattr(module, "error", None)
        self.known_here = self.known is not None and self.frames == wanted

    def _seeds(self, given: int | Iterable[int]) -> list[int]:
        """The seeds, or none where there is nothing to choose."""
        first = options_of(self.build).get(SEED)
        if SEED in self.options or not isinstance(first, int):
            return []
        if isinstance(given, Iterable):
            return [validate.whole(self.owner, "seeds", each) for each in given]
        count = validate.whole(self.owner, "seeds", given, minimum=1)
        return [first + k for k in range(count)]

    def replace(self, **changes: Any) -> Study:
        """The same scene over other ``frames``, or with other ``seeds``."""
        given = {"frames": self.frames, "seeds": self.seeds or 1, **changes}
        return Study(self.owner, self.build, self.given, self.options, device=self.device, **given)

    def alone(self) -> Study:
        """This study with its first seed only."""
        return self.replace(seeds=self.seeds[:1] or 1)

    def split(
        self, values: Mapping[str, Any], argument: str, knobs: Iterable[str] = KNOBS
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Divide values into options of ``build`` and knobs (see :func:`split`)."""
        return split(self.build, self.label, values, f"{self.owner}: {argument}", knobs)

    def lists(self, vary: Mapping[str, Iterable[Any]]) -> dict[str, list[Any]]:
        """What varies, checked, as plain values."""
        found = {}
        for name, values in vary.items():
            if isinstance(values, str) or not isinstance(values, Iterable):
                raise validate.fail(
                    self.owner, f"vary[{name!r}]", "be a list of values", values, "put it in a list"
                )
            found[name] = [each.item() if hasattr(each, "item") else each for each in values]
            if not found[name]:
                raise validate.fail(
                    self.owner, f"vary[{name!r}]", "hold a value", found[name], "give it some"
                )
        return found

    def plan(self, values: Mapping[str, Any], argument: str = "vary") -> Plan:
        """The plan of these values, over the study's simulated time."""
        if not self.duration > 0:
            raise validate.fail(
                self.owner, "frames times settings.dt", "be above 0 [s]", self.duration,
                "an error and a cost need some time to show",
            )  # fmt: skip
        options, knobs = self.split(values, argument)
        options = {**self.options, **options}
        settings = self._chosen(self.settings.replace(**knobs), options)
        exact = self.duration / settings.dt if settings.dt else 0.0
        frames = round(exact)
        if frames < 1 or abs(frames - exact) > 1e-6 * exact:
            raise validate.fail(
                self.owner, f"{argument} dt", f"divide the simulated time, {self.duration:g} s",
                settings.dt, "choose whole fractions of it, or other frames",
            )  # fmt: skip
        return Plan(dict(values), options, settings, frames)

    def plans(self, vary: Mapping[str, Iterable[Any]]) -> list[Plan]:
        """Every combination of the values of ``vary``; the last name varies fastest."""
        if not isinstance(vary, Mapping) or not vary:
            raise validate.fail(
                self.owner, "vary", "be a dict of lists", vary, "pass {'substeps': [1, 2, 5]}, say"
            )
        lists = self.lists(vary)
        return [
            self.plan(dict(zip(lists, combination, strict=True)))
            for combination in itertools.product(*lists.values())
        ]

    def scenes(self, options: Mapping[str, Any]) -> list[Scene]:
        """The scenes, one a world; of the first seed where none is given."""
        seed = {SEED: self.seeds[0]} if self.seeds else {}
        return batch(self.build(**{**seed, **options}), self.worlds)

    def simulation(self, plan: Plan) -> Simulation:
        """A simulation of a plan, at its start."""
        return Simulation(self.scenes(plan.options), plan.settings, device=self.device)

    def batch(self, plan: Plan) -> Simulation:
        """A simulation of a plan with a world for each seed, at its start."""
        seeds = self.seeds if SEED not in plan.options else []
        each = [{SEED: seed, **plan.options} for seed in seeds] or [plan.options]
        scenes = [scene for options in each for scene in self.scenes(options)]
        return Simulation(scenes, plan.settings, device=self.device)

    def _chosen(self, settings: Settings, options: dict[str, Any]) -> Settings:
        """The settings, with what is "auto" as the scene's simulation chooses it."""
        if not settings.automatic:
            return settings
        return automatic(self.scenes(options), settings, self.device)


def options_of(build: Callable[..., Any]) -> dict[str, Any]:
    """The options of ``build`` by name, and their defaults, or ``inspect.Parameter.empty``."""
    return {
        name: each.default
        for name, each in inspect.signature(build).parameters.items()
        if each.kind in (each.POSITIONAL_OR_KEYWORD, each.KEYWORD_ONLY)
    }


def split(
    build: Callable[..., Any],
    scene: str,
    values: Mapping[str, Any],
    argument: str,
    knobs: Iterable[str] = KNOBS,
    no_numbers: tuple[type, ...] = (str,),
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Divide values into options of ``build`` and knobs; a name that is both is an option.

    Args:
        build: Makes the scene.
        scene: Its name.
        values: By name.
        argument: Where they come from, as errors say it.
        knobs: Names that may be given beside the options.
        no_numbers: What is refused for an option that is a number by default, before it fails
            somewhere inside.

    Raises:
        ValueError: A name that is neither, or no number where there is to be one.
    """
    named = options_of(build)
    kinds = {each.kind for each in inspect.signature(build).parameters.values()}
    options, chosen = {}, {}
    for name, value in values.items():
        if name in named:
            default = named[name]
            if isinstance(default, int | float) and isinstance(value, no_numbers):
                kind = "true or false" if isinstance(default, bool) else "a number"
                raise ValueError(
                    f"{argument} {name} must be {kind}, got {value!r}; its default is {default!r}."
                )
            options[name] = value
        elif name in knobs:
            chosen[name] = value
        elif inspect.Parameter.VAR_KEYWORD in kinds:
            options[name] = value
        else:
            what = f"an option of {scene} ({', '.join(named) or 'none'})"
            what += f" or a setting ({', '.join(knobs)})" if knobs else ""
            raise ValueError(
                f"{argument} must name {what}, got {name!r}; "
                f"{validate.suggest(name, [*named, *knobs])}."
            )
    return options, chosen
