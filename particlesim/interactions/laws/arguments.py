"""How laws are bound to their arguments: particles' quantities and given values."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...scene.law import Law

# Per-particle quantities that a law may name, beside the attributes of the scene.
QUANTITIES = frozenset({"position", "velocity", "mass", "radius", "density"})
VECTORS = frozenset({"position", "velocity"})  # among them
NUMBERS = (float, wp.float32, inspect.Parameter.empty)  # as a law's parameters are written
WIDTHS = {wp.vec2: 2, wp.vec3: 3, wp.vec4: 4}


class Arguments:
    """How the parameters of a law are filled: by particles' quantities or by given values.

    Args:
        owner: For errors.
        law: The law; its first ``skip`` parameters are filled by whoever calls it.
        given: Values by keyword.
        suffixes: ``("",)`` for one particle; ``("_i", "_j")`` for a pair, whose quantities are
            named ``mass_i``, ``charge_j`` and so on.
    """

    def __init__(
        self,
        owner: str,
        law: Law,
        skip: int,
        given: Mapping[str, Any],
        suffixes: Sequence[str],
        extra: Sequence[str] = (),
    ):
        self.owner, self.law = owner, law
        self.names = list(law.parameters)[skip:]
        self.quantities: set[str] = set()
        self.values: dict[str, Any] = {}
        self.sources: list[tuple[str, str]] = []  # (quantity or parameter or extra, name)
        validate.known(owner, given, self.names, f"parameter of {law.name}")
        for name in self.names:
            suffix = next((s for s in suffixes if s and name.endswith(s)), "")
            base = name[: len(name) - len(suffix)]
            if name in given:
                self.values[name] = self.value(name, given[name])
                self.sources.append(("parameter", name))
            elif name in extra:
                self.sources.append(("extra", name))
            elif (suffix or "" in suffixes) and name not in law.defaults:
                self.quantities.add(base)
                self.sources.append((f"quantity{suffix}", base))
            elif name in law.defaults:
                self.values[name] = self.value(name, law.defaults[name])
                self.sources.append(("parameter", name))
            else:
                raise validate.fail(
                    owner,
                    name,
                    f"be given, as {law.name}({', '.join(law.parameters)}) asks for it",
                    None,
                    f"pass {name}=..., or name a particle's quantity"
                    + (f" ({' or '.join('mass' + s for s in suffixes)})" if suffixes else ""),
                )

    def check(self, attributes: Mapping[str, Any]) -> None:
        """All quantities exist in the scene, and are what the law takes them for."""
        for name in sorted(self.quantities):
            if name not in QUANTITIES and name not in attributes:
                allowed = sorted({*QUANTITIES, *attributes} - {"pinned"})
                raise ValueError(
                    f"{self.owner}: {name} must be given or be one of the particles' "
                    f"{', '.join(allowed)}, got nothing; pass {name}=... or "
                    f"add_particles(..., {name}=...)."
                )
        for parameter, (kind, name) in zip(self.names, self.sources, strict=True):
            if kind.startswith("quantity"):
                width = attributes.get(name, 3 if name in VECTORS else None)
                if width is None or isinstance(width, int):
                    self._check_type(parameter, width)

    def _check_type(self, parameter: str, width: int | None) -> None:
        """The parameter is of that width; None: a number."""
        kind = self.law.parameters[parameter]
        number, vector = kind in NUMBERS or kind is int, WIDTHS.get(kind)
        if (width is None and vector) or (width is not None and number):
            wanted = "float" if width is None else f"wp.vec{width}"
            raise validate.fail(
                self.owner, f"law {self.law.name}", f"take {parameter} as {wanted}",
                "float" if number else f"wp.vec{vector}", f"write {parameter}: {wanted}",
            )  # fmt: skip

    def source(
        self,
        index: Mapping[str, str],
        extra: Mapping[str, str] | None = None,
        read: str = "d.{0}[{1}]",
    ) -> list[str]:
        """Source text of each argument.

        Args:
            index: The particle's index, by suffix.
            extra: The text of what whoever calls fills in, by name.
            read: How an array is read, of its name and an index.
        """
        text = []
        for parameter, (kind, name) in zip(self.names, self.sources, strict=True):
            if kind == "parameter":
                text.append(f"p.{name}")
            elif kind == "extra":
                text.append((extra or {})[name])
            else:
                field = "x" if name == "position" else name
                value = read.format(field, index[kind.removeprefix("quantity")])
                # Arrays hold no whole numbers, but such as are whole.
                text.append(f"int({value})" if self.law.parameters[parameter] is int else value)
        return text

    def value(self, name: str, value: Any) -> Any:
        """A parameter's value, checked: whole, a number or a vector."""
        if self.law.parameters[name] is int:
            return np.int32(validate.whole(self.owner, name, value, minimum=-(2**31)))
        if self.law.parameters[name] is wp.vec3:
            return validate.vector(self.owner, name, value)
        if np.ndim(value) == 0:
            return validate.number(self.owner, name, value)
        if self.law.parameters[name] in NUMBERS:
            raise validate.fail(
                self.owner, name, f"be a number, as {self.law.name} takes it", value,
                f"give one, or write {name}: wp.vec3 there",
            )  # fmt: skip
        return validate.vector(self.owner, name, value)
