"""Chains against nested position functions, exact gradients, blocks, and what they compute."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from mpmath import mp

import sweep
from kernels import status as st
from kernels.chains import links as kernel
from sweep.families import NAMES, family
from sweep.families import chain as chains
from sweep.families.base import Angles, Family, Output, Parameter, Turn
from tests.reference import chain as naive
from tests.reference import guide as naive_guide
from tests.reference import rssp as naive_rssp
from tests.support.own_code import own_code

FIRST = {"a": 1.0, "b": 4.1, "c": 3.2, "e": 2.9, "f": 0.6, "g": -0.4, "alpha": 0.7, "branch": -1.0}
SECOND = {"a": 2.2, "b": 4.6, "c": 3.9, "e": 3.1, "f": -0.3, "g": 0.5, "alpha": -0.4, "branch": 1.0}
GUIDE = {"a": 1.9, "b": 3.3, "c": 3.1, "e": 3.0, "xi": 4.2, "eta": 0.8, "lam": 1.1, "h": -0.6, "branch": 1.0}
SLIDER = {"a": 1.3, "b": 5.2, "e": 0.7, "f": 0.4, "alpha": 0.3, "branch": -1.0}
S_OUTPUTS = ("s", "ds", "d2s", "d3s")
PSI_OUTPUTS = ("psi", "dpsi", "d2psi", "d3psi")


def numbered(*stages, **couplings):
    return {f"{name}{k}": v for k, stage in enumerate(stages, start=1) for name, v in stage.items()} | couplings


def crank_rocker(design):
    numbers = tuple(mp.mpf(x) for x in design.values())
    return lambda phi: naive.rocker_angle(numbers, phi)


def guided(design, index):
    numbers = tuple(mp.mpf(x) for x in design.values())
    return lambda phi: naive_guide.coupler_point(numbers, phi)[index]


def slider(design):
    numbers = [mp.mpf(x) for x in design.values()]
    return lambda phi: naive_rssp.joints(*numbers, phi)[1][1]


CASES = [
    (["rssr", "rssr"], [FIRST, SECOND], [(-1.0, 0.4)], PSI_OUTPUTS, crank_rocker(SECOND)),
    (["rssr", "rssp"], [FIRST, SLIDER], [(1.0, -0.9)], S_OUTPUTS, slider(SLIDER)),
    (["rssr", "guide"], [FIRST, GUIDE], [(-1.0, 2.9)], S_OUTPUTS, guided(GUIDE, 0)),
    (["rssr", "guide"], [FIRST, GUIDE], [(-1.0, 2.9)], ("dev", "ddev", "d2dev"), guided(GUIDE, 1)),
    (["rssr", "rssr", "guide"], [FIRST, SECOND, GUIDE], [(-1.0, 0.4), (1.0, -2.0)], S_OUTPUTS, guided(GUIDE, 0)),
    (["rssr", "rssr", "guide"], [FIRST, SECOND, GUIDE], [(1.0, 0.1), (-1.0, 1.0)], ("dev", "ddev"), guided(GUIDE, 1)),
]


@pytest.mark.parametrize(("names", "designs", "couplings", "outputs", "last"), CASES)
@pytest.mark.parametrize("phi", [0.3, 2.1, 4.4])
def test_chain_equals_nested_position_functions(names, designs, couplings, outputs, last, phi):
    table = numbered(*designs)
    for k, (kappa, offset) in enumerate(couplings, start=2):
        table |= {f"kappa{k}": kappa, f"offset{k}": offset}
    row = sweep.evaluate(names, table, list(outputs), phi=[phi]).iloc[0]
    assert row.status == st.OK
    series = naive.series([*(crank_rocker(d) for d in designs[:-1]), last], couplings)
    for order, name in enumerate(outputs):
        expected = naive.derivative(series, phi, order)
        # transmission angles above 20 deg in every stage: condition numbers below 1e4 to the third derivative
        assert float(abs(row[name] - expected)) < 1e4 * 2.0**-53 * max(1.0, float(abs(expected))), name


def test_chain_stages_own_outputs_are_those_of_the_stages_alone():
    phi = np.linspace(0.0, 6.0, 7)
    own1 = [*PSI_OUTPUTS, "discriminant", "pressure_angle", "x_c", "z_b"]
    own2 = ["s", "dev", "discriminant", "pressure_angle", "x_m", "y_c"]
    table = numbered(FIRST, GUIDE, kappa2=-1.0, offset2=2.9, shift2=0.0, turn2=0.0)
    wanted = [f"{n}1" for n in own1] + [f"{n}2" for n in own2] + own2
    frame = sweep.evaluate(["rssr", "guide"], table, wanted, phi)
    first = sweep.evaluate("rssr", FIRST, own1, phi)
    second = sweep.evaluate("guide", GUIDE | {"phi": 2.9 - frame.psi1.to_numpy()}, own2)
    for name in own1:
        np.testing.assert_array_equal(frame[f"{name}1"], first[name])
    for name in own2:
        np.testing.assert_array_equal(frame[f"{name}2"], frame[name])
        np.testing.assert_allclose(frame[name], second[name], rtol=0, atol=2e-12 * max(1.0, frame[name].abs().max()))


def random_designs(mechanism, count, seed):
    rng = np.random.default_rng(seed)
    base = numbered(FIRST, GUIDE, kappa2=-1.0, offset2=2.9, shift2=0.0, turn2=0.0)
    designs = np.array([[base[name] for name in mechanism.parameter_names]] * count)
    lengths = [k for k, p in enumerate(mechanism.parameters) if p.unit == "length"]
    designs[:, lengths] *= rng.uniform(0.7, 1.4, (count, len(lengths)))
    return designs


@pytest.mark.parametrize("block", [1, 40, 70, 200])
def test_chain_blocks_change_no_bit(monkeypatch, block):
    mechanism = family(["rssr", "guide"])
    designs = random_designs(mechanism, 9, 1)
    wanted = frozenset({"d2s", "dev", "psi1", "pressure_angle2", "x_m2"})
    shared = Angles.of(np.linspace(0.0, 6.0, 64)[None, :])
    own = Angles.of(np.random.default_rng(2).uniform(0.0, 6.0, (9, 64)))
    for angles in (shared, own):
        whole = mechanism.poses(designs, angles, wanted)
        assert {0, 1} <= set(whole["status"].ravel())
        with monkeypatch.context() as patch:
            patch.setattr(chains, "BLOCK", block)
            parts = mechanism.poses(designs, angles, wanted)
        assert set(parts) == wanted | {"status"}
        for name, values in whole.items():
            np.testing.assert_array_equal(parts[name], values)


def test_chain_memory_beside_the_outputs_is_bounded():
    mechanism = family(["rssr", "guide"])
    designs = random_designs(mechanism, 1500, 8)
    angles = Angles.of(np.linspace(0.0, 6.0, 512)[None, :])
    with own_code():  # else the traced call may be the one that has asked for enough poses to compile
        mechanism.poses(designs, angles, frozenset({"d2s"}))  # compiles
        tracemalloc.start()
        mechanism.poses(designs, angles, frozenset({"d2s"}))
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    outputs = 1500 * 512 * (8 + 1)
    assert outputs < peak < outputs + 3e6


def test_chain_row_by_row_equals_grid():
    mechanism = family(["rssr", "guide"])
    designs = random_designs(mechanism, 6, 3)
    phi = np.linspace(0.0, 6.0, 11)
    table = dict(zip(mechanism.parameter_names, designs.T, strict=True))
    grid = sweep.evaluate(["rssr", "guide"], table, ["d3s", "d2dev"], phi)
    rows = {name: np.repeat(values, 11) for name, values in table.items()} | {"phi": np.tile(phi, 6)}
    single = sweep.evaluate(["rssr", "guide"], rows, ["d3s", "d2dev"])
    for name in ("d3s", "d2dev", "status"):
        np.testing.assert_array_equal(grid[name], single[name])


def test_chain_complex_step_gives_exact_gradients():
    mechanism, phi = family(["rssr", "guide"]), 2.1
    table = numbered(FIRST, GUIDE, kappa2=-1.0, offset2=2.9, shift2=0.0, turn2=0.0)
    design = np.array([[table[name] for name in mechanism.parameter_names]])
    angles = Angles.of(np.array([[phi]]))
    wanted = frozenset({"s", "d2s", "dev", "psi1", "pressure_angle2"})
    for k, parameter in enumerate(mechanism.parameters):
        if parameter.unit == "sign":
            continue
        step = design.astype(complex)
        step[0, k] += 1e-100j
        columns = mechanism.poses(step, angles, wanted)
        real = mechanism.poses(design, angles, wanted)
        h = 2e-5
        shifted = []
        for d in (-2.0 * h, -h, h, 2.0 * h):
            moved = design.copy()
            moved[0, k] += d
            shifted.append(mechanism.poses(moved, angles, wanted))
        for name in wanted:
            far, near = (float((shifted[3 - i][name] - shifted[i][name])[0, 0]) for i in (0, 1))
            difference = (8.0 * near - far) / (12.0 * h)
            assert columns[name][0, 0].real == pytest.approx(real[name][0, 0], rel=1e-14, abs=1e-14)
            assert columns[name][0, 0].imag / 1e-100 == pytest.approx(difference, rel=1e-8, abs=1e-8), parameter.name


def test_chain_kernels_jitted_equal_plain():
    rng = np.random.default_rng(4)
    kappa, offset = rng.choice([-1.0, 1.0], 3), rng.normal(size=3)
    arrays = [rng.normal(size=(3, 5)) for _ in range(6)]
    for count in (1, 2, 3):
        results = []
        for function in (kernel.chain_rule, kernel.chain_rule.py_func):
            outer = [x.copy() for x in arrays[3 : 3 + count]]
            padding = [None] * (3 - count)
            function(kappa, *arrays[:count], *padding, *outer, *padding)
            results.append(outer)
        np.testing.assert_array_equal(*results)
    results = []
    for function in (kernel.input_angle, kernel.input_angle.py_func):
        out = [np.empty((3, 5)), np.empty((3, 5))]
        function(kappa, offset, np.cos(arrays[0]), np.sin(arrays[0]), *out)
        results.append(out)
    np.testing.assert_array_equal(*results)
    np.testing.assert_allclose(results[0][0], np.cos(kappa[:, None] * arrays[0] + offset[:, None]), atol=4e-16)


def gear(*, uses_phi=True, asked=None):
    """A toy family psi = ratio phi, with psi alone or with cosine and sine; it notes what it is asked for."""

    def poses(designs, angles, wanted):
        if asked is not None:
            asked.append(wanted)
        ratio = designs[:, :1]
        cos, sin = (
            (angles.cos, angles.sin) if not uses_phi else (np.cos(ratio * angles.phi), np.sin(ratio * angles.phi))
        )
        values = {"psi": ratio * angles.phi, "dpsi": ratio + 0.0 * angles.cos, "d2psi": 0.0 * angles.cos}
        values |= {"d3psi": 0.0 * angles.cos, "cos_psi": cos, "sin_psi": sin}
        return {n: values[n] for n in wanted} | {"status": np.zeros(np.shape(values["dpsi"]), np.uint8)}

    names = PSI_OUTPUTS if uses_phi else (*PSI_OUTPUTS, "cos_psi", "sin_psi")
    return Family(
        name="gear",
        title="gear pair",
        parameters=(Parameter("ratio", "ratio", "ratio"),),
        position="psi",
        pose_outputs=tuple(Output(name, "1", name, wraps=name == "psi") for name in names),
        poses=poses,
        derivative_of={"psi": "dpsi", "dpsi": "d2psi", "d2psi": "d3psi"},
        uses_phi=uses_phi,
    )


def test_chain_of_families_that_give_or_need_the_angle_itself():
    angles = Angles.of(np.linspace(0.1, 1.5, 8)[None, :])
    guide = np.array([list(GUIDE.values())])
    driven = chains.chain((gear(), family("guide")))
    design = np.concatenate([[[2.0]], guide, [[-1.0, 0.3]]], axis=1)
    columns = driven.poses(design, angles, frozenset({"s", "d2s"}))
    alone = family("guide").poses(guide, Angles.of(0.3 - 2.0 * angles.phi), frozenset({"s", "d2s"}))
    np.testing.assert_allclose(columns["s"], alone["s"], atol=1e-14)
    np.testing.assert_allclose(columns["d2s"], 4.0 * alone["d2s"], rtol=1e-13)

    driving = chains.chain((family("rssr"), gear()))
    design = np.array([[*FIRST.values(), 3.0, -1.0, 0.3]])
    columns = driving.poses(design, angles, frozenset({"psi", "d3psi", "psi1", "d3psi1"}))
    np.testing.assert_allclose(columns["psi"], 3.0 * (0.3 - columns["psi1"]), rtol=1e-15)
    np.testing.assert_allclose(columns["d3psi"], -3.0 * columns["d3psi1"], rtol=1e-15)


def test_chain_computes_only_what_is_wanted():
    first, second = [], []
    spied = chains.chain((gear(uses_phi=False, asked=first), gear(uses_phi=False, asked=second)))
    angles = Angles.of(np.array([[0.2, 0.4]]))
    design = np.array([[1.0, 1.0, 1.0, 0.0]])
    angle = {"cos_psi", "sin_psi"}
    for wanted, of_first, of_second in [
        ({"psi1"}, {"psi"}, None),
        ({"sin_psi2"}, angle, {"sin_psi"}),
        ({"dpsi"}, angle | {"dpsi"}, {"dpsi"}),
        ({"d3psi", "psi"}, angle | {"dpsi", "d2psi", "d3psi"}, {"psi", "dpsi", "d2psi", "d3psi"}),
    ]:
        first.clear()
        second.clear()
        assert set(spied.poses(design, angles, frozenset(wanted))) == wanted | {"status"}
        assert first == [frozenset(of_first)]
        assert second == ([] if of_second is None else [frozenset(of_second)])


@pytest.mark.parametrize("name", [name for name in NAMES if isinstance(family(name).domain, Turn)])
def test_poses_that_do_not_use_the_angle_are_those_of_its_cosine_and_sine(name):
    found, angles = family(name), Angles.of(np.linspace(0.1, 6.0, 5)[None, :])
    design = np.array([[found.example.get(p.name, p.default) for p in found.parameters]], float)
    wanted = frozenset(found.pose_names)
    bare = found.poses(design, angles._replace(phi=np.full((1, 5), np.nan)), wanted)
    whole = found.poses(design, angles, wanted)
    same = all(np.array_equal(bare[output], whole[output], equal_nan=True) for output in (*wanted, "status"))
    assert same is not found.uses_phi
