"""What every lens profile format keeps, run over all of `FORMATS`.

A new format is tested by putting a text of its own into samples.py.
"""

from __future__ import annotations

import contextlib
import json
import re
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from samples import SAMPLES, SIZE

from freelook.camera import Camera, make_camera
from freelook.errors import ProfileError
from freelook.formats import (
    FORMATS,
    Choice,
    Document,
    Profile,
    format_module,
    format_of,
    load_profile,
    parse_profile,
)
from freelook.lens import MODELS
from lens_examples import EXAMPLES

CHOICE = Choice(size=SIZE)
TEXTS = [(name, text) for name, texts in SAMPLES.items() for text in texts]
IDS = [f"{name}-{i}" for name, texts in SAMPLES.items() for i in range(len(texts))]
every_sample = pytest.mark.parametrize(("name", "text"), TEXTS, ids=IDS)
every_format = pytest.mark.parametrize("name", FORMATS)


def read(text: str, name: str | None = None) -> Profile:
    return parse_profile(Document(text), CHOICE, format=name)


def rays(field_rad: float) -> np.ndarray:
    """Unit rays up to this angle from the axis, all around, (60, 36, 3)."""
    theta = np.linspace(0, field_rad, 60)[:, None]
    phi = np.linspace(0, 2 * np.pi, 36, endpoint=False)
    across = np.sin(theta)[..., None] * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    along = np.broadcast_to(np.cos(theta)[..., None], (*across.shape[:2], 1))
    return np.concatenate([across, along], axis=-1)


def largest_difference_px(a: Camera, b: Camera) -> float:
    seen = rays(min(a.theta_max, b.theta_max) * (1 - 1e-12))
    return float(np.abs(a.project(seen) - b.project(seen)).max())


def assert_usable(profile: Profile) -> None:
    """What a renderer takes for granted about any camera that was read."""
    camera = profile.camera
    assert np.isfinite(camera.table.g).all()
    assert camera.grid is None or np.isfinite(camera.grid.offsets).all()
    assert 0 < camera.theta_max <= np.radians(140)
    assert np.isfinite(camera.project(rays(camera.theta_max * (1 - 1e-12)))).all()
    assert all(isinstance(note, str) for note in profile.notes)


def test_every_format_has_samples() -> None:
    assert set(SAMPLES) == set(FORMATS)
    assert all(SAMPLES.values())


@every_format
def test_a_format_says_what_it_holds(name: str) -> None:
    module = format_module(name)
    assert module.SUFFIX.startswith(".")
    assert module.MODELS
    assert set(module.MODELS) <= set(MODELS)


@every_sample
def test_a_text_is_recognised_by_exactly_its_own_format(name: str, text: str) -> None:
    document = Document(text)
    assert [other for other in FORMATS if format_module(other).recognises(document)] == [name]


@every_sample
def test_line_ends_and_a_byte_order_mark_change_nothing(name: str, text: str) -> None:
    other = read("\ufeff" + text.replace("\n", "\r\n"))
    assert largest_difference_px(other.camera, read(text).camera) == 0


@every_sample
def test_what_is_read_can_be_used(name: str, text: str) -> None:
    assert_usable(read(text))


@every_sample
def test_what_is_written_is_read_back_the_same(name: str, text: str) -> None:
    camera = read(text).camera
    written = format_module(name).write(Profile(camera, "A name: with\na # and \x07", "its source"))
    assert format_of(Document(written)) == name
    again = read(written).camera
    assert again.size == camera.size
    # a field that the format cannot say may be larger again, never smaller
    assert again.theta_max > camera.theta_max - 1e-6
    assert largest_difference_px(again, camera) < 1e-9


@cache
def example_cameras(model: str) -> list[Camera]:
    """Off centre, with pixels that are not square, and with a skew as well."""
    stretches = (np.diag([1, 0.98]), np.array([[1, 0.01], [0, 0.97]]))
    lenses = [example.lens for example in EXAMPLES[model]]
    with contextlib.suppress(TypeError):  # splines have no defaults
        lenses.append(MODELS[model](300.0))  # type: ignore[call-arg]
    return [
        make_camera(SIZE, lens, center=(300.25, 250.5), stretch=stretch, field_deg=60)
        for lens in lenses
        for stretch in stretches
    ]


@every_format
@pytest.mark.parametrize("model", MODELS)
def test_any_lens_is_written_exactly_or_refused(name: str, model: str) -> None:
    """A format may hold less of a model than there is (no k3, no skew); then it must say so."""
    for camera in example_cameras(model):
        with contextlib.suppress(ProfileError):
            written = format_module(name).write(Profile(camera))
            assert model in format_module(name).MODELS
            assert largest_difference_px(read(written).camera, camera) < 1e-9


@every_format
def test_something_of_every_model_a_format_holds_is_written(name: str) -> None:
    """Guards the test above against refusing everything."""
    for model in format_module(name).MODELS:
        written = []
        for camera in example_cameras(model):
            with contextlib.suppress(ProfileError):
                written.append(format_module(name).write(Profile(camera)))
        assert written, model


