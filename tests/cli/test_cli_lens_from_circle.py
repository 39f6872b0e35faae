"""`freelook lens from-circle`, and the circle in place of a missing --lens."""

from __future__ import annotations

import json
import re
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from freelook import sources
from freelook.calibration.circle import one_parameter_models
from freelook.camera import Camera
from freelook.cli import _circles, fly, main
from freelook.cli._circles import look_at
from freelook.cli.lens import from_circle
from freelook.errors import FreelookError, SourceError
from freelook.formats import load_camera, load_profile
from freelook.media.pictures import read_picture
from freelook.sources.file import FileSource
from freelook.types import AccessUnit, Counters

SIZE = (480, 480)


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """4 seconds of the demo camera at half its size, with several key pictures."""
    path = tmp_path_factory.mktemp("circle") / "a flight.mp4"
    command = ["simulate", str(path), "--seconds", "4", "--fps", "10", "--size", "480x480"]
    assert main(command) == 0
    return path


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def truth() -> Camera:
    return load_camera("demo").resized(SIZE)


def errors(found: Camera, true: Camera) -> tuple[float, float]:
    """The largest distances over the common field: pixels, and degrees between the rays that the
    two see in one pixel."""
    theta, phi = np.meshgrid(
        np.linspace(0, 0.995 * min(found.theta_max, true.theta_max), 95),
        np.linspace(0, 2 * np.pi, 73),
    )
    sine = np.sin(theta)
    rays = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)
    pixels = true.project(rays)
    apart_px = np.linalg.norm(found.project(rays) - pixels, axis=-1)
    chord = np.linalg.norm(found.ray(pixels) - rays, axis=-1)
    return float(np.nanmax(apart_px)), float(np.degrees(2 * np.arcsin(np.nanmax(chord) / 2)))


def test_simulated_flight_gives_back_its_camera(
    flight: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["lens", "from-circle", str(flight), "--fov", "188"]) == 0
    out = capsys.readouterr().out
    profile = load_profile(here / "a flight.lens.json")
    assert profile.camera.size == SIZE
    apart_px, apart_deg = errors(profile.camera, truth())
    # measured: 0.02 px and 0.01 degrees. A pixel is 0.4 degrees here, so a tenth of one, which no
    # view shows; coded video blurs the rim, but alike on all sides.
    assert apart_px < 0.1
    assert apart_deg < 0.04
    assert "188 degrees" in profile.source
    assert "said, not measured" in profile.source
    assert "radius  237.1" in out
    assert "360 of 360 degrees" in out
    assert "2.52 pixels per degree" in out
    assert "--lens 'a flight.lens.json'" in out


def test_a_wrong_field_of_view_costs_as_many_degrees_at_the_rim(flight: Path, here: Path) -> None:
    assert main(["lens", "from-circle", str(flight), "--fov", "180", "-o", "lens.json"]) == 0
    _, apart_deg = errors(load_camera("lens.json"), truth())
    # 94 degrees taken for 90; compared up to 99.5 percent of the smaller field
    assert apart_deg == pytest.approx(0.995 * 90 * (1 - 90 / 94), abs=0.02)


def test_drawing_shows_what_was_found(flight: Path, here: Path) -> None:
    command = ["lens", "from-circle", str(flight), "--fov", "188", "-o", "lens.json"]
    assert main(command) == 0
    drawn = cv2.imread("lens.png")
    assert drawn is not None
    scale = drawn.shape[1] / SIZE[0]
    assert drawn.shape[0] > scale * SIZE[1]  # a caption below
    used = (np.abs(drawn.astype(int) - (60, 220, 255)).sum(axis=-1) < 60).nonzero()
    rows, columns = (np.array(used) + 0.5) / scale - 0.5
    picture = rows < SIZE[1] - 1
    away = np.hypot(columns - 239.5, rows - 239.5)[picture] - 237.1
    assert len(away) > 1000
    assert np.abs(away).max() < 3  # every one of them on the rim
    angles = np.arctan2(rows[picture] - 239.5, columns[picture] - 239.5)
    assert len(np.unique(np.round(np.degrees(angles) / 10))) == 37  # on all sides


