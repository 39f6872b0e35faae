"""freelook lens convert: every format, what it costs, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from freelook.camera import Camera, make_camera
from freelook.cli import main
from freelook.fitting.refit import measure
from freelook.formats import FORMATS, Profile, format_module, load_camera, load_profile
from freelook.lens import DoubleSphere, Equidistant, KannalaBrandt, Mei
from freelook.rotations import body_from_view


def convert(*arguments: str | Path) -> int:
    return main(["lens", "convert", *map(str, arguments)])


def report(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> dict[str, Any]:
    assert convert(*arguments, "--json") == 0
    facts: dict[str, Any] = json.loads(capsys.readouterr().out)
    return facts


def written(path: Path, camera: Camera, name: str = "") -> Path:
    path.write_text(format_module("freelook").write(Profile(camera, name, "a test")), "utf-8")
    return path


@pytest.fixture
def fisheye(tmp_path: Path) -> Path:
    """A real 186 degree calibration with all of its field on the picture, looking down."""
    real = load_camera("uzh-fpv-indoor")
    camera = make_camera(
        (1000, 1000),
        real.lens,
        center=(502, 497),
        field_deg=186,
        stretch=real.stretch,
        camera_from_body=body_from_view(0, -15, 0).inv(),
    )
    return written(tmp_path / "fisheye.json", camera, "drone, front")


# The nearest lens that each format has for it, and by how much it is off at most.
BECOMES = {
    "freelook": ("kannala_brandt", 0),
    "opencv": ("kannala_brandt", 0),
    "ros": ("kannala_brandt", 0),
    "kalibr": ("kannala_brandt", 0),
    "basalt": ("kannala_brandt", 0),
    "colmap": ("kannala_brandt", 0),
    "gyroflow": ("kannala_brandt", 0),
    "ocamcalib": ("ocamcalib", 0.05),
    "py-ocamcalib": ("ocamcalib", 0.05),
    "mrcal": ("splined_stereographic", 0.001),
    "onvif": ("radial_spline", 0.002),
    "woodscape": ("polynomial", 0.5),
}


def test_every_format_is_tried() -> None:
    assert set(BECOMES) == set(FORMATS)


@pytest.mark.parametrize("target", FORMATS)
def test_a_real_fisheye_goes_into_every_format(
    target: str, fisheye: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / f"lens{format_module(target).SUFFIX}"
    facts = report(capsys, fisheye, out, "--to", target)
    model, most_px = BECOMES[target]
    assert facts["new_model"] == model
    assert facts["exact"] == (most_px == 0)
    assert facts["written"]
    assert facts["max_px"] <= most_px + 1e-9
    # half a pixel is the limit in 1000
    assert facts["holds_for_deg"] == pytest.approx(186)
    # an independent look at what stands in the file
    given = load_camera(fisheye)
    read = load_profile(out, format=target, size=given.size).camera
    ring = np.radians(np.arange(0, 360, 7.0))
    for theta in np.radians([0, 30, 60, 85]):
        ray = np.stack(
            [np.sin(theta) * np.cos(ring), np.sin(theta) * np.sin(ring), 0 * ring + np.cos(theta)],
            axis=-1,
        )
        off_px = np.linalg.norm(read.project(ray) - given.project(ray), axis=-1)
        assert off_px.max() <= facts["max_px"] * 1.01 + 1e-6
    mounted = "the mounting is not held" in " ".join(facts["lost"])
    assert mounted == (target not in ("freelook", "woodscape"))


@pytest.mark.data
def test_published_numbers_of_a_kalibr_chain(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """UZH-FPV's own numbers, written as Kalibr does, to Kalibr's other models and to COLMAP."""
    published = json.loads((shared_data / "lens_references" / "published.json").read_text("utf-8"))
    numbers = published["uzhfpv_indoor_cam0"]
    k = numbers["kb4_kalibr"]
    chain = tmp_path / "chain.yaml"
    chain.write_text(
        "cam0:\n  camera_model: pinhole\n  distortion_model: equidistant\n"
        f"  distortion_coeffs: {k['k']}\n"
        f"  intrinsics: {[k['fx'], k['fy'], k['cx'], k['cy']]}\n"
        f"  resolution: {numbers['resolution']}\n",
        "utf-8",
    )
    most_px = {"double_sphere": 0.35, "eucm": 0.2, "mei": 0.4, "fov": 0.7}
    for model, most in most_px.items():
        options = ["--to", "kalibr", "--model", model, "--force"]
        facts = report(capsys, chain, tmp_path / f"{model}.yaml", *options)
        assert 0.5 * most < facts["max_px"] < most
        assert facts["rms_px"] < facts["max_px"] / 2
    exact = report(capsys, f"{chain}#cam0", tmp_path / "cameras.txt")
    assert exact["format"] == "colmap"
    assert exact["exact"]


def test_what_is_read_back_is_what_was_written(fisheye: Path, tmp_path: Path) -> None:
    """There and back through six formats, none of which changes a digit."""
    names = ["a.yml", "kalibr.yaml", "cameras.txt", "ros.yaml", "gyroflow.json", "basalt.json"]
    last = fisheye
    for name in names:
        assert convert(last, tmp_path / name) == 0
        last = tmp_path / name
    camera = load_camera(fisheye)
    found = measure(camera, load_camera(last), 0.5)
    assert found.max_px < 1e-9


def test_a_fisheye_is_not_written_as_a_rectilinear_lens(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lens = written(tmp_path / "a.json", make_camera((960, 960), Equidistant(280), field_deg=190))
    out = tmp_path / "b.yml"
    assert convert(lens, out, "--model", "perspective") == 2
    said = capsys.readouterr()
    assert not out.exists()
    assert "b.yml is not written: the nearest perspective lens is off by up to 2" in said.err
    assert "does not see 22.6 % of the image" in said.err
    assert "--force" in said.err
    assert "differs by rms" in said.out


def test_force_writes_it_and_says_how_wrong_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lens = written(tmp_path / "a.json", make_camera((960, 960), Equidistant(280), field_deg=190))
    facts = report(capsys, lens, tmp_path / "b.yml", "--model", "perspective", "--force")
    assert facts["max_px"] > 100
    assert facts["seen"] < 0.9
    assert np.degrees(load_camera(tmp_path / "b.yml").theta_max) < 90


def test_less_of_the_field_can_be_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lens = written(tmp_path / "a.json", make_camera((960, 960), Equidistant(280), field_deg=190))
    facts = report(capsys, lens, tmp_path / "b.yml", "--model", "opencv_rational", "--field", "120")
    assert facts["max_px"] < 0.05
    assert facts["holds_for_deg"] == pytest.approx(120)
    assert convert(lens, tmp_path / "c.yml", "--field", "200") == 2
    assert "--field must be 1 to the lens's own 190.00 degrees" in capsys.readouterr().err


def test_the_limit_is_the_users_to_set(
    fisheye: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "b.yml"
    assert convert(fisheye, out, "--model", "equidistant") == 2
    assert "(limit 0.500)" in capsys.readouterr().err
    assert convert(fisheye, out, "--model", "equidistant", "--limit", "1") == 0


def test_models_are_tried_and_the_nearest_is_taken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Gyroflow has no double sphere; its models that end at 90 degrees are not even tried."""
    camera = make_camera((960, 960), DoubleSphere(280, -0.2, 0.59), field_deg=186)
    facts = report(capsys, written(tmp_path / "a.json", camera), tmp_path / "gyroflow.json")
    assert facts["format"] == "gyroflow"
    assert set(facts["tried"]) == {"kannala_brandt", "sony", "mei"}
    off = {name: said["max_px"] for name, said in facts["tried"].items()}
    assert facts["max_px"] == min(off.values())
    assert facts["new_model"] == min(off, key=lambda name: off[name])


