"""Finding plug-ins: the modules of a package, each of which says what KIND it is.

Adding one is adding a file; nothing is registered anywhere. Users name them by a text, which may
end in options: `KIND:ARGUMENT?name=value&name=value`.
"""

from __future__ import annotations

import pkgutil
from importlib import import_module
from types import ModuleType

from .errors import FreelookError


def modules_by_kind(package: str) -> dict[str, ModuleType]:
    """KIND to module, for every module of a package whose name has no leading underscore."""
    path = import_module(package).__path__
    names = sorted(m.name for m in pkgutil.iter_modules(path) if not m.name.startswith("_"))
    found = [import_module(f"{package}.{name}") for name in names]
    return {module.KIND: module for module in found}


def split_options(spec: str, error: type[FreelookError]) -> tuple[str, dict[str, str]]:
    """What stands before the last question mark, and the options behind it.

    `error` for what is not `name=value`, and for a name that is given twice.
    """
    head, mark, tail = spec.rpartition("?")
    if not mark:
        return spec, {}
    options: dict[str, str] = {}
    for pair in tail.split("&"):
        name, equals, value = pair.partition("=")
        if not equals or not name:
            raise error(f"'{pair}' in '{spec}' is not an option; write name=value")
        if name in options:
            raise error(f"option '{name}' is given twice in '{spec}'")
        options[name] = value
    return head, options
