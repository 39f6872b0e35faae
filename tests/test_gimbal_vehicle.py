"""The vehicle's attitude on its way: from a source on its thread, by the station, to each frame."""

from __future__ import annotations

import argparse
import json
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.camera import Camera, make_camera
from freelook.cli import main, make_parser
from freelook.cli._stabilising import gimbal_settings, stabiliser_for, vehicle_for
from freelook.clock import NS_PER_MS, NS_PER_S
from freelook.gimbal import Gimbal, LensLimit, Stabiliser, parse_shape
from freelook.head import Head
from freelook.lens import Equidistant
from freelook.mailbox import Mailbox
from freelook.rotations import (
    FRD_FROM_RDF,
    RDF_FROM_FRD,
    angle_between_deg,
    body_from_view,
    from_wxyz,
    head_angles_deg,
)
from freelook.session import Session
from freelook.types import AccessUnit, Attitude, Counters, Frame, Picture, Pose, StreamInfo
from freelook.vehicle import Vehicle
from freelook.viewport import Viewport

WaitUntil = Callable[..., None]
LEVEL = Rotation.identity()


def rolled(deg: float) -> Rotation:
    return Rotation.from_euler("x", deg, degrees=True)


class ScriptedAttitude:
    """Yields what it is given, then waits for `close` or fails."""

    message = "waiting for the autopilot"

    def __init__(self, attitudes: list[Attitude], then: Exception | None = None) -> None:
        self.counters = Counters({"received": len(attitudes)})
        self._attitudes = attitudes
        self._then = then
        self._closed = threading.Event()

    def attitudes(self) -> Iterator[Attitude]:
        yield from self._attitudes
        if self._then is not None:
            raise self._then
        self._closed.wait(20)

    def close(self) -> None:
        self._closed.set()


def rolling(until_ms: int = 1000) -> list[Attitude]:
    """10 degrees a second to the right, at 100 Hz."""
    return [Attitude(t * NS_PER_MS, rolled(t / 100)) for t in range(0, until_ms + 1, 10)]


