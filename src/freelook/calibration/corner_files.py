"""Corners that another program found, as text files."""

from __future__ import annotations

from collections.abc import Sequence

from .views import View


def is_corner_file(name: str) -> bool:
    """By its name."""
    return name.lower().endswith((".orpc", ".vnl"))


def read_corner_files(names: Sequence[str]) -> tuple[list[View], tuple[int, int]]:
    raise NotImplementedError
