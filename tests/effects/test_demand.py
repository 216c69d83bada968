"""What is not asked for is not compiled, costs nothing and changes nothing."""

from __future__ import annotations

import ast
import inspect
import json
import re
import subprocess
import sys
import textwrap
from pathlib import Path

import numba
import numpy as np
import pytest

import sweep.effects
from kernels import status as st
from kernels.effects import coupler, pressure
from studies.accuracy.ordinary import designs as bench_designs
from sweep.effects import applicable, called_for, extended, input_names
from sweep.errors import InputError
from sweep.families import family
from sweep.families.base import Angles
from tests.support.oracle_rows import geometry, joint_records, rows

ROOT = Path(__file__).parents[2]
PHI = 2.0 * np.pi * np.arange(24) / 24


class Pruned(ast.NodeTransformer):
    """Takes optional outputs out of a kernel's source: their arguments and the statements about them."""

    def __init__(self, names):
        self.names = names

    def visit_FunctionDef(self, node):
        node.args.args = [a for a in node.args.args if a.arg not in self.names]
        node.decorator_list = []
        self.generic_visit(node)
        return node

    def visit_If(self, node):
        self.generic_visit(node)
        return None if asked(node.test) and asked(node.test) <= self.names else node

    def visit_Expr(self, node):
        """Leave out what only stores one of them."""
        stored = isinstance(node.value, ast.Call) and node.value.args and asked(node.value.args[0])
        return None if stored and stored <= self.names else node


def asked(node):
    """Names of arguments, and of fields of the tuple ``out``, in an expression."""
    fields = {x.attr for x in ast.walk(node) if isinstance(x, ast.Attribute)}
    return fields or {x.id for x in ast.walk(node) if isinstance(x, ast.Name)}


def twin(kernel, names):
    """The kernel as it would have been written without these outputs, compiled as the house does but not cached.

    numba shows no assembly of code from its cache, so the kernel itself is compiled anew too: without names.
    """
    function = kernel.py_func
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    tree = ast.fix_missing_locations(Pruned(set(names)).visit(tree))
    space = dict(function.__globals__)
    exec("from __future__ import annotations\n" + ast.unparse(tree), space)
    return numba.njit(nogil=True, error_model="numpy")(space[function.__name__])


def instructions(kernel, arguments):
    """Mnemonics of the compiled specialisation's own function, sorted out of the assembly text."""
    kernel.compile(tuple(numba.typeof(a) for a in arguments))
    signature = next(s for s in kernel.signatures if len(s) == len(arguments))
    for s in kernel.signatures:
        if s == tuple(numba.typeof(a) for a in arguments):
            signature = s
    body = kernel.inspect_asm(signature).split(".size")[0]
    return [line.split()[0] for line in body.splitlines() if re.match(r"\t[a-z]", line)]


def pose_arguments():
    table = rows("pressure", kind="rssr")[:5]
    geometries, phi = geometry([row["inputs"] for row in table])
    return joint_records(geometries, phi)


@pytest.mark.parametrize("kept", ["t_rho", "theta2"])
def test_unwanted_outputs_leave_no_instruction(kept):
    """The specialisation with one output and five None is the build that never knew the five."""
    poses, fixed, status = pose_arguments()
    names = ["t_tau", "t_rho", "t_k", "theta1", "theta2", "theta3"]
    out = np.empty(status.shape)
    with_none = instructions(
        twin(pressure.directions, []), [poses, fixed, status, *(out if n == kept else None for n in names)]
    )
    never_knew = instructions(twin(pressure.directions, [n for n in names if n != kept]), [poses, fixed, status, out])
    everything_on = instructions(twin(pressure.directions, []), [poses, fixed, status, *(out for _ in names)])
    arithmetic = re.compile(r"v?(add|sub|mul|div|sqrt|fm|and|or|xor|max|min|call|ucomi|cmp).*")
    counts = [sorted(m for m in x if arithmetic.match(m) and "sd" in m) for x in (with_none, never_knew, everything_on)]
    assert counts[0] == counts[1]
    assert abs(len(with_none) - len(never_knew)) <= 0.02 * len(never_knew)  # moves of the absent arguments
    assert len(everything_on) > 1.2 * len(with_none)


