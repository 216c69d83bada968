"""Bearings and speed of the loopers against statics of each shaft, split integrals, and the torque left for the motor.

Axes and turning of the shafts come from public poses alone (tests/reference/linked.py), loads of the supports from a
linear system, lives from Gauss rules between kinks that are searched here.
"""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st
from kernels.effects.bearings import bearing_loads, journal_pressures
from sweep.effects import applicable, called_for
from sweep.errors import InputError
from sweep.families import family
from sweep.families.link_tree import LinkTree
from tests.effects.test_link_loads import DESIGNS, OMEGA, TOOL, WEIGHT, design, masses, rubbing, vector
from tests.effects.test_motor_line import changes
from tests.reference.linked import POSES, READERS, Z, shaft

PHI = np.linspace(0.1, 6.2, 61)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
Z1, Z2 = -0.4, 0.5  # of the supports, in tests.effects.test_link_loads.rubbing
CATALOGUE = {"radial_factor": 0.56, "axial_factor": 1.5, "e_limit": 0.3, "dynamic_capacity": 6e5, "life_exponent": 3.0}


def joints(case, kinds=("shaft",)):
    return [j.name for j in family(case.split()[0]).find(LinkTree).joints if j.kind in kinds]


def inputs(case, mu=0.0):
    name, d = design(case)
    own = {f"{key}_{j}": x for j in joints(case) for key, x in CATALOGUE.items()}
    own |= {f"required_life_{j}": 2e6 for j in joints(case)}
    return name, d, d | masses(name)[0] | TOOL | WEIGHT | {"speed": OMEGA} | rubbing(name, mu) | own


def axes_of(case, d, poses):
    """Axis of every shaft, (n, 3), from public poses."""
    name = case.split()[0]
    own = dict(READERS[name](d, poses)[3])
    if "looper" in name:
        st2, ct2 = np.sin(d.get("theta2", 0.0)), np.cos(d.get("theta2", 0.0))
        b2 = d.get("beta2", 0.0)
        own["a1"] = shaft(d, "f1", "alpha1")[0]
        own["a2"] = np.array([st2 * np.cos(b2), st2 * np.sin(b2), ct2])
        if name == "cylindrical_looper":
            x2 = np.array([np.cos(d["gamma2"]), np.sin(d["gamma2"]), 0.0])
            own["a2"] = np.sin(d["alpha2"]) * Z + np.cos(d["alpha2"]) * np.cross(x2, Z)
    else:
        own["a"] = shaft(d)[0]
    return {joint: np.broadcast_to(axis, (len(poses), 3)) for joint, axis in own.items()}


@pytest.mark.parametrize("case", DESIGNS)
def test_loads_of_both_bearings_of_every_shaft_balance_its_force_and_moment(case):
    name, d, table = inputs(case)
    shafts = joints(case)
    wanted = [f"{v}_{j}_{x}" for j in shafts for v in ("force", "moment") for x in "xyz"]
    wanted += [f"radial_load_{j}{k}" for j in shafts for k in "12"] + [f"axial_load_{j}" for j in shafts]
    poses = sweep.evaluate(name, table, [*POSES[name], *wanted], phi=PHI)
    assert (poses["status"] == st.OK).all()
    scale = max(np.abs(poses[f"radial_load_{j}{k}"]).max() for j in shafts for k in "12")
    for j, axis in axes_of(case, d, poses).items():
        if j not in shafts:
            continue
        force, moment = vector(poses, f"force_{j}"), vector(poses, f"moment_{j}")
        for pose in range(0, len(poses), 7):
            k = axis[pose]
            across = np.eye(3) - np.outer(k, k)
            turn = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
            # two forces across the axis: their sum, and their moments about the joint
            system = np.block([[across, across], [Z1 * turn, Z2 * turn]])
            right = np.concatenate([across @ force[pose], across @ moment[pose]])
            both = np.linalg.lstsq(system, right, rcond=None)[0]
            found = [poses[f"radial_load_{j}{n}"][pose] for n in "12"]
            np.testing.assert_allclose(
                found, [np.linalg.norm(both[:3]), np.linalg.norm(both[3:])], atol=1e-11 * scale, err_msg=j
            )
            assert poses[f"axial_load_{j}"][pose] == pytest.approx(force[pose] @ k, abs=1e-11 * scale), j


