"""Views left out, told from one solution, are as if the camera had been solved without them."""

from __future__ import annotations

import numpy as np
import pytest
from boards import truth, views_of

from freelook.calibration import left_out
from freelook.calibration.bundle import resect_all, rms, solve
from freelook.calibration.left_out import FOLDS, cross_validate
from freelook.calibration.parameters import Freedom
from freelook.camera import Camera

FREE = Freedom()


def plainly(model: str, count: int, seed: int) -> tuple[float, float]:
    """(as told, as solved again and again)"""
    camera = truth(model)
    made = views_of(camera, count, seed, noise_px=0.3)
    found = solve(camera, made.poses, made.views, robust=False)
    errors = []
    for fold in range(FOLDS):
        kept = [i for i in range(count) if i % FOLDS != fold]
        held = [i for i in range(count) if i % FOLDS == fold]
        without = solve(
            found.camera,
            [found.poses[i] for i in kept],
            [made.views[i] for i in kept],
            robust=False,
        )
        poses = [found.poses[i] for i in held]
        residuals = resect_all(without.camera, poses, [made.views[i] for i in held])[1]
        errors += list(residuals)
    return cross_validate(found, made.views, FREE), rms(np.concatenate(errors))


@pytest.mark.parametrize("model", ["kannala_brandt", "eucm", "radial_spline"])
def test_many_views(model: str) -> None:
    """To a thousandth: models are told apart by a hundredth."""
    told, solved = plainly(model, 10, 31)
    assert told == pytest.approx(solved, rel=1e-3)


def test_few_views_are_solved_again_where_one_step_does_not_tell(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of five views four are left, and of a flexible lens their share is far from linear; what is
    told holds all the same."""
    asked: list[bool] = []
    step = left_out._Whole.camera_from

    def watched(self: left_out._Whole, kept: list[int]) -> Camera | None:
        camera = step(self, kept)
        asked.append(camera is None)
        return camera

    monkeypatch.setattr(left_out._Whole, "camera_from", watched)
    told, solved = plainly("thin_prism_fisheye", 5, 32)
    assert any(asked)
    assert told == pytest.approx(solved, rel=5e-3)


def test_two_views_predict_nothing() -> None:
    camera = truth("equidistant")
    made = views_of(camera, 2, 33)
    found = solve(camera, made.poses, made.views, robust=False)
    assert np.isnan(cross_validate(found, made.views, FREE))


def test_views_that_do_not_count_are_not_predicted() -> None:
    """A view none of whose points count is as if it were not there."""
    camera = truth("equidistant")
    made = views_of(camera, 6, 34)
    everything = [np.ones(len(view.pixels), bool) for view in made.views]
    nothing = [*everything[:5], np.zeros(len(made.views[5].pixels), bool)]
    with_it = solve(camera, made.poses, made.views, robust=False, counted=nothing)
    without = solve(camera, made.poses[:5], made.views[:5], robust=False)
    told = cross_validate(with_it, made.views, FREE)
    assert told == pytest.approx(cross_validate(without, made.views[:5], FREE), rel=1e-6)
