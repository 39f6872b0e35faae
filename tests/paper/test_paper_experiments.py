"""The simulated experiments find what they were made from."""

from __future__ import annotations

import numpy as np
import pytest

from freelook.calibration.circle import find_circle
from freelook.camera import Camera
from freelook.fitting.curve import fit_curve
from freelook.formats import load_camera
from freelook.lens import Equidistant, Orthographic
from freelook.paper import angles, distances, focal, points, polar, principal_point, printed, rig
from freelook.paper.exhibit import Settings


def test_the_simulated_camera_is_that_of_the_paper() -> None:
    camera = rig.camera()
    assert camera.size == (720, 576)
    assert np.degrees(camera.theta_max) == pytest.approx(94)
    # 1.2 mm on 3.6 mm and 576 rows
    assert float(camera.lens.radius(np.array(1e-6))) / 1e-6 == pytest.approx(192)
    rim = float(camera.lens.radius(np.array(camera.theta_max)))
    assert 0 < rig.CENTER[1] - rim < rig.CENTER[1] + rim < 575  # inside, as the paper says
    assert camera.stretch[1, 1] / camera.stretch[0, 0] == pytest.approx(12 / 11)


def test_the_built_in_profile_is_the_same_camera_with_its_axis_in_the_middle() -> None:
    ours, built_in = rig.camera(), load_camera("paper-2011")
    assert (ours.size, ours.lens) == (built_in.size, built_in.lens)
    assert ours.theta_max == built_in.theta_max
    np.testing.assert_allclose(ours.stretch, built_in.stretch, rtol=1e-15)
    assert built_in.center == (359.5, 287.5)


def test_readings_are_whole_pixels_with_the_stated_error(rng: np.random.Generator) -> None:
    exact = np.full(20_000, 100.37)
    read = rig.read_off(exact, rng)
    assert (read == np.rint(read)).all()
    assert np.std(read - exact) == pytest.approx(rig.read_sigma_px(), rel=0.03)  # 6 sigma
    assert np.mean(read - exact) == pytest.approx(0, abs=0.05)


class TestAngles:
    def test_finds_the_lens(self, rng: np.random.Generator) -> None:
        fits = angles.model_fits(angles.measure(rng))
        equisolid = next(fit for fit in fits if fit.model == "equisolid")
        assert fits[0].model in ("equisolid", "kannala_brandt", "polynomial")  # they contain it
        true_f = 192 * 11 / 12
        f = float(equisolid.lens.radius(np.array(1e-6))) / 1e-6
        assert abs(f - true_f) < 4 * equisolid.sigma["f"]
        assert abs(equisolid.offset_px - rig.CENTER[0]) < 4 * equisolid.sigma["offset_px"]
        worse = {fit.model: fit.aicc - equisolid.aicc for fit in fits}
        assert min(worse[m] for m in ("orthographic", "equidistant", "stereographic")) > 50

    def test_sigma_is_the_spread_of_many_experiments(self) -> None:
        found, sigma = [], []
        for seed in range(40):
            experiment = angles.measure(np.random.default_rng(seed))
            used = experiment.angles_deg <= 90
            fit = fit_curve(
                "equisolid",
                np.radians(experiment.angles_deg[used]),
                experiment.columns_px[used],
                free_offset=True,
                loss="linear",
            )
            found.append(fit.offset_px)
            sigma.append(fit.sigma["offset_px"])
        # a standard deviation of 40 has an error of 11 percent; 3 of them
        assert np.std(found) == pytest.approx(np.mean(sigma), rel=0.35)

    def test_points_stand_at_true_angles(self, rng: np.random.Generator) -> None:
        experiment = angles.measure(rng)
        assert experiment.angles_deg.min() == 0
        assert 90 < experiment.angles_deg.max() <= 94
        theta = np.radians(experiment.angles_deg)
        expected = rig.CENTER[0] + 11 / 12 * 2 * 192 * np.sin(theta / 2)
        np.testing.assert_allclose(experiment.exact_px, expected, atol=1e-9)
        np.testing.assert_allclose(experiment.columns_px, expected, atol=6)  # 6 sigma

    def test_rounding_the_quintic_as_in_print_ruins_it(self, rng: np.random.Generator) -> None:
        table = angles.points_table(angles.measure(rng))
        rounded = np.abs(table["quintic_as_printed_px"] - table["quintic_px"])
        # 3 pixels: the error of a fitted quintic at its very ends
        assert np.abs(table["quintic_px"] - table["true_px"]).max() < 3
        assert rounded[table["theta_deg"] < 10].max() < 1
        assert rounded.max() > 10

    def test_stems_are_line_minus_quintic(self, rng: np.random.Generator) -> None:
        experiment = angles.measure(rng)
        table = angles.stems_table(experiment)
        at_60 = float(table["line_minus_quintic_px"][table["theta_deg"] == 60][0])
        offset, slope = experiment.line
        quintic = np.polynomial.polynomial.polyval(60.0, experiment.quintic)
        assert at_60 == pytest.approx(offset + slope * 60 - quintic, abs=1e-6)


