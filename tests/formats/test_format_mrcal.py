"""mrcal's .cameramodel: every model against mrcal itself, and what is refused.

The numbers are mrcal 2.2's (Debian 13, python3-mrcal). For each of `MODELS`:

    model = mrcal.cameramodel(intrinsics=(name, numpy.array(CORE + own)), imagersize=size)
    model.write("it.cameramodel")  # rounds to 10 digits
    mrcal.project(rays(widest), *mrcal.cameramodel("it.cameramodel").intrinsics())

The files written here were read by it once and gave back every number.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from freelook.camera import Camera, make_camera
from freelook.errors import ProfileError
from freelook.formats import Document, Profile, format_of, mrcal, parse_profile
from freelook.lens import (
    Equidistant,
    Floats,
    Lens,
    OpenCVRational,
    Perspective,
    SplinedStereographic,
    Stereographic,
)

CORE = [261.25, 258.5, 318.75, 241.5]
KNOTS = [
    0.0, 0.025, 0.0289, 0.0191, 0.0155, 0.0042, -0.0206, -0.0126, -0.0265, -0.0236, 0.0065,
    -0.0234, 0.0117, 0.0155, 0.0297, 0.0245, 0.0042, 0.0219, -0.0275, 0.0091, -0.0189, -0.0081,
    0.0174, -0.0214, 0.0215, -0.0057, 0.0259, 0.0113, -0.0077, 0.023, -0.03, 0.0239, -0.0084,
    0.0135, 0.0255, -0.0032, 0.028, -0.0226, 0.018, -0.0104, -0.0184, 0.0067, -0.0278, 0.0206,
    0.0035, 0.0249, 0.0296, 0.0174, 0.03, -0.0224, 0.0072, -0.0243, -0.0261, -0.0147, -0.0212,
    0.0018, 0.0148, 0.0174, 0.0291, 0.0249,
]  # fmt: skip
EIGHT = [0.4, 0.02, 4e-4, -3e-4, 1e-3, 0.7, 0.09, 1.5e-3]
SPLINED = "LENSMODEL_SPLINED_STEREOGRAPHIC_order={}_Nx=6_Ny=5_fov_x_deg=150"
SMALL, LARGE = (640, 480), (2000, 1900)

# lensmodel: what is behind CORE, the picture's size, widest (see `rays`), pixels by mrcal
MODELS: dict[str, tuple[list[float], tuple[int, int], float, list[list[float]]]] = {
    "LENSMODEL_PINHOLE": (
        [],
        SMALL,
        55,
        [
            [401.452354576, 266.813543186],
            [282.724658538, 319.388209212],
            [255.906895498, 182.587621151],
            [373.694614668, 175.306870775],
            [504.556659904, 298.371717061],
            [237.812179024, 416.490761432],
            [177.560944316, 109.142071414],
            [442.19358735, 92.784472939],
            [675.189547084, 350.599044574],
            [163.484089373, 577.191023029],
            [47.901995482, -12.406938225],
            [555.556239282, -43.786303178],
        ],
    ),
    "LENSMODEL_STEREOGRAPHIC": (
        [],
        LARGE,
        126,
        [
            [510.360844456, 300.148262324],
            [235.283862491, 421.957081503],
            [173.150513946, 105.007505706],
            [446.049688972, 88.138932434],
            [768.198668103, 379.067283642],
            [122.969096046, 664.786036662],
            [-22.772919902, -78.661261962],
            [617.348316922, -118.228739531],
            [1298.413167097, 541.355379148],
            [-107.993595068, 1164.136484861],
            [-425.667436501, -456.355435192],
            [969.604688434, -542.600657706],
        ],
    ),
    "LENSMODEL_OPENCV4": (
        [-0.2, 0.05, 1e-3, -2e-3],
        SMALL,
        45,
        [
            [384.586757101, 261.681361481],
            [289.96509483, 303.671553483],
            [268.591758185, 194.532794842],
            [362.466931151, 188.806503022],
            [453.597260022, 282.913535555],
            [259.516887059, 369.273938013],
            [215.676177176, 145.122703013],
            [408.232248083, 133.574877784],
            [529.565684104, 306.444907993],
            [225.438207249, 442.372610875],
            [156.73533544, 90.367386288],
            [458.49175455, 72.778701284],
        ],
    ),
    "LENSMODEL_OPENCV5": (
        [-0.2, 0.05, 1e-3, -2e-3, 0.01],
        SMALL,
        45,
        [
            [384.587004604, 261.681437237],
            [289.964987017, 303.671786578],
            [268.591570115, 194.532618536],
            [362.467095583, 188.806304926],
            [453.650628925, 282.929870713],
            [259.493639438, 369.324200285],
            [215.635623705, 145.08468609],
            [408.267704556, 133.532162499],
            [532.061500682, 307.208827728],
            [224.351023639, 444.723144724],
            [154.838837296, 88.589510766],
            [460.149889688, 70.781105083],
        ],
    ),
    "LENSMODEL_OPENCV8": (
        EIGHT,
        SMALL,
        63,
        [
            [410.567258261, 269.622204598],
            [278.716556962, 328.044150363],
            [248.954214609, 176.095880709],
            [379.730188198, 168.036990009],
            [503.368548879, 298.111337724],
            [238.122694286, 415.76586677],
            [178.317777879, 109.994961987],
            [441.293895733, 93.875633664],
            [595.198618326, 326.606096961],
            [197.344715035, 503.72860134],
            [107.991215142, 44.605092089],
            [501.88871405, 20.902873382],
        ],
    ),
    "LENSMODEL_OPENCV12": (
        [*EIGHT, 2e-3, -1e-4, 3e-3, 5e-5],
        SMALL,
        63,
        [
            [410.643682232, 269.736756396],
            [278.792980933, 328.158702161],
            [249.030638579, 176.210432507],
            [379.806612169, 168.151541807],
            [503.774982554, 298.748552187],
            [238.529127961, 416.403081233],
            [178.724211555, 110.63217645],
            [441.700329409, 94.512848126],
            [596.823596685, 329.784962856],
            [198.969693394, 506.907467235],
            [109.616193501, 47.783957984],
            [503.513692409, 24.081739276],
        ],
    ),
    SPLINED.format(3): (
        KNOTS,
        SMALL,
        54,
        [
            [392.224639534, 270.885884614],
            [280.009982691, 320.753688282],
            [255.785828156, 190.376410246],
            [366.245339975, 183.183347445],
            [475.289303022, 296.232940959],
            [244.011236025, 398.025992981],
            [194.734886328, 131.154781622],
            [421.054139664, 115.748527777],
            [568.688212273, 324.223626798],
            [204.113247328, 483.12939761],
            [127.185908511, 65.504441148],
            [482.032044343, 40.362282069],
        ],
    ),
    SPLINED.format(2): (
        KNOTS,
        SMALL,
        54,
        [
            [391.569151903, 271.161256199],
            [279.824572801, 320.746339223],
            [256.324566613, 190.665373697],
            [365.617258917, 183.238126971],
            [475.418605979, 296.394017491],
            [243.866895079, 397.223420802],
            [196.193919675, 131.431779095],
            [420.392498821, 115.012461965],
            [570.631418611, 324.173773468],
            [204.019356579, 481.328692532],
            [129.436244564, 65.785783866],
            [481.562303231, 38.546729919],
        ],
    ),
}  # fmt: skip

# As mrcal wrote it:
#   mrcal.cameramodel(intrinsics=("LENSMODEL_OPENCV8", CORE + EIGHT), imagersize=(640, 480),
#       extrinsics_rt_fromref=[0.1, -0.2, 0.05, 1.5, 0, -0.25],
#       valid_intrinsics_region=[[40, 30], [600, 25], [610, 450], [35, 455], [40, 30]])
#   .write(..., note="made on a day\nsecond line")
WRITTEN_BY_MRCAL = """# made on a day
# second line
{
    'lensmodel':  'LENSMODEL_OPENCV8',

    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....
    'intrinsics': [ 261.25, 258.5, 318.75, 241.5, 0.4, 0.02, 0.0004, -0.0003, 0.001, 0.7, 0.09, 0.0015,],

    'valid_intrinsics_region': [
    [ 40, 30 ],
    [ 600, 25 ],
    [ 610, 450 ],
    [ 35, 455 ],
    [ 40, 30 ],
],

    # extrinsics are rt_fromref
    'extrinsics': [ 0.1, -0.2, 0.05, 1.5, 0, -0.25,],

    'imagersize': [ 640, 480,],


}
"""  # noqa: E501


CORNERS = ([40, 30], [600, 25], [610, 450], [35, 455])


def rays(widest_deg: float) -> Floats:
    """Twelve rays, (12, 3): three angles from the axis in four directions."""
    theta = np.radians(np.linspace(0, widest_deg, 4)[1:])[:, None]
    phi = np.array([0.3, 2.0, 3.9, 5.4])
    x, y, z = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


def text(name: str = "LENSMODEL_PINHOLE", own: Any = (), **changes: Any) -> str:
    """A model's text; a change to None leaves the key out."""
    data = {"lensmodel": name, "intrinsics": [*CORE, *own], "extrinsics": [0] * 6}
    data |= {"imagersize": [640, 480]} | changes
    return f"# a comment\n{ {k: v for k, v in data.items() if v is not None} }\n"