def test_unwanted_acceleration_leaves_no_instruction():
    poses, fixed, status = pose_arguments()
    point, out = np.zeros((5, 3)), np.empty((*status.shape, 3))
    arguments = [poses, fixed, point, np.zeros(5), status]
    some, every = coupler.CouplerMotion(position=out), coupler.CouplerMotion(*[out] * 7)
    with_none = instructions(twin(coupler.coupler_point, []), [*arguments, some])
    never_knew = instructions(twin(coupler.coupler_point, coupler.CouplerMotion._fields[1:]), [*arguments, some])
    assert abs(len(with_none) - len(never_knew)) <= 0.02 * len(never_knew)
    assert len(instructions(twin(coupler.coupler_point, []), [*arguments, every])) > 1.3 * len(with_none)


def test_an_effect_that_is_not_wanted_is_not_there():
    rssr = family("rssr")
    assert extended(rssr, ["max_abs_d2psi", "margin", "swing"]) is rssr
    assert [e.name for e in called_for(rssr, ["rms_drive_torque"])] == ["kinetostatics"]
    assert [e.name for e in called_for(rssr, ["unevenness", "max_theta1"])] == ["pressure", "speed_fluctuation"]
    full = extended(rssr, ["max_lag"])
    assert {"stiffness", "driven_inertia"} < set(full.parameter_names)
    assert "m_crank" not in full.parameter_names


def test_everything_else_keeps_its_bits_whatever_is_wanted_beside_it():
    bare = family("rssr")
    full = extended(bare, ["drive_torque", "lag_dynamic", "theta1", "crank_speed"])
    matrix = bench_designs(full, 5)
    angles = Angles.of(PHI[None])
    names = frozenset(["psi", "d2psi", "pressure_angle", "force_c", "theta1"])
    alone = {name: full.poses(matrix, angles, frozenset([name]))[name] for name in names}
    beside = full.poses(matrix, angles, names | {"lag_dynamic", "crank_speed", "drive_torque", "moment_d"})
    own = bare.poses(np.ascontiguousarray(matrix[:, :8]), angles, frozenset(["psi", "d2psi"]))
    for name in names:
        assert np.array_equal(alone[name], beside[name]), name
    assert np.array_equal(own["d2psi"], beside["d2psi"])


def test_a_complex_step_gives_the_derivative():
    """What the optimiser asks for: effects answer with a central difference along the imaginary direction."""
    full = extended(family("rssr"), ["force_c", "lag_dynamic"])
    matrix, angles = bench_designs(full, 2), Angles.of(PHI[None] + 0j)
    names = frozenset(["force_c", "lag_dynamic", "d2psi"])
    step = 1e-30
    direction = np.zeros_like(matrix)
    direction[:, 1] = 1.0
    got = full.poses(matrix + 1j * step * direction, angles, names)
    real = Angles.of(PHI[None])
    ahead, behind = (full.poses(matrix + h * direction, real, names) for h in (1e-3, -1e-3))
    for name in names:
        slope = (ahead[name] - behind[name]) / 2e-3
        np.testing.assert_allclose(got[name].imag / step, slope, atol=1e-6 * np.abs(slope).max(), err_msg=name)


def test_blocks_change_no_bit(monkeypatch):
    full = extended(family("rssr"), ["drive_torque", "lag_dynamic"])
    matrix = bench_designs(full, 9)
    angles, names = Angles.of(PHI[None]), frozenset(["drive_torque", "lag_dynamic"])
    whole = full.poses(matrix, angles, names)
    monkeypatch.setattr("sweep.effects.evaluation.BLOCK", 7)
    monkeypatch.setattr("sweep.effects.evaluation.TURNS", 2)
    cut = full.poses(matrix, angles, names)
    for name in names:
        assert np.array_equal(whole[name], cut[name])


def test_a_missing_input_names_itself_and_the_effect():
    table = {"a": 20.0, "b": 95.0, "c": 60.0, "e": 70.0, "f": 12.0, "g": 8.0, "alpha": 1.2, "speed": 500.0}
    with pytest.raises(InputError, match=r"m_crank .*kinetostatics"):
        sweep.summarise("rssr", table, ["max_drive_torque"])
    with pytest.raises(InputError, match="max_drive_torque"):
        sweep.summarise("rssr", table, ["max_drive_torqe"])


def test_inputs_of_effects_that_are_off_are_no_misspelling():
    table = {"a": 20.0, "b": 95.0, "c": 60.0, "e": 70.0, "f": 12.0, "g": 8.0, "alpha": 1.2, "speed": 500.0}
    table |= {"stiffness": 1e4, "driven_inertia": 0.6, "axial_suport": 1.0, "support_a1": 3.0}
    assert sweep.summarise("rssr", table, ["max_abs_lag"])["status"][0] == st.OK


