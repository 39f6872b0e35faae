"""What files of corners say, and what the user adds where they do not."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from ...calibration.views import View
from ...errors import CalibrationError, SourceError
from ...lens import Floats

if TYPE_CHECKING:
    from ...calibration.targets import Target


@dataclass
class Corners:
    """views; size (width, height) of all pictures; names of pictures without the target."""

    views: list[View]
    size: tuple[int, int]
    without: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Choice:
    """What the user says about files that say less: the target, the pictures' size."""

    target: Target | None = None
    size: tuple[int, int] | None = None

    def points(self, name: str) -> Floats:
        """(n, 3) of the target; CalibrationError if it is not known well enough."""
        if self.target is None:
            raise CalibrationError(f"{name}: which target is it? give --target or --board")
        try:
            return self.target.points
        except CalibrationError as error:
            raise CalibrationError(f"{name} does not say what target it is: {error}") from None

    def size_of(self, name: str, picture: str) -> tuple[int, int]:
        """Of the pictures of a file: as the user says, or that of one of them if it is here."""
        if self.size is not None:
            return self.size
        for path in (Path(picture), Path(name).parent / picture):
            if size := _size_of(path):
                return size
        raise CalibrationError(
            f"{name} does not say how large its pictures are, and {picture} is not here; give "
            "--size WIDTHxHEIGHT"
        )


def _size_of(path: Path) -> tuple[int, int] | None:
    from ...media.pictures import is_picture, read_picture

    try:
        if not (is_picture(path.name) and path.is_file()):
            return None
        height, width = read_picture(str(path)).picture.planes[0].shape[:2]
    except (OSError, ValueError, SourceError):  # a name that no file can have; no picture
        return None
    return width, height
