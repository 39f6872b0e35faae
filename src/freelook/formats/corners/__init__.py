"""Corners that other programs found, in their files. One file per format.

A format has `SUFFIXES` and `read(name, choice) -> Corners`; the first line of its docstring is its
row in the documentation. Whatever is wrong is a CalibrationError that says where.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from ...calibration.views import View
from ...errors import CalibrationError
from ._corners import Choice, Corners

if TYPE_CHECKING:
    from ...calibration.targets import Target

__all__ = ["FORMATS", "Choice", "Corners", "corner_format", "is_corner_file", "read_corner_files"]

FORMATS = ("orpc", "opencv", "vnl", "table")


def corner_format(name: str) -> ModuleType | None:
    """The module that reads a file of that name, by its ending."""
    suffix = Path(name).suffix.lower()
    modules = (import_module(f".{format_name}", __name__) for format_name in FORMATS)
    return next((module for module in modules if suffix in module.SUFFIXES), None)


def is_corner_file(name: str) -> bool:
    """By its name."""
    return corner_format(name) is not None


def read_corner_files(
    names: Sequence[str], target: Target | None = None, size: tuple[int, int] | None = None
) -> Corners:
    """The views in the files, in this order.

    target  whose points the corners are, for files that do not say where they are on it
    size    of the pictures, for files that do not say it and whose pictures are not here

    CalibrationError names the file and line that cannot be read, and files of another size.
    """
    views: list[View] = []
    without: list[str] = []
    common: tuple[int, int] | None = None
    for name in names:
        module = corner_format(name)
        if module is None:
            raise CalibrationError(f"{name}: not a file of corners by its ending")
        found: Corners = module.read(name, Choice(target, size))
        if common is not None and found.size != common:
            raise CalibrationError(
                f"{name}: its pictures are {found.size[0]} x {found.size[1]} pixels, those before "
                f"it {common[0]} x {common[1]}; a lens is calibrated for one size"
            )
        common = found.size
        views += found.views
        without += found.without
    if common is None:
        raise CalibrationError("no file of corners to read")
    return Corners(views, common, without)
