"""Image circles in what a command was given: pictures, a recording, a live source."""

from __future__ import annotations

import itertools
import shlex
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..camera import Camera
from ..clock import NS_PER_S
from ..errors import FreelookError, ProfileError, SourceError
from ..formats import builtin_names
from ..types import Frame, Picture, Plane, Source

if TYPE_CHECKING:
    from ..calibration.circle import Brightness, ImageCircle
    from ..sources.file import FileSource

PICTURES = 24
FEWEST_KEYS = 4  # a recording with fewer key pictures than this is decoded from its beginning
MOST_DECODED = 300
LIVE_S = 2.0
WAIT_S = 15.0
DEFAULT_FOV_DEG = 180.0
NO_PICTURE = "one is needed to find the lens's image circle: start the camera first, or give --lens"
LUMA = (0.299, 0.587, 0.114)


@dataclass(frozen=True)
class Looked:
    """What was seen of a camera: the brightness of `count` pictures, and the brightest of them."""

    brightness: Brightness
    brightest: Picture
    what: str

    @property
    def count(self) -> int:
        return self.brightness.count


def look_at(inputs: Sequence[str], count: int = PICTURES, *, quiet: bool = False) -> Looked:
    """`count` pictures of one camera: all of some picture files, or throughout a recording, or
    the first seconds of a live source.

    SourceError if there is none to be had; ProfileError if they differ in size.
    """
    from ..media.pictures import is_picture
    from ._bars import bar

    if len(inputs) > 1 and not all(map(is_picture, inputs)):
        raise FreelookError("give one video, or pictures of one camera, not a mixture")
    pictures = is_picture(inputs[0])
    frames = _frames_of_pictures(inputs) if pictures else _frames(inputs[0], count)
    what = f"{len(inputs)} pictures" if len(inputs) > 1 else inputs[0]
    total = len(inputs) if pictures else None  # a recording may have fewer than are wanted
    with bar("looking for the image circle", total, "pictures", quiet=quiet or total == 1) as step:
        return _seen(frames, what, step)


def _seen(frames: Iterator[Frame], what: str, advance: Callable[[], None]) -> Looked:
    from ..calibration.circle import Brightness

    brightness, brightest, most = Brightness(), None, -1.0
    for frame in frames:
        luma = luma_of(frame.picture)
        brightness.add(luma)
        if (mean := float(luma.mean())) > most:
            brightest, most = frame.picture, mean
        advance()
    if brightest is None:
        raise SourceError(f"{what}: not a single picture in it can be decoded")
    return Looked(brightness, brightest, what)


def luma_of(picture: Picture) -> Plane:
    """(rows, columns) brightness, uint8; of RGB with the weights of BT.601."""
    if picture.layout != "rgb24":
        return picture.planes[0]
    return np.asarray(picture.planes[0] @ np.array(LUMA, np.float32) + 0.5).astype(np.uint8)


def _frames_of_pictures(names: Sequence[str]) -> Iterator[Frame]:
    from ..media.pictures import read_picture

    return map(read_picture, names)


def _frames(source: str, count: int) -> Iterator[Frame]:
    from ..sources import open_source
    from ..sources.file import FileSource

    opened = open_source(source, pace=False)
    if not isinstance(opened, FileSource):
        return _live_frames(opened, source, count)
    keys = _key_frames(opened, count)
    some = list(itertools.islice(keys, min(FEWEST_KEYS, count)))
    if len(some) == min(FEWEST_KEYS, count):
        return itertools.chain(some, keys)
    return _first_frames(source, count)


def _key_frames(source: FileSource, count: int) -> Iterator[Frame]:
    """Pictures that need no others, throughout a recording: only these are read and decoded."""
    from ..media.decoder import Decoder

    decoder = Decoder(low_delay=False)
    for unit in source.key_units(count):
        yield from [*decoder.decode(unit), *decoder.flush()][:1]


def _first_frames(name: str, count: int) -> Iterator[Frame]:
    """Pictures from the beginning of a recording that has few of the other kind."""
    from ..media.decoder import Decoder
    from ..offline import decoded
    from ..sources.file import FileSource

    source = FileSource(name, loop=False, pace=False, clock=lambda: 0)
    there = min(source.expected_frames or MOST_DECODED, MOST_DECODED)
    frames = decoded(source.units(), Decoder(low_delay=False))
    return itertools.islice(frames, 0, MOST_DECODED, max(1, there // count))


def _live_frames(source: Source, name: str, count: int) -> Iterator[Frame]:
    """Pictures of the first seconds; SourceError when none come in time.

    Begins at a key picture: what is decoded before one is damaged.
    """
    from ..media.decoder import Decoder

    decoder, begun, first_ns, taken = Decoder(), False, None, 0
    giving_up = threading.Timer(WAIT_S, source.close)
    giving_up.daemon = True
    giving_up.start()
    try:
        for unit in source.units():
            begun = begun or unit.key
            for frame in decoder.decode(unit) if begun else ():
                first_ns = frame.capture_ns if first_ns is None else first_ns
                since_s = (frame.capture_ns - first_ns) / NS_PER_S
                if since_s * count >= taken * LIVE_S:
                    taken += 1
                    yield frame
                if since_s > LIVE_S or taken == count:
                    return
    except SourceError as error:
        raise SourceError(f"{error}; {NO_PICTURE}", retry=error.retry) from None
    finally:
        giving_up.cancel()
        source.close()
    if not taken:
        raise SourceError(f"{name}: no whole picture came within {WAIT_S:g} s; {NO_PICTURE}")


def camera_by_circle(source: str, fov_deg: float | None) -> Camera:
    """What is taken for the camera when nobody named its lens; says so on standard error.

    Equidistant, with its image circle where it is found. ProfileError where there is none.
    """
    from ..calibration.circle import camera_from_circle, find_circle, unit_radius

    fov = DEFAULT_FOV_DEG if fov_deg is None else fov_deg
    unit_radius("equidistant", fov)  # says what is wrong with it before the work begins
    looked = look_at([source])
    try:
        circle = find_circle(looked.brightness)
    except ProfileError as error:
        known = ", ".join(builtin_names())
        raise ProfileError(
            f"there is no --lens, and in {source} {error}. Or name it: --lens PROFILE, "
            f"a file or one of: {known}"
        ) from None
    camera = camera_from_circle(circle, fov)
    print(without_lens(looked, circle, fov, told=fov_deg is not None), file=sys.stderr)
    return camera


def without_lens(looked: Looked, circle: ImageCircle, fov_deg: float, *, told: bool) -> str:
    """What a user is told who gave no lens."""
    how = "as --fov says" if told else "assumed, --fov changes it"
    better = f"freelook lens from-circle {shlex.quote(looked.what)} --fov {fov_deg:g} -o lens.json"
    return (
        f"no --lens: image circle found ({in_words(looked, circle)}), taken for an equidistant "
        f"lens of {fov_deg:g} degrees ({how})\n"
        f"better: {better}, look at its drawing, then --lens lens.json"
    )


def in_words(looked: Looked, circle: ImageCircle) -> str:
    x, y = circle.center
    return (
        f"centre {x:.1f}, {y:.1f} ± {circle.center_error_px:.1f}, "
        f"radius {circle.radius_px:.1f} ± {circle.radius_error_px:.1f} px, "
        f"from {looked.count} picture{'' if looked.count == 1 else 's'}"
    )
