"""The circle finder on simulated flights, where the truth is known, and on real cameras."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from freelook.calibration.circle import (
    Brightness,
    ImageCircle,
    camera_from_circle,
    circle_in,
    find_circle,
    one_parameter_models,
)
from freelook.camera import Camera, make_camera
from freelook.errors import ProfileError
from freelook.formats import load_camera
from freelook.lens import Equidistant, Perspective
from freelook.media.pictures import read_picture
from freelook.media.planes import picture_from_av
from freelook.simulation.camera import SimulatedCamera, pixel_deg
from freelook.simulation.world import World
from freelook.types import ColorSpace

Pictures = NDArray[np.uint8]
Floats = NDArray[np.float64]

CENTER_PX, RADIUS_PX = 2.0, 3.0  # asked of the finder wherever the truth is known
# On simulated pictures, whose rims are sharp or evenly blurred, it is better: measured over 124 of
# them, at most 0.10 and 0.47.
SIMULATED_CENTER_PX, SIMULATED_RADIUS_PX = 0.3, 0.9
FIELD_DEG = 188.0


def camera_with(
    size: tuple[int, int], radius_px: float, center: tuple[float, float], aspect: float = 1.0
) -> Camera:
    lens = Equidistant(radius_px / np.radians(FIELD_DEG / 2))
    stretch = np.diag([1.0, aspect])
    return make_camera(size, lens, center=center, field_deg=FIELD_DEG, stretch=stretch)


@cache
def flight(camera: str, count: int = 5, full_range: bool = False) -> Pictures:
    """(count, rows, columns) luma of the simulated flight, every 4 seconds."""
    color = ColorSpace(full_range=full_range)
    made = CAMERAS[camera]
    simulated = SimulatedCamera(made, World(pixel_deg(made)), color=color)
    times_s = range(5, 5 + 4 * count, 4)
    return np.array([simulated.picture(int(t * 1e9)).planes[0] for t in times_s])


CAMERAS = {
    "round": camera_with((640, 640), 305.0, (316.3, 325.7)),
    # the circle is higher than the picture: two arcs
    "wide": camera_with((800, 450), 380.0, (402.4, 213.8)),
    "pal": camera_with((720, 576), 230.0, (352.4, 281.8), 16 / 15),
    "anamorphic": camera_with((640, 480), 170.0, (322.0, 244.0), 4 / 3),
    "slight": camera_with((640, 640), 280.0, (316.3, 325.7), 1.02),
}


def assert_found(found: ImageCircle, truth: Camera, shift: tuple[float, float] = (0, 0)) -> None:
    rim = float(truth.lens.radius(np.array([truth.theta_max]))[0])
    off = np.subtract(found.center, truth.center) + shift
    assert np.hypot(*off) < SIMULATED_CENTER_PX
    assert abs(found.radius_px - rim) < SIMULATED_RADIUS_PX
    assert abs(found.radius_px * found.aspect - rim * truth.stretch[1, 1]) < SIMULATED_RADIUS_PX


def as_luma(levels: NDArray[Any]) -> Pictures:
    luma: Pictures = np.clip(np.rint(levels), 0, 255).astype(np.uint8)
    return luma


def noisy(pictures: Pictures, sigma: float) -> Pictures:
    random = np.random.default_rng(7)
    return as_luma(pictures + random.normal(0, sigma, pictures.shape))


def from_axis(pictures: Pictures, camera: Camera) -> Floats:
    """(rows, columns): pixels from the axis."""
    y, x = np.mgrid[: pictures.shape[1], : pictures.shape[2]]
    return np.asarray(np.hypot(x - camera.center[0], y - camera.center[1]))


def with_text(pictures: Pictures) -> Pictures:
    """White text outside, across the rim and inside, as cameras write it."""
    out = pictures.copy()
    columns = out.shape[2]
    for picture in out:
        for place in ((8, 24), (columns - 230, 24), (30, 330), (columns - 260, 560), (8, 630)):
            cv2.putText(picture, "CAM1 12:34:56", place, cv2.FONT_HERSHEY_SIMPLEX, 1, 255, 2)
    return out


def with_lamps(pictures: Pictures, camera: Camera, rim_px: float) -> Pictures:
    """Saturated lamps on the rim, with glare on both sides of it."""
    light = np.zeros(pictures.shape[1:])
    inside = from_axis(pictures, camera) <= rim_px
    y, x = np.mgrid[: pictures.shape[1], : pictures.shape[2]]
    for angle, share, size in ((0.4, 0.99, 26.0), (2.1, 0.93, 18.0), (4.0, 1.0, 12.0)):
        lamp = camera.center + share * rim_px * np.array([np.cos(angle), np.sin(angle)])
        away = np.minimum(np.hypot(x - lamp[0], y - lamp[1]) / size, 20)
        light += inside * 400 * np.exp(-(away**2) / 2) + 110 * np.exp(-away / 2)
    return as_luma(pictures + light)


def darkened(pictures: Pictures, share: float) -> Pictures:
    return as_luma(16 + share * (pictures.astype(float) - 16))


def vignetted(pictures: Pictures, camera: Camera, rim_px: float) -> Pictures:
    """Darker outwards, down to a tenth just inside the rim."""
    share = np.minimum(from_axis(pictures, camera) / rim_px, 1)
    return as_luma(16 + (pictures.astype(float) - 16) * (1 - 0.9 * share**3))


def with_stray_light(pictures: Pictures, camera: Camera, rim_px: float) -> Pictures:
    """A ring around the image, fading outwards: what many cheap lenses have."""
    outside = from_axis(pictures, camera) - rim_px
    ring = np.where((outside > 0) & (outside < 24), 50 * (1 - outside / 24), 0)
    return as_luma(pictures + ring)


def blurred(pictures: Pictures, sigma: float) -> Pictures:
    return as_luma(np.array([cv2.GaussianBlur(picture, (0, 0), sigma) for picture in pictures]))


RIM = 305.0
ROUND = CAMERAS["round"]
DISTURBED: dict[str, Callable[[], Pictures]] = {
    "nothing": lambda: flight("round"),
    "full range": lambda: flight("round", full_range=True),
    "noise, one picture": lambda: noisy(flight("round")[:1], 10),
    "text": lambda: with_text(flight("round")),
    "lamps": lambda: with_lamps(flight("round"), ROUND, RIM),
    "text and lamps, one picture": lambda: with_text(with_lamps(flight("round")[:1], ROUND, RIM)),
    "dark": lambda: noisy(darkened(flight("round"), 0.06), 2),
    "out of focus": lambda: blurred(flight("round"), 6),
    "vignetting": lambda: vignetted(flight("round"), ROUND, RIM),
    "stray light": lambda: with_stray_light(flight("round"), ROUND, RIM),
    "all of it": lambda: noisy(
        with_text(with_lamps(with_stray_light(flight("round"), ROUND, RIM), ROUND, RIM)), 4
    ),
}


@pytest.mark.parametrize("what", DISTURBED)
def test_found_in_spite_of(what: str) -> None:
    assert_found(find_circle(DISTURBED[what]()), ROUND)


@pytest.mark.parametrize(
    ("left", "top", "right", "bottom"),
    [(80, 0, 0, 0), (0, 90, 0, 90), (150, 0, 0, 150), (60, 60, 60, 60)],
)
def test_circle_cut_by_the_frame(left: int, top: int, right: int, bottom: int) -> None:
    pictures = with_text(flight("round"))[:, top : 640 - bottom, left : 640 - right]
    assert_found(find_circle(pictures), ROUND, shift=(left, top))


def test_circle_higher_than_the_picture() -> None:
    found = find_circle(flight("wide"))
    assert_found(found, CAMERAS["wide"])
    assert 100 < found.seen_deg < 180


@pytest.mark.parametrize("name", ["pal", "anamorphic", "slight"])
def test_pixels_that_are_not_square(name: str) -> None:
    found = find_circle(flight(name))
    assert_found(found, CAMERAS[name])
    assert found.aspect == pytest.approx(CAMERAS[name].stretch[1, 1], abs=0.004)


def test_square_pixels_stay_exactly_square() -> None:
    """Also where lamps bend the rim a little."""
    assert find_circle(DISTURBED["lamps"]()).aspect == 1


def test_blur_moves_the_edge_by_less_than_a_tenth_of_it() -> None:
    """The edge is half way down, wherever blur puts the foot and the top."""
    sharp, soft = (find_circle(blurred(flight("round"), sigma)) for sigma in (0.5, 6))
    assert abs(soft.radius_px - sharp.radius_px) < 0.6
    # a Gaussian falls from 90 to 10 percent within 2.56 sigma; the rest is the scene's unevenness
    assert 2.56 * 6 - 2 < soft.rim_px < 2.56 * 6 + 14
    assert sharp.rim_px < 4


def test_one_white_picture_among_many_changes_little() -> None:
    pictures = flight("round").copy()
    pictures[2] = 235
    assert_found(find_circle(pictures), ROUND)


def test_night_with_light_in_one_picture_of_many() -> None:
    """In the mean it is 1 level of 255; the brightest levels show it."""
    night = np.full((40, 640, 640), 16, np.uint8)
    night[11] = darkened(flight("round")[:1], 0.25)
    seen = Brightness()
    for picture in night:
        seen.add(picture)
    with pytest.raises(ProfileError, match="uniform"):
        circle_in(seen.mean)
    assert_found(find_circle(seen), ROUND)


def test_less_of_the_rim_is_less_certain() -> None:
    pictures = noisy(DISTURBED["lamps"](), 4)
    whole, cut = find_circle(pictures), find_circle(pictures[:, 150:490])
    assert cut.center_error_px > 1.5 * whole.center_error_px
    assert cut.found_deg < whole.found_deg
    assert whole.seen_deg == 360


def test_same_pictures_same_answer() -> None:
    one, other = (find_circle(flight("round")[:1]) for _ in range(2))
    assert (one.center, one.radius_px) == (other.center, other.radius_px)


def test_edges_that_were_used_lie_on_the_circle() -> None:
    found = find_circle(DISTURBED["text"]())
    away = np.linalg.norm(found.used - found.center, axis=1) - found.radius_px
    assert len(found.used) > 500
    assert np.abs(away).max() < 3
    off = np.linalg.norm(found.unused - found.center, axis=1) - found.radius_px
    assert np.abs(off).min() > np.abs(away).max()


def full_frame() -> Pictures:
    """An ordinary lens: the image fills the picture."""
    camera = make_camera((640, 360), Perspective(320.0))
    simulated = SimulatedCamera(camera, World(pixel_deg(camera)))
    return np.array([simulated.picture(t * 10**9).planes[0] for t in (0, 12, 24)])


def nothing_round() -> Iterator[tuple[str, Pictures, str]]:
    full = full_frame()
    boxed = full.copy()
    boxed[:, :40], boxed[:, -40:], boxed[:, :, :90], boxed[:, :, -90:] = 16, 16, 16, 16
    y, x = np.mgrid[:360, :640]
    corners = np.cos(np.arctan(1.2 * np.hypot(x - 320, y - 180) / 367)) ** 4
    yield "full frame", full, ""
    yield "full frame, one picture", full[:1], ""
    yield "full frame at night", noisy(darkened(full[:1], 0.05), 2), ""
    yield "black bars all around", boxed[:1], ""
    yield "vignetting of a full frame", as_luma(16 + (full[:1].astype(float) - 16) * corners), ""
    yield "hardly more than the image", flight("round")[:1, 105:545, 100:530], ""
    yield "black", np.full((2, 240, 320), 16, np.uint8), "uniform"
    yield "white", np.full((2, 240, 320), 235, np.uint8), "uniform"
    yield "noise", noisy(np.full((1, 240, 320), 60, np.uint8), 30), ""
    yield "tiny", np.zeros((1, 20, 20), np.uint8), "too small"


@pytest.mark.parametrize(
    ("pictures", "why"), [pytest.param(*case[1:], id=case[0]) for case in nothing_round()]
)
def test_no_circle_is_said(pictures: Pictures, why: str) -> None:
    with pytest.raises(ProfileError, match=f"no image circle found: .*{why}.*calibrate"):
        find_circle(pictures)


def test_pictures_must_be_there_and_of_one_size() -> None:
    with pytest.raises(ProfileError, match="no pictures"):
        find_circle([])
    with pytest.raises(ProfileError, match="640 x 480 and of 320 x 240"):
        find_circle([np.zeros((480, 640), np.uint8), np.zeros((240, 320), np.uint8)])


CIRCLE = ImageCircle(
    (1000, 900), (490.0, 460.0), 400.0, 1.05, 0.1, 0.1, 2.0, 360, 360, np.zeros((0, 2)), np.eye(2)
)


@pytest.mark.parametrize("model", ["equidistant", "equisolid", "stereographic", "orthographic"])
def test_camera_sees_its_field_at_the_circle(model: str) -> None:
    camera = camera_from_circle(CIRCLE, 170.0, model)
    assert camera.size == (1000, 900)
    half = np.radians(170.0 / 2 - 1e-6)
    right, down = camera.project(
        np.array([[np.sin(half), 0, np.cos(half)], [0, np.sin(half), np.cos(half)]])
    )
    np.testing.assert_allclose(right, [890.0, 460.0], atol=1e-3)
    np.testing.assert_allclose(down, [490.0, 460.0 + 420.0], atol=1e-3)
    assert np.isnan(camera.project(np.array([np.sin(1.01 * half), 0, np.cos(1.01 * half)]))).all()


def test_models_are_those_with_one_parameter() -> None:
    expected = ["equidistant", "equisolid", "orthographic", "perspective", "stereographic"]
    assert sorted(one_parameter_models()) == expected


@pytest.mark.parametrize(
    ("fov_deg", "model", "why"),
    [
        (188, "kannala_brandt", "must have one parameter.* equidistant"),
        (188, "fisheye", "'fisheye' is none of: "),
        (180, "perspective", "no perspective lens has a field of view of 180"),
        (188, "orthographic", "no orthographic lens .* at most 180"),
        (360, "stereographic", "no stereographic lens"),
        (0, "equidistant", "field of view of 0"),
        (-10, "equidistant", "field of view of -10"),
        (float("nan"), "equidistant", "field of view of nan"),
        (320, "equidistant", "field_deg must be"),
    ],
)
def test_impossible_lenses_are_refused(fov_deg: float, model: str, why: str) -> None:
    with pytest.raises(ProfileError, match=why):
        camera_from_circle(CIRCLE, fov_deg, model)


def test_what_assuming_equidistant_costs_is_what_the_docs_say() -> None:
    page = (Path(__file__).parents[2] / "docs" / "lenses.md").read_text("utf-8")
    section = page.split("## From the image circle")[1].split("\n## ")[0]
    rows = re.findall(r"\| `([\w-]+)` \| ([\d.]+) \| ([\d.]+) \|", section)
    assert len(rows) > 2
    for name, field_deg, worst_deg in rows:
        camera = load_camera(name)
        assert np.degrees(2 * camera.theta_max) == pytest.approx(float(field_deg), abs=0.06)
        theta = np.linspace(0, camera.theta_max, 2001)
        radius = camera.lens.radius(theta)
        taken_for = camera.theta_max * radius / radius[-1]
        worst = np.degrees(np.abs(taken_for - theta).max())
        assert worst == pytest.approx(float(worst_deg), abs=0.06), name


# Real cameras. No truth is known; what can be known is said in each test.


def key_pictures(video: Path) -> Pictures:
    with av.open(str(video)) as container:
        stream = container.streams.video[0]
        stream.codec_context.skip_frame = "NONKEY"
        return np.array(
            [picture_from_av(frame).planes[0].copy() for frame in container.decode(stream)]
        )


@pytest.fixture(scope="module")
def office(shared_data: Path) -> Pictures:
    """A fixed camera's video, 1440 x 1440: lamps along the rim, text, a ring of stray light."""
    return key_pictures(shared_data / "lilyth_video" / "cam2.mp4")


