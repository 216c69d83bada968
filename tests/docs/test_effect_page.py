"""docs/how-to-add-an-effect.md: the effect that stands there works as it stands."""

from __future__ import annotations

import re
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np

import sweep
from sweep.effects import _ENTRIES, base
from sweep.families import family

TEXT = (Path(__file__).parents[2] / "docs" / "how-to-add-an-effect.md").read_text(encoding="utf-8")


def test_effect_of_the_page_answers(monkeypatch):
    kernel, entry = re.findall(r"```python\n(.*?)```", TEXT, flags=re.DOTALL)
    (table,) = re.findall(r"```toml\n(.*?)```", TEXT, flags=re.DOTALL)
    new = tomllib.loads(table)["effects"]
    ((name, about),) = new.items()
    monkeypatch.setattr(base, "REGISTER", base.REGISTER | {"effects": base.REGISTER["effects"] | new})
    monkeypatch.setitem(_ENTRIES, name, (about["entry"], ""))
    # the kernel lies outside of its package, so that no cache keeps it
    outside = f"{name}_of_the_page"
    entry = entry.replace(f"kernels.effects.{name}", outside)
    for place, source in ((outside, kernel), (f"sweep.effects.{name}", entry)):
        module = ModuleType(place)
        monkeypatch.setitem(sys.modules, place, module)
        exec(compile(source, f"/{place}.py", "exec"), vars(module))
    crank_rocker = replace(family("rssr"))  # knows nothing of its effects yet
    inputs = {"load_torque": 3.0, "speed": -100.0}
    found = sweep.summarise(crank_rocker, crank_rocker.example | inputs, "max_abs_load_power, max_abs_dpsi")
    # P = M omega dpsi; its own relative error is 1e-8
    np.testing.assert_allclose(found["max_abs_load_power"], 300.0 * found["max_abs_dpsi"], rtol=2e-8)
    assert found["status"].to_list() == [0]
    poses = sweep.evaluate(crank_rocker, crank_rocker.example | inputs, "load_power", [0.0])
    assert poses.attrs["units"]["load_power"] == "torque/time"
