"""Lens profiles: what is read, and that everything else is refused with words that help."""

from __future__ import annotations

import contextlib
import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook import formats
from freelook.camera import make_camera
from freelook.errors import ProfileError
from freelook.formats import Document, Profile, builtin_names, load_camera, parse_camera
from freelook.formats.freelook import write
from freelook.lens import (
    MODELS,
    DoubleSphere,
    Equidistant,
    KannalaBrandt,
    Orthographic,
    Perspective,
    RadialSpline,
    ThinPrismFisheye,
    model_name,
    parameters,
)
from freelook.rotations import angle_between_deg, body_from_view, head_angles_deg
from lens_examples import ALL, Example

OWN: dict[str, Any] = {
    "freelook_lens": 1,
    "size": [1000, 800],
    "model": "equidistant",
    "parameters": {"f": 300.0},
}
OPENCV: dict[str, Any] = {
    "K": [[280.0, 1.4, 318.0], [0.0, 276.0, 243.0], [0.0, 0.0, 1.0]],
    "D": [-0.0137, 0.0207, -0.0128, 0.0025],
    "image_size_wh": [640, 480],
}


def own(**changes: Any) -> str:
    return json.dumps(OWN | changes)


def opencv(**changes: Any) -> str:
    return json.dumps(OPENCV | changes)


def without(data: dict[str, Any], key: str) -> str:
    return json.dumps({k: v for k, v in data.items() if k != key})


def test_smallest_profile_takes_the_usual_defaults() -> None:
    camera = parse_camera(own())
    assert camera.lens == Equidistant(300.0)
    assert camera.size == (1000, 800)
    assert camera.center == (499.5, 399.5)
    np.testing.assert_array_equal(camera.stretch, np.eye(2))
    looking = camera.camera_from_body.inv()
    assert head_angles_deg(looking) == pytest.approx((0, 0, 0))


def test_everything_a_profile_can_say() -> None:
    camera = parse_camera(
        own(
            name="n",
            source="s",
            center=[510, 390.5],
            field_deg=188,
            stretch=[[1, 0.01], [0.02, 0.9]],
            mount_deg={"pitch": -20, "yaw": 5},
        )
    )
    assert camera.center == (510, 390.5)
    assert np.degrees(camera.theta_max) == pytest.approx(94)
    assert camera.stretch.tolist() == [[1, 0.01], [0.02, 0.9]]
    assert head_angles_deg(camera.camera_from_body.inv()) == pytest.approx((5, -20, 0))


def test_a_mount_is_where_the_camera_looks() -> None:
    camera = parse_camera(own(mount_deg={"pitch": 90}))
    up_in_body = np.array([0, 0, -1.0])
    pixel = camera.project(camera.camera_from_body.apply(up_in_body))
    np.testing.assert_allclose(pixel, camera.center, atol=1e-9)


@pytest.mark.parametrize("example", ALL, ids=str)
def test_written_profiles_are_read_back_the_same(example: Example) -> None:
    camera = make_camera(
        (1000, 800),
        example.lens,
        center=(1.5, 2.25),
        field_deg=example.field_deg,
        stretch=np.array([[1, 0.1], [0, 0.9]]),
        camera_from_body=body_from_view(10, -20, 30).inv(),
    )
    again = parse_camera(write(Profile(camera)))
    assert (again.size, again.lens, again.center) == (camera.size, camera.lens, camera.center)
    assert model_name(again.lens) == model_name(example.lens)
    assert again.theta_max == pytest.approx(camera.theta_max)
    np.testing.assert_array_equal(again.stretch, camera.stretch)
    assert angle_between_deg(again.camera_from_body, camera.camera_from_body) < 1e-9


@pytest.mark.parametrize(
    "lens",
    [
        KannalaBrandt(300, -0.05),
        Orthographic(300),
        Perspective(3000),
        RadialSpline((40.0, 94.0), (200.0, 450.0)),
        DoubleSphere(300, 0.2, 0.8),
        ThinPrismFisheye(300, -0.05, p1=0.01),
    ],
    ids=lambda lens: type(lens).__name__,
)
def test_a_field_that_ends_at_the_limit_survives_the_round_trip(lens: Any) -> None:
    camera = make_camera((40_000, 40_000), lens)
    again = parse_camera(write(Profile(camera)))
    assert again.theta_max == pytest.approx(camera.theta_max, abs=1e-9)


def test_measured_points_are_good_to_the_last_one() -> None:
    lens = RadialSpline((40.0, 94.0), (200.0, 450.0))
    assert np.degrees(make_camera((4000, 4000), lens).theta_max) == pytest.approx(94)
    assert np.degrees(make_camera((1000, 800), lens, field_deg=188).theta_max) == pytest.approx(94)


def test_opencv_parameters() -> None:
    camera = parse_camera(opencv(note="free text", model="OpenCV fisheye (KB)"))
    assert camera.lens == KannalaBrandt(280.0, *OPENCV["D"])
    assert camera.center == (318.0, 243.0)
    np.testing.assert_allclose(camera.stretch, [[1, 0.005], [0, 276 / 280]])


