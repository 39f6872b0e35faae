"""What a format gives and takes: a camera with its name, its source and what should be told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..camera import Camera
from ..errors import ProfileError


@dataclass(frozen=True)
class Profile:
    """A camera as a file describes it.

    name, source  for people: which lens it is, where the numbers come from
    notes         what a user should be told: what was not taken over, how good the numbers are
    """

    camera: Camera
    name: str = ""
    source: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Choice:
    """What a user adds to a file that alone does not say everything.

    pick  which of several cameras in one file (after `#` in `file.yaml#cam1`)
    size  (width, height) of the picture, for formats that do not say it
    """

    pick: str | None = None
    size: tuple[int, int] | None = None

    def of(self, names: Sequence[str]) -> int:
        """The index of the picked one; ProfileError that lists them unless it is clear."""
        if self.pick is None:
            if len(names) == 1:
                return 0
            raise ProfileError(
                f"{len(names)} cameras in one file: add which one, as in FILE#{names[0]}; "
                f"there are: {', '.join(names)}"
            )
        if self.pick not in names:
            raise ProfileError(f"no camera '{self.pick}' in it; there are: {', '.join(names)}")
        return list(names).index(self.pick)

    def needed_size(self, why: str) -> tuple[int, int]:
        """The picture's size, or ProfileError saying why it has to be told."""
        if self.size is None:
            raise ProfileError(f"{why}; tell the picture's size: --lens-size WIDTHxHEIGHT")
        return self.size
