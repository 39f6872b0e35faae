"""OCamCalib's calib_results.txt against the toolbox's formulas, written out here once more."""

from __future__ import annotations

import numpy as np
import pytest

from freelook.camera import Camera, make_camera
from freelook.errors import ProfileError
from freelook.formats import Document, Profile, format_of, ocamcalib, parse_profile
from freelook.lens import Equidistant, Floats, OCamCalib

# A calibration somebody published (github.com/renmengqisheng/calib_fisheye @b531e935,
# calib_results.txt): a camera that is turned a little in its mount, so d and e matter.
DIRECT = [-7.463674e02, 0.0, 8.872435e-04, -1.024379e-06, 9.406640e-10]
INVERSE = [
    976.011496, 423.799439, -71.005688, 109.822387, 14.864652, -10.577479, -103.634310,
    -135.380427, 365.628459, 832.263016, 646.459114, 228.199663, 31.134605,
]  # fmt: skip
ROW, COLUMN = 630.102940, 958.314910
C, D, E = 0.996974, -0.014257, 0.013102
HEIGHT, WIDTH = 1208, 1920


def counted(numbers: list[float]) -> str:
    return " ".join(map(str, [len(numbers), *numbers]))


def text(
    direct: list[float] = DIRECT,
    inverse: list[float] = INVERSE,
    center: str = f"{ROW} {COLUMN}",
    affine: str = f"{C} {D} {E}",
    size: str = f"{HEIGHT} {WIDTH}",
) -> str:
    parts = [counted(direct), counted(inverse), center, affine, size]
    return "".join(f"#what follows\n\n{part}\n\n" for part in parts)


def read(words: str) -> Profile:
    return parse_profile(Document(words))


def cam2world(pixel: Floats) -> Floats:
    """(row, column) (n, 2) to (x along rows, y along columns, z backward), unit vectors."""
    x, y = np.linalg.solve([[C, D], [E, 1]], (pixel - [ROW, COLUMN]).T)
    z = np.polyval(DIRECT[::-1], np.hypot(x, y))
    ray = np.stack([x, y, z], axis=-1)
    return np.asarray(ray / np.linalg.norm(ray, axis=-1, keepdims=True))


def world2cam(ray: Floats, *, exactly: bool) -> Floats:
    """(x, y, z backward) (n, 3) to (row, column): by the direct polynomial or the inverse one."""
    x, y, z = ray.T
    flat = np.hypot(x, y)
    if exactly:  # the smallest positive rho with a0 + (a1 - z / |xy|) rho + a2 rho^2 + ... = 0
        rho = np.array([_root(m) for m in z / flat])
    else:
        rho = np.polyval(INVERSE[::-1], np.arctan(z / flat))
    x, y = x / flat * rho, y / flat * rho
    return np.stack([x * C + y * D + ROW, x * E + y + COLUMN], axis=-1)


def _root(slope: float) -> float:
    roots = np.roots([*DIRECT[:1:-1], DIRECT[1] - slope, DIRECT[0]])
    real = roots.real[np.abs(roots.imag) < 1e-9 * np.abs(roots)]
    return float(real[real > 0].min())


def theirs(ray: Floats) -> Floats:
    """A ray in our camera frame (x right, y down, z forward) in the toolbox's."""
    return np.asarray(ray[..., [1, 0, 2]] * [1, 1, -1])


@pytest.fixture(scope="module")
def camera() -> Camera:
    return read(text()).camera


def test_the_parts_are_where_they_belong(camera: Camera) -> None:
    assert camera.size == (WIDTH, HEIGHT)
    assert camera.center == (COLUMN, ROW)
    assert camera.stretch.tolist() == [[1.0, E], [D, C]]
    assert isinstance(camera.lens, OCamCalib)
    np.testing.assert_allclose(camera.lens.coefficients, np.negative(DIRECT), rtol=1e-14)
    assert 90 < np.degrees(camera.theta_max) < 120  # the farthest corner


def test_projection_is_the_toolboxs_over_the_whole_field(camera: Camera) -> None:
    theta = np.linspace(0.001, camera.theta_max - 1e-9, 50)[:, None]
    phi = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    z = np.cos(theta) + 0 * phi
    ray = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), z], axis=-1)
    ray = ray.reshape(-1, 3)
    pixel = camera.project(ray)
    expected = world2cam(theirs(ray), exactly=True)[:, ::-1]
    np.testing.assert_allclose(pixel, expected, rtol=0, atol=1e-8)  # what np.roots is good for
    # The published inverse polynomial is the toolbox's own answer. It was fitted to 0.01 px out to
    # half of the picture's diagonal; d and e stretch that a little.
    fast = world2cam(theirs(ray), exactly=False)[:, ::-1]
    fitted = camera.lens.radius(np.arccos(ray[:, 2])) < np.hypot(WIDTH, HEIGHT) / 2
    assert fitted.sum() > 1000
    np.testing.assert_allclose(pixel[fitted], fast[fitted], rtol=0, atol=0.011)


def test_rays_are_the_toolboxs_over_the_whole_picture(camera: Camera) -> None:
    column, row = np.meshgrid(np.linspace(0, WIDTH - 1, 33), np.linspace(0, HEIGHT - 1, 21))
    pixel = np.stack([column, row], axis=-1).reshape(-1, 2)
    expected = cam2world(pixel[:, ::-1])
    np.testing.assert_allclose(theirs(camera.ray(pixel)), expected, rtol=0, atol=1e-12)