# Turning of a shaft in its bearings, of those whose angle is a pose output; cranks turn at unit speed.
TURNING = {"five_link": {"d": "dpsi"}, "slotted": {"d": "dpsi"}, "spherical_looper": {"d1": "dpsi", "os": "dchi"}}


def naive_life(name, table, joint, turning):
    """Mean load and life of bearing 1, split at every change of sign that a grid of 4001 poses shows."""
    limit = table[f"e_limit_{joint}"]
    names = [
        f"equivalent_load_{joint}1",
        f"radial_load_{joint}1",
        f"axial_load_{joint}",
        *([turning] if turning else []),
    ]

    def at(phi):
        found = sweep.evaluate(name, table, names, phi=phi)
        rate = found[turning].to_numpy() if turning else np.ones(len(phi))
        axial = found[names[2]].to_numpy()
        return found[names[0]].to_numpy(), np.stack([rate, axial, np.abs(axial) - limit * found[names[1]].to_numpy()])

    grid = np.linspace(0.0, 2.0 * np.pi, 4002)
    signs = np.sign(at(grid)[1])
    which, column = np.nonzero(signs[:, 1:] * signs[:, :-1] < 0.0)
    low, high, left = grid[column], grid[column + 1], signs[which, column]
    for _ in range(48):
        middle = 0.5 * (low + high)
        same = np.sign(at(middle)[1][which, np.arange(which.size)]) == left if which.size else left == left
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    edges = np.sort(np.concatenate([grid, 0.5 * (low + high)]))
    half = 0.5 * np.diff(edges)[:, None]
    load, signs = at((0.5 * (edges[1:] + edges[:-1])[:, None] + half * NODES).ravel())
    way = np.abs(signs[0]) * (half * WEIGHTS).ravel()
    mean = load.max() * (((load / load.max()) ** 3 * way).sum() / way.sum()) ** (1.0 / 3.0)
    return mean, 1e6 * (6e5 / mean) ** 3 / (way.sum() / (2.0 * np.pi) * OMEGA / (2.0 * np.pi))


@pytest.mark.parametrize("case", DESIGNS)
def test_mean_loads_and_lives_are_as_exact_as_asked(case):
    name, _, table = inputs(case)
    shafts = [j for j in joints(case) if j.startswith(("a", "d", "o"))]
    wanted = [f"{w}_{j}1" for j in shafts for w in ("mean_load", "life")]
    exact = {j: naive_life(name, table, j, TURNING.get(name, {}).get(j)) for j in shafts}
    for target in (1e-5, 1e-9):
        found = sweep.summarise(name, table, wanted, accuracy=target).iloc[0]
        assert found["status"] == st.OK
        for j in shafts:
            for value, w in zip(exact[j], ("mean_load", "life"), strict=True):
                off, err = abs(found[f"{w}_{j}1"] - value), found[f"err_{w}_{j}1"]
                # Gauss rules of 8 points on 4000 panels, places of jumps to 48 bisections: 1e-11
                assert off <= err + 1e-11 * value, (j, w)
                assert err <= 8.0 * target * value, (j, w)


def test_utilisation_of_rolling_bearings_is_the_load_over_that_of_the_required_life():
    name, _, table = inputs("spherical_looper")
    pair = [f"equivalent_load_os{k}" for k in "12"]
    poses = sweep.evaluate(name, table, [*pair, "rolling_utilisation_os"], phi=PHI)
    turns = OMEGA / (2.0 * np.pi) * 2e6
    permissible = 6e5 * (turns / 1e6) ** (-1.0 / 3.0)
    np.testing.assert_allclose(poses["rolling_utilisation_os"], poses[pair].max(axis=1) / permissible, rtol=1e-13)


def journals(case):
    table = {}
    for j in joints(case, ("shaft", "sleeve")):
        table |= {f"journal_diameter_{j}": 0.2, f"journal_length_{j}1": 0.3, f"journal_length_{j}2": 0.25}
        table |= {f"permissible_pressure_{j}{k}": 1e4 * int(k) for k in "12"}
    for j in joints(case):
        table |= {f"collar_diameter_{j}": 0.4, f"permissible_pressure_{j}3": 5e3}
    return table


