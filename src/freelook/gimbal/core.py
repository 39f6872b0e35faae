"""From head poses to where the virtual camera looks, also when the tracker falls silent.

    waiting ----> tracking ----------> holding ------> easing ------> centred
            pose      ^   lost_after_s         hold_s      (no blend left)   |
                      '---------- from any of these: a pose -------------'

Without poses the state moves to the right as time goes by; any pose leads back to tracking.
`disable` leads from everywhere to disabled, `eyes_front` from everywhere to front; both stay,
whatever the tracker does, until `enable` leads to wherever time has got to.

    aim = (what is left of an earlier aim) * body_from_base * head

`body_from_base` is the stabiliser's (`freelook.gimbal.stabiliser`). Easing, centred, disabled and
front look along the vehicle's nose, whatever the mode: they use neither it nor the head.

The aim never jumps, with three exceptions that are meant: a new pose while tracking is followed
at once, and `recentre` and `eyes_front` act at once because the pilot asked for it. Everywhere
else the difference is eased away, never faster than `rate_deg_s`. A pose too far from the one
before to be a head's turn is a jump of the tracker: it is eased too, and never extrapolated.

All methods take the time as an argument. Not safe between threads (`freelook.head` is).
"""

from __future__ import annotations

from dataclasses import dataclass

from scipy.spatial.transform import Rotation

from ..clock import NS_PER_S
from ..prediction import Hold, Predictor
from ..rotations import (
    FRD_FROM_RDF,
    RDF_FROM_FRD,
    angle_between_deg,
    body_from_view,
    head_angles_deg,
)
from ..types import Pose
from .base import BODY, Base
from .easing import LONG_AGO_NS, NOTHING, Blend, blend
from .settings import GimbalSettings
from .shaping import STRAIGHT, Angles
from .stabiliser import Stabiliser

CENTRE: Rotation = FRD_FROM_RDF
LEAST_JUMP_DEG = 15.0  # less than this in no time is noise, or poses that came in a heap
LONGEST_PREDICTION_S = 0.2  # after the newest pose; then the prediction is held
FORWARD_STATES = ("easing", "centred", "disabled", "front")


@dataclass(frozen=True)
class Aim:
    """Where the virtual camera looks.

    `state` is waiting, tracking, holding, easing, centred, disabled or front; `pose_ns` the time
    of the newest pose, None if there never was one; `moving` whether the aim changes by itself,
    without new poses. `base` is the stabiliser's answer.

    For those who know a better base than `base`, that of the frame they show:
    body_from_view = leftover * (base.body_from_base if stabilised) * head.
    """

    body_from_view: Rotation
    state: str
    pose_ns: int | None
    moving: bool = False
    head: Rotation = CENTRE
    leftover: Rotation = NOTHING
    stabilised: bool = False
    base: Base = BODY