# Read by eye off enlarged pieces of the mean picture, where the rim shows best, to about 2 px
OFFICE_RIM = [(1386, 902), (1171, 1198.5), (714, 1369), (243, 1195.5), (85, 1005), (1403.5, 465)]


@pytest.mark.data
def test_office_circle_is_where_the_eye_sees_it(office: Pictures) -> None:
    found = find_circle(office)
    rim = np.array(OFFICE_RIM)
    away = np.linalg.norm(rim - found.center, axis=1) - found.radius_px
    assert np.abs(away).max() < 4
    matrix = np.column_stack([2 * rim, np.ones(len(rim))])
    x, y, rest = np.linalg.lstsq(matrix, (rim**2).sum(axis=1), rcond=None)[0]
    assert np.hypot(found.center[0] - x, found.center[1] - y) < CENTER_PX
    assert found.radius_px == pytest.approx(np.sqrt(rest + x**2 + y**2), abs=RADIUS_PX)
    # an axis may lie beside the circle's middle: its owner's calibration says (713.7, 656.6)
    assert np.hypot(found.center[0] - 713.7, found.center[1] - 656.6) < 10


@pytest.mark.data
def test_office_answers_agree_among_pictures_and_parts_of_them(office: Pictures) -> None:
    whole = find_circle(office)
    parts = {
        "first half": (office[: len(office) // 2], 0, 0),
        "last": (office[-1:], 0, 0),
        "left": (office[:, :, :1000], 0, 0),
        "right": (office[:, :, 440:], 440, 0),
        "top": (office[:, :1000], 0, 0),
        "bottom": (office[:, 440:], 0, 440),
    }
    for name, (pictures, left, top) in parts.items():
        found = find_circle(pictures)
        off = np.subtract(found.center, whole.center) + np.array([left, top])
        assert np.hypot(*off) < RADIUS_PX, name  # half of a rim that is 50 px soft
        assert abs(found.radius_px - whole.radius_px) < RADIUS_PX, name


@pytest.mark.data
def test_chessboard_pictures_agree_with_their_calibration(shared_data: Path) -> None:
    """Of the rim only the corners show, 136 degrees, and half of that against glaring windows.

    cv2.fisheye.calibrate (OpenCV 5.0, findChessboardCornersSB, all 15 pictures, 0.49 px RMS)
    says centre (543.3, 377.7) and f = 336.4.
    """
    files = sorted((shared_data / "fish_1").glob("*.jpg"))
    pictures = [read_picture(str(file)).picture.planes[0].max(axis=2) for file in files]
    assert len(pictures) == 15
    for chosen in (pictures, pictures[::2], pictures[1::2]):
        found = find_circle(chosen)
        # 6 px are 1 degree of this lens
        assert np.hypot(found.center[0] - 543.3, found.center[1] - 377.7) < 6
        # the image ends at 90 degrees from the axis, as it does in many lenses
        assert found.radius_px / (np.pi / 2) == pytest.approx(336.4, rel=0.01)


@pytest.mark.data
def test_doubt_between_two_circles_is_told(shared_data: Path) -> None:
    """These three pictures show two likely rims, 20 px apart, and the wrong one wins."""
    names = ("Fisheye1_2.jpg", "Fisheye1_14.jpg", "Fisheye1_15.jpg")
    files = [str(shared_data / "fish_1" / name) for name in names]
    found = find_circle([read_picture(file).picture.planes[0].max(axis=2) for file in files])
    assert found.rival is not None
    off, rivals_off = (np.hypot(x - 543.3, y - 377.7) for x, y in (found.center, found.rival[:2]))
    assert min(off, rivals_off) < 3
    assert off < 2 * found.center_error_px + 3  # it is half the way to the rival


@pytest.mark.data
def test_an_ordinary_cameras_video_has_no_circle(shared_data: Path) -> None:
    pictures = key_pictures(shared_data / "gopro_karma" / "karma.mp4")
    for chosen in (pictures, pictures[:1], pictures[20:21]):
        with pytest.raises(ProfileError, match="no image circle"):
            find_circle(chosen)