@pytest.mark.data
def test_the_sample_videos_own_calibration(shared_data: Path) -> None:
    camera = load_camera(shared_data / "lilyth_video/author_calibration.json")
    assert camera.size == (1440, 1440)
    assert isinstance(camera.lens, KannalaBrandt)
    assert np.degrees(camera.theta_max) > 80
    assert camera.table.residual_px < 0.01


def test_profiles_in_the_package_are_good() -> None:
    assert "demo" in builtin_names()
    for name in builtin_names():
        assert load_camera(name).table.residual_px < 0.01


FAULTS = [
    (own(fov=3), r"unknown key 'fov' in the profile; known: .*field_deg.*stretch"),
    (without(OWN, "size"), r"'size' is missing in the profile; needed: .*model.*size"),
    (own(freelook_lens=2), r"freelook_lens is 2; this program reads version 1"),
    (own(model="fish"), r"unknown model 'fish'; known: perspective, stereographic, "),
    (own(model=["equidistant"]), r"unknown model \['equidistant'\]; known"),
    (own(parameters={"f": 300, "k9": 0}), r"unknown key 'k9' in .*'equidistant'; known: f"),
    (own(parameters={}), r"key 'f' is missing in the parameters of model 'equidistant'"),
    (own(parameters=[300]), r"parameters must be an object, not \[300\]"),
    (own(parameters={"f": "300"}), r"parameters\.f must be a number, not '300'"),
    (own(parameters={"f": True}), r"parameters\.f must be a number, not True"),
    (own(parameters={"f": None}), r"parameters\.f must be a number, not None"),
    (own(parameters={"f": [300, 2]}), r"parameters\.f must be a number, not \[300, 2\]"),
    (
        own(model="ocamcalib", parameters={"f": 300, "taylor": 0.5}),
        r"parameters\.taylor must be a list of 1 to 4096 numbers, not 0\.5",
    ),
    (
        own(model="radial_spline", parameters={"angles_deg": [10, 20]}),
        r"key 'radii_px' is missing in the parameters of model 'radial_spline'",
    ),
    (own(parameters={"f": 1e300}), r"parameters\.f = 1e\+300 is not a number a lens can have"),
    (own(parameters={"f": 1e-300}), r"parameters\.f = 1e-300 is not a number a lens can have"),
    (own(parameters={"f": -300}), r"does not grow with the angle"),
    (own().replace("300.0", "NaN"), r"NaN is not a number a lens can have"),
    (own().replace("300.0", "-Infinity"), r"-Infinity is not a number"),
    (own().replace("300.0", "1e999"), r"inf is not a number"),
    (own(size=[1000]), r"size must be a list of 2 numbers"),
    (own(size=[1000, 800.5]), r"size must be two whole numbers of 2 to 65536"),
    (own(size=[1, 800]), r"size must be two whole numbers of 2 to 65536"),
    (own(size=[1000, 1e9]), r"size must be two whole numbers of 2 to 65536"),
    (own(center=[1, "x"]), r"center\[1\] must be a number"),
    (own(center=5), r"center must be a list of 2 numbers, not 5"),
    (own(field_deg=300), r"field_deg must be 1 to 280, not 300"),
    (own(model="orthographic", field_deg=188), r"stops growing at 90\.00 degrees"),
    (
        own(model="polynomial", parameters={"a": 300, "c": -100}, field_deg=180),
        r"stops growing at 57\.30 degrees from the axis, inside the claimed field of 180",
    ),
    (own(stretch=[[1, 0]]), r"stretch must be two rows of two numbers"),
    (own(stretch=[[1, 0], [2, 0]]), r"flattens the picture to a line"),
    (own(stretch=[[1, 0], [2, "0"]]), r"stretch\[1\]\[1\] must be a number"),
    (own(mount_deg=20), r"mount_deg must be an object with yaw, pitch, roll"),
    (own(mount_deg={"tilt": 20}), r"unknown key 'tilt' in mount_deg; known: pitch, roll, yaw"),
    (own()[:-1] + ', "model": "equisolid"}', r"key 'model' is given twice"),
    (opencv(extra=1), r"unknown key 'extra' in OpenCV fisheye parameters; known: .*field_deg"),
    (without(OPENCV, "image_size_wh"), r"'image_size_wh' is missing"),
    (opencv(model="pinhole radtan"), r"only OpenCV's fisheye model"),
    (opencv(K=[[1, 2, 3]]), r"K must be three rows of three numbers"),
    (opencv(K=[[-280, 0, 318], [0, 276, 243], [0, 0, 1]]), r"must be positive"),
    (opencv(D=[0.1, 0.2]), r"D must be a list of 4 numbers"),
    ("", r"not a format known here .*: it is empty"),
    ('{"freelook_lens": 1,\n "size": [10', r"not JSON: .* line 2, column 13"),
    ("[1, 2]", r"not a format known here .*: a list"),
    ("{}", r"not a format known here \(freelook, opencv.*\); its keys are: none"),
    ('{"fx": 1, "fy": 2}', r"its keys are: fx, fy"),
    ("[" * 100_000, r"nested too deeply"),
]


