"""Where video comes from: one file per kind of source, found by itself.

A source module has a one-line docstring (its row in the documentation), `KIND`, and two
functions: `recognises(argument)` says whether this is one of its own, and
`open(argument, *, loop, pace, clock, options)` makes the source. Opening checks what can be
checked at once and on this machine; whatever may have to be waited for happens in `units`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import ModuleType
from urllib.parse import parse_qsl, urlsplit

from ..clock import Clock, now_ns
from ..errors import SourceError
from ..plugins import modules_by_kind
from ..types import Source


def modules() -> dict[str, ModuleType]:
    """The source modules by their KIND."""
    return modules_by_kind(__name__)


def open_source(
    argument: str,
    *,
    loop: bool = False,
    pace: bool = True,
    clock: Clock = now_ns,
    options: Mapping[str, str] | None = None,
) -> Source:
    """The source that an argument names: a file, an address, a device, or `KIND:ARGUMENT`.

    `loop` (start again at the end) and `pace` (play at the recorded pace, not as fast as
    possible) matter to recordings only. SourceError when the argument means nothing here, an
    option is unknown, or the source cannot be opened.
    """
    kinds = modules()
    prefix, colon, rest = argument.partition(":")
    if colon and prefix in kinds and not rest.startswith("//"):
        module, argument = kinds[prefix], rest
    else:
        module = _recognise(argument, kinds)
    source: Source = module.open(
        argument, loop=loop, pace=pace, clock=clock, options=dict(options or {})
    )
    return source


def _recognise(argument: str, kinds: Mapping[str, ModuleType]) -> ModuleType:
    for module in kinds.values():
        if module.recognises(argument):
            return module
    lines = [
        f"  {kind}: {(module.__doc__ or '').splitlines()[0]}" for kind, module in kinds.items()
    ]
    raise SourceError("\n".join([f"no kind of source here is called {argument!r}; known:", *lines]))


def split_url(
    argument: str, options: Mapping[str, str], known: Iterable[str]
) -> tuple[str, int | None, dict[str, str]]:
    """Host, port and options of `scheme://host:port?option=value`.

    Options in the argument win over those given beside it. SourceError for a port that is none
    and for options that are not `known`.
    """
    try:
        parts = urlsplit(argument)
        host, port = parts.hostname or "", parts.port
    except ValueError as error:
        raise SourceError(f"{argument}: {error}") from None
    merged = {**options, **dict(parse_qsl(parts.query, keep_blank_values=True))}
    check_options(argument, merged, known)
    return host, port, merged


def check_options(argument: str, options: Iterable[str], known: Iterable[str]) -> None:
    """SourceError for an option that is not known, listing those that are."""
    known = sorted(known)
    for name in options:
        if name not in known:
            raise SourceError(
                f"{argument}: unknown option '{name}'; known: {', '.join(known) or 'none'}"
            )


def number(argument: str, options: Mapping[str, str], name: str, default: float) -> float:
    """A positive option, or SourceError."""
    text = options.get(name)
    if text is None:
        return default
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < 1e9:
        raise SourceError(f"{argument}: {name} must be a positive number, not {text!r}")
    return value