def read(words: str) -> Profile:
    return parse_profile(Document(words))


@pytest.mark.parametrize("name", MODELS)
def test_projection_is_that_of_mrcal(name: str) -> None:
    own, size, widest_deg, pixels = MODELS[name]
    camera = read(text(name, own, imagersize=list(size))).camera
    assert np.degrees(camera.theta_max) > widest_deg  # and little wider than the farthest ray
    assert np.degrees(camera.theta_max) < widest_deg + 25
    np.testing.assert_allclose(camera.project(rays(widest_deg)), pixels, rtol=0, atol=2e-9)


def test_what_mrcal_wrote_is_read() -> None:
    assert format_of(Document(WRITTEN_BY_MRCAL)) == "mrcal"
    profile = read(WRITTEN_BY_MRCAL)
    assert profile.source == "made on a day"
    camera = profile.camera
    assert camera.lens == OpenCVRational(261.25, *EIGHT)
    assert camera.size == (640, 480)
    assert camera.center == (318.75, 241.5)
    np.testing.assert_allclose(camera.stretch, np.diag([1, 258.5 / 261.25]))
    region, pose = profile.notes
    farthest = max(reach_deg(camera, pixel) for pixel in CORNERS)
    nearest = min(reach_deg(camera, [x, 450 + 5 * (610 - x) / 575]) for x in range(35, 611))
    assert region == (
        f"reliable to {nearest:.1f} degrees from the axis all around, and to {farthest:.1f} at "
        "best (valid_intrinsics_region); the rest is extrapolated"
    )
    assert "turned by 13.1 degrees and moved by 1.52 in its rig" in pose


