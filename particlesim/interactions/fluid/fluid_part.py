"""What equations of state and viscosities share: parts of a fluid that are given by laws."""

from __future__ import annotations

from typing import Any

from ...scene.law import Law


class FluidPart:
    """Base of what an ``SPH`` is made of: a member gives its laws, and the values they are fed."""

    law_names: tuple[str, ...]
    parameters: dict[str, Any]

    @property
    def name(self) -> str:
        """What reports and errors call it."""
        return type(self).__name__

    @property
    def laws(self) -> dict[str, Law]:
        """The laws by name."""
        return {name: getattr(self, name) for name in self.law_names}