@pytest.mark.parametrize("case", DESIGNS)
def test_pressures_are_the_loads_with_friction_over_the_areas(case):
    name, d, table = inputs(case, 0.02)
    table |= journals(case)
    supported = joints(case, ("shaft", "sleeve"))
    loads = [f"load_support_{j}{k}" for j in supported for k in "12"]
    forces = [f"force_{j}_friction_{x}" for j in joints(case) for x in "xyz"]
    pressures = [f"journal_pressure_{j}{k}" for j in supported for k in "12"]
    pressures += [f"collar_pressure_{j}" for j in joints(case)] + [f"sliding_utilisation_{j}" for j in supported]
    poses = sweep.evaluate(name, table, [*POSES[name], *loads, *forces, *pressures], phi=PHI)
    assert (poses["status"] == st.OK).all()
    axes = axes_of(case, d, poses)
    for j in supported:
        parts = [poses[f"load_support_{j}{k}"] / (0.2 * size) for k, size in (("1", 0.3), ("2", 0.25))]
        used = [parts[0] / 1e4, parts[1] / 2e4]
        for k in (0, 1):
            np.testing.assert_allclose(poses[f"journal_pressure_{j}{k + 1}"], parts[k], rtol=1e-13)
        if j in joints(case):
            axial = (vector(poses, f"force_{j}_friction") * axes[j]).sum(axis=1) if j in axes else None
            if axial is not None:
                area = 0.25 * np.pi * (0.4**2 - 0.2**2)
                size = np.abs(vector(poses, f"force_{j}_friction")).max() / area
                np.testing.assert_allclose(poses[f"collar_pressure_{j}"], np.abs(axial) / area, atol=1e-12 * size)
            used.append(poses[f"collar_pressure_{j}"] / 5e3)
        np.testing.assert_allclose(poses[f"sliding_utilisation_{j}"], np.max(used, axis=0), rtol=1e-13)


def test_friction_moves_the_pressures():
    """Negative control: pressures without friction are others."""
    name, _, table = inputs("slotted fork", 0.05)
    bare = table | {key: 0.0 for key in table if key.startswith("mu_")}
    both = [
        sweep.evaluate(name, t | journals("slotted fork"), ["journal_pressure_d1"], phi=PHI)["journal_pressure_d1"]
        for t in (table, bare)
    ]
    assert np.abs(both[0] - both[1]).max() > 1e-3 * both[1].max()


def test_a_collar_no_wider_than_its_journal_and_supports_at_one_place_are_refused():
    name, _, table = inputs("swivel")
    table |= journals("swivel")
    thin = sweep.evaluate(name, table | {"collar_diameter_a": 0.2}, ["journal_pressure_a1"], phi=PHI)
    one = sweep.evaluate(name, table | {"support_a2": Z1}, ["radial_load_a1"], phi=PHI)
    life = sweep.summarise(name, table | {"support_a2": Z1}, ["life_a1"])
    assert {*thin["status"], *one["status"], *life["status"]} == {st.INVALID_INPUT}
    assert thin["journal_pressure_a1"].isna().all() and one["radial_load_a1"].isna().all()


def test_a_shaft_that_does_not_turn_in_its_bearings_has_no_life():
    # massless links without any load: nothing is carried
    name, d = design("swivel")
    table = d | {"speed": OMEGA, "support_a1": Z1, "support_a2": Z2} | {f"{k}_a": x for k, x in CATALOGUE.items()}
    found = sweep.summarise(name, table, ["life_a1", "mean_load_a1"], accuracy=1e-8).iloc[0]
    assert found["status"] == st.INVALID_INPUT
    assert np.isnan(found["life_a1"]) and found["mean_load_a1"] == 0.0


def test_only_the_shaft_asked_for_has_to_be_given():
    looper = family("spherical_looper")
    (placed,) = called_for(looper, ["life_os1"])
    catalogue = {p.name for p in placed.entry.inputs if p.name.endswith("_os")}
    assert catalogue >= {f"{key}_os" for key in CATALOGUE}
    assert not {"required_life_os", "dynamic_capacity_a1", "support_a11"} & {p.name for p in placed.entry.inputs}
    (whole,) = (p for p in applicable(looper) if p.name == placed.name)
    assert {"required_life_os", "dynamic_capacity_a1"} <= {p.name for p in whole.entry.inputs}
    name, _, table = inputs("spherical_looper")
    others = {k: x for k, x in table.items() if not k.endswith(("_a1", "_a2", "_d1")) and "support_" not in k}
    given = others | {"support_os1": Z1, "support_os2": Z2}
    assert sweep.summarise(name, given, ["life_os1"])["status"][0] == st.OK
    with pytest.raises(InputError, match="dynamic_capacity_os"):
        sweep.summarise(name, {k: x for k, x in given.items() if k != "dynamic_capacity_os"}, ["life_os1"])


