"""ONVIF lens descriptions: normalised coordinates to pixels, and XML from anybody."""

from __future__ import annotations

import numpy as np
import pytest

from freelook.camera import Camera, make_camera
from freelook.errors import ProfileError
from freelook.formats import Choice, Document, Profile, format_of, parse_profile
from freelook.formats.onvif import write
from freelook.lens import Equidistant, RadialSpline

SIZE = (1280, 720)
# Equidistant with a little bend; angles in degrees, radii in units of half the picture's height.
POINTS: list[tuple[float, float]] = [
    (10, 0.1),
    (25, 0.2505),
    (40, 0.404),
    (60, 0.61),
    (75, 0.768),
    (90, 0.93),
    (95, 0.985),
]


def description(
    points: list[tuple[float, float]] = POINTS,
    offset: str = 'x="0.02" y="-0.03"',
    x_factor: str = "0.5625",
    tag: str = "tt:",
    extra: str = "",
) -> str:
    body = "".join(
        f"<{tag}Projection><{tag}Angle>{a}</{tag}Angle><{tag}Radius>{r}</{tag}Radius>{extra}"
        f"</{tag}Projection>"
        for a, r in points
    )
    scope = ' xmlns:tt="http://www.onvif.org/ver10/schema"' if tag else ""
    return (
        f'<{tag}LensDescription{scope} FocalLength="1.2"><{tag}Offset {offset}/>{body}'
        f"<{tag}XFactor>{x_factor}</{tag}XFactor></{tag}LensDescription>"
    )


def read(text: str, size: tuple[int, int] | None = SIZE, pick: str | None = None) -> Profile:
    return parse_profile(Document(text), Choice(pick, size))


def normalised(camera: Camera, pixel: np.ndarray) -> np.ndarray:
    """-1 to 1 between outer edges, y up."""
    width, height = camera.size
    x = 2 * (pixel[..., 0] + 0.5) / width - 1
    y = 1 - 2 * (pixel[..., 1] + 0.5) / height
    return np.stack([x, y], axis=-1)


@pytest.mark.parametrize("tag", ["tt:", ""])
def test_measured_points_land_where_the_standard_says(tag: str) -> None:
    camera = read(description(tag=tag)).camera
    for angle_deg, radius in POINTS:
        angle = np.radians(angle_deg) * (1 - 1e-12)  # a hair inside: the last one is the rim
        phi = np.radians(np.arange(0, 360, 7.0))  # from x to the right to y up
        ray = np.stack(
            [
                np.sin(angle) * np.cos(phi),
                -np.sin(angle) * np.sin(phi),
                np.full_like(phi, np.cos(angle)),
            ],
            axis=-1,
        )
        expected = np.stack([np.cos(phi) * radius * 0.5625 - 0.02, np.sin(phi) * radius + 0.03], -1)
        off = normalised(camera, camera.project(ray)) - expected
        assert np.abs(off).max() * SIZE[0] / 2 < 1e-6, angle_deg


def test_between_the_points_the_curve_is_smooth_and_beyond_there_is_nothing() -> None:
    camera = read(description()).camera
    assert np.degrees(camera.theta_max) == pytest.approx(95)
    assert isinstance(camera.lens, RadialSpline)
    theta = np.radians(np.linspace(0, 95, 951))
    assert (np.diff(camera.lens.radius(theta)) > 0).all()
    beyond = np.radians(95.1)
    assert np.isnan(camera.project(np.array([np.sin(beyond), 0, np.cos(beyond)]))).all()


def test_a_round_image_of_an_equidistant_lens() -> None:
    """XFactor = height / width makes pixels square: the image of a cone is a circle."""
    points = [(float(a), a / 90) for a in range(10, 101, 10)]
    camera = read(description(points, offset="")).camera
    np.testing.assert_allclose(camera.stretch, np.eye(2), atol=1e-12)
    assert camera.center == (639.5, 359.5)
    f = 360 / (np.pi / 2)
    theta = np.linspace(0, np.radians(99.9), 100)
    np.testing.assert_allclose(camera.lens.radius(theta), f * theta, atol=1e-9)


