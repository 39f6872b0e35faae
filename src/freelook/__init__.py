"""freelook: a gimbal with no moving parts.

A fixed fisheye camera sees everything; a virtual camera looks wherever the head points. Start
with `Camera` and `load_camera`, point a `Viewport`, and render with `freelook.renderers`.

Importing the package loads nothing heavy: each name below is fetched when first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_HOME = {
    "Camera": "camera",
    "FreelookError": "errors",
    "Viewport": "viewport",
    "body_from_view": "rotations",
    "load_camera": "formats",
    "make_camera": "camera",
}

__all__ = ["__version__", *_HOME]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