def test_terms_a_format_lacks_are_left_out_of_the_fit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """OpenCV's omnidir has no k3, and a skew, which this camera has too."""
    camera = make_camera(
        (1280, 966),
        Mei(900, 1.1, -0.1, 0.02, 0.004, 1e-3, -5e-4),
        field_deg=150,
        stretch=np.array([[1, 1e-3], [0, 1.001]]),
    )
    lens = written(tmp_path / "a.json", camera)
    facts = report(capsys, lens, tmp_path / "b.yml", "--model", "mei")
    assert not facts["exact"]
    assert 0 < facts["max_px"] < 0.5
    read = load_camera(tmp_path / "b.yml").lens
    assert isinstance(read, Mei)
    assert read.k3 == 0
    assert read.p1 != 0


def test_a_turned_stretch_is_lost_only_where_it_must(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    camera = make_camera(
        (960, 960),
        KannalaBrandt(280, -0.01),
        field_deg=180,
        stretch=np.array([[1, 2e-4], [3e-4, 0.999]]),
    )
    lens = written(tmp_path / "a.json", camera)
    assert report(capsys, lens, tmp_path / "b.json")["max_px"] == 0
    facts = report(capsys, lens, tmp_path / "b.yml")
    assert facts["new_model"] == "kannala_brandt"
    assert 0.05 < facts["max_px"] < 0.3
    assert load_camera(tmp_path / "b.yml").stretch[1, 0] == 0


@pytest.mark.parametrize(
    ("name", "target"),
    [
        ("lens.json", "freelook"),
        ("cam_gyroflow.json", "gyroflow"),
        ("py-ocamcalib.json", "py-ocamcalib"),
        ("fisheye.yml", "opencv"),
        ("camchain.yaml", "kalibr"),
        ("ost.yaml", "ros"),
        ("cameras.txt", "colmap"),
        ("calib_results.txt", "ocamcalib"),
        ("a.cameramodel", "mrcal"),
        ("lens.xml", "onvif"),
    ],
)
def test_the_name_says_the_format_where_it_is_clear(name: str, target: str) -> None:
    from freelook.cli.lens._conversion import target_format

    assert target_format(Path(name)) == target


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["demo", "OUT.yaml"], "a .yaml file can be one of opencv, ros, kalibr"),
        (["demo", "OUT.txt"], "a .txt file can be one of ocamcalib, colmap"),
        (["demo", "OUT.lens"], r"which format is OUT.lens to have? say it with --to FORMAT"),
        (["demo", "OUT.yml", "--model", "eucm"], "cannot hold the model 'eucm'; it can: kannala"),
        (["demo", "OUT.json", "--limit", "-1"], "--limit is a distance"),
        (["none.yaml", "OUT.json"], "lens profile none.yaml"),
    ],
)
def test_mistakes_are_told(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert convert(*arguments) == 2
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_an_existing_file_is_kept_unless_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out.json"
    out.write_text("mine", "utf-8")
    assert convert("demo", out) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert out.read_text("utf-8") == "mine"
    assert convert("demo", out, "--overwrite") == 0
    assert isinstance(load_camera(out).lens, Equidistant)


def test_what_is_printed_is_for_people(
    fisheye: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert convert(fisheye, tmp_path / "b.yml", "--model", "equidistant", "--limit", "1") == 0
    out = capsys.readouterr().out
    assert "kannala_brandt, 1000 x 1000" in out
    assert "opencv, equidistant, the nearest lens" in out
    assert "within 1.00 px for 186.00 of 186.00 degrees" in out
    assert "--mount=0,-15,0" in out
    assert "the end of the field is not held by opencv: 186.00 degrees become" in out
