"""Calibration while the camera runs: looks at pictures, takes views, says what is missing.

A view is taken when the target is held still, is sharp, and is somewhere new. Nothing here knows
threads, clocks or pages: `step` is given the newest picture and the time; somebody else solves
(`solve_views`) and hands the result in (`solved`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ..errors import CalibrationError
from .calibrate import Calibration, calibrate
from .live_coverage import Sectors
from .live_guidance import Guide, Hold
from .live_sharpness import Sharpness, Steadiness, edge_width_px
from .parameters import Freedom
from .targets import Finder, Gray
from .uncertainty import grid_of, projection_uncertainty
from .views import FEWEST_POINTS, View

# The target is followed in a picture of at most this many pixels along its longer side; once it is
# to be taken it is looked for at full size.
FOLLOWED_PX = 800
LEAST_SHARE = 0.4  # of the most points ever seen: with fewer, most of the board is hidden
FIRST_SOLVE = 4  # views
MOST_VIEWS = 40  # that are taken without being asked for
ENOUGH_VIEWS = 8

SENTENCES = {
    "absent": "No board in sight: show it whole, flat and evenly lit",
    "hidden": "Only a small part of the board is seen",
    "moving": "Hold still",
    "blurred": "Blurred: more light, or another distance",
    "known": "This view is there already",
    "many": "Many views are there: finish, or take more by hand",
    "coarse": "Not clear enough to be taken: hold the board nearer",
    "taken": "Taken",
}


@dataclass(frozen=True)
class Progress:
    """What `views` views gave, in pixels; NaN is unknown.

    RMS and RMS on views left out (2-D, per point); 95th percentile of the standard deviation of
    the projection where the lens was seen.
    """

    views: int
    rms_px: float
    left_out_px: float
    uncertainty_px: float


@dataclass(frozen=True)
class LiveState:
    """What one look found.

    size      of the picture, pixels
    verdict   a key of SENTENCES, or "size": another size than that of the views
    sentence  the verdict in words
    found     the target in this picture, if it is there
    held      share of the time to hold still that has passed, 0 to 1
    views     taken so far; the last one just now if the verdict is "taken"
    sectors, counts, filled   parts of the picture, points seen in each, which have enough
    hold      where to hold the board next; None when nothing is missing
    history   by number of views that were solved
    trouble   why solving failed, if it did
    """

    now_ns: int
    size: tuple[int, int]
    verdict: str
    sentence: str
    found: View | None
    held: float
    views: tuple[View, ...]
    sectors: Sectors
    counts: NDArray[np.int64]
    filled: NDArray[np.bool_]
    hold: Hold | None
    history: tuple[Progress, ...]
    trouble: str

    @property
    def enough(self) -> bool:
        """Whether nothing is missing for a good calibration."""
        return self.hold is None and len(self.views) >= ENOUGH_VIEWS


class LiveCalibration:
    """From pictures of a target, one after the other, to views worth solving.

    Not safe between threads: one of them does everything.
    """

    def __init__(self, target: Finder) -> None:
        self._target = target
        self.restart()

    def restart(self) -> None:
        """Forget everything."""
        self._views: list[View] = []
        self._number = 0
        self._guide: Guide | None = None
        self._steadiness, self._sharpness = Steadiness(), Sharpness()
        self._most_points = 0
        self._wanted = False
        self._known: Calibration | None = None
        self._history: dict[int, Progress] = {}
        self._trouble = ""

    @property
    def views(self) -> tuple[View, ...]:
        return tuple(self._views)

    @property
    def size(self) -> tuple[int, int] | None:
        """Of the pictures the views are from; None before the first."""
        return self._guide.size if self._guide else None

    def take(self) -> None:
        """Take the target at the next look, however it is held."""
        self._wanted = True

    def drop(self) -> None:
        """Forget the view that was taken last; what it showed then counts as new again."""
        if not self._views or self._guide is None:
            return
        self._views.pop()
        self._history = {n: p for n, p in self._history.items() if n <= len(self._views)}
        self._steadiness.forget()
        self._update()

    def solved(self, calibration: Calibration, progress: Progress) -> None:
        """The outcome of solving the views there were some time ago."""
        if calibration.camera.size != self.size or progress.views > len(self._views):
            return  # the views it is about are no more
        self._trouble = ""
        self._known = calibration
        self._history[progress.views] = progress
        self._update()

    def failed(self, why: str) -> None:
        """Solving gave no result; `why` is shown until it does."""
        self._trouble = why

    def step(self, gray: Gray, now_ns: int) -> LiveState:
        """Look at the newest picture (rows, columns), taken at or before `now_ns`."""
        size = (gray.shape[1], gray.shape[0])
        if self._guide is None or (self._guide.size != size and not self._views):
            self._guide = Guide(size)
            self._steadiness.forget()
        if self._guide.size != size:
            self._wanted = False
            self._steadiness.forget()
            return self._state(size, now_ns, "size", None, 0.0)
        found = _followed(self._target, gray, f"view {self._number + 1}")
        self._guide.look(gray, found)
        held = self._steadiness.look(found, size, now_ns)
        verdict = self._verdict(gray, found, held)
        if verdict == "taken" and found is not None:
            verdict, found = self._take(gray, found)
        self._wanted = False
        return self._state(size, now_ns, verdict, found, held)

    def again(self, state: LiveState) -> LiveState:
        """The same look, with what has changed since: views, history, where to hold next."""
        return self._state(state.size, state.now_ns, state.verdict, state.found, state.held)

    def _verdict(self, gray: Gray, found: View | None, held: float) -> str:
        """What stands in the way of taking this view; "taken" if nothing does."""
        if found is None:
            return "absent"
        self._most_points = max(self._most_points, len(found.pixels))
        if self._wanted:
            return "taken"
        if len(found.pixels) < max(LEAST_SHARE * self._most_points, FEWEST_POINTS):
            return "hidden"
        if held < 1:
            return "moving"
        if not self._sharpness.look(edge_width_px(gray, found.pixels)):
            return "blurred"
        assert self._guide is not None
        if not self._guide.is_new(found):
            return "known"
        return "many" if len(self._views) >= MOST_VIEWS else "taken"

    def _take(self, gray: Gray, found: View) -> tuple[str, View]:
        """Take it from the picture at full size; "coarse" if it is not found there."""
        assert self._guide is not None
        exact = found if _scale(gray) == 1 else self._target.find(gray, found.name)
        if exact is None or len(exact.pixels) < FEWEST_POINTS:
            self._steadiness.forget()  # or every look from now on would be a long one
            return "coarse", found
        self._number += 1
        self._views.append(exact)
        self._guide.taking()
        self._update()
        return "taken", exact

    def _update(self) -> None:
        assert self._guide is not None
        newest = self._history[max(self._history)] if self._history else None
        self._guide.update(
            self._views,
            self._known.camera if self._known else None,
            newest.uncertainty_px if newest else float("nan"),
        )

    def _state(
        self, size: tuple[int, int], now_ns: int, verdict: str, found: View | None, held: float
    ) -> LiveState:
        guide = self._guide
        assert guide is not None
        return LiveState(
            now_ns=now_ns,
            size=size,
            verdict=verdict,
            sentence=SENTENCES.get(verdict) or _other_size(size, guide.size, len(self._views)),
            found=found,
            held=held,
            views=self.views,
            sectors=guide.sectors,
            counts=guide.counts,
            filled=guide.filled,
            hold=guide.hold,
            history=tuple(self._history[n] for n in sorted(self._history)),
            trouble=self._trouble,
        )


def _other_size(now: tuple[int, int], before: tuple[int, int], views: int) -> str:
    return (
        f"The picture is now {now[0]} x {now[1]} pixels, but the {views} views are of "
        f"{before[0]} x {before[1]}: switch the camera back, or start over"
    )


def _scale(gray: Gray) -> float:
    return min(1.0, FOLLOWED_PX / max(gray.shape))


def _followed(target: Finder, gray: Gray, name: str) -> View | None:
    """The target in a picture that is not too large to be searched many times a second."""
    scale = _scale(gray)
    if scale == 1:
        return target.find(gray, name)
    rows, columns = gray.shape
    small = cv2.resize(
        gray, (round(columns * scale), round(rows * scale)), interpolation=cv2.INTER_AREA
    )
    view = target.find(small.astype(np.uint8), name)
    if view is None:
        return None
    by = np.array([columns / small.shape[1], rows / small.shape[0]])
    return View(name, view.points, (view.pixels + 0.5) * by - 0.5)


def solve_views(
    views: Sequence[View],
    size: tuple[int, int],
    model: str = "kannala_brandt",
    freedom: Freedom | None = None,
    *,
    say: Callable[[str], None] = lambda _: None,
) -> tuple[Calibration, Progress]:
    """Calibrate, and say how good the result is. CalibrationError as `calibrate`."""
    if len(views) < FIRST_SOLVE:
        raise CalibrationError(
            f"{len(views)} views are too few; take at least {FIRST_SOLVE}, better {ENOUGH_VIEWS}"
        )
    result = calibrate(views, size, model, freedom, progress=say)
    pixels = grid_of(size, 16)
    sure = projection_uncertainty(result.camera, result.solution, result.freedom, pixels).sigma_px
    seen = sure[np.isfinite(sure)]
    uncertainty = float(np.percentile(seen, 95)) if len(seen) else float("nan")
    return result, Progress(len(views), result.rms_px, result.cross_validated_px, uncertainty)
