"""What runs in a worker, thread or process: compute one chunk, write it, say so."""

from __future__ import annotations

import os
import threading
import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from sweep.chunks.cascade import Dropped
from sweep.chunks.chunk import compute_chunk
from sweep.dataset.store import write_chunk
from sweep.errors import LinksweepError
from sweep.jobs.signals import depend_on_parent

if TYPE_CHECKING:
    from sweep.chunks.plan import Plan
    from sweep.study import Study


@dataclass(frozen=True)
class Done:
    """A finished chunk; ``error`` if it failed, ``dropped`` if the run was asked to stop before it was ready."""

    index: int
    designs: int = 0
    dropped: bool = False
    error: Exception | None = None


def work(study: Study, plan: Plan, folder: Path, index: int, parent: int, stop: threading.Event | None) -> Done:
    """Compute and write one chunk.

    An error is handed back as a value: the other workers finish what they hold, and the parent raises it when all is
    quiet.

    Parameters
    ----------
    study, plan, folder : what to compute and where to
    index : of the chunk
    parent : process id of the engine
    stop : flag shared with the engine, None in another process
    """
    if os.getpid() != parent:
        depend_on_parent(parent)

    def should_stop() -> bool:
        return stop is not None and stop.is_set()

    start, end = plan.bounds(index)
    try:
        result = compute_chunk(study, start, end, should_stop)
        write_chunk(folder, plan, index, result)
    except Dropped:
        return Done(index, dropped=True)
    except LinksweepError as error:
        return Done(index, error=error)
    except Exception as error:  # a bug: the parent raises it again, with the trace of this worker
        error.add_note(f"in chunk {index}, designs {start}:{end}\n{traceback.format_exc()}")
        return Done(index, error=error)
    return Done(index, end - start)
