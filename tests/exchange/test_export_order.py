"""Shafts of an exported simulation model, where a chain whose stages have no common frame follows another member."""

from __future__ import annotations

import mujoco

import sweep
from tests.exchange.test_export import scaled


def test_every_crank_is_coupled_to_the_shaft_that_drives_it(tmp_path):
    # The first stage of "two" stands in a frame of its own, the second beside "one" in the machine's.
    design = {f"one.{key}": value for key, value in scaled("rssr").items()}
    for stage, name in ((1, "kim_dison"), (2, "rssr")):
        design |= {f"two.{key}{stage}": value for key, value in scaled(name).items()}
    machine = sweep.machine({"one": "rssr", "two": {"chain": ["kim_dison", "rssr"], "ratio": -2}})
    model = mujoco.MjModel.from_xml_path(str(sweep.export(machine, design, tmp_path / "m.xml")))
    rows = [k for k in range(model.neq) if model.eq_type[k] == mujoco.mjtEq.mjEQ_JOINT]
    found = {model.joint(model.eq_obj1id[k]).name: (model.joint(model.eq_obj2id[k]).name, model.eq_data[k, 1])
             for k in rows}  # fmt: skip
    assert found == {"crank two 1": ("crank one", -2.0), "crank two 2": ("rocker two 1", 1.0)}
