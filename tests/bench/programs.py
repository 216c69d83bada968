"""Page of other programs on the same tasks: ``python -m tests.bench.programs``, the last part of ``make bench-peers``.

Reads the tables that the other parts left in the folder of results, and writes docs/accuracy/programs.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas as pd

from studies.accuracy.prices import SAMPLES
from studies.accuracy.tables import duration, pipe_table, prose
from studies.accuracy.tables import significant as sig

PAGE = Path(__file__).resolve().parents[2] / "docs" / "accuracy" / "programs.md"


def main() -> None:
    """Write the page from the tables of the folder."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.programs", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    folder: Path = parser.parse_args().out
    tables = [pd.read_parquet(folder / f"{name}.parquet") for name in ("peers", "loads", "peer_loads")]
    PAGE.write_text("\n".join(page(*tables)) + "\n", encoding="utf-8")


def page(peers: pd.DataFrame, loads: pd.DataFrame, one: pd.DataFrame) -> list[str]:
    """Largest accelerations, joint loads by family, joint loads of one crank-rocker by the ways of a program."""
    return [
        "# Other programs on the same tasks",
        "",
        *prose(
            "This page compares linksweep with other programs; `make bench-peers` measures it. Back to [what the next",
            "digit costs](../accuracy.md).",
        ),
        "",
        "## The planar case",
        "",
        *prose(
            f"The table has the largest acceleration of ordinary designs of `{peers['family'].iloc[0]}` on a grid.",
            "Each program computes it by its fastest method. A cell has the largest relative error and the median",
            "time per design. All programs have the same designs, so equal errors mean equal accelerations.",
        ),
        "",
        *pipe_table(
            ["program", *(f"grid {n}" for n in SAMPLES)],
            [
                [str(what), *(_cell(row) for _, row in part.sort_values("setting").iterrows())]
                for what, part in peers.groupby("what", sort=False)
            ],
        ),
        "",
        "## Joint loads",
        "",
        *prose(
            "The programs compute inverse dynamics of the same bodies at the same poses. The difference is the largest",
            "of a joint force or drive torque, relative to the largest of the turn; times are per pose. The others run",
            "from Python, with the loop closed by Newton's method in the exported model; linksweep runs in a sweep.",
        ),
        "",
        *pipe_table(
            ["program", "family", "poses", "difference", "its time", "ours", "times as fast"],
            [_load(row) for _, row in loads.iterrows()],
        ),
        "",
        *prose(
            "The next table is for one crank-rocker with heavy links. The ratio compares with the first row; the loads",
            f"differ by at most {sig(one['largest_difference'].max())} of the largest.",
        ),
        "",
        *pipe_table(
            ["what", "per pose", "times as fast"],
            [[str(row["what"]), duration(row["ns_per_pose"]), sig(row["ratio"])] for _, row in one.iterrows()],
        ),
    ]


def _cell(row: pd.Series) -> str:
    return f"{sig(row['largest_error'])}; {duration(row['ns_per_design'])}"


def _load(row: pd.Series) -> list[str]:
    ratio = row["ns_per_pose"] / row["ns_per_pose_own"]
    times = [duration(row["ns_per_pose"]), duration(row["ns_per_pose_own"]), sig(ratio)]
    return [row["program"], f"`{row['family']}`", str(row["poses"]), sig(row["largest_difference"]), *times]


if __name__ == "__main__":
    main()
