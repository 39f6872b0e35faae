"""Views of a calibration target from what people have: pictures, a video, files of corners."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from ..calibration.choice import differing, moved_px
from ..calibration.mistakes import is_blurred
from ..calibration.targets import Gray, Target
from ..calibration.views import View
from ..errors import CalibrationError
from ._bars import bar

MOST_FRAMES = 300  # of a video that are searched
MOST_VIEWS = 40  # of a video that are kept
MOST_MISSED = 3  # pictures without the target that are kept
STILL_PX = 1.0  # between two frames that follow each other


@dataclass
class Found:
    """What was found where.

    pictures  of the views, by name: gray; for reports
    without   names of pictures without the target
    missed    the first few of these, by name
    blurred   names of pictures that are blurred, with the target or without
    size      of all pictures
    """

    views: list[View] = field(default_factory=list)
    pictures: dict[str, Gray] = field(default_factory=dict)
    without: list[str] = field(default_factory=list)
    missed: dict[str, Gray] = field(default_factory=dict)
    blurred: list[str] = field(default_factory=list)
    size: tuple[int, int] | None = None

    def add(self, name: str, gray: Gray, view: View | None) -> None:
        size = (gray.shape[1], gray.shape[0])
        self.of_size(name, size)
        if is_blurred(gray):
            self.blurred.append(name)
        if view is None:
            self.without.append(name)
            if len(self.missed) < MOST_MISSED:
                self.missed[name] = gray
        else:
            self.views.append(view)
            self.pictures[name] = gray

    def of_size(self, name: str, size: tuple[int, int]) -> None:
        if self.size not in (None, size):
            assert self.size is not None
            raise CalibrationError(
                f"{name} is {size[0]} x {size[1]} pixels, the pictures before it are "
                f"{self.size[0]} x {self.size[1]}; a lens is calibrated for one size: leave out "
                "those of the other"
            )
        self.size = size


def find_views(
    inputs: Sequence[str],
    target: Target,
    *,
    size: tuple[int, int] | None = None,
    quiet: bool = False,
) -> Found:
    """The target's views in pictures, videos and corner files, in this order.

    `size`: of the pictures that corner files are of, where those do not say it.

    CalibrationError names inputs of different sizes; SourceError those that cannot be read.
    """
    from ..formats.corners import is_corner_file, read_corner_files
    from ..media.pictures import is_picture

    found = Found()
    pictures = [name for name in inputs if is_picture(name)]
    corners = [name for name in inputs if is_corner_file(name)]
    videos = [name for name in inputs if name not in {*pictures, *corners}]
    if pictures:
        with bar("looking for the target", len(pictures), "pictures", quiet=quiet) as advance:
            for name in pictures:
                gray = _gray(name)
                found.add(name, gray, target.find(gray, name))
                advance()
    for name in videos:
        _search_video(name, target, found, quiet)
    if corners:
        known = read_corner_files(corners, target, size)
        found.of_size(corners[0], known.size)
        found.views += known.views
        found.without += known.without
    return found


def _gray(name: str) -> Gray:
    import cv2

    from ..media.pictures import read_picture

    rgb = read_picture(name).picture.planes[0]
    return cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)


def _search_video(name: str, target: Target, found: Found, quiet: bool) -> None:
    """Pairs of frames throughout the video; a view counts where the target was held still."""
    views: list[View] = []
    pictures = {}
    expected, frames = _frames(name)
    step = max(1, (expected or 0) // (MOST_FRAMES // 2))
    with bar(f"looking for the target in {name}", expected, "frames", quiet=quiet) as advance:
        for number, gray in enumerate(frames):
            advance()
            found.of_size(name, (gray.shape[1], gray.shape[0]))
            if number % step == 0:
                first = target.find(gray, f"{name} frame {number}")
                if step == 1 and first is not None:
                    views.append(first)
                    pictures[first.name] = gray
            elif number % step == 1 and first is not None:
                second = target.find(gray, f"{name} frame {number}")
                if second is not None and moved_px(first, second) < STILL_PX:
                    views.append(second)
                    pictures[second.name] = gray
    assert found.size is not None
    for view in differing(views, MOST_VIEWS, found.size):
        found.views.append(view)
        found.pictures[view.name] = pictures[view.name]
    if not views:
        found.without.append(name)


def _frames(name: str) -> tuple[int | None, Iterator[Gray]]:
    """How many a video claims to have, and the luma of all its frames."""
    from ..media.decoder import Decoder
    from ..offline import decoded
    from ..sources import file

    source = file.FileSource(name, loop=False, pace=False, clock=lambda: 0)
    frames = decoded(source.units(), Decoder(low_delay=False))
    first = next(frames, None)
    if first is None:
        raise CalibrationError(f"{name}: not a single picture in it can be decoded")
    return source.expected_frames, (f.picture.planes[0] for f in itertools.chain([first], frames))