@every_format
def test_a_stretch_that_turns_the_picture_is_written_exactly_or_refused(name: str) -> None:
    for model in format_module(name).MODELS:
        lens = EXAMPLES[model][0].lens
        camera = make_camera(
            SIZE, lens, center=(300, 250), stretch=np.array([[1, 0.01], [0.02, 1]]), field_deg=60
        )
        with contextlib.suppress(ProfileError):
            written = format_module(name).write(Profile(camera))
            assert largest_difference_px(read(written).camera, camera) < 1e-9


# Where a text is no profile


def is_refused_or_usable(text: str, name: str | None = None) -> None:
    with contextlib.suppress(ProfileError):
        assert_usable(read(text, name))


def recognises_quietly(text: str) -> None:
    for name in FORMATS:
        assert format_module(name).recognises(Document(text)) in (True, False)


ODD_TEXTS = [
    *("", " ", "\n", "\ufeff", "\0", "{", "[", "<", "<a>", "{}", "[]", "<a/>", "null", "~", "0"),
    *(
        "---",
        "---\n---\n",
        "%YAML:1.0",
        "%YAML 1.2\n---\n",
        "*a",
        "&a",
        "!!set {a}",
        "? a",
        "? [a]",
    ),
    *("a: &b 1", "a: *b", "<<: {a: 1}", "{1: 2, 3: 4}", "1 2 3", "cam0:", "cam0: {}", "value0: {}"),
    '{"value0": {"intrinsics": []}}',
    '{"value0": {"intrinsics": [[]], "resolution": [[]]}}',
    '{"K": [[]], "D": []}',
    '{"camera_matrix": {"type_id": "opencv-matrix"}}',
    "camera_matrix: !!opencv-matrix [1]",
    "camera_matrix: !!opencv-matrix\n  rows: 3",
    "K: [1]\ndistortion_model:",
    "cam0: {camera_model: [], distortion_model: {}, intrinsics: 1, distortion_coeffs: ~}",
    "<opencv_storage/>",
    "<opencv_storage><K type_id='opencv-matrix'/></opencv_storage>",
    "9" * 5000,
    "a: " + "9" * 5000,
    '{"a": ' + "9" * 5000 + "}",
    "\ud800",
    "!!timestamp x",
    "!!int ''",
    "!!float ''",
    "!!bool x",
    "!!python/object/apply:os.getcwd []",
]


@pytest.mark.parametrize("text", ODD_TEXTS, ids=range(len(ODD_TEXTS)))
def test_odd_texts_are_refused(text: str) -> None:
    recognises_quietly(text)
    for name in (None, *FORMATS):
        with pytest.raises(ProfileError):
            read(text, name)


@every_sample
def test_a_wrong_format_that_is_forced_reads_nothing_else(name: str, text: str) -> None:
    """ROS and OpenCV write so much alike that either reads the other's, rightly."""
    camera = read(text).camera
    for other in set(FORMATS) - {name}:
        with contextlib.suppress(ProfileError):
            assert largest_difference_px(read(text, other).camera, camera) < 1e-9


WORDS = [
    *("0", "-1", "1", "1e400", "-1e300", "1e-320", "1e-29", "9" * 400, "9" * 5000, "0x10", "1_0"),
    *("nan", ".nan", "-.inf", "NaN", "Infinity", "null", "~", "true", "yes", "2020-01-01", "1:30"),
    *(
        "[]",
        "{}",
        "[[]]",
        '""',
        "''",
        '"x"',
        "x",
        "{",
        "]",
        ":",
        "- -",
        "#",
        "//",
        "\n",
        "\t",
        "\0",
    ),
    *("*a", "&a 1", "!!python/object:os.system x", "!!timestamp x", "!a", "<<", "<!DOCTYPE a>"),
    *("&lt;", "<a>", "</a>", "\ud7ff", "\ufeff", "é", "[" * 2000, "- " * 2000, "<a>" * 2000),
]
TOKEN = re.compile(r"[-+.\w]+|[^\w\s]")


@given(data=st.data())
def test_samples_with_words_exchanged(data: st.DataObject) -> None:
    """One or two words or signs of a sample become something else."""
    _, text = data.draw(st.sampled_from(TEXTS))
    for _ in range(data.draw(st.integers(1, 2))):
        tokens = [match.span() for match in TOKEN.finditer(text)]
        start, end = data.draw(st.sampled_from(tokens)) if tokens else (0, 0)
        word = data.draw(st.sampled_from(WORDS) | st.floats().map(repr) | st.text(max_size=5))
        text = text[:start] + word + text[end:]
    recognises_quietly(text)
    is_refused_or_usable(text)


@given(data=st.data())
def test_samples_with_parts_cut_out_doubled_and_moved(data: st.DataObject) -> None:
    name, text = data.draw(st.sampled_from(TEXTS))
    places = st.integers(0, len(text))
    start, end = sorted((data.draw(places), data.draw(places)))
    part, into = text[start:end], data.draw(places)
    rest = data.draw(st.sampled_from([text, text[:start] + text[end:]]))
    mixed = rest[:into] + part * data.draw(st.integers(0, 2)) + rest[into:]
    recognises_quietly(mixed)
    is_refused_or_usable(mixed, data.draw(st.sampled_from([None, name])))


