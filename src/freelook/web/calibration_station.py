"""The calibration station: one camera, one target, and any number of pages that look on.

Two threads: one looks at the newest picture, and only it touches the calibration; one solves. Pages
pull: each asks for the newest look when it has shown the last one, so nothing can queue anywhere.
"""

from __future__ import annotations

import asyncio
import contextlib
import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from .. import __version__
from ..calibration.calibrate import Calibration
from ..calibration.live import FIRST_SOLVE, LiveCalibration, LiveState, Progress, solve_views
from ..calibration.targets import Gray
from ..calibration.views import View
from ..calibration.words import sentences
from ..clock import NS_PER_MS, NS_PER_S, Clock, now_ns
from ..errors import FreelookError
from ..ingest import Ingest
from ..mailbox import Mailbox
from ..types import Counters, Frame
from . import calibration_messages as messages
from .calibration_picture import jpeg, luma
from .calibration_plan import Plan, Result
from .messages import camera_table, counts, source_status
from .station import UnknownName

LIVE_MODEL = "kannala_brandt"  # while views come in; fast, and near every real lens
ACTIONS = ("take", "drop", "finish", "resume", "restart")
TICK_S = 0.25
LONGEST_WAIT_S = 1.0
SHOWN_EVERY_NS = 60 * NS_PER_MS  # pictures of the finished view
LOOKED_ON_NS = 2 * NS_PER_S  # a page that has not asked for so long is gone


@dataclass(frozen=True)
class Look:
    """What a page gets: data for JSON, and the picture it is about. `number` grows; `pictured` is
    that of the look the picture came with."""

    number: int
    data: dict[str, Any]
    picture: bytes
    pictured: int


@dataclass(frozen=True)
class _Job:
    """Views to solve; the last word if `final`."""

    round: int
    views: tuple[View, ...]
    size: tuple[int, int]
    final: bool


