"""What is installed, without the sources: `make dist-test` runs this with the Python of an environment of its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tarfile
import tempfile
import urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SWEEP = [sys.executable, "-P", "-m", "sweep"]


def said(*words: str) -> str:
    """What a verb prints, of the installed package."""
    done = subprocess.run([*SWEEP, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"sweep {' '.join(words)}: {done.stdout}{done.stderr}"
    return done.stdout


def main(folder: Path) -> None:
    """Go the way of a new user in an empty folder."""
    (source,), (wheel,) = folder.glob("*.tar.gz"), folder.glob("*.whl")
    version = wheel.name.split("-")[1]
    assert source.name == f"linksweep-{version}.tar.gz", (source.name, wheel.name)
    with tarfile.open(source) as content:
        names = [name.partition("/")[2] for name in content.getnames()]
    needed = ["pyproject.toml", "README.md", "LICENSE", "sweep/templates/explore.html", "kernels/jit.py"]
    assert not set(needed) - set(names), set(needed) - set(names)
    with tempfile.TemporaryDirectory() as place:
        os.chdir(place)
        import kernels

        assert Path(place) not in Path(kernels.__file__).parents and Path(kernels.__file__).parent != ROOT / "kernels"
        assert said("--version").strip().endswith(version)
        said("init", "press", "--family", "slider_crank")
        assert "25 designs" in said("check", "press")
        assert "within all limits" in said("run", "press")
        report = Path(said("report", "results/press/designs").removeprefix("report: ").strip())
        assert "https://" not in report.read_text().split("<main>")[1].split("<script>")[0]
        for kind in ("xlsx", "dxf", "csv", "glb"):
            assert Path(said("export", "results/press", "--format", kind).partition(": ")[2].strip()).stat().st_size > 0
        explored()
        import pandas as pd

        rows = pd.read_parquet("results/press/designs")
        assert len(rows) == 25 and rows["stroke"].notna().all()
    print(f"linksweep {version}: wheel and sdist serve a new user")


def explored() -> None:
    """The page of a result is served and ends with Ctrl-C."""
    command = [*SWEEP, "explore", "results/press"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    address = process.stdout.readline().removeprefix("explore: ").strip()
    with urllib.request.urlopen(address) as page:
        assert b"page-data" in page.read()
    process.send_signal(signal.SIGINT)
    assert process.wait(30) == 0


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
