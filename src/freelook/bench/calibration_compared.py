"""Which calibration is the best on a set, and how far ours is from it.

A calibration is there to say where things will be in pictures it has not seen. So what counts
first is the RMS on views left out. The RMS of the fit alone falls with every parameter that is
added, whether it says anything about the lens or follows the noise of these corners; of two
calibrations that predict about equally well, though, the one that fits closer is the better. So a
fit counts where it is not overfit: where its RMS on views left out is at most 10 % above the least
of all. The closest fit of all is told beside, overfit or not.

Ours is one way as it comes, `auto`; the best is the best of what any other program made.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

from .calibrate import OURS, Row, Set, cpu_seconds
from .calibration_peers import Peer

NOT_OVERFIT = 1.1  # times the least RMS on views left out
NEAR_BEST = 1.05
TIMES = 3


@dataclass(frozen=True)
class Compared:
    """Ours on a set, and the best others by each measure; None where there is none.

    predicting  least RMS on views left out
    fitting     least RMS of those that are not overfit
    closest     least RMS of all
    """

    set: str
    ours: Row
    predicting: Row | None
    fitting: Row | None
    closest: Row | None

    @property
    def succeeds(self) -> bool:
        return isfinite(self.ours.rms_px)

    @property
    def predicts_near_best(self) -> bool:
        """Within 5 %; also where no other has anything to compare with."""
        best = self.predicting
        ours = self.ours.cross_validated_px
        return isfinite(ours) and (best is None or ours <= NEAR_BEST * best.cross_validated_px)

    @property
    def fits_near_best(self) -> bool:
        best, ours = self.fitting, self.ours.rms_px
        return isfinite(ours) and (best is None or ours <= NEAR_BEST * best.rms_px)


def compared(rows: Sequence[Row]) -> list[Compared]:
    """For each set in which ours was run and rows were cross-validated."""
    names = dict.fromkeys(row.set for row in rows if row.way == OURS[0].name)
    own = {way.name for way in OURS}
    found = []
    for name in names:
        here = [row for row in rows if row.set == name]
        able = [row for row in here if isfinite(row.cross_validated_px)]
        if not able and any(isfinite(row.rms_px) for row in here):
            continue  # not asked to
        limit = NOT_OVERFIT * min((row.cross_validated_px for row in able), default=0.0)
        others = [row for row in here if row.way not in own and isfinite(row.rms_px)]
        predicting = [row for row in others if isfinite(row.cross_validated_px)]
        fitting = [row for row in predicting if row.cross_validated_px <= limit]
        found.append(
            Compared(
                name,
                next(row for row in here if row.way == OURS[0].name),
                min(predicting, key=lambda row: row.cross_validated_px, default=None),
                min(fitting, key=lambda row: row.rms_px, default=None),
                min(others, key=lambda row: row.rms_px, default=None),
            )
        )
    return found


@dataclass(frozen=True)
class Timed:
    """The least seconds of a few calibrations of one set, and of CPU."""

    set: str
    seconds: float
    cpu_seconds: float


def timed(each: Set, way: Peer = OURS[0], times: int = TIMES) -> Timed:
    """Of the calibration alone, from corners that are found. PeerFailed as from the way."""
    spent = []
    for _ in range(times):
        start, start_cpu = time.perf_counter(), cpu_seconds()
        way.calibrate(each.views, each.size)
        spent.append((time.perf_counter() - start, cpu_seconds() - start_cpu))
    wall, cpu = zip(*spent, strict=True)
    return Timed(each.name, min(wall), min(cpu))