class CalibrationStation:
    """Looks, solves, tells. `start` and `close` once each, on the event loop."""

    def __init__(self, ingest: Ingest, plan: Plan, *, clock: Clock = now_ns) -> None:
        self.counters = Counters()
        self.result: dict[str, Any] | None = None
        self._ingest, self._plan, self._clock = ingest, plan, clock
        self._live = LiveCalibration(plan.target)
        self._state: LiveState | None = None
        self._phase, self._message, self._solving = "taking", "", ""
        self._round = 0  # grows when everything starts over: older jobs are then void
        self._pictures: dict[str, Gray] = {}
        self._asked: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._jobs: Mailbox[_Job] = Mailbox()
        self._closing = threading.Event()
        self._threads = [
            threading.Thread(target=work, name=name, daemon=True)
            for name, work in (("looking", self._run), ("solving", self._solve))
        ]
        self._look = Look(0, {}, b"", 0)
        self._shown_ns = 0
        self._fetched_ns: int | None = None

    async def start(self) -> None:
        """SourceError when the source can never work."""
        self._loop = asyncio.get_running_loop()
        self._news = asyncio.Event()
        self._frames = self._ingest.frames()
        self._ingest.start()
        for thread in self._threads:
            thread.start()

    async def close(self) -> None:
        self._closing.set()
        self._jobs.close()
        self._ingest.release(self._frames)
        await asyncio.to_thread(self._ingest.close)
        # a long last solve is not waited for: the thread ends with the process
        await asyncio.to_thread(self._threads[0].join, 5.0)

    def describe(self) -> dict[str, Any]:
        """GET /api/calibration."""
        plan = self._plan
        return {"version": __version__, "source": plan.source, "model": plan.model}

    async def newest(self, after: int) -> Look:
        """The newest look, once it is newer than `after`, or after a second in any case."""
        self._fetched_ns = self._clock()
        if self._look.number <= after:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(LONGEST_WAIT_S):
                    await self._news.wait()
        return self._look

    def act(self, action: str) -> None:
        """From the event loop; done before the next look. UnknownName lists the actions."""
        if action not in ACTIONS:
            raise UnknownName(f"unknown action {action!r}; known: {', '.join(ACTIONS)}")
        self._asked.put(getattr(self, f"_{action}"))

    # --- on the looking thread

    def _run(self) -> None:
        while not self._closing.is_set():
            frame = self._frames.take(TICK_S)
            while not self._asked.empty():
                self._asked.get()()
            picture = b""
            if frame is not None:
                self._see(frame)
                picture = self._shown(frame)
            self._publish(picture)

    def _see(self, frame: Frame) -> None:
        if self._phase != "taking":
            return
        gray = luma(frame.picture)
        try:
            state = self._live.step(gray, frame.capture_ns)
        except Exception as error:  # a fault in a detector must not end the session
            self.counters.add("looks_failed")
            self._live.failed(f"this picture could not be searched: {error!r}")
            return
        self.counters.add("looks")
        self._state = state
        if state.verdict == "taken":
            if self._plan.keep_pictures:
                self._pictures[state.views[-1].name] = gray.copy()
            self._solve_soon()

    def _take(self) -> None:
        self._live.take()

    def _drop(self) -> None:
        self._live.drop()
        self._solve_soon()
        self._refresh()

    def _restart(self) -> None:
        self._round += 1
        self._live.restart()
        self._state, self.result = None, None
        self._pictures.clear()
        self._phase, self._message, self._solving = "taking", "", ""

    def _resume(self) -> None:
        if self._phase == "done":
            self._phase = "taking"

    def _finish(self) -> None:
        if self._phase == "finishing":
            return
        views, size = self._live.views, self._live.size
        if len(views) < FIRST_SOLVE or size is None:
            have = f"{len(views)} view{'' if len(views) == 1 else 's'}"
            self._message = f"{have} cannot be solved: take at least {FIRST_SOLVE}, better 8"
            return
        self._phase, self._message = "finishing", ""
        self._put(_Job(self._round, views, size, True))

    def _solve_soon(self) -> None:
        self._message = ""
        if len(self._live.views) >= FIRST_SOLVE and self._live.size:
            self._put(_Job(self._round, self._live.views, self._live.size, False))

    def _put(self, job: _Job) -> None:
        self._solving = self._plan.model if job.final else LIVE_MODEL
        self._jobs.put(job)

    def _came_out(self, job: _Job, calibration: Calibration, progress: Progress) -> None:
        if job.round == self._round:
            if self._phase == "taking":
                self._solving = ""
            self._live.solved(calibration, progress)
            self._refresh()

    def _went_wrong(self, job: _Job, why: str) -> None:
        if job.round == self._round:
            self._solving = ""
            if job.final:
                self._phase, self._message = "taking", why
            else:
                self._live.failed(why)
                self._refresh()

    def _finished(self, job: _Job, result: dict[str, Any]) -> None:
        if job.round == self._round:
            self._solving = ""
            self._phase, self.result = "done", result

    def _refresh(self) -> None:
        """Show what was solved, also while no picture comes."""
        if self._state is not None:
            self._state = self._live.again(self._state)

    def _shown(self, frame: Frame) -> bytes:
        """The picture for the pages, if there are any to see it."""
        now = self._clock()
        fetched = self._fetched_ns
        if fetched is None or now - fetched > LOOKED_ON_NS:
            return b""
        if self._phase != "taking" and now - self._shown_ns < SHOWN_EVERY_NS:
            return b""
        self._shown_ns = now
        return jpeg(frame.picture)

    def _publish(self, picture: bytes) -> None:
        number = self._look.number + 1
        data = self.status() | {"number": number}
        if self._state is not None:
            data |= {"look": messages.state(self._state)}
        kept = (picture, number) if picture else (self._look.picture, self._look.pictured)
        self._look = Look(number, data, *kept)
        with contextlib.suppress(RuntimeError):  # the loop is closed: nobody is left to tell
            self._loop.call_soon_threadsafe(self._tell)

    def _tell(self) -> None:
        self._news.set()
        self._news = asyncio.Event()

    # --- from any thread

    def status(self) -> dict[str, Any]:
        """How it goes, without the look."""
        ingest = self._ingest.status(self._clock())
        counters = ingest.counters | counts(self.counters)
        return {
            "source": source_status(ingest, None, None, counters),
            "phase": self._phase,
            "message": self._message,
            "solving": self._solving,
            "views": len(self._live.views),
            "result": self.result and self.result["number"],
        }

    # --- on the solving thread

    def _solve(self) -> None:
        while not self._closing.is_set():
            job = self._jobs.take(TICK_S)
            if job is None:
                continue
            try:
                self._asked.put(self._work(job))
            except FreelookError as error:
                self._asked.put(partial(self._went_wrong, job, str(error)))
            except Exception as error:  # a fault of ours must not end the session
                self.counters.add("solves_failed")
                self._asked.put(partial(self._went_wrong, job, f"solving failed: {error!r}"))

    def _work(self, job: _Job) -> Callable[[], None]:
        model = self._plan.model if job.final else LIVE_MODEL
        freedom = self._plan.freedom
        calibration, progress = solve_views(job.views, job.size, model, freedom, say=self._say)
        if not job.final:
            return partial(self._came_out, job, calibration, progress)
        result = Result(calibration, progress, dict(self._pictures))
        return partial(self._finished, job, self._saved(result))

    def _say(self, what: str) -> None:
        self._solving = what

    def _saved(self, result: Result) -> dict[str, Any]:
        saved = self._plan.save(result)
        return {
            "number": 1 + (self.result["number"] if self.result else 0),
            "saved": saved.done,
            "where": saved.where,
            "profile": saved.profile,
            "sentences": sentences(result.calibration),
            "model": result.calibration.model,
            "camera": camera_table(result.calibration.camera),
            **messages.progress(result.progress),
        }
