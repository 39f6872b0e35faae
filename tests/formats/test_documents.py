"""JSON, YAML and XML of profiles: what they say, and that nothing but errors comes of the rest."""

from __future__ import annotations

import math
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from freelook.errors import ProfileError
from freelook.formats import Document, _yaml
from freelook.formats._document import expect_mapping, parse_json, parse_xml
from freelook.formats._numbers import number, numbers, picture_size
from freelook.formats._profile import Choice, Profile
from freelook.formats._yaml import parse_yaml, plain_value
from freelook.formats._yaml_text import dump, heading, real

SCALARS: list[tuple[str, Any]] = [
    ("1", 1),
    ("-0", 0),
    ("010", 10),  # neither octal ...
    ("1:30", "1:30"),  # ... nor base 60 ...
    ("0x10", "0x10"),
    ("1_000", "1_000"),
    ("2026-03-03", "2026-03-03"),  # ... nor a date
    ("yes", "yes"),
    ("on", "on"),
    ("true", True),
    ("False", False),
    ("~", None),
    ("null", None),
    ("", None),
    ("1.", 1.0),
    (".5", 0.5),
    ("+1.5e3", 1500.0),
    ("1e-5", 1e-5),  # which PyYAML takes for a text
    ("-9.9999999999999995e-08", -1e-7),
    (".Inf", math.inf),
    ("-.inf", -math.inf),
    ("1e400", math.inf),
    ("'1'", "1"),
    ('"1.5"', "1.5"),
    ("! 1", "1"),
    ("!!str 1", "1"),
    ("!!float 1.5", 1.5),
    ("radtan", "radtan"),
    ("1 2", "1 2"),
    ("1e", "1e"),
    (".", "."),
    ("[1, 2.5, x]", [1, 2.5, "x"]),
    ("{a: 1, 2: b}", {"a": 1, "2": "b"}),
    ("9" * 401, math.inf),
]


@pytest.mark.parametrize(("text", "value"), SCALARS, ids=range(len(SCALARS)))
def test_yaml_values(text: str, value: Any) -> None:
    found = parse_yaml(f"key: {text}\n")["key"]
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize("text", [".nan", ".NaN", "-.NAN", ".Nan"])
def test_yaml_knows_what_is_no_number(text: str) -> None:
    assert math.isnan(parse_yaml(f"a: {text}")["a"])


@pytest.mark.parametrize("version", ["%YAML:1.0\n---\n", "%YAML:1.0\n", "%YAML 1.2\n---\n", ""])
def test_yaml_with_opencvs_first_line(version: str) -> None:
    text = f"{version}m: !!opencv-matrix\n   rows: 1\n   cols: 2\n   dt: d\n   data: [ 1., 2. ]\n"
    matrix = {"rows": 1, "cols": 2, "dt": "d", "data": [1.0, 2.0], "type_id": "opencv-matrix"}
    assert parse_yaml(text) == {"m": matrix}


def test_aliases_stand_for_short_things() -> None:
    """A program that has the same list twice writes it so."""
    size = [640, 480]
    text = yaml.safe_dump({"cam0": {"resolution": size}, "cam1": {"resolution": size}})
    assert "*id001" in text
    assert parse_yaml(text)["cam1"] == {"resolution": size}


def test_lines_are_counted_with_opencvs_first_one() -> None:
    with pytest.raises(ProfileError, match="given twice in line 4"):
        parse_yaml("%YAML:1.0\n---\na: 1\na: 2\n")


def test_empty_documents_behind_the_first_are_nothing() -> None:
    assert parse_yaml("a: 1\n---\n") == {"a": 1}
    assert parse_yaml("a: 1\n---\n---\n...\n") == {"a": 1}
    assert parse_yaml("# nothing\n") is None


