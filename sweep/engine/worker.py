"""Task of a worker in any process: compute one chunk, write it, return its counts."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sweep.chunks import plan as plans
from sweep.chunks.cascade import Dropped
from sweep.chunks.chunk import compute_chunk
from sweep.dataset.chunk_files import parts, write_chunk
from sweep.errors import InputError, LinksweepError, ProgramFault, StoreError, WorkerDied, is_memory_full
from sweep.families.base import Columns
from sweep.study import Study


@dataclass(frozen=True)
class Done:
    """A finished chunk; ``error`` if it failed, ``dropped`` if the run was asked to stop before it was ready."""

    index: int
    designs: int = 0
    dropped: bool = False
    error: Exception | None = None


@dataclass(frozen=True)
class ChunkTask:
    """Compute and write a chunk of a study.

    An error is returned as a value: the other workers finish their chunks, and the parent raises it at the end.  A
    worker whose sources differ from those of the plan computes nothing.

    The folder ``known`` holds the same chunks under other limits.
    """

    study: Study
    plan: plans.Plan
    folder: Path
    known: Path | None = None

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> Done:
        """Compute and write a chunk by its index, unless ``should_stop`` returns true before it is ready."""
        start, end = self.plan.bounds(number)
        try:
            self._check_sources()
            result = compute_chunk(self.study, start, end, should_stop, self._known(number))
            write_chunk(self.folder, self.plan, number, result)
        except Dropped:
            return Done(number, dropped=True)
        except LinksweepError as error:
            return Done(number, error=error)
        except Exception as error:  # a bug: the parent raises it, with the trace of this worker
            if is_memory_full(error):
                why = f"the memory it may use is full, in chunk {number}; fewer jobs need less"
                message = f"{self.folder}: {why}; finished chunks are kept, run again to continue"
                return Done(number, error=WorkerDied(message))
            fault = f"{type(error).__name__}: {error}".removesuffix(": ")
            message = (
                f"{self.folder}: {fault}, in chunk {number}, designs {start}:{end}; this is an error in the program, "
                "not in the study: report it with the trace above; finished chunks are kept, run again to continue"
            )
            return Done(number, error=ProgramFault(message, traceback.format_exc()))
        return Done(number, end - start)

    def _known(self, number: int) -> Columns | None:
        if self.known is None or not self.known.is_dir():
            return None
        try:
            rows = [part.rows() for part in parts(self.known) if part.index == number]
        except StoreError:  # damaged in the meantime: the chunk is computed instead
            return None
        return {str(name): rows[0][name].to_numpy() for name in rows[0].columns} if len(rows) == 1 else None

    def _check_sources(self) -> None:
        code = plans.code_hash()
        if code != self.plan.code:
            allowed = f"{self.plan.code}, the sources and libraries of the process that plans"
            raise InputError("code", code, allowed, "worker")
