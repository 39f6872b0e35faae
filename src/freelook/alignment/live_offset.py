"""The offset between video and attitude while flying: found, then refined in a sliding window.

    searching ----> found        an estimate that is sure, once a second at most
        set_by_user              from anywhere, and it stays

Every sure estimate from the last seconds is weighed against what is believed by their
uncertainties (a Kalman filter of one number that may wander by a millisecond a second). One that
contradicts the belief by more than 30 ms must come three times in a row before it replaces it: a
stream that was interrupted may really return with another delay.

Time is an argument; nothing here reads a clock. Not safe between threads.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from ..attitude_track import track_of
from ..clock import NS_PER_S
from ..errors import AttitudeError
from ..types import Attitude
from .image_turns import ImageTurn
from .time_offset import TimeOffset, find_offset

WINDOW_S = 20.0
LONGEST_LAG_S = 1.0
EVERY_S = 1.0
WANDER_NS = 1_000_000.0  # per square root of a second
LEAST_DEVIATION_NS = 1_000_000.0  # windows overlap, so what one claims is not believed alone
JUMP_NS = 30_000_000
JUMPS_BELIEVED = 3


class LiveOffset:
    """Attitudes and turns in, in any interleaving; attitude time = video time + `offset_ns` out.

    `state` is "searching", "found" or "set by the user"; `latest` the newest window's result,
    sure or not, with its confidence, for display.
    """

    def __init__(self, window_s: float = WINDOW_S, longest_lag_s: float = LONGEST_LAG_S) -> None:
        self.latest: TimeOffset | None = None
        self.state = "searching"
        self._window_ns = round(window_s * NS_PER_S)
        self._lag_ns = round(longest_lag_s * NS_PER_S)
        self._turns: deque[ImageTurn] = deque()
        self._attitudes: deque[Attitude] = deque()
        self._asked_ns: int | None = None
        self._believed_ns = 0.0
        self._variance = np.inf
        self._jumps: list[float] = []

    @property
    def offset_ns(self) -> int:
        """What is believed now; 0 while nothing is known."""
        return round(self._believed_ns)

    @property
    def deviation_ns(self) -> float:
        """One standard deviation of it; infinite while nothing is known, 0 when set."""
        return float(np.sqrt(self._variance))

    def set(self, offset_ns: int) -> None:
        """The user knows: this offset, from now on."""
        self._believed_ns, self._variance, self.state = float(offset_ns), 0.0, "set by the user"

    def search(self) -> None:
        """Forget what was set or believed."""
        self._believed_ns, self._variance, self.state = 0.0, np.inf, "searching"
        self._jumps.clear()

    def push_attitude(self, attitude: Attitude) -> None:
        if not self._attitudes or attitude.t_ns > self._attitudes[-1].t_ns:
            self._attitudes.append(attitude)
        reach_ns = self._window_ns + 2 * self._lag_ns
        while self._attitudes[-1].t_ns - self._attitudes[0].t_ns > reach_ns:
            self._attitudes.popleft()

    def push_turn(self, turn: ImageTurn) -> None:
        if not self._turns or turn.start_ns >= self._turns[-1].end_ns:
            self._turns.append(turn)
        while self._turns[-1].end_ns - self._turns[0].end_ns > self._window_ns:
            self._turns.popleft()

    def refine(self, now_ns: int) -> TimeOffset | None:
        """A new estimate from the window, if the last one is a second old; None otherwise, and
        while there is too little to go by."""
        if self._asked_ns is not None and now_ns - self._asked_ns < EVERY_S * NS_PER_S:
            return None
        elapsed_ns = 0 if self._asked_ns is None else now_ns - self._asked_ns
        self._asked_ns = now_ns
        self.latest = self._estimate()
        if self.latest is not None and self.latest.sure and self.state != "set by the user":
            self._weigh(self.latest, elapsed_ns)
        return self.latest

    def _estimate(self) -> TimeOffset | None:
        try:
            track = track_of(
                np.array([a.t_ns for a in self._attitudes], np.int64),
                np.array([a.world_from_body.as_quat() for a in self._attitudes]).reshape(-1, 4),
            )
            return find_offset(list(self._turns), track, (-self._lag_ns, self._lag_ns))
        except AttitudeError:
            return None

    def _weigh(self, found: TimeOffset, elapsed_ns: int) -> None:
        apart = found.offset_ns - self._believed_ns
        if self.state == "found" and abs(apart) > JUMP_NS:
            self._jumps.append(found.offset_ns)
            if len(self._jumps) < JUMPS_BELIEVED or np.ptp(self._jumps) > JUMP_NS:
                self._jumps = self._jumps[-JUMPS_BELIEVED:]
                return
            self.search()
            apart = found.offset_ns - self._believed_ns
        self._jumps.clear()
        measured = max(found.uncertainty_ns, LEAST_DEVIATION_NS) ** 2
        prior = self._variance + WANDER_NS**2 * elapsed_ns / NS_PER_S
        gain = 1.0 if np.isinf(prior) else prior / (prior + measured)
        self._believed_ns += gain * apart
        self._variance = gain * measured
        self.state = "found"