values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=8,
)
TREES = [
    (tree, text)
    for _, text in TEXTS
    for tree in (Document(text).json, Document(text).yaml)
    if isinstance(tree, dict)
]


def paths(tree: Any, above: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Where every value of a tree stands."""
    for key in tree if isinstance(tree, dict) else range(len(tree)):
        yield (*above, key)
        if isinstance(tree[key], (dict, list)):
            yield from paths(tree[key], (*above, key))


def exchanged(tree: Any, path: tuple[Any, ...], value: Any) -> Any:
    if not path:
        return value
    copy = tree.copy()
    copy[path[0]] = exchanged(tree[path[0]], path[1:], value)
    return copy


def test_there_are_trees_to_change() -> None:
    assert len(TREES) >= 10


@given(data=st.data())
def test_samples_with_any_value_in_place_of_any_other(data: st.DataObject) -> None:
    tree, _ = data.draw(st.sampled_from(TREES))
    path = data.draw(st.sampled_from(list(paths(tree))))
    changed = exchanged(tree, path, data.draw(values))
    for text in (json.dumps(changed), yaml.safe_dump(changed)):
        recognises_quietly(text)
        is_refused_or_usable(text)


@given(content=st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_files_of_anything(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "profile"
    path.write_bytes(content)
    for name in (None, *FORMATS):
        with pytest.raises(ProfileError):
            load_profile(path, format=name, size=SIZE)


# Where a file is meant to do harm. Processor time, so that a busy machine fails nothing.


@contextlib.contextmanager
def at_most(seconds: float) -> Iterator[None]:
    start = time.process_time()
    yield
    assert time.process_time() - start < seconds


@every_format
def test_a_file_of_100_mb_is_refused_without_reading_it_all(name: str, tmp_path: Path) -> None:
    path = tmp_path / "profile"
    with path.open("w", encoding="utf-8") as file:
        file.write(SAMPLES[name][0])
        file.truncate(100_000_000)  # a hole: it costs no room
    for asked in (None, name):
        with at_most(0.5), pytest.raises(ProfileError, match="more than 16 MiB"):
            load_profile(path, format=asked)


LAUGHS_YAML = "a0: &a0 [lol, lol, lol]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 30)
)
LAUGHS_XML = (
    '<?xml version="1.0"?>\n<!DOCTYPE a [<!ENTITY a0 "lol">\n'
    + "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 9}">\n' for i in range(1, 30))
    + "]>\n<opencv_storage><LensDescription>&a29;</LensDescription></opencv_storage>"
)
OUTSIDE_XML = (
    '<!DOCTYPE a [<!ENTITY a SYSTEM "file:///etc/hostname">]>'
    "<LensDescription><opencv_storage>&a;</opencv_storage></LensDescription>"
)


@pytest.mark.parametrize("text", [LAUGHS_YAML, LAUGHS_XML, OUTSIDE_XML], ids=["yaml", "xml", "out"])
@pytest.mark.parametrize("name", [None, *FORMATS])
def test_a_billion_laughs_are_refused_at_once(name: str | None, text: str) -> None:
    with at_most(0.5), pytest.raises(ProfileError):
        read(text, name)


@every_sample
def test_a_billion_laughs_in_a_sample_are_refused_at_once(name: str, text: str) -> None:
    """Behind a real profile, where the format has recognised it before."""
    more = LAUGHS_XML if text.startswith("<") else LAUGHS_YAML
    with at_most(0.5), pytest.raises(ProfileError):
        read(text + more, name)


SWAMPS = {
    "[": "[" * 2**20,
    "a: [": "a: " + "[" * 2**20,
    "numbers": "a: [" + "1.5, " * 50_000 + "1]",
    "json numbers": "[" + "1.5, " * 300_000 + "1]",
    "json objects": "[" + '{"a": 0}, ' * 100_000 + "0]",
    "- ": "- " * 2**18,
    "-": "-\n" * 2**17,
    "a:": "".join(f"a{i}:\n" for i in range(2**15)),
    "spaces": " " * 2**22,
    "lines": "\n" * 2**20,
    "words": "1 2 3.5\n" * 2**16,
    "cameras": "1 PINHOLE 640 480 300 300 320 240\n" * 2**15,
    "<a>": "<a>" * 2**18,
    "opencv_storage": "<opencv_storage>" + "<a>1</a>" * 2**16 + "</opencv_storage>",
    "lens": "<LensDescription>" * 2**15,
    "quote": '"' + "x" * 2**20,
}


@pytest.mark.parametrize("swamp", SWAMPS)
def test_large_texts_are_refused_soon(swamp: str) -> None:
    """As large as a reader lets them be; a second or two is the price of reading megabytes."""
    with at_most(4), contextlib.suppress(ProfileError):
        read(SWAMPS[swamp])
