"""`refit`: exact where one model contains the other, honest about what remains where not."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from freelook.camera import Camera, make_camera
from freelook.errors import FitError
from freelook.fitting.refit import Refit, field_rays, limit_px, measure, refit
from freelook.formats import load_camera
from freelook.lens import (
    MODELS,
    DoubleSphere,
    Equidistant,
    ExtendedUnified,
    KannalaBrandt,
    Lens,
    Mei,
    Perspective,
    Polynomial,
    model_name,
    parameters,
)
from freelook.resolution import around_axis, ray_at
from freelook.rotations import body_from_view
from lens_examples import EXAMPLES

SIZE = (960, 900)
# not quite square pixels, a little skew, the axis beside the middle, looking down
STRETCH = np.array([[1.0, 0.0004], [0.0, 0.9987]])
MOUNT = body_from_view(5, -20, 3).inv()


def camera_with(lens: Lens, field_deg: float) -> Camera:
    return make_camera(
        SIZE,
        lens,
        center=(471.3, 455.8),
        field_deg=field_deg,
        stretch=STRETCH,
        camera_from_body=MOUNT,
    )


@pytest.fixture(scope="module")
def uzh() -> Camera:
    """The UZH-FPV lens with all of its 186 degrees on the picture, which the real one cuts."""
    camera = load_camera("uzh-fpv-indoor")
    return make_camera(
        (1000, 1000), camera.lens, center=(502, 497), field_deg=186, stretch=camera.stretch
    )


NESTED = [
    (Equidistant(280), 210, "kannala_brandt"),
    (Equidistant(280), 210, "polynomial"),
    (Equidistant(280), 210, "sony"),
    (Polynomial(339.749, -31.988, 48.275, -7.201), 190, "sony"),
    (KannalaBrandt(280, -0.0137, 0.0207, -0.0128, 0.0025), 186, "kannala_brandt_9"),
    (KannalaBrandt(280, -0.0137, 0.0207, -0.0128, 0.0025), 186, "thin_prism_fisheye"),
    (KannalaBrandt(280, -0.0137, 0.0207, -0.0128, 0.0025), 186, "rad_tan_thin_prism_fisheye"),
    (ExtendedUnified(300, 0.6), 190, "mei"),
    (ExtendedUnified(300, 0.6), 190, "double_sphere"),
    (DoubleSphere(300, 0.0, 0.6), 190, "eucm"),
    (Perspective(500), 100, "poly5"),
    (Perspective(500), 100, "ptlens"),
    (Perspective(500), 100, "opencv_rational"),
    (Perspective(500), 100, "eucm"),
]


@pytest.mark.parametrize(
    ("lens", "field_deg", "model"), NESTED, ids=lambda v: model_name(v) if hasattr(v, "f") else v
)
def test_a_model_that_contains_the_other_gives_the_same_lens(
    lens: Lens, field_deg: float, model: str
) -> None:
    camera = camera_with(lens, field_deg)
    found = refit(camera, model)
    assert model_name(found.camera.lens) == model
    assert found.max_px < 1e-6
    assert found.max_deg < 1e-6
    assert found.holds
    assert found.seen == 1
    assert found.field_deg == pytest.approx(field_deg)
    assert found.camera.theta_max == pytest.approx(camera.theta_max)
    assert found.camera.camera_from_body.approx_equal(camera.camera_from_body)


@pytest.mark.parametrize("name", sorted(set(MODELS) - {"splined_stereographic"}))
def test_a_lens_in_its_own_model_stays_what_it_is(name: str) -> None:
    camera = EXAMPLES[name][0].camera
    found = refit(camera, name)
    assert found.max_px < 1e-6
    np.testing.assert_allclose(
        np.concatenate([np.ravel(v) for v in parameters(found.camera.lens).values()]),
        np.concatenate([np.ravel(v) for v in parameters(camera.lens).values()]),
        rtol=1e-6,
        atol=1e-9,
    )


DOCS = Path(__file__).parents[2] / "docs" / "lenses.md"
ROW = re.compile(r"^\| ((?:`\w+`(?:, )?)+).*? \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|$", re.M)


def documented() -> dict[str, tuple[float, float, float]]:
    """Model to (rms px, largest px, largest degrees) of the table in docs/lenses.md."""
    text = DOCS.read_text("utf-8").split("## Convert")[1].split("## Fit")[0]
    return {
        name: (float(rms), float(most), float(deg))
        for names, rms, most, deg in ROW.findall(text)
        for name in re.findall(r"`(\w+)`", names)
    }


def test_the_documentation_has_the_table() -> None:
    assert len(documented()) == 12


@pytest.mark.parametrize("model", documented())
def test_a_real_fisheye_in_other_models_loses_what_the_documentation_says(
    uzh: Camera, model: str
) -> None:
    """Two digits of each; a minimum may wander by a few per cent from machine to machine."""
    found = refit(uzh, model)
    numbers = (found.rms_px, found.max_px, found.max_deg)
    for number, said in zip(numbers, documented()[model], strict=True):
        digit = 10.0 ** np.floor(np.log10(said)) if said else 1e-6
        assert number == pytest.approx(said, rel=0.05, abs=digit / 2)
    assert found.seen == 1
    assert found.holds == (found.max_px < 0.5)


def test_numbers_are_those_of_an_independent_look(uzh: Camera) -> None:
    """Every fourth pixel of the picture, and the directions both take it for."""
    found = refit(uzh, "double_sphere")
    pixel = np.stack(np.meshgrid(np.arange(0.0, 1000, 4), np.arange(0.0, 1000, 4)), axis=-1)
    ray = uzh.ray(pixel).reshape(-1, 3)
    ray = ray[np.isfinite(ray[:, 0])]
    exact = uzh.project(ray)
    off_px = np.linalg.norm(found.camera.project(ray) - exact, axis=-1)
    assert found.rms_px == pytest.approx(np.sqrt(np.nanmean(off_px**2)), rel=0.02)
    assert found.max_px == pytest.approx(np.nanmax(off_px), rel=0.02)
    cosine = np.sum(found.camera.ray(exact) * ray, axis=-1)
    off_deg = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    assert found.rms_deg == pytest.approx(np.sqrt(np.nanmean(off_deg**2)), rel=0.02)


def test_the_field_it_holds_for_is_where_it_first_leaves_the_limit(uzh: Camera) -> None:
    found = refit(uzh, "equidistant", limit=0.5)
    half = np.radians(found.field_deg / 2)
    assert 40 < found.field_deg < 180

    def largest(theta: float) -> float:
        ring = ray_at(np.array(theta), around_axis(90))
        return float(np.linalg.norm(found.camera.project(ring) - uzh.project(ring), axis=-1).max())

    inside = [largest(theta) for theta in np.linspace(0.001, half - 0.02, 60)]
    assert max(inside) <= 0.5
    assert largest(half + 0.02) > 0.5


def test_the_least_squares_are_not_beaten_by_a_nudge(uzh: Camera) -> None:
    """Any small change of any parameter makes the rms larger: it is a minimum."""
    found = refit(uzh, "eucm")
    rays = np.concatenate(field_rays(uzh, uzh.theta_max, 36))
    exact = uzh.project(rays)

    def rms(camera: Camera) -> float:
        wide = replace(camera, theta_max=camera.theta_max + 1e-6)
        return float(np.sqrt(np.mean((wide.project(rays) - exact) ** 2)))

    best = rms(found.camera)
    for name, value in parameters(found.camera.lens).items():
        assert isinstance(value, float)
        for factor in (0.9999, 1.0001):
            lens = replace(found.camera.lens, **{name: value * factor})  # type: ignore[type-var]
            assert rms(replace(found.camera, lens=lens)) > best
    x, y = found.camera.center
    assert rms(replace(found.camera, center=(x + 0.05, y - 0.05))) > best


def test_a_fisheye_is_no_rectilinear_lens() -> None:
    found = refit(camera_with(Equidistant(280), 190), "perspective")
    assert not found.holds
    assert found.max_px > 100
    assert found.seen < 0.9
    assert np.degrees(found.camera.theta_max) <= 85 + 1e-9


def test_less_of_the_field_may_be_kept() -> None:
    camera = camera_with(Equidistant(280), 190)
    whole = refit(camera, "opencv_rational")
    part = refit(camera, "opencv_rational", theta_max=np.radians(60))
    assert not whole.holds
    assert whole.seen < 0.9
    assert part.holds
    assert part.field_deg == pytest.approx(120)
    assert part.max_px < 0.05


def test_bent_lenses_are_fitted_with_their_bends() -> None:
    lens = Mei(900, 1.1, -0.1, 0.02, 0, 1e-3, -5e-4)
    camera = make_camera((1280, 966), lens, field_deg=160)
    straight, bent = refit(camera, "kannala_brandt"), refit(camera, "rad_tan_thin_prism_fisheye")
    assert straight.max_px > 1
    assert bent.max_px < 0.03
    free = refit(camera, "splined_stereographic")
    assert free.max_px < 0.001
    assert free.camera.grid is not None


def test_round_lenses_stay_round_in_models_that_could_bend(uzh: Camera) -> None:
    lens = refit(uzh, "mei").camera.lens
    assert isinstance(lens, Mei)
    assert lens.p1 == lens.p2 == 0


def test_of_the_stretch_only_what_is_asked_for_is_taken(uzh: Camera) -> None:
    turned = replace(uzh, stretch=np.array([[1.0, 0.001], [0.002, 0.9994]]))
    found: dict[str, Refit] = {
        which: refit(turned, "kannala_brandt", stretch=which)
        for which in ("free", "skew", "aspect", "none")
    }
    stretch = {which: fit.camera.stretch for which, fit in found.items()}
    assert found["free"].max_px < 1e-6
    assert found["skew"].max_px > 0.3
    assert found["free"].rms_px < found["skew"].rms_px < found["aspect"].rms_px
    assert stretch["skew"][1, 0] == 0
    assert stretch["skew"][0, 1] != 0
    assert stretch["aspect"][0, 1] == stretch["aspect"][1, 0] == 0
    assert stretch["none"][0, 0] == stretch["none"][1, 1]


def test_parameters_can_be_held_at_their_defaults(uzh: Camera) -> None:
    """WoodScape's polynomial has four terms."""
    lens = refit(uzh, "polynomial", held=["e"]).camera.lens
    assert isinstance(lens, Polynomial)
    assert lens.e == 0
    assert lens.d != 0