@pytest.mark.parametrize("case", ["five_link", "slotted fork", "swivel", "spherical_looper", "cylindrical_looper held"])
@pytest.mark.parametrize("suffix", ["", "_friction"])
def test_motor_of_an_uneven_looper_gives_what_its_line_says_at_every_pose(case, suffix):
    """Loads at the speed and acceleration found, pose by pose, leave the motor its line and nothing else."""
    name, _, table = inputs(case, 0.01)
    table |= {"flywheel": 60.0, "motor_slope": 400.0}
    phi = 2.0 * np.pi * np.arange(64) / 64
    found = sweep.evaluate(name, table, [f"crank_speed{suffix}", f"crank_acceleration{suffix}"], phi=phi)
    assert (found["status"] == st.OK).all()
    speed, change = found[f"crank_speed{suffix}"].to_numpy(), changes(name, table, f"crank_speed{suffix}", phi)
    acceleration = found[f"crank_acceleration{suffix}"]
    assert np.abs(acceleration - change).max() < (1e-2 if suffix else 1e-6) * np.abs(change).max()
    posed = table | {"speed": speed, "speed_change": change, "phi": phi}
    torque = sweep.evaluate(name, posed, [f"drive_torque{suffix}"])[f"drive_torque{suffix}"].to_numpy()
    left = torque + 60.0 * change + 400.0 * (speed - OMEGA)
    even = sweep.evaluate(name, table, [f"drive_torque{suffix}"], phi=phi)[f"drive_torque{suffix}"]
    # without friction the series are resolved to 1e-9; its kinks leave 1e-3 of the torque to the finest grid
    assert np.ptp(left) < (1e-7 if not suffix else 2e-3) * np.abs(even).max()
    assert np.ptp(even) > 0.1 * np.abs(even).max()  # negative control: an even crank asks for another torque
    assert 1.0 / np.mean(1.0 / speed) == pytest.approx(OMEGA, rel=1e-9 if not suffix else 1e-5)
    numbers = sweep.summarise(name, table, [f"unevenness{suffix}", f"fastest{suffix}"], accuracy=1e-6).iloc[0]
    assert numbers["status"] == st.OK
    assert numbers[f"fastest{suffix}"] >= speed.max() * (1.0 - 1e-9)
    assert numbers[f"unevenness{suffix}"] >= np.ptp(speed) / OMEGA * (1.0 - 1e-6)


def test_compiled_loads_and_pressures_are_those_of_plain_python():
    rng = np.random.default_rng(5)
    shape = (4, 9)
    forces, axis = rng.normal(size=(*shape, 12)), rng.normal(size=(4, 1, 3))
    axis /= np.linalg.norm(axis, axis=2, keepdims=True)
    forces[0, 0] = 0.0
    bearings = rng.uniform(0.1, 1.0, (4, 11))
    bearings[:, 1], bearings[:, 10] = -bearings[:, 1], [1.0, 2.0, 1.0, 2.0]
    status = np.zeros(shape, np.uint8)
    status[1, 2] = st.DEAD_POINT
    sides = []
    for function in (bearing_loads, bearing_loads.py_func):
        found, pressures = np.empty((5, *shape)), np.empty((4, *shape))
        function(forces, 6, 9, axis, bearings, status, found)
        pressing = journal_pressures if function is bearing_loads else journal_pressures.py_func
        sizes = np.column_stack([bearings[:, 3:6], [0.0, 2.0, 3.0, 4.0]])
        pressing(*found[:3], sizes, bearings[:, 6:9].copy(), status, pressures)
        sides.append([*found, *pressures])
    for fast, slow in zip(*sides, strict=True):
        np.testing.assert_allclose(fast, slow, rtol=4e-15, atol=1e-15)
        assert np.isnan(fast[1, 2])
