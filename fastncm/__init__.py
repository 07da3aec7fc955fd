"""fastncm: contact of compliant fingers by nonlinear constrained minimisation (Lan & Lee 2008).

Units are SI, angles radians. Names are loaded when they are first used, so that importing is cheap.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fastncm.cases import solve_cases
    from fastncm.curve import solve
    from fastncm.curve_base import Curve
    from fastncm.errors import FastNcmError, SceneError, SweepError
    from fastncm.scene import Scene, load_scene
    from fastncm.sweeping import Design, Study, load, sweep

__version__ = "0.1.0"

_HOMES = {
    "Curve": "curve_base",
    "Design": "sweeping",
    "FastNcmError": "errors",
    "Scene": "scene",
    "SceneError": "errors",
    "Study": "sweeping",
    "SweepError": "errors",
    "load": "sweeping",
    "load_scene": "scene",
    "solve": "curve",
    "solve_cases": "cases",
    "sweep": "sweeping",
}
__all__ = [
    "Curve",
    "Design",
    "FastNcmError",
    "Scene",
    "SceneError",
    "Study",
    "SweepError",
    "load",
    "load_scene",
    "solve",
    "solve_cases",
    "sweep",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'fastncm' has no attribute {name!r}")
    return getattr(import_module(f"fastncm.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