def test_the_limit_is_half_a_pixel_in_a_thousand(uzh: Camera) -> None:
    assert limit_px((1000, 600)) == 0.5
    assert refit(uzh, "kannala_brandt").limit_px == 0.5


def test_measuring_a_shift_finds_it() -> None:
    camera = camera_with(Equidistant(280), 180)
    moved = replace(camera, center=(camera.center[0] + 3, camera.center[1] - 4))
    found = measure(camera, moved, 0.5)
    assert found.rms_px == pytest.approx(5)
    assert found.max_px == pytest.approx(5)
    assert found.field_deg < 2
    assert not found.holds
    # 4.9 pixels per degree along the radius; at the rim of 90 degrees pi/2 times less around it
    assert 1.0 < found.max_deg < 1.1 * 1.03


@pytest.mark.parametrize(
    ("model", "options", "message"),
    [
        ("fisheye", {}, "unknown lens model 'fisheye'; known: "),
        ("mei", {"stretch": "round"}, "unknown stretch 'round'; known: free, skew, aspect, none"),
        ("mei", {"held": ["k9"]}, "no parameter 'k9'"),
    ],
)
def test_nonsense_is_refused(
    uzh: Camera, model: str, options: dict[str, object], message: str
) -> None:
    with pytest.raises(FitError, match=message):
        refit(uzh, model, **options)  # type: ignore[arg-type]


def test_the_example_in_the_documentation_runs(capsys: pytest.CaptureFixture[str]) -> None:
    text = DOCS.read_text("utf-8").split("### From a program")[1]
    example = text.split("```python\n")[1].split("```")[0]
    exec(compile(example, "docs/lenses.md", "exec"), {})
    assert capsys.readouterr().out.startswith("equisolid {'f': 299.")