class Gimbal:
    """Keeps the newest pose, what counts as forward, and one blend from the past."""

    def __init__(
        self,
        settings: GimbalSettings | None = None,
        predictor: Predictor | None = None,
        stabiliser: Stabiliser | None = None,
    ) -> None:
        self.settings = GimbalSettings() if settings is None else settings
        self.jumps = 0
        self._predictor = Hold() if predictor is None else predictor
        self._stabiliser = stabiliser
        self._pose: Pose | None = None
        self._latch = ""  # "", disabled or front
        self._yaw_fix = NOTHING
        self._mount_fix = NOTHING
        self._angles: Angles = STRAIGHT
        self._blend = Blend()
        # of a lost tracker: when the view began its way forward, and the way
        self._way_forward: tuple[int, Blend] = (LONG_AGO_NS, Blend())

    def push(self, pose: Pose) -> None:
        """A new pose, at its own time. One older than the newest is ignored."""
        if self._pose is not None and pose.t_ns < self._pose.t_ns:
            return
        lost = self._pose is None or self._silence_s(pose.t_ns) > self.settings.lost_after_s
        jumped = not lost and self._is_jump(pose)
        self.jumps += jumped
        may_leap = not (lost or jumped or self.settings.shape.plain)
        if not (lost or jumped or may_leap):
            return self._take(pose, reset=False)
        before = self._turned(self._state(pose.t_ns), pose.t_ns)
        shaped_before = self._shaped(pose.t_ns)[0] if may_leap else CENTRE
        self._take(pose, reset=lost or jumped)
        leapt = may_leap and self._leapt(shaped_before, pose.t_ns)
        if (lost or jumped or leapt) and not self._latch:
            self._blend_from(before, pose.t_ns)

    def aim(self, now_ns: int, capture_ns: int | None = None) -> Aim:
        """Where to look at this time, in a frame taken at `capture_ns` (unknown: the newest frame
        that was asked about)."""
        base = self._base(now_ns, capture_ns)
        state = self._state(now_ns)
        left = self._blend_at(state, now_ns)
        head, stabilised = self._head(state, now_ns)
        leftover = left.left(now_ns)
        path = base.body_from_base * head if stabilised and base.turned else head
        total = leftover * path if left.active(now_ns) else path
        moving = left.active(now_ns) or (stabilised and base.moving)
        pose_ns = self._pose.t_ns if self._pose else None
        return Aim(total, state, pose_ns, moving, head, leftover, stabilised, base)

    def recentre(self, now_ns: int) -> None:
        """Make the direction of the head now forward, at once; nothing before the first pose.

        Yaw is taken off about the vehicle's vertical (a drifting or turned reference), pitch and
        roll about the head (a tracker worn askew), so that turning the head stays a pure yaw.
        """
        if self._pose is None:
            return
        state = self._state(now_ns)  # before: a way forward begins from where the head was then
        yaw, pitch, roll = head_angles_deg(self._predicted(now_ns))
        self._yaw_fix = body_from_view(-yaw, 0.0) * RDF_FROM_FRD
        self._mount_fix = (RDF_FROM_FRD * body_from_view(0.0, pitch, roll)).inv()
        self._angles = STRAIGHT
        if state in ("tracking", "holding"):
            self._blend = Blend()

    def enable(self, now_ns: int) -> None:
        """Follow the tracker (again)."""
        self._switch("", now_ns)

    def disable(self, now_ns: int) -> None:
        """Go forward and stay there, whatever the tracker says."""
        self._switch("disabled", now_ns)

    def eyes_front(self, now_ns: int) -> None:
        """Look forward along the vehicle's nose at once, in any mode, and stay there."""
        self._latch = "front"
        self._blend = Blend()

    def _switch(self, latch: str, now_ns: int) -> None:
        if latch == self._latch:
            return
        before = self._turned(self._state(now_ns), now_ns)
        self._latch = latch
        self._blend_from(before, now_ns)

    # --- the pose and what is made of it

    def _take(self, pose: Pose, *, reset: bool) -> None:
        if reset:
            self._predictor.reset()
        self._predictor.push(pose)
        self._pose = pose
        if not self.settings.shape.plain:
            self._angles = self._shaped(pose.t_ns)[1]

    def _predicted(self, now_ns: int) -> Rotation:
        """The head as its tracker would report it, `ahead_s` from now."""
        assert self._pose is not None
        latest_ns = self._pose.t_ns + round(LONGEST_PREDICTION_S * NS_PER_S)
        return self._predictor.at(min(now_ns + round(self.settings.ahead_s * NS_PER_S), latest_ns))

    def _shaped(self, now_ns: int) -> tuple[Rotation, Angles]:
        head = self._yaw_fix * self._predicted(now_ns) * self._mount_fix
        return self.settings.shape(head, self._angles)

    def _is_jump(self, pose: Pose) -> bool:
        """Whether this pose lies farther from the newest than a head can have turned."""
        assert self._pose is not None
        turned_deg = angle_between_deg(self._pose.body_from_view, pose.body_from_view)
        elapsed_s = (pose.t_ns - self._pose.t_ns) / NS_PER_S
        return turned_deg > max(LEAST_JUMP_DEG, self.settings.jump_deg_s * elapsed_s)

    def _leapt(self, before: Rotation, now_ns: int) -> bool:
        """Whether the shape made a jump of a turn: next to straight up or down, yaw and roll flip,
        and two gains make two different things of that."""
        leap_deg = LEAST_JUMP_DEG * max(1.0, self.settings.shape.most_gain)
        return angle_between_deg(before, self._shaped(now_ns)[0]) > leap_deg

    # --- state and way

    def _silence_s(self, now_ns: int) -> float:
        assert self._pose is not None
        return max(0, now_ns - self._pose.t_ns) / NS_PER_S

    def _way_start_ns(self) -> int:
        """When a silent tracker's view begins its way forward."""
        assert self._pose is not None
        start_s = self.settings.lost_after_s + self.settings.hold_s
        return self._pose.t_ns + round(start_s * NS_PER_S)

    def _state(self, now_ns: int) -> str:
        if self._latch:
            return self._latch
        if self._pose is None:
            return "waiting"
        if self._silence_s(now_ns) <= self.settings.lost_after_s:
            return "tracking"
        if now_ns <= self._way_start_ns():
            return "holding"
        return "easing" if self._blend_at("easing", now_ns).active(now_ns) else "centred"

    def _head(self, state: str, now_ns: int) -> tuple[Rotation, bool]:
        """The head in the base, and whether the base is used."""
        if state in FORWARD_STATES:
            return CENTRE, False
        if state == "waiting":
            return CENTRE, True
        return self._shaped(now_ns)[0], True

    def _blend_at(self, state: str, now_ns: int) -> Blend:
        """The one blend that counts: the way forward of a lost tracker begins by itself, and
        what the pilot does after that replaces it."""
        if state not in ("easing", "centred"):
            return self._blend
        start_ns = self._way_start_ns()
        if self._blend.start_ns > start_ns:
            return self._blend
        if self._way_forward[0] != start_ns:
            head = self._based(self._shaped(start_ns)[0])
            before = self._blend.left(start_ns) * head
            way = self._eased(before, CENTRE, start_ns, self.settings.ease_s)
            self._way_forward = (start_ns, way)
        return self._way_forward[1]

    def _turned(self, state: str, now_ns: int) -> Rotation:
        """The whole aim, with the newest base, asking nobody."""
        return self._blend_at(state, now_ns).left(now_ns) * self._path(state, now_ns)

    def _blend_from(self, before: Rotation, now_ns: int) -> None:
        after = self._path(self._state(now_ns), now_ns)
        self._blend = self._eased(before, after, now_ns, self.settings.blend_s)

    def _eased(self, before: Rotation, after: Rotation, now_ns: int, at_least_s: float) -> Blend:
        rate_deg_s = self.settings.rate_deg_s
        return blend(before, after, now_ns, at_least_s=at_least_s, rate_deg_s=rate_deg_s)

    def _path(self, state: str, now_ns: int) -> Rotation:
        """The whole aim without the blend, with the newest base."""
        head, stabilised = self._head(state, now_ns)
        return self._based(head) if stabilised else head

    def _based(self, head: Rotation) -> Rotation:
        if self._stabiliser is None or not self._stabiliser.newest.turned:
            return head
        return self._stabiliser.newest.body_from_base * head

    def _base(self, now_ns: int, capture_ns: int | None) -> Base:
        return BODY if self._stabiliser is None else self._stabiliser.at(now_ns, capture_ns)