class TestDistances:
    def test_exact_tracks_are_straight_lines_into_the_centre(self) -> None:
        for point, track in zip(distances.SQUARES, distances.exact_tracks(), strict=True):
            from_center = track - rig.CENTER
            if point == 1:
                assert np.abs(from_center).max() < 1e-9
                continue
            direction = from_center[0] / np.linalg.norm(from_center[0])
            beside = from_center @ [-direction[1], direction[0]]
            assert np.abs(beside).max() < 1e-9
            assert (np.diff(from_center @ direction) < 0).all()
            assert distances.off_line_px(track).max() < 1e-9

    def test_point_6_keeps_its_y_and_the_others_move_both_ways(self) -> None:
        moves = np.ptp(distances.exact_tracks(), axis=1)
        assert moves[5, 0] > 50
        assert moves[5, 1] < 1e-9
        assert (moves[1:5] > 50).all()

    def test_a_bend_would_be_seen(self) -> None:
        """Guards the straightness measure: a lens that is not round does bend tracks."""
        track = distances.exact_tracks()[5].copy()  # along a row
        track[len(track) // 2, 1] += 1.0
        assert distances.off_line_px(track).max() > 0.9

    def test_tracks_are_straight_through_any_round_lens(self) -> None:
        plain = rig.camera()
        for lens in (Equidistant(150.0), Orthographic(250.0)):
            camera = Camera(plain.size, lens, plain.center, np.radians(89.0), plain.stretch)
            for track in camera.project(distances.rays())[1:]:
                assert distances.off_line_px(track).max() < 1e-9

    def test_readings_lead_back_to_the_centre(self) -> None:
        table = distances.straightness(distances.tracks(Settings(seed=4)))
        # reading error 1.04 px; 27 points leave a fifth of it, more at the far end
        assert np.nanmax(table["line past centre, read"]) < 3
        assert np.nanmax(table["off its line, read (rms)"]) < 1.6

    def test_the_way_covers_40_to_300_mm(self) -> None:
        away = distances.distances_mm()
        assert (away[0], away[-1]) == printed.DISTANCES_MM


class TestFocal:
    def test_bias_is_that_of_the_formula(self) -> None:
        sizes = np.array([6.0, 60.0])
        half = np.arctan(sizes / 200)
        expected = 2 * 2 * np.sin(half / 2) * 100 / sizes - 1
        np.testing.assert_allclose(focal.bias("equisolid", sizes), expected, rtol=1e-9)
        np.testing.assert_allclose(focal.bias("perspective", sizes), 0, atol=1e-12)

    def test_error_grows_with_the_object_and_reading_shrinks(self) -> None:
        table = focal.errors(Settings())
        assert (np.diff(np.abs(table["equisolid_percent"])) > 0).all()
        assert (np.diff(table["reading_percent"]) < 0).all()
        strays = np.abs(table["simulated_percent"] - table["equisolid_percent"])
        assert (strays < 4.5 * table["reading_percent"]).all()
        assert strays.max() > 0


def test_equations_2_to_5_are_the_camera(rng: np.random.Generator) -> None:
    assert polar.largest_difference_px(Settings(seed=9)) < 1e-9
    ray = np.array([[0.0, 1.0, 1.0]])  # 45 degrees down, by hand
    expected = [366.3, 284.9 + 160 * 1.2 * 2 * np.sin(np.pi / 8)]
    np.testing.assert_allclose(polar.paper_pixels(ray)[0], expected, atol=1e-9)


class TestPoints:
    def test_recovers_everything_within_its_sigma(self, rng: np.random.Generator) -> None:
        solution = points.solve(*points.seen_points(rng))
        table = points.comparison(solution)
        assert np.abs(table["off by sigmas"]).max() < 4
        # 14 of about 340 residuals are used up by the parameters: 2 percent
        assert solution.rms_px == pytest.approx(rig.read_sigma_px(), rel=0.15)
        curve = points.curve(solution)
        assert np.abs(curve["error_px"]).max() < 4

    def test_without_errors_it_is_exact_but_for_the_polynomial(self) -> None:
        pixels = rig.camera().project(points.true_rays())
        seen = np.isfinite(pixels).all(axis=1)
        solution = points.solve(points.box_points()[seen], pixels[seen])
        # 2 sin(theta / 2) as a polynomial of fifth degree over 94 degrees
        assert solution.rms_px < 1e-3
        assert abs(solution.x[5] - rig.CENTER[0]) < 1e-3
        assert solution.x[7] == pytest.approx(11 / 12, abs=1e-6)
        np.testing.assert_allclose(solution.x[11:], points.TRUE_SHIFT_MM, atol=0.01)

    def test_points_reach_the_rim(self, rng: np.random.Generator) -> None:
        rays = points.true_rays()
        theta = np.degrees(np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2]))
        seen, _ = points.seen_points(rng)
        assert len(seen) == (theta <= 94).sum() > 150
        assert theta[theta <= 94].max() > 88


def test_circle_gives_the_principal_point() -> None:
    settings = Settings(seed=6, pictures=1)
    for camera in (rig.camera(), principal_point.cut_camera()):
        found = find_circle(principal_point.pictures(camera, settings))
        case = principal_point.Case("one", camera, found)
        assert case.center_error_px < 0.5
        assert found.radius_px == pytest.approx(case.true_radius_px, abs=0.5)
        assert found.aspect == pytest.approx(12 / 11, abs=0.003)
    rim = 192 * np.radians(94)
    assert case.true_radius_px == pytest.approx(rim * 11 / 12)  # the cut one, by hand
    assert 2 * rim > 576
