"""Balancing against the 25-digit table: counterweights that remove a force, orders, the best counterweight."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import sweep
from sweep.evaluation.balancing import CorrectionPlane, best_counterweights, force_balance, orders, rms

TABLE = json.loads((Path(__file__).parents[1] / "oracle" / "machine_open.json").read_text())["rows"]
ROWS = [row for row in TABLE if row["kind"] == "balance"]
FACTOR, UNIT = 64.0, 2.0**-53
LINKS = ("crank", "coupler", "rocker")
FINGER = {"driving": 1.0, "driven": 0.0, "planar": 0.0}


def rows_of(case):
    found = [row for row in ROWS if row["case"].startswith(case)]
    assert found
    return found


def design_of(given):
    (stage,) = given["stages"]
    found = stage["p"] | {"finger": FINGER[stage["construction"]], "speed": given["omega"]}
    found["speed_change"] = given.get("epsilon", 0.0)
    for name, body in stage["bodies"].items():
        found[f"m_{name}"] = body["m"]
        found |= {f"com_{name}_{x}": value for x, value in zip("xyz", body["com"], strict=True)}
        found |= {f"j_{name}_{'xyz'[i]}{'xyz'[j]}": body["J"][i][j] for i in range(3) for j in range(i, 3)}
    return found


def shaking(design, phi):
    machine = sweep.machine({"x": "rssr"}, {"f": {"shaking": ["x"]}})
    names = [*(f"f_{axis}" for axis in "xyz"), *(f"f_moment_{axis}" for axis in "xyz")]
    found = sweep.evaluate(machine, {f"x.{key}": value for key, value in design.items()}, names, phi=phi)[names]
    return found.to_numpy()[:, :3], found.to_numpy()[:, 3:]


def numbers(row, name):
    return np.array([float(x) for x in np.atleast_1d(row["expected"][name])])


@pytest.mark.parametrize("case", ["four-bar", "crank-rocker"])
def test_two_counterweights_remove_the_whole_shaking_force(case):
    for row in rows_of(case):
        design, bodies = design_of(row["inputs"]), row["inputs"]["stages"][0]["bodies"]
        centres = np.array([complex(*bodies[name]["com"][:2]) for name in LINKS])
        masses = np.array([bodies[name]["m"] for name in LINKS])
        weights = force_balance((design["a"], design["b"], design["c"]), masses, centres)
        for name, weight in zip(("crank", "rocker"), weights, strict=True):
            error = np.abs(np.array([weight.real, weight.imag]) - numbers(row, f"counterweight_{name}")).max()
            assert error < FACTOR * UNIT * float(row["cond"][f"counterweight_{name}"])
            # as a point: the first moment of the link grows by the counterweight's, its mass does not count
            for axis, value in (("x", weight.real), ("y", weight.imag)):
                design[f"com_{name}_{axis}"] += value / design[f"m_{name}"]
        before, _ = shaking(design_of(row["inputs"]), [row["inputs"]["phi"]])
        assert np.abs(before[0] - numbers(row, "force_before")).max() < FACTOR * UNIT * float(
            row["cond"]["force_before"]
        )
        after, _ = shaking(design, np.linspace(0.0, 6.0, 7))
        assert np.abs(after).max() < FACTOR * UNIT * float(row["cond"]["force_after"]) + 1e-11 * np.abs(before).max()


def test_orders_and_the_best_counterweight_are_those_of_the_table():
    for row in rows_of("orders"):
        given, scale = row["inputs"], {key: float(value) for key, value in row["scale"].items()}
        phi = np.arange(640) * (2.0 * np.pi / 640)
        design = design_of(given)
        force, moment = shaking(design, phi)
        for name, values in (("force", force), ("moment", moment)):
            found = orders(values, 3)
            for k in (1, 2, 3):
                for part, got in (("cos", found.cos), ("sin", found.sin)):
                    error = np.abs(got[k - 1] - numbers(row, f"{name}_{part}{k}")).max()
                    assert error < FACTOR * UNIT * scale[name]
            assert abs(rms(values) - numbers(row, f"rms_{name}")[0]) < FACTOR * UNIT * scale[name]
        across = (0.0, float(np.cos(design["alpha"])), -float(np.sin(design["alpha"])))
        best = best_counterweights(
            phi, force, moment, given["omega"], [CorrectionPlane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), across)]
        )
        # a least-squares solution is as good as the force it is made of
        allowed = FACTOR * UNIT * max(scale["best_counterweight"], scale["force"] / given["omega"] ** 2)
        assert np.abs(best.weights[0] - numbers(row, "best_counterweight")).max() < allowed
        assert rms(best.force) == pytest.approx(numbers(row, "rms_force_after")[0], rel=1e-12)


@pytest.mark.parametrize("samples", [7, 8])
def test_orders_add_up_to_the_samples(samples):
    """The highest order of an even number of samples has a cosine alone; its amplitude was doubled."""
    values = np.random.default_rng(3).normal(size=samples)
    found = orders(values, samples // 2)
    angle = np.outer(2.0 * np.pi * np.arange(samples) / samples, np.arange(1, samples // 2 + 1))
    again = found.mean + np.cos(angle) @ found.cos + np.sin(angle) @ found.sin
    np.testing.assert_allclose(again, values, atol=1e-14)


def test_two_shafts_remove_what_one_leaves_and_a_moment_counts_by_its_length():
    phi = np.arange(256) * (2.0 * np.pi / 256)
    force = np.stack([np.cos(phi), np.zeros(256), np.zeros(256)], axis=1)  # half of it turns backwards
    ahead, back = (
        CorrectionPlane((0.0, 0.0, z), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), ratio)
        for z, ratio in ((0.0, 1.0), (2.0, -1.0))
    )
    one = best_counterweights(phi, force, 0.0 * force, 3.0, [ahead])
    assert rms(one.force) == pytest.approx(rms(force) / np.sqrt(2.0))
    two = best_counterweights(phi, force, 0.0 * force, 3.0, [ahead, back])
    assert rms(two.force) < 1e-14
    both = best_counterweights(phi, force, 0.0 * force, 3.0, [ahead, back], length=1.0)
    assert rms(both.force) ** 2 + rms(both.moment) ** 2 < rms(two.force) ** 2 + rms(two.moment) ** 2
