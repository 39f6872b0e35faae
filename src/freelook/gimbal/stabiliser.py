"""The vehicle's turning taken out of the view: the base in which a head turns.

    body_from_view = body_from_base * head
    body_from_base = body_from_world(at capture) * world_from_base

    mode      world_from_base
    body      that of the vehicle: the view turns with it
    horizon   level, heading with the vehicle
    world     level, heading fixed where it was when the mode was chosen
    follow    level, heading after the vehicle's through a low-pass filter
    point     towards a set direction or location

The attitude is the one at the frame's capture. When it is not known (none yet, silent, a gap, no
position for a location), the base eases to the body's and says so; when it has been known again
for `settle_s`, it eases back. An attitude that jumps (an estimator's reset) does not turn the view
at once: the view stays, and eases to where it belongs.
"""

from __future__ import annotations

import threading
from bisect import bisect_right
from dataclasses import replace

from scipy.spatial.transform import Rotation

from ..attitude import AttitudeBuffer
from ..clock import NS_PER_S
from ..errors import TrackerError
from ..rotations import angle_between_deg
from ..types import Attitude
from .base import BODY, MODES, Base, level
from .easing import LONG_AGO_NS, NOTHING, Blend, blend
from .headings import Heading
from .settings import StabiliserSettings
from .targets import Direction, Location, Target, direction_to

LEAST_JUMP_DEG = 3.0  # less between two attitudes is noise, or a jitter of their times
JOINED_S = 0.5  # attitudes farther apart than this say nothing about a jump
JUMPS_KEPT = 1000
LARGE_OFFSET_NS = 5_000_000  # at 100 degrees a second, half a degree


