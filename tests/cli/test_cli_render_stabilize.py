"""`freelook render --stabilize`: from a video and a real autopilot's log to a steady view."""

from __future__ import annotations

import argparse
import itertools
import re
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from freelook.attitude_track import AttitudeTrack
from freelook.cli import main
from freelook.cli._recording_time import recording_offset_s, seconds_or_auto
from freelook.clock import NS_PER_S
from freelook.formats import Profile
from freelook.formats import freelook as profile_format
from freelook.sinks import open_sink
from freelook.types import ColorSpace, Frame
from logged_flight import FRAME_NS, SIZE, px4_attitude, simulated, small_fisheye

pytestmark = pytest.mark.data

START_NS = 2_500_000_000  # into the log, whose own time begins at 112.57 s
FRAMES = 75


@pytest.fixture(scope="module")
def folder(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fisheye video of 2.5 s and its lens profile."""
    folder = tmp_path_factory.mktemp("stabilize")
    track = px4_attitude(shared_data)
    camera = simulated(track)
    sink = open_sink(
        str(folder / "flight.mp4"), size=SIZE, fps=NS_PER_S / FRAME_NS, color=ColorSpace()
    )
    for k in range(FRAMES):
        picture = camera.picture(track.start_ns + START_NS + k * FRAME_NS)
        sink.write(Frame(picture, k * FRAME_NS, k * FRAME_NS))
    sink.close()
    (folder / "lens.json").write_text(profile_format.write(Profile(small_fisheye())))
    return folder


def plain(folder: Path, out: str, *options: str) -> int:
    fixed = ["--lens", str(folder / "lens.json"), "--size", "160x120", "--hfov", "80"]
    return main(["render", str(folder / "flight.mp4"), str(folder / out), *fixed, *options])


def render(folder: Path, shared_data: Path, out: str, *options: str, log: str = "") -> int:
    log = log or str(shared_data / "px4_log/vehicle_attitude.csv")
    return plain(folder, out, "--attitude", log, *options)


def gray_frames(path: Path) -> NDArray[np.uint8]:
    with av.open(str(path)) as container:
        return np.array([f.to_ndarray(format="gray") for f in container.decode(video=0)])


def motion_px(frames: NDArray[np.uint8]) -> float:
    """The rms shift from frame to frame, by correlating them."""
    window = np.hanning(frames.shape[1])[:, None] * np.hanning(frames.shape[2])
    shifts = [
        cv2.phaseCorrelate(a.astype(float), b.astype(float), window)[0]
        for a, b in itertools.pairwise(frames)
    ]
    return float(np.sqrt(np.mean(np.square(shifts))))


def test_the_view_is_steadied_and_the_time_is_found_and_told(
    folder: Path, shared_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert plain(folder, "raw.mp4") == 0
    assert render(folder, shared_data, "world.mp4", "--stabilize", "world") == 0
    told = capsys.readouterr().err
    # the truth is 112.574307 + 2.5 s
    assert "flight.mp4 begins at 115.07" in told
    assert "confidence" in told
    raw, steady = (motion_px(gray_frames(folder / f"{n}.mp4")) for n in ("raw", "world"))
    assert raw > 2
    assert steady < 0.3 * raw


def test_horizon_is_mode_horizon(folder: Path, shared_data: Path) -> None:
    told = ["--attitude-offset", "115.0743"]
    assert render(folder, shared_data, "a.mp4", "--stabilize", "horizon", *told) == 0
    assert render(folder, shared_data, "b.mp4", "--mode", "horizon", *told) == 0
    a, b = (gray_frames(folder / f"{name}.mp4") for name in "ab")
    assert len(a) == FRAMES
    assert np.array_equal(a, b)


def test_smooth_is_calmer_than_raw_and_stays_in_the_lens(
    folder: Path, shared_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told = ["--attitude-offset", "115.0743"]
    assert plain(folder, "c.mp4") == 0
    assert (
        render(folder, shared_data, "d.mp4", "--stabilize", "smooth", "--smooth-hz", "0.3", *told)
        == 0
    )
    assert "no attitude" not in capsys.readouterr().err
    raw, calm = gray_frames(folder / "c.mp4"), gray_frames(folder / "d.mp4")
    assert motion_px(calm) < 0.3 * motion_px(raw)
    # black is 16 in limited range, and nothing in this world is as dark in the corners
    corners = calm[:, [0, 0, -1, -1], [0, -1, 0, -1]]
    assert corners.min() > 25


def test_smooth_tells_when_the_lens_leaves_too_little_room(
    folder: Path, shared_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told = ["--attitude-offset", "115.0743", "--stabilize", "smooth", "--smooth-hz", "0.05"]
    assert render(folder, shared_data, "e.mp4", *told, "--yaw", "52") == 0
    assert "less smooth than asked for" in capsys.readouterr().err
    assert render(folder, shared_data, "f.mp4", *told, "--yaw", "52", "--hfov", "150") == 2
    assert "try --hfov" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--stabilize", "smooth", "--mode", "horizon"], "either --mode or --stabilize"),
        ([], "--attitude changes nothing without --stabilize or --mode"),
        (["--smooth-hz", "1"], "--smooth-hz is for --stabilize smooth"),
        (
            ["--stabilize", "smooth", "--smooth-hz", "99", "--attitude-offset", "115"],
            "0.02 to 10 Hz",
        ),
        (["--stabilize", "smooth", "--attitude-offset", "0"], "the video begins at 0.000 s of it"),
        (["--stabilize", "world", "--attitude-offset", "900"], "give --attitude-offset"),
    ],
)
def test_what_cannot_be_is_said(
    folder: Path,
    shared_data: Path,
    capsys: pytest.CaptureFixture[str],
    options: list[str],
    complaint: str,
) -> None:
    assert render(folder, shared_data, "no.mp4", *options) == 2
    assert complaint in capsys.readouterr().err
    assert not (folder / "no.mp4").exists()


@pytest.mark.parametrize("text", ["nan", "inf", "-1e300"])
def test_an_offset_that_is_no_time_is_refused(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match="not a time in seconds"):
        seconds_or_auto(text)


def test_a_log_that_shows_no_such_motion_is_not_believed(
    folder: Path, shared_data: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """The last minute of the log, in which the vehicle lies still."""
    lines = (shared_data / "px4_log/vehicle_attitude.csv").read_text().splitlines()
    (tmp_path / "still.csv").write_text("\n".join([lines[0], *lines[1500:]]))
    asked = ["--stabilize", "horizon"]
    assert render(folder, shared_data, "no.mp4", *asked, log=str(tmp_path / "still.csv")) == 2
    told = capsys.readouterr().err
    assert "do not show it surely" in told or "too little time in common" in told
    assert "--attitude-offset" in told


def test_a_wrong_mounting_is_told_with_the_right_one(
    folder: Path, shared_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The camera is said to look right, but looks forward."""
    assert render(folder, shared_data, "no.mp4", "--stabilize", "horizon", "--mount=90,0,0") == 2
    told = capsys.readouterr().err
    mount = re.search(r"--mount=(-?\d+),(-?\d+),(-?\d+): try that", told)
    assert mount, told
    assert [abs(int(angle)) for angle in mount.groups()] == pytest.approx([0, 0, 0], abs=2)


def test_a_video_s_own_telemetry_has_its_time() -> None:
    args = argparse.Namespace(
        attitude_offset=None, attitude="telemetry:a/../b.mp4?orientation=XYZ", input="b.mp4"
    )
    still = AttitudeTrack(np.array([0, 1]), Rotation.from_rotvec(np.zeros((2, 3))))
    assert recording_offset_s(args, small_fisheye(), still) == 0.0


def test_notes_of_a_log_are_told(
    folder: Path, tmp_path: Path, shared_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    still = str(tmp_path / "still.png")
    with av.open(str(folder / "flight.mp4")) as video:
        cv2.imwrite(still, next(video.decode(video=0)).to_ndarray(format="gray"))
    log = str(shared_data / "px4_log/sensor_combined.csv")
    asked = ["--attitude", log, "--attitude-offset", "115.07", "--stabilize", "horizon"]
    lens = ["--lens", str(folder / "lens.json"), "--hfov", "60", "--size", "64x48"]
    assert main(["render", still, str(tmp_path / "o.png"), *lens, *asked]) == 0
    assert "heading starts at 0 and drifts" in capsys.readouterr().err