def reach_deg(camera: Camera, pixel: Sequence[float]) -> float:
    return float(np.degrees(np.arccos(camera.ray(np.array(pixel))[2])))


@pytest.mark.parametrize("name", MODELS)
def test_a_written_model_is_the_same_model_and_the_same_camera(name: str) -> None:
    own, size, _, _ = MODELS[name]
    profile = read(text(name, own, imagersize=size))
    written = mrcal.write(Profile(profile.camera, "a\nname", "its source"))
    assert written.startswith("# a name its source\n{")
    data = ast.literal_eval(written)  # what mrcal itself does
    assert data["lensmodel"] == name
    assert data["intrinsics"] == pytest.approx([*CORE, *own], rel=1e-15)
    assert data["imagersize"] == list(size)
    assert data["extrinsics"] == [0] * 6
    assert read(written).camera.lens == profile.camera.lens
    assert read(written).source == "a name its source"


def test_the_smallest_opencv_model_is_written() -> None:
    def written(**terms: float) -> str:
        camera = make_camera((640, 480), OpenCVRational(500.0, **terms), field_deg=40)
        return str(ast.literal_eval(mrcal.write(Profile(camera)))["lensmodel"])

    assert written() == "LENSMODEL_OPENCV4"
    assert written(k1=0.1, p2=1e-3) == "LENSMODEL_OPENCV4"
    assert written(k3=0.1) == "LENSMODEL_OPENCV5"
    assert written(k6=0.1) == "LENSMODEL_OPENCV8"
    assert written(s1=0.001) == "LENSMODEL_OPENCV12"