class Stabiliser:
    """Asked in the order of time. A frame from before the last one that was asked about is
    answered too, and leaves everything as it was.

    Safe between threads: attitudes come on one, questions on others.
    """

    def __init__(
        self, settings: StabiliserSettings | None = None, buffer: AttitudeBuffer | None = None
    ) -> None:
        self.settings = StabiliserSettings() if settings is None else settings
        self._buffer = AttitudeBuffer() if buffer is None else buffer
        self._lock = threading.RLock()
        self._offset_ns = 0
        self._mode = "body"
        self._target: Target | None = None
        self._here: tuple[int, Location] | None = None
        self._heading = Heading(self.settings.follow_s)
        self._fixed_deg: float | None = None
        self._choice = 0  # counts choices of a mode; a new one is a change even to the same mode
        self._jumps: list[tuple[int, int]] = []
        self._framed = False  # whether anybody ever told a frame's capture
        # of the last question
        self._asked: tuple[int, int] | None = None
        self._kind: tuple[bool, int] | None = None
        self._usable = False
        self._known_since_ns: int | None = None
        self._blend = Blend()
        self._jumping = False  # whether that is because the attitude jumped
        self._newest = BODY

    # --- what is told

    @property
    def mode(self) -> str:
        """The mode that was asked for."""
        return self._mode

    @property
    def newest(self) -> Base:
        """The last answer."""
        return self._newest

    @property
    def offset_ns(self) -> int:
        """Attitude time = capture time + this: from where the video comes late, or its clock is
        another, to when the vehicle really was so."""
        return self._offset_ns

    def set_offset(self, offset_ns: int) -> None:
        """Use another offset from the next question on; one that is much different is eased."""
        with self._lock:
            if abs(offset_ns - self._offset_ns) > LARGE_OFFSET_NS:
                self._choice += 1
                self._heading.restart()
            self._offset_ns = offset_ns

    def set_mode(self, mode: str, target: Target | None = None) -> None:
        """Choose a mode, from the next question on. *World* chosen again takes the heading anew.

        TrackerError for an unknown mode, and for *point* without any target.
        """
        if mode not in MODES:
            raise TrackerError(f"unknown mode '{mode}'; known: {', '.join(MODES)}")
        if mode == "point" and target is None and self._target is None:
            raise TrackerError("the mode 'point' needs something to point at: --point AZ,EL")
        with self._lock:
            self._mode = mode
            self._target = target or self._target
            self._fixed_deg = None
            self._choice += 1

    def push(self, attitude: Attitude) -> None:
        """A new attitude of the vehicle."""
        with self._lock:
            before = self._buffer.newest
            self._buffer.push(attitude)
            if before is None or self._buffer.newest is before:
                return
            elapsed_s = (attitude.t_ns - before.t_ns) / NS_PER_S
            if 0 < elapsed_s <= JOINED_S:
                turned = angle_between_deg(before.world_from_body, attitude.world_from_body)
                if turned > max(LEAST_JUMP_DEG, self.settings.jump_deg_s * elapsed_s):
                    self._jumps.append((before.t_ns, attitude.t_ns))
                    del self._jumps[:-JUMPS_KEPT]

    def push_position(self, here: Location, t_ns: int) -> None:
        """Where the vehicle is."""
        with self._lock:
            self._here = (t_ns, here)

    # --- what is asked

    def at(self, now_ns: int, capture_ns: int | None = None) -> Base:
        """The base for a frame taken at `capture_ns`, shown now. None: that of the last frame asked
        about, or where nobody ever knew one, now."""
        with self._lock:
            last_now_ns, last_capture_ns = self._asked or (now_ns, LONG_AGO_NS)
            if capture_ns is None:
                capture_ns = last_capture_ns if self._framed else max(now_ns, last_capture_ns)
            else:
                self._framed = True
            now_ns = max(now_ns, last_now_ns)
            if capture_ns < last_capture_ns:
                return self._glance(now_ns, capture_ns)
            if self._asked != (now_ns, capture_ns):
                self._newest = self._answer(now_ns, capture_ns)
                self._asked = (now_ns, capture_ns)
            return self._newest

    def attitude_at(self, capture_ns: int) -> Rotation | None:
        """`world_from_body` when a frame was taken; None where it is not known. In any mode."""
        with self._lock:
            return self._buffer.at(capture_ns + self._offset_ns)

    def _answer(self, now_ns: int, capture_ns: int) -> Base:
        t_ns = capture_ns + self._offset_ns
        attitude = self._buffer.at(t_ns)
        jumped = self._jumped(t_ns)
        if attitude is not None:
            if jumped:
                self._heading.jumped(attitude)
            heading_deg = self._heading.at(t_ns, attitude)
        else:
            heading_deg = 0.0
            self._heading.restart()
        why = self._why_not(attitude, t_ns, now_ns)
        self._settle(why, now_ns)
        target = NOTHING
        if self._usable and attitude is not None and self._mode != "body":
            target = attitude.inv() * self._world_from_base(heading_deg, now_ns)
        kind = (self._usable, self._choice)
        if self._kind is not None and (kind != self._kind or jumped):
            self._blend = self._eased(self._newest.body_from_base, target, now_ns)
            self._jumping = jumped
        self._kind = kind
        return self._compose(target, why, now_ns)

    def _glance(self, now_ns: int, capture_ns: int) -> Base:
        """The base for a frame from before the last one asked about: changes nothing."""
        t_ns = capture_ns + self._offset_ns
        attitude = self._buffer.at(t_ns)
        if not self._usable or attitude is None or self._mode == "body":
            return self._newest
        target = attitude.inv() * self._world_from_base(self._heading.at(t_ns, attitude), now_ns)
        return replace(self._newest, body_from_base=self._blend.left(now_ns) * target)

    def _compose(self, target: Rotation, why: str, now_ns: int) -> Base:
        moving = self._blend.active(now_ns)
        effective = self._mode if self._usable else "body"
        turned = moving or effective != "body"
        base = self._blend.left(now_ns) * target if moving else target
        return Base(
            base if turned else NOTHING,
            self._mode,
            effective,
            self._notice(why, moving),
            moving,
            turned,
        )

    def _notice(self, why: str, moving: bool) -> str:
        if self._mode == "body":
            return ""
        if self._usable:
            return "the attitude jumped: easing to it" if moving and self._jumping else ""
        return f"{why or 'the attitude is back'}: body mode instead of {self._mode}"

    def _eased(self, before: Rotation, after: Rotation, now_ns: int) -> Blend:
        chosen = self.settings
        return blend(before, after, now_ns, at_least_s=chosen.blend_s, rate_deg_s=chosen.rate_deg_s)

    # --- whether the mode is possible

    def _why_not(self, attitude: Rotation | None, t_ns: int, now_ns: int) -> str:
        """Why the mode is not possible now; nothing when it is."""
        if self._mode == "body":
            return ""
        newest = self._buffer.newest
        if newest is None:
            return "no attitude of the vehicle yet"
        if attitude is None:
            silent_s = (t_ns - newest.t_ns) / NS_PER_S
            if silent_s > 0:
                return f"no attitude for {silent_s:.1f} s"
            return "the attitude at this frame's time is not known"
        if self._mode == "point" and self._direction(now_ns) is None:
            return "no position" if self._here is None else "no direction from this position"
        return ""

    def _settle(self, why: str, now_ns: int) -> None:
        if why:
            self._usable, self._known_since_ns = False, None
            return
        if self._usable or self._kind is None:
            self._usable = True
            return
        if self._known_since_ns is None:
            self._known_since_ns = now_ns
        settled_s = (now_ns - self._known_since_ns) / NS_PER_S
        self._usable = self._mode == "body" or settled_s >= self.settings.settle_s

    def _jumped(self, t_ns: int) -> bool:
        """Whether the attitude jumped between the last question's time and this one's."""
        if not self._jumps or self._asked is None:
            return False
        last_ns = self._asked[1] + self._offset_ns
        before = bisect_right(self._jumps, (t_ns, LONG_AGO_NS)) - 1
        return t_ns > last_ns and before >= 0 and self._jumps[before][1] > last_ns

    # --- where the base looks

    def _world_from_base(self, heading_deg: float, now_ns: int) -> Rotation:
        if self._mode == "horizon":
            return level(heading_deg)
        if self._mode == "follow":
            return level(self._heading.followed_deg)
        if self._mode == "world":
            if self._fixed_deg is None:
                self._fixed_deg = heading_deg
            return level(self._fixed_deg)
        direction = self._direction(now_ns)
        assert direction is not None, "asked for although it is not known"
        return level(direction.azimuth_deg, direction.elevation_deg)

    def _direction(self, now_ns: int) -> Direction | None:
        if not isinstance(self._target, Location):
            return self._target
        if self._here is None:
            return None
        t_ns, here = self._here
        if now_ns - t_ns > self.settings.fresh_s * NS_PER_S:
            return None
        return direction_to(self._target, here)
