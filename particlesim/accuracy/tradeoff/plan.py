"""What a sweep simulates: a build, its settings, and every combination of what is varied."""

from __future__ import annotations

import dataclasses
import inspect
import itertools
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from ... import validate
from ...instruments.stability.check import automatic
from ...scene.settings import Settings
from ...simulation.simulation import Simulation

OWNER = "tradeoff"
FRAMES = 240  # where neither the caller nor the scene's module says how many
KNOBS = tuple(field.name for field in dataclasses.fields(Settings))


@dataclass(frozen=True)
class Plan:
    """One setting of a sweep: the values that vary, and what they lead to."""

    values: dict[str, Any]
    options: dict[str, Any]
    settings: Settings
    frames: int


class Study:
    """A scene to be simulated in many ways, always over the same simulated time.

    Args:
        build: ``build(**options) -> Scene``. If it is the ``build`` of a scene module, that
            module's ``settings``, ``frames`` and ``error`` hold where nothing else is given.
        settings: The knobs that do not vary.
        options: Options of ``build`` that do not vary.
        frames: Of ``settings.dt``; where dt varies, the simulated time stays.
        device: As for Simulation.
    """

    def __init__(
        self,
        build: Callable[..., Any],
        settings: Settings | None,
        options: Mapping[str, Any] | None,
        frames: int | None,
        device: Any,
    ):
        if not callable(build):
            raise TypeError(
                f"{OWNER}: build must be a function that returns a Scene, got {build!r}; "
                "pass the function itself."
            )
        module = sys.modules.get(getattr(build, "__module__", None) or "")
        if getattr(module, "build", None) is not build:
            module = None
        self.build, self.device, self.module = build, device, module
        name = getattr(build, "__name__", "scene") if module is None else module.__name__
        self.label = name.rpartition(".")[2].removeprefix("scene_")
        self.settings = getattr(module, "settings", Settings()) if settings is None else settings
        if not isinstance(self.settings, Settings):
            raise TypeError(
                f"{OWNER}: settings must be a Settings, got {self.settings!r}; use Settings(...)."
            )
        self.parameters = inspect.signature(build).parameters
        self.options: dict[str, Any] = {}
        self.options = self.split(options or {}, "options", knobs=())[0]
        self.settings = self._chosen(self.settings, self.options)
        wanted = getattr(module, "frames", FRAMES)
        self.frames = validate.whole(OWNER, "frames", wanted if frames is None else frames)
        self.duration = self.frames * self.settings.dt
        if not self.duration > 0:
            raise validate.fail(
                OWNER, "frames times settings.dt", "be above 0 [s]", self.duration,
                "an error and a cost need some time to show",
            )  # fmt: skip
        # The scene's answer is known for the scene's own frames.
        self.known = getattr(module, "error", None)
        self.known_here = self.known is not None and self.frames == wanted

    def split(
        self, values: Mapping[str, Any], argument: str, knobs: Iterable[str] = KNOBS
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Divide values into options of ``build`` and knobs; a name that is both is an option."""
        kinds = {each.kind for each in self.parameters.values()}
        named = [
            name
            for name, each in self.parameters.items()
            if each.kind in (each.POSITIONAL_OR_KEYWORD, each.KEYWORD_ONLY)
        ]
        options, chosen = {}, {}
        for name, value in values.items():
            if name in named:
                self._check_kind(name, value, argument)
                options[name] = value
            elif name in knobs:
                chosen[name] = value
            elif inspect.Parameter.VAR_KEYWORD in kinds:
                options[name] = value
            else:
                what = f"an option of {self.label} ({', '.join(named) or 'none'})"
                what += f" or a setting ({', '.join(knobs)})" if knobs else ""
                raise ValueError(
                    f"{OWNER}: {argument} must name {what}, got {name!r}; "
                    f"{validate.suggest(name, [*named, *knobs])}."
                )
        return options, chosen

    def _check_kind(self, name: str, value: Any, argument: str) -> None:
        """Refuse text where ``build`` has a number, before it fails somewhere inside."""
        default = self.parameters[name].default
        if isinstance(default, int | float) and isinstance(value, str):
            raise validate.fail(
                OWNER, f"{argument} {name}", "be a number", value, f"its default is {default!r}"
            )

    def plan(self, values: Mapping[str, Any], argument: str = "vary") -> Plan:
        """The plan of these values, over the study's simulated time."""
        options, knobs = self.split(values, argument)
        options = {**self.options, **options}
        settings = self._chosen(self.settings.replace(**knobs), options)
        exact = self.duration / settings.dt if settings.dt else 0.0
        frames = round(exact)
        if frames < 1 or abs(frames - exact) > 1e-6 * exact:
            raise validate.fail(
                OWNER, f"{argument} dt", f"divide the simulated time, {self.duration:g} s",
                settings.dt, "choose whole fractions of it, or other frames",
            )  # fmt: skip
        return Plan(dict(values), options, settings, frames)

    def _chosen(self, settings: Settings, options: dict[str, Any]) -> Settings:
        """The settings, with what is "auto" as the scene's simulation chooses it."""
        if not settings.automatic:
            return settings
        return automatic([self.build(**options)], settings, self.device)

    def plans(self, vary: Mapping[str, Iterable[Any]]) -> list[Plan]:
        """Every combination of the values of ``vary``; the last name varies fastest."""
        if not isinstance(vary, Mapping) or not vary:
            raise validate.fail(
                OWNER, "vary", "be a dict of lists", vary, "pass {'substeps': [1, 2, 5]}, say"
            )
        columns = {}
        for name, values in vary.items():
            if isinstance(values, str) or not isinstance(values, Iterable):
                raise validate.fail(
                    OWNER, f"vary[{name!r}]", "be a list of values", values, "put it in a list"
                )
            columns[name] = [each.item() if hasattr(each, "item") else each for each in values]
            if not columns[name]:
                raise validate.fail(
                    OWNER, f"vary[{name!r}]", "hold a value", columns[name], "give it some"
                )
        return [
            self.plan(dict(zip(columns, combination, strict=True)))
            for combination in itertools.product(*columns.values())
        ]

    def simulation(self, plan: Plan) -> Simulation:
        """A simulation of a plan, at its start."""
        return Simulation(self.build(**plan.options), plan.settings, device=self.device)