def test_what_mrcal_cannot_say_is_refused() -> None:
    def refused(words: str, lens: Lens, stretch: list[list[float]] | None = None) -> None:
        camera = make_camera((640, 480), lens, stretch=np.array(stretch or np.eye(2)))
        with pytest.raises(ProfileError, match=words):
            mrcal.write(Profile(camera))

    refused("no model like 'equidistant'; it holds perspective, stereog", Equidistant(300))
    refused("no place for tau_x, tau_y", OpenCVRational(600, tau_x=0.01))
    refused("cannot say skew, and this camera has 3 px", Perspective(300), [[1, 0.01], [0, 1]])
    refused("pixel aspect and skew only", Stereographic(300), [[1, 0], [0.1, 1]])
    splined = SplinedStereographic(300, 3, 4, 4, 100.5, (0.0,) * 32)
    refused("whole degrees as fov_x_deg, not 100.5", splined)


@pytest.mark.parametrize("order", [2, 3])
def test_the_field_ends_where_the_picture_leaves_the_spline(order: int) -> None:
    """Nx = 8 and Ny = 7 cover u = 2 tan(fov / 4) to the right, and less downward."""
    name = f"LENSMODEL_SPLINED_STEREOGRAPHIC_order={order}_Nx=8_Ny=7_fov_x_deg=90"
    profile = read(text(name, [0.0] * 112))
    down = 2 * np.tan(np.radians(90 / 4)) * (7 - order) / (8 - order)
    assert 241.5 - 258.5 * down > 0  # the picture goes on above that
    assert profile.camera.theta_max == pytest.approx(2 * np.arctan(down / 2), rel=1e-4)
    (note,) = profile.notes
    assert f"ends at {np.degrees(profile.camera.theta_max):.1f} degrees" in note
    wider = read(text(name.replace("=90", "=150"), [0.0] * 112))
    assert wider.notes == ()
    assert wider.camera.theta_max > np.radians(75)  # the farthest corner


def test_old_names_tuples_and_optimisation_inputs_are_read() -> None:
    old = text(lensmodel=None, distortion_model="DISTORTION_PINHOLE", imagersize=(640, 480))
    assert format_of(Document(old)) == "mrcal"
    assert read(old).camera.lens == Perspective(261.25)
    # a large calibration has megabytes of them, in letters without quotes
    inputs = b"P)h>@6aWAK2mk;8ApnWpd$#G" * 100_000
    profile = read(text(optimization_inputs=inputs, icam_intrinsics=0))
    assert profile.notes == ()
    assert read(text(something=1, more=[2])).notes == ("not taken over: something, more",)


def test_control_points_that_no_corner_was_near_are_zero() -> None:
    """mrcal's solver leaves them at numbers such as these, which are nothing but rounding."""
    knots = [3.733054474e-300, -5e-324, *KNOTS[2:]]
    lens = read(text(SPLINED.format(3), knots)).camera.lens
    assert isinstance(lens, SplinedStereographic)
    assert lens.control == (0.0, 0.0, *KNOTS[2:])


def test_regions_that_say_little() -> None:
    assert "is reliable nowhere" in read(text(valid_intrinsics_region=[])).notes[0]
    outside = [[-5000, -5000], [5000, -5000], [5000, 5000], [-5000, 5000], [-5000, -5000]]
    (note,) = read(text(valid_intrinsics_region=outside)).notes
    whole = np.degrees(read(text()).camera.theta_max)
    assert note.startswith(f"reliable to {whole:.1f} degrees from the axis all around")


