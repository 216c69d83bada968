"""[task]: a task of the engineering method, whose mechanisms are where the study's search begins."""

from __future__ import annotations

from sweep.study.reading import Reading


def read(reading: Reading) -> None:
    """Read the task itself, and ask for the search that begins at its mechanisms."""
    reading.fields["task"] = None
    if "task" not in reading.data:
        return
    from sweep.study.task import read_task  # brings the solver of the tasks

    reading.fields["task"] = read_task(reading.data["task"], reading.faults)
    if "optimise" not in reading.data:
        needed = "a table [optimise]: the mechanisms that do a [task] are where its search begins"
        reading.faults.missing(("optimise",), needed)


def check(reading: Reading) -> None:
    """Report a task whose mechanisms are not those of the study."""
    raw = reading.data.get("task")
    kind = raw.get("kind") if isinstance(raw, dict) else None
    if reading.fields["task"] is None or not isinstance(kind, str):
        return
    from sweep.study.task import CHAINS

    chain = CHAINS.get(kind)
    if chain is None:
        reading.faults.value(("task", "kind"), kind, f"{', '.join(CHAINS)}; {kind} is answered by `sweep task` alone")
    elif reading.fields["mechanism"] != chain:
        wanted = f'family = "{chain[0]}"' if len(chain) == 1 else f"chain = {list(chain)}"
        reading.faults.value(("task", "kind"), kind, f"in this study a task of its mechanism; {kind} is about {wanted}")