def test_numbers_as_json(flight: Path, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["lens", "from-circle", str(flight), "--fov", "200", "--model", "equisolid"]
    assert main([*command, "-o", "lens.json", "--draw", "found.jpg", "--json"]) == 0
    out, err = capsys.readouterr()
    assert not err  # no bar beside it
    facts = json.loads(out)
    assert facts["center"] == pytest.approx([239.5, 239.5], abs=0.1)
    assert facts["radius_px"] == pytest.approx(237.1, abs=0.1)
    assert facts["aspect"] == 1
    assert (facts["model"], facts["fov_deg"], facts["rival"]) == ("equisolid", 200, None)
    axis, rim = facts["pixels_per_degree"]
    f = 237.07 / (2 * np.sin(np.radians(50)))
    assert axis == pytest.approx(np.radians(f), rel=1e-3)
    assert rim == pytest.approx(np.radians(f * np.cos(np.radians(50))), rel=1e-3)
    assert Path("found.jpg").read_bytes()[:2] == b"\xff\xd8"


def test_several_pictures_of_one_camera(flight: Path, here: Path) -> None:
    for start in (5, 20, 35):
        assert main(["simulate", f"{start}.png", "--size", "480x480", "--start", str(start)]) == 0
    command = ["lens", "from-circle", "5.png", "20.png", "35.png", "--fov", "188"]
    assert main([*command, "-o", "lens.json"]) == 0
    apart_px, _ = errors(load_camera("lens.json"), truth())
    assert apart_px < 0.1


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["{flight}"], "how many degrees does the lens see.* --fov DEG.* 180"),
        (["{flight}", "--fov", "500"], "field of view of 500"),
        (["{flight}", "--fov", "nan"], "field of view of nan"),
        (["{flight}", "--fov", "180", "--model", "orthographic", "--frames", "0"], "1 or more"),
        (["{flight}", "--fov", "190", "--model", "orthographic"], "orthographic lens.* 190"),
        (["{flight}", "--fov", "180", "-o", "there.json"], "there.json exists.*--overwrite"),
        (["{flight}", "--fov", "180", "--draw", "there.png"], "there.png exists"),
        (["{flight}", "--fov", "180", "--draw", "a.xyz"], "a.xyz.*try .png"),
        (["{flight}", "--fov", "180", "-o", "no/where.json"], "folder no does not exist"),
        (["missing.mp4", "--fov", "180"], "missing.mp4.*No such file"),
        (["there.json", "--fov", "180"], "not a video file"),
        (["grey.png", "--fov", "180"], "no image circle found.*uniform"),
        (["grey.png", "small.png", "--fov", "180"], "240 x 160 and of 120 x 80"),
        (["{flight}", "grey.png", "--fov", "180"], "not a mixture"),
    ],
)
def test_mistakes_are_explained(
    arguments: list[str],
    says: str,
    flight: Path,
    here: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for name in ("there.json", "there.png"):
        Path(name).write_text("precious, and no video")
    cv2.imwrite("grey.png", np.full((160, 240, 3), 90, np.uint8))
    cv2.imwrite("small.png", np.full((80, 120, 3), 90, np.uint8))
    filled = [argument.format(flight=flight) for argument in arguments]
    assert main(["lens", "from-circle", *filled]) == 2
    message = capsys.readouterr().err.splitlines()[-1]
    assert message.startswith("freelook lens: ")
    assert re.search(says, message)
    for name in ("there.json", "there.png"):
        assert Path(name).read_text() == "precious, and no video"
    assert not Path("a flight.lens.json").exists()


def test_models_offered_are_those_that_a_circle_determines() -> None:
    assert sorted(from_circle.MODELS) == sorted(one_parameter_models())


def test_unknown_models_are_listed(flight: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["lens", "from-circle", str(flight), "--fov", "180", "--model", "fisheye"])
    message = capsys.readouterr().err
    for name in ("equidistant", "equisolid", "stereographic", "orthographic"):
        assert name in message


def test_render_without_lens_takes_the_circle_and_says_so(
    flight: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    view = ["--yaw", "25", "--pitch", "-10", "--size", "160x120"]
    main(["simulate", "shot.png", "--size", "480x480", "--start", "12"])
    capsys.readouterr()
    assert main(["render", "shot.png", "without.png", "--fov", "188", *view]) == 0
    message = capsys.readouterr().err
    assert len(message.strip().splitlines()) == 2
    assert "no --lens: image circle found (centre 239.5, 239.5" in message
    assert "equidistant lens of 188 degrees (as --fov says)" in message
    assert "freelook lens from-circle shot.png --fov 188 -o lens.json" in message
    assert main(["render", "shot.png", "with.png", "--lens", "demo", *view]) == 0
    pictures = [read_picture(name).picture.planes[0] for name in ("without.png", "with.png")]
    error = np.abs(pictures[0].astype(int) - pictures[1])
    # a camera that is 0.02 px off: edges differ by a few levels
    assert error.mean() < 0.5
    assert np.percentile(error, 99) < 12
    assert np.ptp(pictures[1]) > 100


def test_without_fov_180_degrees_are_assumed_aloud(
    flight: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["render", str(flight), "out.mp4", "--size", "64x64"]) == 0
    message = capsys.readouterr().err
    assert "equidistant lens of 180 degrees (assumed, --fov changes it)" in message
    assert f"freelook lens from-circle '{flight}' --fov 180" in message  # it has a space in it


@pytest.mark.parametrize("command", ["render", "fly"])
def test_fov_and_lens_exclude_each_other(
    command: str, flight: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [str(flight), *(["out.mp4"] if command == "render" else [])]
    assert main([command, *files, "--lens", "demo", "--fov", "188"]) == 2
    assert "--fov is for when there is no --lens" in capsys.readouterr().err


def test_no_circle_and_no_lens(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cv2.imwrite("grey.png", np.full((160, 240, 3), 90, np.uint8))
    assert main(["render", "grey.png", "out.png"]) == 2
    message = capsys.readouterr().err
    assert "there is no --lens, and in grey.png no image circle found" in message
    assert "--lens PROFILE, a file or one of: " in message
    assert not Path("out.png").exists()


class Flown:
    """Stands for the station: keeps the camera it is given."""

    camera: Camera | None = None

    def __call__(self, args: Any, ingest: Any, camera: Camera, *rest: Any, **named: Any) -> None:
        self.camera = camera


@pytest.fixture
def flown(monkeypatch: pytest.MonkeyPatch) -> Flown:
    station = Flown()
    monkeypatch.setattr(fly, "fly", station)
    return station


class LiveCamera:
    """A recording that is no file to those who ask; counts who has it open."""

    opened = 0

    def __init__(self, path: Path, skip: int = 0) -> None:
        self.counters = Counters()
        self._file = FileSource(str(path), loop=False, pace=False, clock=lambda: 0)
        self._skip = skip
        LiveCamera.opened += 1

    def units(self) -> Iterator[AccessUnit]:
        for number, unit in enumerate(self._file.units()):
            if number >= self._skip:
                yield unit

    def close(self) -> None:
        self._file.close()
        LiveCamera.opened -= 1


class SilentCamera:
    """Nothing comes until somebody closes it."""

    def __init__(self) -> None:
        self.counters = Counters()
        self._closed = threading.Event()

    def units(self) -> Iterator[AccessUnit]:
        self._closed.wait(20)
        yield from ()

    def close(self) -> None:
        self._closed.set()


class BrokenCamera(SilentCamera):
    def units(self) -> Iterator[AccessUnit]:
        raise SourceError("the cable is out", retry=True)
        yield


def test_fly_without_lens_looks_at_the_recording(flight: Path, flown: Flown) -> None:
    assert main(["fly", str(flight), "--fov", "188", "--mount", "0,-90,0"]) == 0
    assert flown.camera is not None
    level = truth()
    looking_down = np.array([0.0, 0.0, 1.0]) @ flown.camera.camera_from_body.as_matrix()
    np.testing.assert_allclose(looking_down, [0, 0, 1], atol=1e-9)
    assert errors(flown.camera, level)[0] < 0.1


def test_fly_without_lens_looks_at_the_first_seconds_of_a_live_camera(
    flight: Path,
    flown: Flown,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    LiveCamera.opened = 0
    monkeypatch.setattr(sources, "open_source", lambda *_, **__: LiveCamera(flight, skip=3))
    assert main(["fly", "x://camera", "--fov", "188"]) == 0
    assert flown.camera is not None
    assert errors(flown.camera, truth())[0] < 0.1
    assert LiveCamera.opened == 0  # free for the station
    assert "no --lens: image circle found" in capsys.readouterr().err


def test_a_live_camera_is_looked_at_for_two_seconds_from_a_key_picture(
    flight: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sources, "open_source", lambda *_, **__: LiveCamera(flight))
    assert look_at(["x://camera"], 1000, quiet=True).count == pytest.approx(21, abs=1)  # at 10 fps
    assert look_at(["x://camera"], 5, quiet=True).count == 5
    keys = list(FileSource(str(flight), loop=False, pace=False, clock=lambda: 0).key_units(100))
    assert len(keys) > 2
    monkeypatch.setattr(sources, "open_source", lambda *_, **__: LiveCamera(flight, skip=1))
    late = look_at(["x://camera"], 1000, quiet=True)
    assert late.count > 5
    assert late.brightness.mean.std() > 20  # no grey of pictures whose beginning is missing


@pytest.mark.parametrize(
    ("camera", "says"),
    [(SilentCamera, "no whole picture came within"), (BrokenCamera, "the cable is out")],
)
def test_a_live_camera_that_shows_nothing(
    camera: type[SilentCamera],
    says: str,
    flown: Flown,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sources, "open_source", lambda *_, **__: camera())
    monkeypatch.setattr(_circles, "WAIT_S", 0.02)
    assert main(["fly", "x://camera"]) == 2
    message = capsys.readouterr().err
    assert says in message
    assert "start the camera first, or give --lens" in message
    assert flown.camera is None


def test_a_recording_with_one_key_picture_is_decoded_from_its_beginning(here: Path) -> None:
    command = ["simulate", "short.mp4", "--seconds", "0.5", "--fps", "10", "--size", "240x240"]
    assert main(command) == 0
    assert look_at(["short.mp4"], 24, quiet=True).count == 5
    assert look_at(["short.mp4"], 2, quiet=True).count in (2, 3)


def test_key_pictures_come_from_all_over_a_recording(flight: Path) -> None:
    source = FileSource(str(flight), loop=False, pace=False, clock=lambda: 0)
    units = list(source.key_units(8))
    times_s = [unit.media_ns / 1e9 for unit in units if unit.media_ns is not None]
    assert all(unit.key for unit in units)
    assert times_s == sorted(set(times_s))
    assert times_s[0] < 1
    assert times_s[-1] > 2


def test_mixtures_are_refused() -> None:
    with pytest.raises(FreelookError, match="not a mixture"):
        look_at(["a.mp4", "b.mp4"])


@pytest.mark.data
def test_office_recording_from_end_to_end(
    shared_data: Path, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    video = str(shared_data / "lilyth_video" / "cam2.mp4")
    assert main(["lens", "from-circle", video, "--fov", "188", "-o", "cam2.json"]) == 0
    camera = load_camera("cam2.json")
    # see test_circle.py: read by eye, (710.3, 650.1) and 718.4
    assert camera.center == pytest.approx((710.3, 650.1), abs=2)
    assert camera.lens.radius(np.array([camera.theta_max]))[0] == pytest.approx(718.4, abs=3)
    assert "6 pictures, 1440 x 1440" in capsys.readouterr().out
