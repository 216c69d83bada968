"""Presser foot stepped through time in plain Python: slow, obvious, imports nothing from kernels or sweep."""

from __future__ import annotations

import math


def flights(p: dict[str, float], turns: int, steps: int) -> list[tuple[float, float, float]]:
    """Every flight over some turns: crank angle of launch and landing, and the closing speed of that landing.

    The foot starts on the plate where the rack is lowest.  Each step is one of ``steps`` per turn; a change of state
    inside a step is found by halving it.
    """
    m, k, preload, omega = p["m"], p["k"], p["F0"], p["omega"]

    def rack(t: float) -> tuple[float, float, float]:
        x = omega * t
        return p["Y"] * math.sin(x) - p["p"], omega * p["Y"] * math.cos(x), -omega * omega * p["Y"] * math.sin(x)

    def flying(y0: float, v0: float, t: float) -> tuple[float, float]:
        w = math.sqrt(k / m)
        rest = -preload / k
        a = y0 - rest
        return rest + a * math.cos(w * t) + v0 / w * math.sin(w * t), v0 * math.cos(w * t) - a * w * math.sin(w * t)

    def crossing(f: object, low: float, high: float) -> float:
        for _ in range(80):
            middle = 0.5 * (low + high)
            if (f(middle) < 0.0) == (f(high) < 0.0):  # type: ignore[operator]
                high = middle
            else:
                low = middle
        return high

    t, dt = -0.5 * math.pi / omega, 2.0 * math.pi / omega / steps
    end = t + turns * steps * dt
    mode, launched, y0, v0 = "plate", 0.0, 0.0, 0.0
    found = []
    tiny = 1e-9 * omega * p["Y"]

    def meet(at: float, speed: float) -> tuple[str, float, float, float, float]:
        y, v, a = rack(at)
        on_rack = (y > -1e-12 * p["Y"] and v > 0.0) or y > 1e-9 * p["Y"]
        ground, surface = (max(y, 0.0), v) if on_rack else (0.0, 0.0)
        closing = surface - speed
        bounce = p["restitution"] * closing
        if bounce > tiny:
            return "flight", at, ground, surface + bounce, closing
        if on_rack and preload + k * ground + m * a < 0.0:
            return "flight", at, ground, surface, closing
        return ("rack" if on_rack else "plate"), at, ground, surface, closing

    while t < end:
        after = t + dt
        if mode == "plate":
            if rack(after)[0] > 0.0:
                t = crossing(lambda x: rack(x)[0], t, after)
                mode, launched, y0, v0, _ = meet(t, 0.0)
                continue
        elif mode == "rack":
            if preload + k * rack(after)[0] + m * rack(after)[2] < 0.0:
                t = crossing(lambda x: preload + k * rack(x)[0] + m * rack(x)[2], t, after)
                mode, launched, (y0, v0, _) = "flight", t, rack(t)
                continue
            if rack(after)[0] < 0.0:
                t = crossing(lambda x: rack(x)[0], t, after)
                mode, launched, y0, v0, _ = meet(t, rack(t)[1])
                continue
        else:

            def gap(x: float, y: float = y0, v: float = v0, since: float = launched) -> float:
                return flying(y, v, x - since)[0] - max(rack(x)[0], 0.0)

            if gap(after) < 0.0:
                before = max(t, launched)
                tries = [before + (after - before) * n / 64 for n in range(64)]
                clear = [x for x in tries if gap(x) > 0.0]
                if not clear:
                    # a hop shorter than a sixty-fourth of a step: the foot has come to rest
                    mode, t = ("rack" if rack(before)[0] > 0.0 else "plate"), after
                    continue
                start, t = launched, crossing(gap, clear[-1], after)
                mode, launched, y0, v0, closing = meet(t, flying(y0, v0, t - start)[1])
                found.append((omega * start, omega * t, closing))
                continue
        t = after
    return found
