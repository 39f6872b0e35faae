"""What all tests share: loud arithmetic, one seed, the real recordings, waiting with a deadline."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

ROOT = Path(__file__).resolve().parent.parent
SHARED_DATA = ROOT.parent / "shared" / "data"

# No deadline per example: the machine may be busy with other things.
settings.register_profile(
    "freelook",
    deadline=None,
    max_examples=60,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.load_profile("freelook")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files that use a browser come last: Playwright keeps an event loop running on the main
    thread, where after it no test could run its own."""
    browsing = {item.path for item in items if "browser" in getattr(item, "fixturenames", ())}
    items.sort(key=lambda item: item.path in browsing)


@pytest.fixture(autouse=True)
def _loud_arithmetic() -> Iterator[None]:
    """Overflow, invalid operations and the like are errors in every test."""
    with np.errstate(all="raise"):
        yield


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(2011)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real recordings; the test is skipped where it is absent."""
    if not SHARED_DATA.is_dir():
        pytest.skip("the real recordings are not here (../shared/data beside the project)")
    return SHARED_DATA


@pytest.fixture(scope="session")
def wait_until() -> Callable[..., None]:
    """`wait_until(predicate, timeout_s=5)`: returns once it holds, fails the test if it never
    does."""
    return _wait_until


def _wait_until(predicate: Callable[[], Any], timeout_s: float = 5.0, what: str = "") -> None:
    deadline = time.monotonic() + timeout_s
    while not predicate():
        if time.monotonic() > deadline:
            pytest.fail(f"still not so after {timeout_s} s: {what or predicate}")
        time.sleep(0.002)  # between looks; the deadline decides