CHAIN = "".join(f"{name}: &{name} {{}}\n" for name in "abcde")
YAML_FAULTS = [
    ("a: 1\n---\nb: 2\n", "more than one YAML document"),
    ("a: 1\na: 2\n", "key 'a' is given twice in line 2"),
    ("? [1, 2]\n: 3\n", "a key must be a word in line 1"),
    ("a: *x\n", r"\*x in line 1 stands for nothing before it"),
    ("a: &x [*x]\n", r"\*x in line 1 stands for nothing before it"),
    ("a: &x " + "y" * 2000 + "\nb: [*x, *x, *x, *x, *x]\n", "aliases in line 2 make it too long"),
    (CHAIN.format("[1, 2, 3]", *[f"[{f'*{name}, ' * 9}]" for name in "abcd"]), "aliases in line 5"),
    (CHAIN.format("[1]", *["[" * 12 + f"*{name}" + "]" * 12 for name in "abcd"]), "too deeply"),
    ("a: !!python/object/apply:os.getcwd []\n", "tag tag:yaml.org,2002:python/object/apply:os.ge"),
    ("a: !!timestamp 2020-01-01\n", "tag .*timestamp in line 1 is not read here"),
    ("a: !mine 1\n", "tag !mine in line 1"),
    ("a: !!opencv-matrix [1]\n", "tag .*opencv-matrix in line 1"),
    ("a: [1, 2\n", "not YAML: .* line 2"),
    ("a: b: c\n", "not YAML: .* line 1, column 5"),
    ("a: \0\n", "not YAML: .*character"),
    ("a: \ud800\n", "not YAML"),
    ("- " * 100, "nested too deeply"),
    ("[" * 100_000, "nested too deeply"),
    ("#" + "x" * 2**19, "more than 512 kB of YAML"),
]


@pytest.mark.parametrize("loader", ["C", "Python"])
@pytest.mark.parametrize(("text", "words"), YAML_FAULTS, ids=[words for _, words in YAML_FAULTS])
def test_yaml_faults(text: str, words: str, loader: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """With PyYAML's parser in C, and where a system has only the one in Python."""
    if loader == "Python":
        monkeypatch.setattr(_yaml, "_LOADER", yaml.SafeLoader)
    with pytest.raises(ProfileError, match=words):
        parse_yaml(text)


letters = st.characters(exclude_categories=["C"])
# PyYAML writes the text 1e5 without quotes: it is no number to it, and one to everybody else
texts = st.text(letters, max_size=10).filter(lambda text: plain_value(text) == text)
finite = st.integers(-(10**300), 10**300) | st.floats(allow_nan=False)
trees = st.recursive(
    st.none() | st.booleans() | finite | texts,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.text(letters, max_size=5), inner, max_size=4)
    ),
    max_leaves=12,
)


@given(trees.filter(lambda tree: tree is not None))
def test_yaml_that_is_written_is_read_back(tree: Any) -> None:
    assert parse_yaml(yaml.safe_dump({"a": tree}))["a"] == tree
    assert parse_yaml(dump({"a": tree}))["a"] == tree


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_written_numbers_keep_all_their_digits_for_everybody(value: float) -> None:
    assert parse_yaml(f"a: {real(value)}")["a"] == value
    assert yaml.safe_load(f"a: {real(value)}")["a"] == value  # PyYAML wants a point
    assert "." in real(value)


def test_json_with_opencvs_comments() -> None:
    assert parse_json('{\n  // flags: "x"\n  "a": "http://b" // c\n}'.replace(" // c", "")) == {
        "a": "http://b"
    }


JSON_FAULTS = [
    ('{"a": 1, "a": 2}', "key 'a' is given twice"),
    ('{"a": NaN}', "NaN is not a number a lens can have"),
    ('{"a": 1,\n "b": }', "not JSON: .* in line 2, column 7"),
    ('{"a": ' + "9" * 5000 + "}", "not JSON: .*digits"),
    ("[" * 100_000, "nested too deeply"),
    ("[" * 65 + "]" * 65, "nested too deeply"),
    (" " * 2**21 + "1", "more than 2 MiB of JSON"),
]


@pytest.mark.parametrize(("text", "words"), JSON_FAULTS, ids=[words for _, words in JSON_FAULTS])
def test_json_faults(text: str, words: str) -> None:
    with pytest.raises(ProfileError, match=words):
        parse_json(text)
    if text[0] in "{[":
        assert Document(text).json is None
        assert Document(text).why_not_json


def test_json_as_deep_as_it_may_be() -> None:
    assert parse_json("[" * 64 + "]" * 64)


