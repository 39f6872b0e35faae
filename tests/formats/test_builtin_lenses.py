"""The lenses that come with the package: sound, and as their sources have them."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from freelook.camera import Camera
from freelook.formats import builtin_names, load_camera, load_profile
from freelook.lens import Equisolid

COLLECTION = re.compile(r"gyroflow/lens_profiles at 886fc616 \(CC0\), (.*\.json): calibrated")
PUBLISHED = {
    "tum-vi-cam0": "tumvi_cam0",
    "tum-vi-cam1": "tumvi_cam1",
    "uzh-fpv-indoor": "uzhfpv_indoor_cam0",
}


def rays(camera: Camera) -> np.ndarray:
    theta, phi = np.meshgrid(
        np.linspace(0.001, camera.theta_max * (1 - 1e-9), 60), np.radians(np.arange(0, 360, 10))
    )
    return np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    )


def from_collection() -> list[tuple[str, str]]:
    """(name, file in the collection)."""
    found = [(name, COLLECTION.search(load_profile(name).source)) for name in builtin_names()]
    return [(name, match[1]) for name, match in found if match]


@pytest.mark.parametrize("name", builtin_names())
def test_a_built_in_lens_is_sound(name: str) -> None:
    profile = load_profile(name)
    assert profile.name
    assert profile.source
    camera = profile.camera
    assert camera.residual_px < 0.01
    assert (np.diff(camera.lens.radius(np.linspace(0, camera.theta_max, 500))) > 0).all()
    ray = rays(camera)
    back = camera.ray(camera.project(ray))
    np.testing.assert_allclose(back, ray, atol=1e-9)


def test_there_are_some_of_each_kind() -> None:
    names = builtin_names()
    assert {"demo", "paper-2011", *PUBLISHED} <= set(names)
    assert 5 <= len(from_collection()) <= 8
    assert len(names) == 2 + len(PUBLISHED) + len(from_collection())


def test_the_papers_lens_is_what_the_paper_says() -> None:
    """188 degrees on both axes inside the picture, black corners, 1.2 mm on 4.8 x 3.6 mm."""
    camera = load_camera("paper-2011")
    assert camera.size == (720, 576)
    assert isinstance(camera.lens, Equisolid)
    assert camera.lens.f == pytest.approx(1.2 / 3.6 * 576)
    for axis in np.array([[1, 0], [-1, 0], [0, 1], [0, -1]]):
        rim = np.radians(94) * (1 - 1e-9)
        pixel = camera.project(np.array([*(np.sin(rim) * axis), np.cos(rim)]))
        assert (pixel > -0.5).all()
        assert (pixel < np.array(camera.size) - 0.5).all()
    assert np.isnan(camera.ray(np.array([[0, 0], [719, 0], [0, 575], [719, 575]]))).all()


@pytest.mark.data
@pytest.mark.parametrize(("name", "key"), PUBLISHED.items())
def test_published_numbers_are_the_published_ones(name: str, key: str, shared_data: Path) -> None:
    published = json.loads((shared_data / "lens_references" / "published.json").read_text("utf-8"))
    numbers: dict[str, Any] = published[key]["kb4_kalibr"]
    camera = load_camera(name)
    assert list(camera.size) == published[key]["resolution"]
    ray = rays(camera)
    theta = np.arccos(ray[..., 2])
    k1, k2, k3, k4 = numbers["k"]
    theta_d = theta * (1 + k1 * theta**2 + k2 * theta**4 + k3 * theta**6 + k4 * theta**8)
    across = ray[..., :2] / np.linalg.norm(ray[..., :2], axis=-1, keepdims=True)
    expected = theta_d[..., None] * across * [numbers["fx"], numbers["fy"]]
    expected += [numbers["cx"], numbers["cy"]]
    assert np.abs(camera.project(ray) - expected).max() < 1e-6


@pytest.mark.data
@pytest.mark.parametrize(("name", "file"), from_collection())
def test_lenses_of_the_collection_are_those_of_their_files(
    name: str, file: str, shared_data: Path
) -> None:
    camera = load_camera(name)
    origin = load_profile(shared_data / "gyroflow_profiles" / "profiles" / file).camera
    assert camera.size == origin.size
    assert camera.theta_max == pytest.approx(origin.theta_max, abs=1e-9)
    ray = rays(camera)
    np.testing.assert_allclose(camera.project(ray), origin.project(ray), atol=1e-9)