@pytest.mark.parametrize(("text", "words"), FAULTS, ids=[words for _, words in FAULTS])
def test_faults_are_named(text: str, words: str) -> None:
    with pytest.raises(ProfileError, match=words):
        parse_camera(text)


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    binary = tmp_path / "lens.json"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ProfileError, match=r"lens\.json: not a text file"):
        load_camera(binary)
    with pytest.raises(ProfileError, match=r"nowhere.*No such file.*one of: .*demo"):
        load_camera("nowhere")
    with pytest.raises(ProfileError, match="directory"):
        load_camera(tmp_path)
    wrong = tmp_path / "wrong.json"
    wrong.write_text(own(model="fish"))
    with pytest.raises(ProfileError, match=r"wrong\.json: unknown model"):
        load_camera(wrong)


def test_every_format_has_its_entry_points_and_its_line_of_documentation() -> None:
    from importlib import import_module

    for name in formats.FORMATS:
        module = import_module(f"freelook.formats.{name.replace('-', '_')}")
        assert module.__doc__
        assert len(module.__doc__.strip().splitlines()[0]) > 20
        assert not module.recognises(Document("{}"))


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=8,
)
# of every size, and mostly of a size that lenses have
numbers = st.floats(allow_nan=False) | st.floats(-3, 3) | st.integers(-5, 400)
keys = st.sampled_from([*OWN, "center", "field_deg", "stretch", "mount_deg", "K", "D"])


@given(st.dictionaries(keys, json_values, max_size=4))
def test_any_change_is_read_or_refused(changes: dict[str, Any]) -> None:
    for profile in (OWN, OPENCV):
        try:
            camera = parse_camera(json.dumps(profile | changes))
        except ProfileError:
            continue
        assert np.isfinite(camera.table.g).all()


@given(
    model=st.sampled_from(sorted(MODELS)),
    values=st.lists(numbers | st.lists(numbers, max_size=5), min_size=1, max_size=15),
    field_deg=st.none() | st.floats(-10, 400),
)
def test_any_parameters_make_a_lens_that_works_or_an_error(
    model: str, values: list[Any], field_deg: float | None
) -> None:
    names = [f.name for f in fields(MODELS[model])]  # type: ignore[arg-type]
    makes_a_lens_or_an_error(model, dict(zip(names, values, strict=False)), field_deg)


@given(
    example=st.sampled_from(ALL),
    changes=st.lists(st.tuples(st.integers(0, 200), numbers), min_size=1, max_size=3),
    field_deg=st.none() | st.floats(1, 280),
)
def test_a_real_calibration_with_wrong_numbers_is_a_lens_or_an_error(
    example: Example, changes: list[tuple[int, float]], field_deg: float | None
) -> None:
    values: dict[str, Any] = {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in parameters(example.lens).items()
    }
    places = [(values, name) for name, value in values.items() if not isinstance(value, list)]
    lists = [value for value in values.values() if isinstance(value, list)]
    slots: list[tuple[Any, Any]] = places + [
        (items, i) for items in lists for i in range(len(items))
    ]
    for place, number in changes:
        holder, key = slots[place % len(slots)]
        holder[key] = number
    makes_a_lens_or_an_error(model_name(example.lens), values, field_deg)


def makes_a_lens_or_an_error(model: str, values: dict[str, Any], field_deg: float | None) -> None:
    changes: dict[str, Any] = {"model": model, "parameters": values}
    if field_deg is not None:
        changes["field_deg"] = field_deg
    try:
        camera = parse_camera(own(**changes))
    except ProfileError:
        return
    grid = np.linspace(0, camera.theta_max, 100)
    assert (np.diff(camera.lens.radius(grid)) > 0).all()
    assert np.isfinite(camera.table.g).all()
    assert camera.grid is None or np.isfinite(camera.grid.offsets).all()
    middle = camera.ray(np.array([[499.5, 399.5], [700.0, 200.0]]))
    assert (np.isnan(middle) | (np.abs(middle) <= 1)).all()


@given(st.text(max_size=200) | st.text(alphabet='{}[]",:0123456789.eE+-KDfa ', max_size=80))
def test_any_text_is_refused_politely(text: str) -> None:
    with pytest.raises(ProfileError):
        parse_camera(text)


@given(st.integers(0, 200), st.characters())
def test_a_profile_with_one_wrong_letter(place: int, letter: str) -> None:
    text = own(center=[1.5, 2.5], field_deg=150)
    place %= len(text)
    with contextlib.suppress(ProfileError):
        parse_camera(text[:place] + letter + text[place + 1 :])
