"""What equations of state and viscosities share: parts of a fluid that are given by laws."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from ...scene.law import Law, law


class FluidPart:
    """Base of what an ``SPH`` is made of: a member gives its laws, and the values they are fed."""

    law_names: tuple[str, ...]
    parameters: Mapping[str, Any] = MappingProxyType({})

    @property
    def name(self) -> str:
        """What reports and errors call it."""
        return type(self).__name__

    @property
    def laws(self) -> dict[str, Law]:
        """The laws by name.

        Raises:
            TypeError: One is missing, or no function.
        """
        for name in self.law_names:
            if not hasattr(self, name):
                wanted = ", ".join(self.law_names)
                raise TypeError(f"{self.name}: laws must be {wanted}, got no {name}; give it one.")
        return {name: law(getattr(self, name)) for name in self.law_names}
