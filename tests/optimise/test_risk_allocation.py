"""What may miss its limits is spent where room is dear: the exact share-out, and robust searches with known answers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest

from sweep.families.base import Angles, Columns, Family, Output, Parameter
from sweep.optimise import Problem, minimise
from sweep.optimise.manufacture import robust as robust_search
from sweep.optimise.manufacture.margins import Scatter, excesses, prices, risk_allocation, with_margins
from sweep.optimise.manufacture.robust import robust
from sweep.optimise.manufacture.sample import Sampler
from sweep.study import Limit, OptimiseSettings, Tolerance

NORMAL = NormalDist()
SHARE = 0.95
DEAR = 10.0  # price of the first limit's room against that of the second


def best(prices: tuple[float, float]) -> tuple[float, float]:
    """Numbers of standard deviations of two independent limits at the least price, by bisection of what is exact.

    At the least price both limits have the same quotient of price and hazard, the density over the share at its end.
    """

    def second(first: float) -> float:
        return NORMAL.inv_cdf(SHARE / NORMAL.cdf(first))

    def slope(first: float) -> float:
        other = second(first)
        hazards = [NORMAL.pdf(k) / NORMAL.cdf(k) for k in (first, other)]
        return prices[0] / prices[1] - hazards[0] / hazards[1]

    low, high = NORMAL.inv_cdf(SHARE) + 1e-9, 5.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if slope(middle) > 0.0 else (middle, high)
    return low, second(low)


def price(prices: tuple[float, float], numbers: Any) -> float:
    return float(np.dot(prices, numbers))


TOGETHER = NORMAL.inv_cdf(math.sqrt(SHARE))  # the number of both where they have one


def normal(count: int, seed: int = 3) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((count, 2))


@pytest.mark.parametrize("prices", [(DEAR, 1.0), (1.0, DEAR), (100.0, 1.0), (3.0, 2.0)])
def test_share_out_of_independent_limits_is_the_exact_one(prices: tuple[float, float]) -> None:
    sample = normal(1 << 16)
    found, saved = risk_allocation(sample, np.array(prices), SHARE)
    exact = price(prices, best(prices))
    assert (sample <= found).all(axis=1).mean() >= SHARE
    # 65 536 mechanisms tell the share to 0.1 %, which is 0.01 standard deviations; the price is flat at its least.
    assert price(prices, found) == pytest.approx(exact, rel=0.01)
    one = np.full(2, TOGETHER)
    assert saved == pytest.approx(price(prices, one) - exact, abs=0.02 * sum(prices))
    # Negative control: one number for both keeps the same share and costs more.
    assert price(prices, one) > exact * (1.02 if max(prices) >= DEAR else 1.0)


def test_limits_of_one_price_have_one_number_and_nothing_is_saved() -> None:
    found, saved = risk_allocation(normal(1 << 16), np.ones(2), SHARE)
    np.testing.assert_allclose(found, TOGETHER, atol=0.06)  # the last step of the search is 0.05
    assert 0.0 <= saved < 0.01


def test_limits_that_cost_nothing_are_given_all_they_need() -> None:
    found, _ = risk_allocation(normal(1 << 14), np.array([1.0, 0.0]), SHARE)
    assert found[0] == pytest.approx(NORMAL.inv_cdf(SHARE), abs=0.03) and found[1] > 2.9


def test_shifts_stay_together_as_far_as_asked_and_keep_the_share() -> None:
    sample = normal(1 << 14)
    near, little = risk_allocation(sample, np.array([DEAR, 1.0]), SHARE, 0.2)
    far, much = risk_allocation(sample, np.array([DEAR, 1.0]), SHARE)
    assert near[1] - near[0] <= 0.2 + 1e-12 < far[1] - far[0]
    assert (sample <= near).all(axis=1).mean() >= SHARE and 0.0 < little < much


def test_share_that_no_room_gives_is_told() -> None:
    sample = normal(1000)
    sample[:100] = np.inf  # a tenth does not turn
    found, saved = risk_allocation(sample, np.ones(2), SHARE)
    assert np.isinf(found).all() and saved == 0.0
    assert np.isfinite(risk_allocation(sample, np.ones(2), 0.85)[0]).all()


def poses(designs: Any, angles: Angles, wanted: frozenset[str]) -> dict[str, Any]:
    x, y = (designs[:, [k]] for k in range(2))
    wave, double = angles.cos, 2.0 * angles.cos * angles.cos - 1.0
    values = {"s": wave + 0.0 * x, "load": (20.0 - DEAR * x - y) * wave, "u": x * wave, "v": y * double}
    shape = np.broadcast_shapes(x.shape, wave.shape)
    found = {name: np.broadcast_to(values[name], shape).copy() for name in wanted}
    return found | {"status": np.zeros(shape, np.uint8)}


# The load is smallest where x and y are largest; |u| <= 1 and |v| <= 1 hold them back, the first ten times as hard.
PAIR = Family(
    name="pair",
    title="two limits that know nothing of each other",
    parameters=(
        Parameter("x", "length", "amplitude of u"),
        Parameter("y", "length", "amplitude of v"),
        Parameter("branch", "sign", "without effect", default=1.0, choices=(-1.0, 1.0)),
    ),
    position="s",
    outward="branch",
    pose_outputs=tuple(Output(name, "length", name) for name in ("s", "load", "u", "v")),
    poses=poses,
)
SIGMA = 0.01
PROBLEM = Problem(
    PAIR, ("x", "y"), np.full(2, 0.5), np.full(2, 1.5), {}, "max_abs_load",
    (Limit("max_abs_u", None, 1.0), Limit("max_abs_v", None, 1.0)),
)  # fmt: skip
TOLERANCE = Tolerance(lengths=3.0 * SIGMA, angles=0.0, robust=SHARE)


def test_price_of_room_is_what_the_objective_pays_for_a_standard_deviation_of_it() -> None:
    levels = {"u": 2.0, "v": 1.0}
    design = np.array([1.0 - 2.0 * SIGMA, 1.0 - SIGMA, 1.0])
    held = with_margins(Scatter(PROBLEM, TOLERANCE), design, levels, None)
    (result,) = minimise(held, design[None, :], OptimiseSettings(starts=1))
    found = prices(Scatter(PROBLEM, TOLERANCE), result.design, levels)
    # Sixteen harmonics of |cos phi| miss its height by 1 %, and |cos 2 phi| by 2 %: the room is so much smaller.
    for key, dear in (("u", DEAR), ("v", 1.0)):
        assert found[key].price == pytest.approx(dear * SIGMA / result.objective, rel=0.05)
        assert found[key].spread == pytest.approx(SIGMA, rel=0.05)
    excess = excesses(PROBLEM, {"max_abs_u": np.array([1.0 + SIGMA, 1.0, np.nan]), "max_abs_v": np.array([0.9] * 3),
                                "max_abs_load": np.ones(3)}, found)  # fmt: skip
    assert excess["u"][0] == pytest.approx(1.0, rel=0.05) and excess["u"][1] == 0.0 and np.isinf(excess["u"][2])
    assert (excess["v"] < -5.0).all()


def room() -> tuple[float, float]:
    """What the robust design costs, in standard deviations of the dearer amplitude and its share of what is made."""
    settings = OptimiseSettings(starts=2, seed=5)
    drawing = minimise(PROBLEM, PROBLEM.rows(np.array([[0.7, 0.8], [0.9, 0.6]])), settings)
    assert drawing[0].objective == pytest.approx(20.0 - DEAR - 1.0, rel=1e-9)
    made = robust(PROBLEM, drawing, TOLERANCE, settings)
    assert made is not None and not made.cut
    x, y = np.random.default_rng(1).normal(made.result.design[:2, None], SIGMA, (2, 200_000))
    return (made.result.objective - drawing[0].objective) / SIGMA, float(((x <= 1.0) & (y <= 1.0)).mean())


def test_robust_search_finds_the_share_out_that_costs_least() -> None:
    cost, share = room()
    # The share is good to 0.2 % (8192 mechanisms of the search), which is 0.02 standard deviations at this price.
    assert share == pytest.approx(SHARE, abs=0.002)
    assert cost == pytest.approx(price((DEAR, 1.0), best((DEAR, 1.0))), abs=0.02 * (DEAR + 1.0))


def test_a_search_that_runs_out_of_looks_is_corrected_until_that_brings_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What its limits cost is not known there; what is asked for is kept all the same."""
    approached, ended = robust_search._margin_rounds, []

    def unsettled(*given: Any) -> Any:
        result, radius, step = approached(*given)
        ended.append(result.ended)
        return replace(result, ended="looks"), radius, step

    monkeypatch.setattr(robust_search, "_margin_rounds", unsettled)
    _, share = room()
    assert share == pytest.approx(SHARE, abs=0.002)
    assert len(ended) < robust_search.CORRECTIONS