def test_the_size_is_asked_for_or_taken_from_the_bounds() -> None:
    with pytest.raises(ProfileError, match="-1 to 1 whatever the size; tell the picture's size"):
        read(description(), size=None)
    whole = (
        '<s:Envelope xmlns:s="soap" xmlns:tt="http://www.onvif.org/ver10/schema">'
        '<tt:Bounds x="0" y="0" width="1920" height="1080"/>'
        f"{description()}</s:Envelope>"
    )
    assert read(whole, size=None).camera.size == (1920, 1080)
    assert read(whole, size=(640, 360)).camera.size == (640, 360)


def test_one_of_several_descriptions_is_picked() -> None:
    other = description([(30, 0.5), (60, 0.9)])
    both = f"<all>{description()}{other}</all>"
    with pytest.raises(ProfileError, match="2 cameras in one file: add which one, as in FILE#1"):
        read(both)
    assert np.degrees(read(both, pick="2").camera.theta_max) == pytest.approx(60)


def test_what_is_not_used_is_told() -> None:
    assert "sign of Offset" in read(description()).notes[0]
    assert read(description(offset="")).notes == ()
    dim = description(offset="", extra="<tt:Transmittance>0.7</tt:Transmittance>")
    assert "transmittance falls to 0.7" in read(dim).notes[0]


def test_written_and_read_again_it_is_the_same_camera() -> None:
    camera = read(description()).camera
    text = write(Profile(camera, 'Dome <"&">'))
    assert format_of(Document(text)) == "onvif"
    profile = read(text, size=None)
    assert profile.name == 'Dome <"&">'
    again = profile.camera
    assert again.size == camera.size
    rays = np.random.default_rng(1).normal(size=(2000, 3))
    np.testing.assert_allclose(again.project(rays), camera.project(rays), atol=1e-9)


def test_what_the_format_cannot_say_is_an_error() -> None:
    with pytest.raises(ProfileError, match="cannot hold a equidistant"):
        write(Profile(make_camera((640, 480), Equidistant(200.0))))
    spline = RadialSpline((40.0, 80.0), (100.0, 200.0))
    skewed = make_camera((640, 480), spline, stretch=np.array([[1, 0.01], [0, 1]]))
    with pytest.raises(ProfileError, match="no skew"):
        write(Profile(skewed))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (description([(30, 0.5)]), "2 to 4096 Projection points, not 1"),
        (description([(30, 0.5), (20, 0.6)]), "must lie beyond the one before it"),
        (description([(30, 0.5), (40, 0.5)]), "must lie beyond the one before it"),
        (description([(0, 0), (40, 0.5)]), "0 itself is not given"),
        (description([(0.5, 0.2), (1.6, 0.6)]), "angles are degrees"),
        (description([(50, 0.2), (190, 0.6)]), "to 180"),
        (description([(10, 0.4), (50, 0.41), (60, 0.95), (70, 0.951)]), "stops growing"),
        (description(x_factor="0"), "XFactor must be above 0"),
        (description(x_factor="wide"), "XFactor must be a number"),
        (description(x_factor=""), "XFactor must be a number"),
        (description(offset='x="nan"'), "Offset x must be a number"),
        (description().replace("<tt:Radius>0.1</tt:Radius>", ""), "one Radius, not 0"),
        (description().replace("XFactor", "Factor"), "one XFactor, not 0"),
        (description()[:-5], "not XML"),
        ("<a>LensDescription</a>", "no LensDescription in it"),
        ("<LensDescription" + " " * 2**20 + "/>", "more than 1 MiB"),
    ],
)
def test_what_is_wrong_is_said(text: str, words: str) -> None:
    with pytest.raises(ProfileError, match=words):
        read(text)


@pytest.mark.parametrize(
    "attack",
    [
        '<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]><x>&b;LensDescription</x>',
        '<!doctype x SYSTEM "file:///etc/passwd"><LensDescription/>',
        '<?xml version="1.0"?>\n<!DOCTYPE x PUBLIC "a" "http://b"><LensDescription/>',
    ],
)
def test_document_types_are_refused_before_they_are_read(attack: str) -> None:
    with pytest.raises(ProfileError, match="document type"):
        read(attack)


def test_deep_nesting_is_refused() -> None:
    deep = "<a>" * 100_000 + "<LensDescription/>" + "</a>" * 100_000
    with pytest.raises(ProfileError, match="nested too deeply"):
        read(deep)
