"""Pixels per degree against closed forms, and fields of view against where the picture ends."""

from __future__ import annotations

import numpy as np
import pytest

from freelook.camera import Camera, make_camera
from freelook.lens import (
    MODELS,
    Equidistant,
    Equisolid,
    KannalaBrandt,
    Lens,
    Perspective,
    Stereographic,
    ThinPrismFisheye,
    radius_slope,
)
from freelook.resolution import (
    angles,
    around_axis,
    fields_of_view,
    image_pixels,
    inside_picture,
    least_and_most,
    over_picture,
    places,
    ray_at,
    resolution_at,
    resolution_towards,
    sample_places,
)
from lens_examples import EXAMPLES

DEGREE = np.pi / 180
CLOSE = 1e-7  # central differences of 1e-5 rad of pixels below 1e4: rounding errs by less
BENT = ThinPrismFisheye(300.0, k1=-0.02, p1=0.003, p2=-0.002, sx1=0.004, sy1=-0.001)
ROUND = [
    Equidistant(300),
    Stereographic(300),
    Equisolid(300),
    KannalaBrandt(685.5, -0.1586, 0.01716, -0.01452, 0.00759),
]


def camera(lens: Lens, field_deg: float = 220, **changes: object) -> Camera:
    return make_camera((1000, 800), lens, field_deg=field_deg, **changes)  # type: ignore[arg-type]


def test_an_equidistant_lens_has_the_same_pixels_per_degree_all_along_a_radius() -> None:
    theta = np.radians([[0, 1e-4, 30, 89.999, 90, 109.9, 110]])
    there = resolution_at(camera(Equidistant(300)), ray_at(theta, around_axis(8)[:, None]))
    np.testing.assert_allclose(there.radial, 300 * DEGREE, rtol=CLOSE)
    sine = np.sin(theta[:, 1:])
    around = 300 * DEGREE * theta[:, 1:] / sine
    # on the rim itself it is taken 2e-5 rad further in, where it is smaller by as much
    np.testing.assert_allclose(there.tangential[:, 1:], np.tile(around, (8, 1)), rtol=2e-4)
    np.testing.assert_allclose(
        there.tangential[:, 1:-1], np.tile(around, (8, 1))[:, :-1], rtol=CLOSE
    )
    np.testing.assert_allclose(there.tangential[:, 0], 300 * DEGREE, rtol=CLOSE)


@pytest.mark.parametrize("lens", ROUND, ids=str)
def test_round_lenses_follow_the_closed_forms(lens: Lens) -> None:
    theta = np.radians(np.linspace(1, 109, 50))
    there = resolution_at(camera(lens), ray_at(theta, np.array(2.5)))
    np.testing.assert_allclose(there.radial, radius_slope(lens, theta) * DEGREE, rtol=CLOSE)
    around = lens.radius(theta) / np.sin(theta) * DEGREE
    np.testing.assert_allclose(there.tangential, around, rtol=CLOSE)
    np.testing.assert_allclose(there.mean**2, there.radial * there.tangential, rtol=CLOSE)


def test_stereographic_is_the_same_in_all_directions_and_equisolid_keeps_areas() -> None:
    ray = ray_at(np.radians(np.linspace(0, 109, 40)), np.array(0.7))
    conformal = resolution_at(camera(Stereographic(300)), ray)
    np.testing.assert_allclose(conformal.least, conformal.most, rtol=CLOSE)
    equal = resolution_at(camera(Equisolid(300)), ray)
    np.testing.assert_allclose(equal.mean, 300 * DEGREE, rtol=CLOSE)


def test_pixels_twice_as_dense_to_the_right() -> None:
    stretched = camera(Equidistant(200), stretch=np.diag([2.0, 1.0]))
    right, down = np.array([0.0]), np.array([np.pi / 2])
    theta = np.radians([60.0])
    to_the_right = resolution_at(stretched, ray_at(theta, right))
    downwards = resolution_at(stretched, ray_at(theta, down))
    around = 200 * DEGREE * theta / np.sin(theta)
    np.testing.assert_allclose(to_the_right.radial, 400 * DEGREE, rtol=CLOSE)
    np.testing.assert_allclose(to_the_right.tangential, around, rtol=CLOSE)
    np.testing.assert_allclose(downwards.radial, 200 * DEGREE, rtol=CLOSE)
    np.testing.assert_allclose(downwards.tangential, 2 * around, rtol=CLOSE)
    on_the_axis = resolution_towards(stretched, np.zeros(2), np.radians([0.0, 90.0]))
    np.testing.assert_allclose(on_the_axis.radial, np.array([400, 200]) * DEGREE, rtol=CLOSE)


def test_what_the_lens_does_not_see_has_no_resolution() -> None:
    ray = ray_at(np.radians([89.9, 90.0, 90.1, 180.0]), np.zeros(1))
    there = resolution_at(camera(Equidistant(300), 180), ray)
    for values in (there.radial, there.tangential, there.least, there.most, there.mean):
        assert np.isfinite(values).tolist() == [True, True, False, False]


@pytest.mark.parametrize("lens", [Equidistant(200), BENT], ids=["round", "bent"])
def test_square_degrees_over_the_picture_add_up_to_the_whole_field(lens: Lens) -> None:
    """Each pixel shows 1 / mean^2 square degrees: together they are the field's cap."""
    seen = camera(lens, 150, stretch=np.array([[1.1, 0.05], [0.0, 0.9]]))
    over = over_picture(seen, columns=400)
    cell_px = 1000 * 800 / over.theta.size
    total = np.nansum(cell_px / over.resolution.mean**2)
    cap = 2 * np.pi * (1 - np.cos(np.radians(75))) / DEGREE**2
    assert total == pytest.approx(cap, rel=1e-3)  # cells of 2.5 px cut the rim into steps


