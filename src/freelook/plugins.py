"""Finding plug-ins: the modules of a package, each of which says what KIND it is.

Adding one is adding a file; nothing is registered anywhere.
"""

from __future__ import annotations

import pkgutil
from importlib import import_module
from types import ModuleType


def modules_by_kind(package: str) -> dict[str, ModuleType]:
    """KIND to module, for every module of a package whose name has no leading underscore."""
    path = import_module(package).__path__
    names = sorted(m.name for m in pkgutil.iter_modules(path) if not m.name.startswith("_"))
    found = [import_module(f"{package}.{name}") for name in names]
    return {module.KIND: module for module in found}