NEST = "[" * 150_000
FAULTS = [
    (text("LENSMODEL_OPENCV14", [0] * 14), "unknown lensmodel 'LENSMODEL_OPENCV14'; known: .*V12"),
    (text("LENSMODEL_CAHVOR", [0] * 5), "CAHVOR is not read here: .* mrcal-convert-lensmodel, to"),
    (text("LENSMODEL_CAHVORE_linearity=0.3", [0] * 8), "is not read here: its distortion is about"),
    (text("LENSMODEL_LONLAT"), "LENSMODEL_LONLAT is not read here: a panorama has no axis"),
    (text("LENSMODEL_LATLON"), "LENSMODEL_LATLON is not read here"),
    (text(SPLINED.format(3)[:-4], KNOTS), "unknown lensmodel 'LENSMODEL_SPLINED"),
    (text(SPLINED.format(3), KNOTS[:-1]), "must be a list of 64 numbers"),
    (text(SPLINED.format(4), KNOTS), "order of a splined lens must be 2 or 3, not 4"),
    (text(SPLINED.format(3).replace("=150", "=400"), KNOTS), "fov_x_deg must be 1 to 355"),
    (text("LENSMODEL_OPENCV8", EIGHT[:4]), "intrinsics of LENSMODEL_OPENCV8 must be a list of 12"),
    (text(intrinsics=[300, True, 320, 240]), r"PINHOLE\[1\] must be a number, not True"),
    (text(intrinsics=[300, 1 + 2j, 320, 240]), r"PINHOLE\[1\] must be a number, not \(1\+2j\)"),
    (
        text(intrinsics=[300, 300, 320, 240]).replace("320", "0x" + "f" * 9000),
        "an integer of more than 64 bits is",
    ),
    (text(intrinsics=[300, 300, 320, 240]).replace("320", "9" * 9000), "not a Python dictionary"),
    (text(intrinsics=[-300, 300, 320, 240]), "focal lengths must be positive"),
    (text(intrinsics=None), "key 'intrinsics' is missing"),
    (text(imagersize=None), "key 'imagersize' is missing"),
    (text(imagersize=[640, 480.5]), "imagersize must be two whole numbers"),
    (text(imagersize="640x480"), "imagersize must be a list of 2 numbers"),
    (text(extrinsics=[1, 2, 3]), "extrinsics must be a list of 6 numbers"),
    (text(valid_intrinsics_region=[[1, 2], [3]]), r"valid_intrinsics_region\[1\] must be a list"),
    (text(valid_intrinsics_region=7), "valid_intrinsics_region must be a list of points"),
    (text().replace("'extrinsics'", "'lensmodel'"), "key 'lensmodel' is no name, or is given twi"),
    (text().replace("'extrinsics'", "7"), "key 7 is no name, or is given twice"),
    (text().replace("'extrinsics'", "[]"), r"key \[\] is no name, or is given twice"),
    (text().replace("[0, 0, 0, 0, 0, 0]", "{[]: 1}"), "dictionary of plain values: unhashable"),
    (text().replace("[0, 0, 0, 0, 0, 0]", "open('x')"), "dictionary of plain values: malformed"),
    (text().replace("}", ""), "not a Python dictionary: .* in line"),
    (f"[{text().strip()}, 7]", "not mrcal's: it must be one Python dictionary"),
    (text().replace("}", ", **{}}"), "key None is no name, or is given twice"),
    (text().replace("[0, 0, 0, 0, 0, 0]", NEST), "not a Python dictionary: too many nested"),
    (text().replace("[0, 0, 0, 0, 0, 0]", "-" * 150_000 + "1"), "nested too deeply"),
    (text().replace("[0, 0, 0, 0, 0, 0]", "1" + "+1" * 60_000), "maximum recursion depth|nested"),
    (text(something="x" * 300_000), "characters besides its optimisation inputs; at most 262144"),
    (text().replace("}", "\0}"), "not a Python dictionary"),
]


@pytest.mark.parametrize(("words", "message"), FAULTS, ids=[message for _, message in FAULTS])
def test_faults_are_named(words: str, message: str) -> None:
    with pytest.raises(ProfileError, match=message):
        read(words)


def test_a_lensmodel_that_is_no_text_is_named() -> None:
    with pytest.raises(ProfileError, match=r"key 'lensmodel' is missing, or no text; known: LENS"):
        parse_profile(Document(text(lensmodel=[1])), format="mrcal")