def test_the_register_is_not_searched_at_every_call(monkeypatch):
    """A call of the reductions on a handful of designs took six to ten times as long while it was."""
    names = {kind: input_names(family(kind)) for kind in ("rssr", "guide")}
    assert "m_crank" in names["rssr"] == input_names(extended(family("rssr"), ["max_force_c"]))
    assert input_names(family(["rssr", "guide"])) > {f"{name}1" for name in names["rssr"]}
    monkeypatch.setattr(sweep.effects, "inputs", None)
    assert {kind: input_names(family(kind)) for kind in names} == names


def test_a_chain_takes_effects_at_its_first_stage():
    plain = {"a": 20.0, "b": 95.0, "c": 60.0, "e": 70.0, "f": 12.0, "g": 8.0, "alpha": 1.2}
    scene = {"driven_inertia": 0.6, "stiffness": 2e4, "speed": 500.0}
    guide = {"a2": 20.0, "b2": 50.0, "c2": 50.0, "e2": 40.0, "xi2": 100.0, "eta2": 0.0, "lam2": 0.0, "h2": 0.0}
    single = sweep.evaluate("rssr", plain | scene, ["lag", "theta1"], phi=PHI)
    numbered = {f"{name}1": x for name, x in (plain | scene).items()}
    chained = sweep.evaluate(["rssr", "guide"], numbered | guide, ["lag1", "theta11"], phi=PHI)
    assert np.array_equal(single["lag"], chained["lag1"])
    assert np.array_equal(single["theta1"], chained["theta11"])
    summary = sweep.summarise(["rssr", "guide"], numbered | guide, ["max_abs_lag1", "max_abs_lag_dynamic1", "floquet1"])
    alone = sweep.summarise("rssr", plain | scene, ["max_abs_lag", "max_abs_lag_dynamic"])
    assert summary["max_abs_lag1"][0] == pytest.approx(alone["max_abs_lag"][0], rel=1e-8)
    assert summary["max_abs_lag_dynamic1"][0] == alone["max_abs_lag_dynamic"][0]
    assert summary["floquet1"][0] == 1.0


def test_dead_points_say_so_and_give_no_number():
    """A crank that does not turn: status and nan in every effect's output, per pose and per design."""
    rssr = family("rssr")
    names = [o.name for e in applicable(rssr) for o in e.pose_outputs if o.name not in ("friction_passes",)]
    full = extended(rssr, names)
    matrix = bench_designs(full, 1)
    matrix[:, 0] = 80.0
    found = full.poses(matrix, Angles.of(PHI[None]), frozenset(names))
    bad = found["status"][0] != st.OK
    assert bad.any()
    for name in names:
        assert np.isnan(found[name][0][found["status"][0] == st.NOT_ASSEMBLED]).all(), name
        assert np.isfinite(found[name][0][~bad]).all(), name


@pytest.mark.long
def test_a_scene_with_everything_on_keeps_its_memory():
    """Reduced from `make bench-scene`: what several chunks need is what the first one needed.

    The first one makes room for itself, some 20 MB, however much the libraries took before; what further ones take on
    top is what would add up over a sweep.  In a process of its own: what other tests have freed says nothing about
    this one.
    """
    program = (
        "import json; from tests.bench.effects import CHUNK, everything; x = everything(3 * CHUNK, timed=4); "
        "print(json.dumps([x.before, x.first, x.peak, sorted(x.parts)]))"
    )
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600, check=True)
    before, first, peak, parts = json.loads(done.stdout.splitlines()[-1])
    assert peak < 1500.0
    assert first - before < 40.0  # twice what was measured
    assert peak - first < 0.01 * first  # with two further chunks
    assert set(parts) == {placed.name for placed in applicable(family("rssr"))}


def test_no_bit_of_a_design_output_depends_on_what_is_wanted_beside_it():
    names = ["max_force_b", "max_abs_drive_torque", "max_abs_finger_couple", "range_psi", "phi_max_abs_drive_torque",
             "rms_force_c", "rms_d2psi", "max_abs_drive_torque_friction", "mean_load_d1", "swing"]  # fmt: skip
    full = extended(family("rssr"), names)
    table = dict(zip(full.parameter_names, bench_designs(full, 40).T, strict=True))
    together = sweep.summarise("rssr", table, names)
    assert (together["status"] == st.OK).sum() > 20
    for name in names:
        alone = sweep.summarise("rssr", table, name)
        known = (alone["status"] == st.OK) & (together["status"] == st.OK)
        for column in (name, f"err_{name}"):
            np.testing.assert_array_equal(alone[column][known], together[column][known], err_msg=column)