def test_least_and_most_are_the_singular_values(rng: np.random.Generator) -> None:
    matrices = rng.normal(size=(50, 2, 2))
    matrices[0], matrices[1] = np.eye(2), [[1, 2], [2, 4]]
    least, most = least_and_most(matrices)
    np.testing.assert_allclose(
        np.stack([most, least], axis=-1), np.linalg.svd(matrices, compute_uv=False), atol=1e-14
    )


def test_angles_and_rays_are_each_other_s_reverse() -> None:
    theta, phi = angles(ray_at(np.array([0.3, 2.0]), np.array([-3.0, 1.5])))
    np.testing.assert_allclose([theta, phi], [[0.3, 2.0], [-3.0, 1.5]])
    np.testing.assert_allclose(ray_at(np.array(np.pi / 2), np.array(0.0)), [1, 0, 0], atol=1e-15)


def test_samples_are_the_pixels_where_there_are_few_and_spread_evenly_elsewhere() -> None:
    x, y = sample_places((4, 3), 100)
    assert (x.tolist(), y.tolist()) == ([0, 1, 2, 3], [0, 1, 2])
    x, y = sample_places((1000, 500), 10)
    assert (x[0], x[-1], len(x), len(y)) == (49.5, 949.5, 10, 5)
    assert places(x, y)[2, 3].tolist() == [x[3], y[2]]


def test_the_picture_ends_at_its_outer_edges() -> None:
    pixels = np.array([[-0.5, 0], [-0.51, 0], [9.5, 4.5], [9.5, 4.51], [np.nan, 0]])
    assert inside_picture(pixels, (10, 5)).tolist() == [True, False, True, False, False]


def test_the_image_of_a_circle_covers_a_circle() -> None:
    inside = camera(Equidistant(100), 220)
    radius = 100 * np.radians(110)
    assert image_pixels(inside, 500) == pytest.approx(np.pi * radius**2, rel=3e-3)
    assert over_picture(inside).seen == pytest.approx(np.pi * radius**2 / 800_000, rel=3e-3)
    assert image_pixels(make_camera((1000, 800), Perspective(500))) == 800_000


def test_fields_run_from_edge_to_edge_through_the_axis() -> None:
    """The axis is 50 px right of the middle and 100 px above: more is seen left and below."""
    fields = fields_of_view(camera(Equidistant(250), center=(549.5, 299.5)))
    f = np.degrees(1 / 250)
    assert fields.left == pytest.approx(min(550 * f, 110))
    assert fields.right == pytest.approx(450 * f)
    assert fields.top == pytest.approx(300 * f)
    assert fields.bottom == pytest.approx(min(500 * f, 110))
    assert fields.horizontal == pytest.approx(110 + 450 * f)
    assert fields.vertical == pytest.approx(300 * f + 110)
    assert fields.circle == pytest.approx(220)


def test_an_ordinary_picture_s_fields_are_the_textbook_s() -> None:
    fields = fields_of_view(make_camera((640, 480), Perspective(400)))
    assert fields.horizontal == pytest.approx(2 * np.degrees(np.arctan(320 / 400)))
    assert fields.vertical == pytest.approx(2 * np.degrees(np.arctan(240 / 400)))
    assert fields.diagonal == pytest.approx(2 * np.degrees(np.arctan(400 / 400)))
    assert fields.circle == pytest.approx(fields.diagonal)
    assert fields.corner == pytest.approx(45)


def test_an_axis_outside_the_picture_lies_on_its_far_side() -> None:
    """The picture shows only what is right of the axis, from 10 degrees on."""
    f = 1000 / np.radians(50)
    aside = make_camera((1000, 800), Equidistant(f), center=(-200.5, 399.5), field_deg=140)
    fields = fields_of_view(aside)
    assert fields.left == pytest.approx(-10)
    assert fields.right == pytest.approx(60)
    assert fields.horizontal == pytest.approx(50)


@pytest.mark.parametrize("model", MODELS)
def test_every_model_s_real_lens_is_resolved_wherever_it_sees(model: str) -> None:
    """Also those with terms that are not round, up to the rim and never beyond it."""
    example = EXAMPLES[model][0].camera
    over = over_picture(example, columns=40)
    seen = np.isfinite(over.theta)
    assert 0.5 < seen.mean() < 0.9  # a circle in a picture that just holds it
    for values in (over.resolution.radial, over.resolution.tangential, over.resolution.least):
        assert (np.isfinite(values) == seen).all()
        assert (values[seen] > 0).all()
    slack = 1 + 1e-7
    assert (over.resolution.least <= over.resolution.tangential * slack)[seen].all()
    assert (over.resolution.most * slack >= over.resolution.radial)[seen].all()


@pytest.mark.parametrize("model", MODELS)
def test_a_ray_without_direction_has_neither_a_place_nor_a_resolution(model: str) -> None:
    example = EXAMPLES[model][0].camera
    assert np.isnan(example.project(np.array([[0.0, 0.0, 0.0], [np.nan] * 3]))).all()
    assert np.isnan(resolution_at(example, np.full((1, 3), np.nan)).least).all()