def test_one_number_for_all_limits_would_cost_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """Negative control: the same search, held to one number, keeps the share and ends a tenth dearer."""
    share_out: Callable[..., tuple[np.ndarray, float]] = risk_allocation
    monkeypatch.setattr(robust_search, "risk_allocation", lambda *given: share_out(*given[:3], 0.0))
    cost, share = room()
    assert share == pytest.approx(SHARE, abs=0.002)
    assert cost == pytest.approx((DEAR + 1.0) * TOGETHER, abs=0.02 * (DEAR + 1.0))
    assert cost > 1.05 * price((DEAR, 1.0), best((DEAR, 1.0)))


def test_a_design_that_a_correction_leaves_as_it_is_is_not_sampled_again(monkeypatch: pytest.MonkeyPatch) -> None:
    approached, sample, sampled, standing = robust_search._margin_rounds, Sampler.outputs, [], []

    def stands_still(*given: Any) -> Any:
        if not standing:
            result, radius, step = approached(*given)
            standing.append((replace(result, ended="looks"), radius, step))
        return standing[0]

    def noted(sampler: Sampler, design: np.ndarray, *given: Any) -> Columns:
        sampled.append(tuple(design))
        return sample(sampler, design, *given)

    monkeypatch.setattr(robust_search, "_margin_rounds", stands_still)
    monkeypatch.setattr(Sampler, "outputs", noted)
    settings = OptimiseSettings(starts=1, seed=5)
    drawing = minimise(PROBLEM, PROBLEM.rows(np.array([[0.7, 0.8]])), settings)
    assert robust(PROBLEM, drawing, TOLERANCE, settings) is not None
    assert len(sampled) == 1
