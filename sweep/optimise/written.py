"""Tables of optimised designs as Parquet files: columns, units and definitions, written as a whole."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.dataset import store
from sweep.families.base import Array
from sweep.optimise.certificate import CAVEAT, Result
from sweep.quantities.names import is_error, without_error

if TYPE_CHECKING:
    from sweep.study import Study

TEXTS = {
    "role": (
        "",
        "optimum, nominal (best drawing where the optimum is robust), start (another one's), or reference",
    ),
    "yield": ("1", "share of toleranced mechanisms that keep all limits on outputs; nan for other starts"),
    "start": ("", "number of the start, best candidate first; -1 for the reference"),
    "violation": ("1", "largest violation of a limit, relative to the limit; for pressure angles of its sin^2"),
    "kkt_residual": ("1", "residual of the optimality conditions, variables scaled to their bounds"),
    "gap": ("1", "difference of the maximum the search worked with and the verified one, relative"),
    "active": ("", "limits and bounds that hold the result back"),
    "relaxation": ("", "where infeasible: by how much each limit would have to give way, in its internal unit"),
    "agree": ("", "number of starts whose objective is within 1e-4 of the best; 1 for those that are not"),
    "basin": ("", "number of the value it ended at, 1 for the best, values within 1e-4 are one; 0 where infeasible"),
    "ended": (
        "",
        "converged, stalled, differs (the search followed other extrema), infeasible, looks, time, interrupted",
    ),
    "looks": ("", "evaluations of designs by the search from this start"),
    "status": ("", "see kernels.status"),
    "parameter": ("", "dimension that changes"),
    "output": ("", "design output; its unit is that of _optimum.parquet"),
    "value": ("unit of the output", "its value; swing and stroke by magnitude"),
    "growing": ("unit of the output per mm or rad", "its derivative where the dimension grows"),
    "shrinking": ("unit of the output per mm or rad", "its derivative where the dimension shrinks"),
    "nominal": ("unit of the output", "value of the exact design"),
    "mean": ("unit of the output", "mean under the tolerances, three standard deviations each"),
    "low": ("unit of the output", "2.5 % of the designs are below"),
    "high": ("unit of the output", "2.5 % of the designs are above"),
    "missing": ("1", "share of designs without this output"),
    "within": ("1", "share of designs that keep the limits of this output; of all of them in the last row"),
}


def certificates(results: list[Result]) -> dict[str, list[Any]]:
    """Return what is known of each result, column by column."""
    return {
        "violation": [r.violation for r in results],
        "kkt_residual": [r.kkt_residual for r in results],
        "gap": [r.gap for r in results],
        "active": ["; ".join(r.active) for r in results],
        "relaxation": ["; ".join(f"{k} by {v:.6g}" for k, v in r.relaxation.items()) for r in results],
        "agree": [r.agree for r in results],
        "basin": [r.basin for r in results],
        "ended": [r.ended for r in results],
        "looks": [r.looks for r in results],
        "status": [r.status for r in results],
    }


def outputs(study: Study, designs: Array) -> dict[str, Any]:
    """Return every wanted output of designs (k, P) with its error estimate."""
    from sweep.evaluation.summaries import design_outputs

    columns = design_outputs(study.family, designs, study.want, study.accuracy, study.window)
    return {name: values for name, values in columns.items() if name != "status"}


def write(
    path: Path,
    columns: dict[str, Any],
    study: Study,
    own_texts: Mapping[str, tuple[str, str]] = MappingProxyType({}),
    about: Mapping[str, str] = MappingProxyType({}),
) -> None:
    """Write a table whose fields' metadata say unit and definition; ``own_texts`` are those of this table alone.

    The file's metadata name the study and say what is in ``about``.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    from sweep.chunks.plan import PARAMETER_UNITS, error_words
    from sweep.evaluation.summaries import output

    family = study.family
    texts = (
        {p.name: (PARAMETER_UNITS[p.unit], p.text) for p in family.parameters} | TEXTS | {"phi": ("rad", "crank angle")}
    )
    texts |= {o.name: (o.unit.replace("length", "mm"), o.text) for o in family.pose_outputs}
    texts |= own_texts
    for name in columns:
        if name not in texts:
            plain = without_error(name)
            wanted = output(family, plain)
            text = f"{error_words(study, plain)} of {wanted.text}" if is_error(name) else wanted.text
            texts[name] = (wanted.unit.replace("length", "mm"), text)
    arrays = {name: pa.array(_plain(values)) for name, values in columns.items()}
    fields = [
        pa.field(name, array.type, metadata={"unit": texts[name][0], "definition": texts[name][1]})
        for name, array in arrays.items()
    ]
    metadata = {"study": study.name, "fingerprint": study.fingerprint, "caveat": CAVEAT} | dict(about)
    schema = pa.schema(fields, metadata=metadata)
    sink = pa.BufferOutputStream()
    table = pa.Table.from_arrays(list(arrays.values()), schema=schema)
    pq.write_table(table, sink, compression="zstd", write_page_checksum=True)
    store.write_atomically(path, bytes(sink.getvalue()))


def _plain(values: Any) -> Any:
    array = np.asarray(values)
    return array.tolist() if array.dtype.kind == "U" else array