def test_attitudes_reach_the_stabiliser_and_are_announced(wait_until: WaitUntil) -> None:
    stabiliser = Stabiliser()
    stabiliser.set_mode("horizon")
    vehicle = Vehicle(stabiliser, ScriptedAttitude(rolling()))
    seen: list[int] = []
    vehicle.start(lambda attitude: seen.append(attitude.t_ns))
    try:
        wait_until(lambda: len(seen) == 101)
        base = stabiliser.at(NS_PER_S, NS_PER_S // 2)
        assert head_angles_deg(base.body_from_base * FRD_FROM_RDF)[2] == pytest.approx(-5)
        status = vehicle.status()
        assert (status.mode, status.effective, status.state) == ("horizon", "horizon", "steady")
        assert (status.message, status.received) == ("", 101)
        stabiliser.at(3 * NS_PER_S, 3 * NS_PER_S)
        message = vehicle.status().message
        assert message == (
            "no attitude for 2.0 s: body mode instead of horizon; waiting for the autopilot"
        )
    finally:
        vehicle.close()


def test_a_source_that_fails_is_announced(wait_until: WaitUntil) -> None:
    stabiliser = Stabiliser()
    stabiliser.set_mode("world")
    vehicle = Vehicle(stabiliser, ScriptedAttitude([], then=OSError("unplugged")))
    vehicle.start()
    stabiliser.at(0, 0)
    wait_until(lambda: "unplugged" in vehicle.status().message)
    vehicle.close()


def test_without_a_source_only_body_mode_is_without_complaint() -> None:
    vehicle = Vehicle(Stabiliser())
    vehicle.start()
    assert vehicle.status().message == ""
    vehicle.stabiliser.set_mode("horizon")
    assert "start with --attitude" in vehicle.status().message
    vehicle.close()


def test_what_a_source_finds_of_its_time_is_told() -> None:
    source = _FindsItsTime([])
    assert Vehicle(Stabiliser(), source).status().offset == "3 ms late"
    assert Vehicle(Stabiliser(), ScriptedAttitude([])).status().offset == ""


class _FindsItsTime(ScriptedAttitude):
    report = "3 ms late"


def test_eyes_front_and_jumps_reach_the_heads_status() -> None:
    gimbal = Gimbal()
    head = Head("test", _NoTracker(), gimbal)
    for t_ms, yaw in ((0, 0), (10, 0), (20, 80)):
        gimbal.push(Pose(body_from_view(yaw, 0), t_ms * NS_PER_MS))
    head.eyes_front(20 * NS_PER_MS)
    status = head.status(20 * NS_PER_MS)
    assert status.state == "front"
    assert status.message == "eyes front: looking straight ahead until enabled"
    assert status.counters == {"jumps": 1}
    head.enable(30 * NS_PER_MS)
    assert head.aim(40 * NS_PER_MS).state == "tracking"


def test_a_trackers_buttons_reach_the_gimbal() -> None:
    tracker = _WithButtons()
    head = Head("test", tracker, clock=lambda: NS_PER_S)
    head.start()
    assert tracker.on_action is not None
    states = []
    for action in ("toggle", "toggle", "eyes_front", "toggle", "eyes_front", "eyes_front"):
        tracker.on_action(action)
        states.append(head.aim(NS_PER_S).state)
    assert states == ["disabled", "waiting", "front", "waiting", "front", "waiting"]
    tracker.on_action("recentre")
    head.close()


class _NoTracker:
    counters = Counters()
    message = ""

    def poses(self) -> Iterator[Pose]:
        return iter(())

    def close(self) -> None:
        pass


class _WithButtons(_NoTracker):
    on_action: Callable[[str], None] | None = None


# --- a session and the station --------------------------------------------------------------------


def camera() -> Camera:
    return make_camera((320, 240), Equidistant(f=100.0), field_deg=180)


class _Recorder:
    """A renderer that notes where it looks."""

    def __init__(self) -> None:
        self.looked: list[Rotation] = []

    def render(
        self, picture: Picture, camera: Camera, camera_from_view: Rotation, viewport: Viewport
    ) -> Picture:
        self.looked.append(camera.camera_from_body.inv() * camera_from_view)
        return picture


def frame_at(capture_ms: int) -> Frame:
    return Frame(Picture("gray", (np.zeros((240, 320), np.uint8),)), capture_ms * NS_PER_MS)


def test_a_session_aims_with_the_attitude_at_the_frames_capture_also_when_drawn_again() -> None:
    stabiliser = Stabiliser()
    stabiliser.set_mode("horizon")
    for attitude in rolling():
        stabiliser.push(attitude)
    gimbal, renderer = Gimbal(stabiliser=stabiliser), _Recorder()
    mailbox: Mailbox[Frame] = Mailbox()
    aim = lambda now_ns, capture_ns: gimbal.aim(now_ns, capture_ns).body_from_view  # noqa: E731
    session = Session(mailbox, camera(), aim, renderer, Viewport((64, 48)))
    mailbox.put(frame_at(600))
    session.step(900 * NS_PER_MS)
    session.step(950 * NS_PER_MS)
    assert [head_angles_deg(look)[2] for look in renderer.looked] == pytest.approx([-6, -6])


def test_a_session_keeps_the_view_in_the_lens_if_asked() -> None:
    for limited, most_deg in ((True, 45.0), (False, 80.0)):
        mailbox, renderer = Mailbox[Frame](), _Recorder()
        aim = lambda _now_ns, _capture_ns: body_from_view(80, 0)  # noqa: E731
        limit = LensLimit(camera()) if limited else None
        session = Session(mailbox, camera(), aim, renderer, Viewport((64, 48), 90), limit)
        mailbox.put(frame_at(0))
        session.step(0)
        yaw = head_angles_deg(renderer.looked[0])[0]
        assert 0.8 * most_deg < yaw <= most_deg + 1e-9


class _Viewer:
    def __init__(self) -> None:
        self.heard: list[dict[str, Any]] = []

    def send(self, text: str) -> bool:
        self.heard.append(json.loads(text))
        return True


def test_every_frame_carries_the_base_of_its_capture() -> None:
    station_module = pytest.importorskip("freelook.web.station")
    stabiliser = Stabiliser()
    stabiliser.set_mode("horizon")
    for attitude in rolling():
        stabiliser.push(attitude)
    station = station_module.Station(
        None,
        camera(),
        {},
        station_module.About("test"),
        vehicle=Vehicle(stabiliser),
        clock=lambda: NS_PER_S,
    )
    viewer = _Viewer()
    for rtp, capture_ms in ((1, 300), (2, 800), (3, 500)):
        station.frame_sent(viewer, rtp, capture_ms * NS_PER_MS)
    for message, roll in zip(viewer.heard, (-3, -8, -5), strict=True):
        view = FRD_FROM_RDF * from_wxyz(message["base"])
        assert head_angles_deg(view)[2] == pytest.approx(roll, abs=1e-4)
    stabiliser.set_mode("body")
    station._clock = lambda: 9 * NS_PER_S
    for rtp in (4, 5):
        station.frame_sent(viewer, rtp, NS_PER_S + rtp)
        station._clock = lambda: 19 * NS_PER_S
    assert "base" not in viewer.heard[-1], "nothing to say in body mode"


def test_a_stabilised_pose_is_told_in_parts_that_make_the_whole() -> None:
    messages = pytest.importorskip("freelook.web.messages")
    stabiliser = Stabiliser()
    stabiliser.set_mode("world")
    for t_ms in range(0, 1001, 10):
        attitude = Rotation.from_euler("ZYX", [t_ms / 50, 5, t_ms / 100], degrees=True)
        stabiliser.push(Attitude(t_ms * NS_PER_MS, attitude))
    gimbal = Gimbal(stabiliser=stabiliser)
    gimbal.aim(0, 0)
    gimbal.push(Pose(body_from_view(50, 10, 5), NS_PER_S))
    now_ns = 1_200 * NS_PER_MS
    aim = gimbal.aim(now_ns, NS_PER_S)
    assert aim.moving
    told = json.loads(messages.pose("one", aim, now_ns))
    base = json.loads(messages.frame(1, NS_PER_S, aim.base))["base"]
    whole = from_wxyz(told["left"]) * from_wxyz(base) * from_wxyz(told["q"])
    assert angle_between_deg(whole, RDF_FROM_FRD * aim.body_from_view) < 1e-4
    assert told["based"] is True


# --- the command line ---------------------------------------------------------------------------


LOG = ("--attitude-offset", "100.5", "--attitude", "LOG")


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (["--mode", "horizon"], "--mode horizon needs the vehicle's attitude: add --attitude"),
        (["--mode", "point", *LOG], "needs something to point at"),
        (["--mode", "point", "--point", "x", *LOG], "'x' is no target"),
    ],
)
def test_render_says_what_is_wrong_with_a_mode(
    options: list[str], why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "log.csv"
    log.write_text("t_s,qw,qx,qy,qz\n100,1,0,0,0\n101,1,0,0,0\n")
    given = [str(log) if option == "LOG" else option for option in options]
    assert main(["render", "in.png", "out.png", "--lens", "demo", *given]) == 2
    assert why in capsys.readouterr().err


class _Ingest:
    """Notes who listens, and hands out mailboxes."""

    def __init__(self) -> None:
        self.listeners: list[Callable[[AccessUnit], None]] = []

    def subscribe(self, listener: Callable[[AccessUnit], None]) -> None:
        self.listeners.append(listener)

    def frames(self) -> Mailbox[Frame]:
        return Mailbox()


def flying(*options: str) -> argparse.Namespace:
    return make_parser().parse_args(["fly", "rtp://127.0.0.1:5004", "--lens", "demo", *options])


def test_a_logs_times_follow_the_recording_that_is_flown_also_round_and_round(
    tmp_path: Path,
) -> None:
    log = tmp_path / "log.csv"
    rows = [f"{t / 10},{t}.0,0,0" for t in range(31)]
    log.write_text("t_s,roll_deg,pitch_deg,yaw_deg\n" + "\n".join(rows) + "\n")
    ingest = _Ingest()
    args = flying("--mode", "horizon", "--attitude", str(log), "--attitude-offset", "1")
    vehicle = vehicle_for(args, cast(Any, ingest), camera())
    (listener,) = ingest.listeners
    for began_s in (100, 200):
        for media_ms, key in ((0, True), (500, False), (1000, True)):
            capture_ns = began_s * NS_PER_S + media_ms * NS_PER_MS
            listener(AccessUnit(StreamInfo("h264"), b"", key, capture_ns, media_ms * NS_PER_MS))
            vehicle.stabiliser.at(capture_ns + NS_PER_S, capture_ns)
            settled = vehicle.stabiliser.at(capture_ns + 3 * NS_PER_S, capture_ns)
            roll = head_angles_deg(settled.body_from_base * FRD_FROM_RDF)[2]
            assert roll == pytest.approx(-(10 + media_ms / 100)), "a second into the log"


def test_a_live_attitudes_time_is_found_unless_it_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    source = ScriptedAttitude([])
    monkeypatch.setattr("freelook.attitudes.open_attitude", lambda _spec: source)
    live = ("--mode", "world", "--attitude", "live")
    found = vehicle_for(flying(*live), cast(Any, _Ingest()), camera())
    assert "not found yet" in found.status().offset
    told = vehicle_for(flying(*live, "--attitude-offset", "-0.1"), cast(Any, _Ingest()), camera())
    assert told.status().offset == ""
    assert told.stabiliser.offset_ns == -100 * NS_PER_MS
    for vehicle in (found, told):
        vehicle.close()


def test_what_is_made_of_the_head_comes_from_the_command_line() -> None:
    args = flying("--gain", "yaw=2", "--invert", "roll", "--ahead", "35", "--hold", "3")
    assert stabiliser_for(flying("--follow", "2.5")).settings.follow_s == 2.5
    settings = gimbal_settings(args)
    assert settings.shape == parse_shape("yaw=2", "", "roll")
    assert (settings.ahead_s, settings.hold_s) == (0.035, 3.0)


def test_render_in_horizon_mode_is_the_view_rolled_back(tmp_path: Path) -> None:
    """One picture, taken with the right wing 25 degrees down: the level view of it is the view
    with the head rolled 25 degrees to the left."""
    pictures = pytest.importorskip("freelook.media.pictures")
    cv2 = pytest.importorskip("cv2")
    rng = np.random.default_rng(0)
    noise = cv2.GaussianBlur(rng.integers(0, 255, (960, 960), dtype=np.uint8), (0, 0), 5)
    cv2.imwrite(str(tmp_path / "in.png"), noise)
    quaternion = rolled(25).as_quat()[[3, 0, 1, 2]]
    row = ",".join(map(str, quaternion))
    (tmp_path / "log.csv").write_text(f"t_s,qw,qx,qy,qz\n0,{row}\n1,{row}\n")

    def rendered(name: str, *options: str) -> Any:
        out = tmp_path / name
        common = ["--lens", "demo", "--size", "320x240", "--yaw", "20"]
        assert main(["render", str(tmp_path / "in.png"), str(out), *common, *options]) == 0
        return pictures.read_picture(str(out)).picture.planes[0].astype(float)

    log = ["--attitude", str(tmp_path / "log.csv"), "--attitude-offset", "0"]
    level = rendered("a.png", "--mode", "horizon", *log)
    poses = tmp_path / "poses.csv"
    turned = RDF_FROM_FRD * rolled(-25) * body_from_view(20, 0)
    w, x, y, z = turned.as_quat()[[3, 0, 1, 2]]
    poses.write_text(f"t_s,qw,qx,qy,qz\n0,{w},{x},{y},{z}\n")
    common = ["--lens", "demo", "--size", "320x240", "--poses", str(poses)]
    assert main(["render", str(tmp_path / "in.png"), str(tmp_path / "b.png"), *common]) == 0
    expected = pictures.read_picture(str(tmp_path / "b.png")).picture.planes[0].astype(float)
    assert np.abs(level - expected).max() <= 1
    assert np.abs(level - rendered("c.png")).mean() > 3, "and not the view as it was"