def test_a_note_says_how_good_the_inverse_polynomial_is(camera: Camera) -> None:
    (note,) = read(text()).notes
    # it was fitted to half of the diagonal; the farthest corner is a little farther
    assert note == (
        "the direct polynomial is used; the file's inverse one is 0.11 px off the direct one at "
        "most (114 degrees)"
    )
    shorter = [*INVERSE[:-1], 0.0]  # without its last term
    (note,) = read(text(inverse=shorter)).notes
    rho = np.polyval(shorter[::-1], -np.pi / 2)  # 0 on the axis, where it is worst
    assert f"is {abs(rho):.2g} px off the direct one at most (0 degrees)" in note


def test_polynomials_of_two_lenses_are_refused() -> None:
    with pytest.raises(ProfileError, match=r"different lenses: \d+ px apart over half of the"):
        read(text(inverse=INVERSE[::-1]))
    with pytest.raises(ProfileError, match="different lenses"):
        read(text(inverse=[-b for b in INVERSE]))


def test_a_written_file_is_the_same_camera_with_an_inverse_that_is_good(camera: Camera) -> None:
    written = ocamcalib.write(Profile(camera))
    assert format_of(Document(written)) == "ocamcalib"
    again = read(written)
    np.testing.assert_allclose(again.camera.stretch, camera.stretch, rtol=0, atol=1e-15)
    assert again.camera.center == camera.center
    assert again.camera.size == camera.size
    theta = np.linspace(0, camera.theta_max, 500)
    radius = camera.lens.radius(theta)
    np.testing.assert_allclose(again.camera.lens.radius(theta), radius, rtol=1e-13)
    fitted = [float(word) for word in written.splitlines()[6].split()[1:]]
    off = np.abs(np.polyval(fitted[::-1], theta - np.pi / 2) - radius)
    assert off.max() < 0.01


def test_the_layout_is_the_toolboxs(camera: Camera) -> None:
    """Programs read it by line: a comment, an empty line, numbers, an empty line, five times."""
    lines = ocamcalib.write(Profile(camera)).split("\n")
    assert [line[:1] == "#" for line in lines[::4]] == [True] * 5
    assert not any(lines[1::2])
    numbers = [line.split() for line in lines[2::4]]
    assert numbers[0][:3] == ["5", str(DIRECT[0]), "0.0"]
    assert int(numbers[1][0]) == len(numbers[1]) - 1
    assert [list(map(float, words)) for words in numbers[2:]] == [
        [ROW, COLUMN],
        [C, D, E],
        [HEIGHT, WIDTH],
    ]
    assert lines[-2:] == ["1208 1920", ""]


def test_any_stretch_that_does_not_turn_the_picture_is_written() -> None:
    """The format's affine part has three numbers; the fourth goes into the polynomial."""
    stretch = np.array([[0.9, 0.02], [-0.01, 1.1]])
    lens = OCamCalib(300.0)
    camera = make_camera((640, 480), lens, center=(310.0, 250.0), stretch=stretch)
    again = read(ocamcalib.write(Profile(camera))).camera
    ray = np.array([[0.3, -0.2, 1.0], [1.0, 0.5, 0.4], [-0.7, -0.9, 1.0]])
    np.testing.assert_allclose(again.project(ray), camera.project(ray), atol=1e-9)


def test_other_lenses_and_turned_pictures_are_not_written() -> None:
    with pytest.raises(ProfileError, match=r"OCamCalib holds Scaramuzza's .* no equidistant"):
        ocamcalib.write(Profile(make_camera((640, 480), Equidistant(200))))
    turned = make_camera((640, 480), OCamCalib(200.0), stretch=np.array([[-1, 0], [0, -1]]))
    with pytest.raises(ProfileError, match="cannot turn the picture"):
        ocamcalib.write(Profile(turned))


def test_polynomials_of_any_length_and_broken_lines_are_read() -> None:
    six = [*DIRECT, 1e-14]
    lens = read(text(direct=six)).camera.lens
    assert isinstance(lens, OCamCalib)
    assert lens.coefficients[-1] == pytest.approx(-1e-14)
    broken = text().replace(" 8.872435e-04", "\n 8.872435e-04").replace(" 109.8", "\r\n109.8")
    assert parse_profile(Document(broken), format="ocamcalib").camera.center == (COLUMN, ROW)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (text(direct=[-a for a in DIRECT]), r"a0 .* must be negative here, not 746\.367: .*JSON"),
        (text(direct=[-300.0, 0.5, 1e-3]), r"a0, a1 = 0, a2, \.\.\. is needed"),
        (text(direct=[-300.0, 0.0]), r"a0, a1 = 0, a2, \.\.\. is needed"),
        (text(direct=[-300.0, 0.0] + [1e-3] * 11), "of 13 terms; 12 can be read"),
        (text(direct=[-1e9, 0.0, 1e-3]), r"a0 = -1e\+09 is no focal length in pixels"),
        (text(size="1208"), r"the file ends before the picture's size \(height, width\)"),
        (text(size="1208 1920 7"), r"more numbers behind the picture's size: 7"),
        (text(size="1208 1"), "width and height must be two whole numbers"),
        (text(center="600 east"), r"the centre \(row, column\)\[1\] must be a number, not 'east'"),
        (text(center="600 nan"), "must be a number, not 'nan'"),
        (text(affine="0 0 0"), "flattens the picture to a line"),
        ("#\n" + counted([0.5] * 70) + "\n#\n1 2\n", "has 70 terms; 1 to 64 can be read"),
    ],
)
def test_faults_are_named(words: str, message: str) -> None:
    with pytest.raises(ProfileError, match=message):
        read(words)