XML_FAULTS = [
    ('<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "document type"),
    ("<!doctype a><a/>", "document type"),
    ("<a>&b;</a>", "not XML: undefined entity"),
    ("<a>", "not XML: no element found"),
    ("<a></b>", "not XML: mismatched tag"),
    ("<a>\0</a>", "not XML"),
    ("<a>\ud800</a>", "not XML"),
    ("<a>" * 100_000, "nested too deeply"),
    ("<a>" + " " * 2**21 + "</a>", "more than 2 MiB of XML"),
]


@pytest.mark.parametrize(("text", "words"), XML_FAULTS, ids=range(len(XML_FAULTS)))
def test_xml_faults(text: str, words: str) -> None:
    with pytest.raises(ProfileError, match=words):
        parse_xml(text)
    assert Document(text).xml is None
    assert Document(text).why_not_xml


def test_xml_is_read_whatever_encoding_it_claims() -> None:
    """The text was decoded before; what it says of itself is about the file."""
    root = Document('\ufeff<?xml version="1.0" encoding="ISO-8859-1"?>\n<a>é</a>').xml
    assert root is not None
    assert root.text == "é"


@pytest.mark.parametrize(
    ("text", "kind"),
    [(" \n{}", "json"), ("\ufeff[1]", "json"), (" <a/>", "xml"), ("a: 1", "yaml"), ("x", "yaml")],
)
def test_a_text_is_of_one_kind(text: str, kind: str) -> None:
    document = Document(text)
    assert (document.json is not None) == (kind == "json")
    assert (document.yaml is not None) == (kind == "yaml")
    assert (document.xml is not None) == (kind == "xml")


def test_an_empty_text_is_nothing() -> None:
    document = Document("")
    assert (document.json, document.yaml, document.xml) == (None, None, None)
    assert document.why_not_json
    assert document.why_not_xml


def test_a_mapping_is_expected_or_said_why_there_is_none() -> None:
    assert expect_mapping({"a": 1}, "x") == {"a": 1}
    with pytest.raises(ProfileError, match=r"x must be an object, not \[1\]"):
        expect_mapping([1], "x")
    with pytest.raises(ProfileError, match="x cannot be read: because"):
        expect_mapping(None, "x", "because")


@given(trees)
def test_numbers_are_numbers_or_errors(value: Any) -> None:
    try:
        found = number(value, "x")
    except ProfileError as error:
        assert "x" in str(error)  # noqa: PT017 - both ways out are right
        return
    assert isinstance(value, (int, float))
    assert not isinstance(value, bool)
    assert found == value
    assert found == 0 or 1e-30 < abs(found) < 1e12


NUMBER_FAULTS: list[tuple[Any, str]] = [
    (True, "x must be a number, not True"),
    ("1", "x must be a number, not '1'"),
    (None, "x must be a number, not None"),
    (math.nan, "x = nan is not a number a lens can have"),
    (math.inf, "x = inf is not"),
    (10**400, "x = 1000000"),
    (1e12, r"x = 1000000000000\.0 is not"),
    (5e-324, "x = 5e-324 is not"),
]


@pytest.mark.parametrize(("value", "words"), NUMBER_FAULTS, ids=[w for _, w in NUMBER_FAULTS])
def test_number_faults(value: Any, words: str) -> None:
    with pytest.raises(ProfileError, match=words):
        number(value, "x")


def test_lists_of_numbers_have_the_asked_length() -> None:
    assert numbers([1, 2.5], 2, "x") == [1.0, 2.5]
    assert numbers([1], range(1, 4), "x") == [1.0]
    for value, count, words in [
        ([1], 2, "x must be a list of 2 numbers"),
        ([], range(1, 4), "x must be a list of 1 to 3 numbers"),
        ("12", 2, "x must be a list of 2 numbers"),
        ([1, "2"], 2, r"x\[1\] must be a number"),
    ]:
        with pytest.raises(ProfileError, match=words):
            numbers(value, count, "x")  # type: ignore[arg-type]


@pytest.mark.parametrize("value", [[1, 480], [640, 65537], [640.5, 480], [-640, 480], [640], "640"])
def test_pictures_that_cannot_be(value: Any) -> None:
    with pytest.raises(ProfileError, match="size"):
        picture_size(value, "size")


def test_one_of_several_cameras_is_picked_by_its_name() -> None:
    names = ["cam0", "cam1"]
    assert Choice("cam1").of(names) == 1
    assert Choice().of(["cam0"]) == 0
    with pytest.raises(ProfileError, match=r"2 cameras in one file.*FILE#cam0.*cam0, cam1"):
        Choice().of(names)
    with pytest.raises(ProfileError, match="no camera 'cam2' in it; there are: cam0, cam1"):
        Choice("cam2").of(names)


def test_names_become_comments_that_end_with_their_line(rng: Any) -> None:
    profile = Profile(None, "Lens A\nsecond\r\nline\x1b[0m\x85x", "\n")  # type: ignore[arg-type]
    text = heading(profile)
    assert text.splitlines() == ["# Lens A", "# second", "# line [0m", "# x"]
    assert parse_yaml(text) is None
