"""What the printed digits of equation 7 leave open.

A printed coefficient stands for everything within half a unit of its last digit. The fifth power
of 90 degrees is 6e9, so half a unit of 1e-7 is 295 pixels there.

Equation 6 takes much of that freedom away, if both equations are least squares fits to the same
equally spaced angles: a straight line fitted to points is then the same as a straight line fitted
to the quintic of those points, for lines are quintics and least squares projects. Which
coefficients are left, and whether any are, is a linear program.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from ..lens import Floats
from . import printed

HALF_UNITS = np.array(printed.QUINTIC_HALF_UNITS)
CENTRE = np.array(printed.QUINTIC)
BATCH, MOST_BATCHES = 5000, 40


def half_width_px(theta_deg: Floats) -> Floats:
    """How far a curve within the rounding can be from the printed one, at most: (..., )."""
    return np.asarray(np.abs(printed.powers(theta_deg)) @ HALF_UNITS)


def within_rounding(rng: np.random.Generator, count: int) -> Floats:
    """(count, 6) coefficients, each anywhere within its half unit with the same probability."""
    return np.asarray(CENTRE + rng.uniform(-1, 1, (count, len(CENTRE))) * HALF_UNITS)


@dataclass(frozen=True)
class Design:
    """The angles at which somebody may have measured: equally spaced, both ends included."""

    first_deg: int
    last_deg: int
    step_deg: int

    @property
    def angles_deg(self) -> Floats:
        return np.arange(self.first_deg, self.last_deg + 1, self.step_deg, dtype=np.float64)

    @property
    def line_of(self) -> Floats:
        """(2, 6): coefficients of a quintic to (offset, slope) of its least squares line here."""
        angles = self.angles_deg
        return np.asarray(np.linalg.pinv(printed.powers(angles)[:, :2]) @ printed.powers(angles))

    @property
    def _missing(self) -> tuple[Floats, Floats]:
        """Least and most that (offset, slope) must gain over the printed coefficients' line."""
        line, half = np.array(printed.LINE), np.array(printed.LINE_HALF_UNITS)
        at_centre = self.line_of @ CENTRE
        return line - half - at_centre, line + half - at_centre

    def range_px(self, theta_deg: float) -> tuple[float, float] | None:
        """Least and greatest p(theta) that both equations allow; None where they contradict."""
        low, high = self._missing
        steps = self.line_of * HALF_UNITS  # unknowns: half units, -1 to 1
        rise = printed.powers(np.array(theta_deg)) * HALF_UNITS
        ends = []
        for sign in (1, -1):
            answer = linprog(
                sign * rise,
                A_ub=np.vstack([steps, -steps]),
                b_ub=np.concatenate([high, -low]),
                bounds=[(-1, 1)] * len(rise),
            )
            if answer.status != 0:
                return None
            ends.append(sign * answer.fun)
        middle = float(printed.quintic(np.array(theta_deg)))
        return middle + float(ends[0]), middle + float(ends[1])

    def coefficients(self, rng: np.random.Generator, wanted: int) -> Floats:
        """(n, 6) of what both equations allow, evenly; n is `wanted`, fewer where little is."""
        found = [self._some_coefficients(rng)]
        while sum(map(len, found)) < wanted and len(found) < MOST_BATCHES:
            found.append(self._some_coefficients(rng))
        return np.concatenate(found)[:wanted]

    def _some_coefficients(self, rng: np.random.Generator) -> Floats:
        """What is allowed among BATCH: four coefficients and the line are drawn, the two others
        follow from the line."""
        low, high = self._missing
        solved, drawn = [3, 4], [0, 1, 2, 5]
        off = rng.uniform(-1, 1, (BATCH, len(CENTRE))) * HALF_UNITS
        wanted = rng.uniform(low, high, (BATCH, 2)) - off[:, drawn] @ self.line_of[:, drawn].T
        off[:, solved] = np.linalg.solve(self.line_of[:, solved], wanted.T).T
        allowed = (np.abs(off) <= HALF_UNITS).all(axis=1)
        return np.asarray(CENTRE + off[allowed])


def designs() -> list[Design]:
    """What is plausible: 5 or 10 degree steps, from 0 to 20 degrees on, to 60 to 90 degrees."""
    return [
        Design(first, last, step)
        for step in (5, 10)
        for first in range(0, 21, step)
        for last in range(60, 91, step)
    ]
