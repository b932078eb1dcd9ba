"""USD frames for offline rendering: what of a simulation is drawn, and how it is written."""

from .info import LinksPrim, MeshPrim, PointsPrim, Shape, StageInfo
from .recorder import UsdRecorder
from .writer import UsdWriter

__all__ = [
    "LinksPrim",
    "MeshPrim",
    "PointsPrim",
    "Shape",
    "StageInfo",
    "UsdRecorder",
    "UsdWriter",
]
