"""From head poses to where the virtual camera looks, also when the tracker falls silent.

    waiting ----> tracking ----------> holding ------> easing ------> centred
            pose      ^   lost_after_s         hold_s         ease_s     |
                      '---------- from any of these: a pose -------------'

Without poses the state moves to the right as time goes by; any pose leads back to tracking.
`disable` leads from everywhere to disabled, `enable` from there to wherever time has got to.

The aim never jumps, with two exceptions that are meant: a new pose while tracking is followed at
once, and `recentre` acts at once because the pilot asked for it. Everywhere else the difference
between the old aim and the new one is blended away, with no speed at either end.

All methods take the time as an argument; `aim` changes nothing. Not safe between threads
(`freelook.head` is).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

from scipy.spatial.transform import Rotation

from .clock import NS_PER_S
from .errors import TrackerError
from .rotations import FRD_FROM_RDF, RDF_FROM_FRD, body_from_view, head_angles_deg, slerp
from .types import Pose

CENTRE: Rotation = FRD_FROM_RDF
LONGEST_S = 3600.0


@dataclass(frozen=True)
class GimbalSettings:
    """Times in seconds, 0 to 3600 (TrackerError).

    lost_after_s  silence of the tracker that counts as lost
    hold_s        how long the last aim is then held
    ease_s        how long the way to the centre takes
    blend_s       how long the way back to a returning tracker, in or out of `disabled`, takes
    """

    lost_after_s: float = 0.3
    hold_s: float = 1.0
    ease_s: float = 1.5
    blend_s: float = 0.3

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0 <= value <= LONGEST_S:
                raise TrackerError(
                    f"{field.name} must be 0 to {LONGEST_S:.0f} seconds, not {value}"
                )


@dataclass(frozen=True)
class Aim:
    """Where the virtual camera looks.

    `state` is waiting, tracking, holding, easing, centred or disabled; `pose_ns` the time of the
    newest pose, None if there never was one; `moving` whether the aim changes by itself, without
    new poses.
    """

    body_from_view: Rotation
    state: str
    pose_ns: int | None
    moving: bool = False


class Gimbal:
    """Keeps the newest pose, what counts as forward, and one blend from the past."""

    def __init__(self, settings: GimbalSettings | None = None) -> None:
        self.settings = GimbalSettings() if settings is None else settings
        self._pose: Pose | None = None
        self._enabled = True
        self._yaw_fix = Rotation.identity()
        self._mount_fix = Rotation.identity()
        # what is left of an earlier aim: body rotation, and when it began to fade
        self._leftover = Rotation.identity()
        self._blend_start_ns: int | None = None

    def push(self, pose: Pose) -> None:
        """A new pose, at its own time. One older than the newest is ignored."""
        if self._pose is not None and pose.t_ns < self._pose.t_ns:
            return
        before = self.aim(pose.t_ns)
        self._pose = pose
        if before.state not in ("tracking", "disabled"):
            self._blend_from(before, pose.t_ns)

    def aim(self, now_ns: int) -> Aim:
        """Where to look at this time."""
        state = self._state(now_ns)
        left = 1.0 - self._blend_fraction(now_ns)
        path = self._path(state, now_ns)
        if left > 0:
            path = _part(self._leftover, left) * path
        pose_ns = self._pose.t_ns if self._pose else None
        return Aim(path, state, pose_ns, moving=left > 0 or state == "easing")

    def recentre(self, now_ns: int) -> None:
        """Make the direction of the newest pose forward, at once; nothing before the first.

        Yaw is taken off about the vehicle's vertical (a drifting or turned reference), pitch and
        roll about the head (a tracker worn askew), so that turning the head stays a pure yaw.
        """
        if self._pose is None:
            return
        yaw, pitch, roll = head_angles_deg(self._pose.body_from_view)
        self._yaw_fix = body_from_view(-yaw, 0.0) * RDF_FROM_FRD
        self._mount_fix = (RDF_FROM_FRD * body_from_view(0.0, pitch, roll)).inv()
        if self._enabled:
            self._blend_start_ns = None

    def enable(self, now_ns: int) -> None:
        """Follow the tracker (again)."""
        self._switch(True, now_ns)

    def disable(self, now_ns: int) -> None:
        """Go to the centre and stay there, whatever the tracker says."""
        self._switch(False, now_ns)

    def _switch(self, enabled: bool, now_ns: int) -> None:
        if enabled != self._enabled:
            before = self.aim(now_ns)
            self._enabled = enabled
            self._blend_from(before, now_ns)

    def _blend_from(self, before: Aim, now_ns: int) -> None:
        path = self._path(self._state(now_ns), now_ns)
        self._leftover = before.body_from_view * path.inv()
        self._blend_start_ns = now_ns

    def _blend_fraction(self, now_ns: int) -> float:
        if self._blend_start_ns is None:
            return 1.0
        return _smooth(now_ns - self._blend_start_ns, self.settings.blend_s)

    def _silence_ns(self, now_ns: int) -> int:
        assert self._pose is not None
        return max(0, now_ns - self._pose.t_ns)

    def _state(self, now_ns: int) -> str:
        if not self._enabled:
            return "disabled"
        if self._pose is None:
            return "waiting"
        lost_s = self._silence_ns(now_ns) / NS_PER_S - self.settings.lost_after_s
        if lost_s <= 0:
            return "tracking"
        if lost_s <= self.settings.hold_s:
            return "holding"
        ease_end_s = self.settings.hold_s + self.settings.ease_s
        return "easing" if lost_s < ease_end_s else "centred"

    def _path(self, state: str, now_ns: int) -> Rotation:
        """The aim without the blend."""
        if self._pose is None or state in ("disabled", "centred"):
            return CENTRE
        head = self._yaw_fix * self._pose.body_from_view * self._mount_fix
        if state != "easing":
            return head
        start_s = self.settings.lost_after_s + self.settings.hold_s
        easing_ns = self._silence_ns(now_ns) - round(start_s * NS_PER_S)
        return slerp(head, CENTRE, _smooth(easing_ns, self.settings.ease_s))


def _smooth(elapsed_ns: int, duration_s: float) -> float:
    """0 at the start, 1 from the end on, without speed at both."""
    if elapsed_ns >= duration_s * NS_PER_S:
        return 1.0
    x = max(0.0, elapsed_ns / (duration_s * NS_PER_S))
    return x * x * (3.0 - 2.0 * x)


def _part(rotation: Rotation, fraction: float) -> Rotation:
    return Rotation.from_rotvec(fraction * rotation.as_rotvec())
