"""Oldest and newest versions of all dependencies: oracle tables, bits and speed: ``python -m tests.bench.versions``.

Two environments below build/versions: one with the lowest version of every dependency that pyproject.toml allows, one
with the newest that the package index offers.  Each runs all oracle tables with a cache of kernels of its own; then the
same designs are computed in each, and the table says whether the bits agree and how the times compare.
Only the interpreter that runs this is used: the lowest and the newest Python come from running it with each.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import time
import tomllib
import venv
from pathlib import Path
from typing import Any

import numpy as np

import sweep

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "build" / "versions"
TEST_TOOLS = ("pytest", "hypothesis", "mpmath")
SHOWN = ("numba", "llvmlite", "numpy", "scipy", "pandas", "pyarrow", "joblib")
TABLES = sorted(str(path.relative_to(ROOT)) for path in (ROOT / "tests").rglob("test_*oracle.py"))
DESIGNS = 20_000
# Few designs of many kinds: a crank-rocker in space, a chain, a family with cosines of its own, a dwell drive.
RSSR = {"a": 10.0, "b": 40.0, "c": 25.0, "e": 35.0, "f": 5.0, "g": -3.0, "alpha": 1.0}
GUIDE = {"a": 20.0, "b": 50.0, "c": 50.0, "e": 40.0, "xi": 100.0, "eta": 0.0, "lam": 1.57, "h": 0.0}


def lowest(requirement: str) -> str:
    """The requirement with its lower bound as the only version: ``numpy>=2.0`` becomes ``numpy==2.0.*``."""
    name, bound = requirement.split(">=")
    return f"{name}=={bound.split(',')[0]}.*"


def environment(label: str, requirements: list[str]) -> Path:
    """Make an environment with these requirements and the project's tests; the path of its Python."""
    folder = FOLDER / label
    python = folder / "bin" / "python"
    if not (folder / "ready").exists():
        venv.create(folder, clear=True, with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", *requirements, *TEST_TOOLS], check=True)
        (folder / "ready").touch()
    return python


def ran(python: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python in the repository with a cache of kernels of its environment."""
    own = os.environ | {"XDG_CACHE_HOME": str(python.parents[1] / "cache"), "PYTHONPATH": str(ROOT)}
    return subprocess.run([python, *arguments], cwd=ROOT, env=own, capture_output=True, text=True)


def measured() -> dict[str, Any]:
    """Versions, the bits of fixed designs, and times against numpy's sine of as many numbers, of this environment."""
    from importlib.metadata import version

    bits, random = hashlib.sha256(), np.random.default_rng(1)
    table = {name: value * random.uniform(0.9, 1.1, DESIGNS) for name, value in RSSR.items()}
    turn = np.linspace(0.0, 6.28, 360)
    wants = ["margin", "swing", "max_abs_d2psi"]
    for family, design, outputs in (("rssr", RSSR, ["psi", "d3psi"]), ("guide", GUIDE, ["s", "d2s", "dev"])):
        bits.update(sweep.evaluate(family, design, outputs, phi=turn).to_numpy().tobytes())
    bits.update(sweep.summarise("rssr", table, wants, accuracy=1e-8).to_numpy().tobytes())
    taken = {
        "sine": _least(lambda: np.sin(np.linspace(0.0, 6.28, 2_000_000))),
        "true maxima": _least(lambda: sweep.summarise("rssr", table, wants, accuracy=1e-8)),
        "dense grid": _least(lambda: sweep.summarise("rssr", table, ["max_abs_d2psi"], samples=360)),
    }
    return {
        "versions": {name: version(name) for name in SHOWN},
        "bits": bits.hexdigest()[:16],
        "ratios": {name: seconds / taken["sine"] for name, seconds in taken.items() if name != "sine"},
    }


def _least(call: Any) -> float:
    """The least processor time of five calls [s], after one that compiles."""
    call()
    seconds = []
    for _ in range(5):
        start = time.process_time()
        call()
        seconds.append(time.process_time() - start)
    return min(seconds)


def compared(label: str, requirements: list[str]) -> dict[str, Any]:
    """Run the oracle tables and the measurement in one environment."""
    python = environment(label, requirements)
    tables = ran(python, "-m", "pytest", "-p", "no:cacheprovider", *TABLES)
    numbers = ran(python, "-m", "tests.bench.versions", "--measure")
    if numbers.returncode:
        raise SystemExit(f"{label}: {numbers.stderr}")
    return {"tables": tables.stdout.strip().splitlines()[-1], "ok": tables.returncode == 0} | json.loads(numbers.stdout)


def main() -> int:
    """Print the table; 1 where a table of an oracle failed."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    required = project["dependencies"]
    found = {
        "oldest": compared("oldest", [lowest(requirement) for requirement in required]),
        "newest": compared("newest", required),
    }
    print(f"Python {sys.version.split()[0]}")
    rows = {name: [found[label]["versions"][name] for label in found] for name in SHOWN}
    rows |= {"oracle tables": [found[label]["tables"] for label in found]}
    rows |= {"bits of fixed designs": [found[label]["bits"] for label in found]}
    for name in found["oldest"]["ratios"]:
        rows[f"{name}, against numpy's sine"] = [f"{found[label]['ratios'][name]:.2f}" for label in found]
    for name, (old, new) in {"": ("oldest", "newest"), **rows}.items():  # type: ignore[dict-item]
        print(f"{name:40}{old:44}{new}")
    return 0 if all(own["ok"] for own in found.values()) else 1


if __name__ == "__main__":
    if "--measure" in sys.argv:
        print(json.dumps(measured()))
    else:
        sys.exit(main())
