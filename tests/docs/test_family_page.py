"""docs/how-to-add-a-family.md: the family that stands there works as it stands, and what the page names is there."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import kernels.families
import sweep
from kernels import status as st
from sweep.families import capabilities, curve_features, link_tree, register
from sweep.families.check import FamilyError, check_family

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "how-to-add-a-family.md").read_text(encoding="utf-8")
PHI = np.linspace(0.0, 6.0, 7)


@pytest.fixture
def entry(monkeypatch):
    """Source of the entry, beside its table and its kernel; from outside of the package, so no cache keeps it."""
    source, entry = re.findall(r"```python\n(.*?)```", TEXT, flags=re.DOTALL)
    module = ModuleType("yoke_of_the_page")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(kernels.families, "yoke", module, raising=False)
    exec(compile(source, "/yoke_of_the_page.py", "exec"), vars(module))
    (table,) = re.findall(r"```toml\n(.*?)```", TEXT, flags=re.DOTALL)
    monkeypatch.setattr(register, "REGISTER", register.REGISTER | tomllib.loads(table))
    return entry


def made(source):
    names = {}
    exec(source, names)
    return check_family(names["FAMILY"])


def test_family_of_the_page_keeps_every_rule_and_answers(entry):
    yoke = made(entry)
    table = {"a": [20.0, 1e308, 30.0]}
    found = sweep.summarise(yoke, table, ["stroke", "max_abs_d2s", "phi_fold", "rms_ds"], accuracy=1e-10)
    for i, a in ((0, 20.0), (2, 30.0)):  # s = a cos(phi)
        expected = {"stroke": 2.0 * a, "max_abs_d2s": a, "phi_fold": np.pi, "rms_ds": a / np.sqrt(2.0)}
        for name, value in expected.items():
            assert abs(found[name][i] - value) <= found[f"err_{name}"][i] <= 1e-9 * a, name
    assert found["status"].to_list() != [st.OK] * 3  # twice the second crank leaves float64
    poses = sweep.evaluate(yoke, {"a": 20.0}, ["s", "ds", "d2s"], phi=PHI)
    np.testing.assert_allclose(poses["ds"], -20.0 * np.sin(PHI), rtol=1e-15, atol=0.0)
    joints = sweep.joints(yoke, {"a": 20.0}, PHI).set_index("joint")
    np.testing.assert_allclose(np.hypot(joints.loc["b", "x"], joints.loc["b", "y"]), 20.0, rtol=1e-15)


def test_what_the_entry_lacks_is_said_at_once(entry, monkeypatch):
    monkeypatch.delitem(register.REGISTER["yoke"]["parameters"]["a"], "example")
    with pytest.raises(FamilyError) as said:
        made(entry.replace("orders=2", "orders=1"))
    for words in ("family yoke: 2 faults", "example lacks 'a'", "derivative_of has 1 orders of 's': name 2"):
        assert words in str(said.value)


def test_files_and_capabilities_that_the_page_names_are_there():
    files = set(re.findall(r"`((?:kernels|sweep|tests|docs)/[\w/]+\.(?:py|toml|md))`", TEXT))
    own = {name for name in files if "yoke" in name}
    assert len(files - own) >= 6
    assert all((ROOT / name).is_file() for name in files - own), files - own
    for name in re.findall(r"`([A-Z][A-Za-z]+)`", TEXT.split("## 5.")[1]):
        assert any(hasattr(room, name) for room in (capabilities, curve_features, link_tree, sweep.families.base)), name
