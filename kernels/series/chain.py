"""The generator: closures of stages composed into closures of their chain.

Every function made here has a name that tells the families it is made of, in order: two chains of the same families
share their machine code (`kernels._jit.generated`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from kernels._jit import generated_inline
from kernels.series.form import STRIDE, Form, Helper, Travel, Turned
from kernels.series.links import NUMBERS, blurred_through, enter, get_link, link_of, put_link, through

COUPLING = 2  # columns kappa and offset of the design matrix behind those of each stage but the first


@dataclass(frozen=True)
class Record:
    """The constants of some stages in a row, as nested tuples: (stage 1), ((stage 1), link, stage 2), ...

    ``doubts(c)`` gives for each stage a bound of the rounding error of its discriminant, nan where it is not valid.
    """

    name: str
    columns: int
    numbers: int
    constants: Helper
    put: Helper
    get: Helper
    doubts: Helper


@dataclass(frozen=True)
class Driving:
    """Some stages in a row, the last of which drives another.

    ``turn(c, u, v)`` gives the output angle as `Turned` by the crank angle of the chain and the discriminants of all
    stages, ``blur(c, u, v)`` the same `Turned` and the rounding errors of its angle and first three derivatives.
    """

    record: Record
    turn: Helper
    blur: Helper


@dataclass(frozen=True)
class Chained:
    """A whole chain; c are its constants, (u, v) cosine and sine of its crank angle.

    Parameters
    ----------
    stages : how many
    record : its constants
    travel : (c, u, v) -> `Travel` by the crank angle of the chain, discriminants of all stages
    dip : (c, u, v) -> squared cosine of the last stage's pressure angle and its first two derivatives
    before : (c, u, v) -> discriminants of the stages before the last
    blur : (c, u, v) -> rounding errors of x, x', x'', x''', y, y', y'', y''' and of that squared cosine
    """

    stages: int
    record: Record
    travel: Helper
    dip: Helper
    before: Helper
    blur: Helper


@lru_cache(maxsize=64)
def chained(forms: tuple[Form, ...]) -> Chained:
    """Compose the closures of stages each of which drives the next; a stage alone moves by the chain's crank itself."""
    if len(forms) == 1:
        return _alone(forms[0])
    driving = _first(forms[0])
    for form in forms[1:-1]:
        driving = _longer(driving, form)
    return _ended(driving, forms[-1], len(forms))


def _first(form: Form) -> Driving:
    turn_alone, blur_alone = form.turn, form.turn_blur
    assert turn_alone is not None and blur_alone is not None

    def turn(c: Any, u: Any, v: Any) -> Any:
        m = turn_alone(c, u, v)
        return m, (m.delta,)

    def blur(c: Any, u: Any, v: Any) -> Any:
        m = turn_alone(c, u, v)
        b0, b1, b2, b3 = blur_alone(c, u, v, m.d1, m.d2, m.d3)
        return m, b0, b1, b2, b3

    record = _recorded_first(form)
    return Driving(record, _made("turn", form.name, turn), _made("blur", form.name, blur))


def _alone(form: Form) -> Chained:
    travel_here, blur_here = form.travel, form.travel_blur

    def travel(c: Any, u: Any, v: Any) -> Any:
        n = travel_here(c, u, v)
        return n, (n.delta,)

    def before(c: Any, u: Any, v: Any) -> Any:
        return ()

    def blur(c: Any, u: Any, v: Any) -> Any:
        n = travel_here(c, u, v)
        return blur_here(c, u, v, n.x1, n.x2, n.x3)

    made = [_made(f.__name__, f"{form.name}_alone", f) for f in (travel, before, blur)]
    return Chained(1, _recorded_first(form), made[0], form.dip, *made[1:])


def _recorded_first(form: Form) -> Record:
    def doubts(c: Any) -> Any:
        return (c.doubt,)

    doubts = _made("doubts", form.name, doubts)
    return Record(form.name, form.columns, form.numbers, form.constants, form.put, form.get, doubts)


def _longer(driving: Driving, form: Form) -> Driving:
    record = _recorded(driving.record, form)
    turn_before, blur_before, turn_here, blur_here = driving.turn, driving.blur, form.turn, form.turn_blur
    assert turn_here is not None and blur_here is not None

    def turn(c: Any, u: Any, v: Any) -> Any:
        m, deltas = turn_before(c[0], u, v)
        t = enter(c[1], m)
        n = turn_here(c[2], t.u, t.v)
        d1, d2, d3, d4 = through(t, n.d1, n.d2, n.d3, n.d4)
        return Turned(n.cos, n.sin, d1, d2, d3, d4, n.delta), (*deltas, n.delta)

    def blur(c: Any, u: Any, v: Any) -> Any:
        m, b0, b1, b2, b3 = blur_before(c[0], u, v)
        t = enter(c[1], m)
        n = turn_here(c[2], t.u, t.v)
        e = blur_here(c[2], t.u, t.v, n.d1, n.d2, n.d3)
        b0, b1, b2, b3 = blurred_through(t, b0, b1, b2, b3, n.d1, n.d2, n.d3, n.d4, e)
        d1, d2, d3, d4 = through(t, n.d1, n.d2, n.d3, n.d4)
        return Turned(n.cos, n.sin, d1, d2, d3, d4, n.delta), b0, b1, b2, b3

    return Driving(record, _made("turn", record.name, turn), _made("blur", record.name, blur))


def _ended(driving: Driving, form: Form, stages: int) -> Chained:
    record = _recorded(driving.record, form)
    turn_before, blur_before = driving.turn, driving.blur
    travel_here, dip_here, blur_here = form.travel, form.dip, form.travel_blur

    def travel(c: Any, u: Any, v: Any) -> Any:
        m, deltas = turn_before(c[0], u, v)
        t = enter(c[1], m)
        n = travel_here(c[2], t.u, t.v)
        x1, x2, x3, x4 = through(t, n.x1, n.x2, n.x3, n.x4)
        y1, y2, y3, y4 = through(t, n.y1, n.y2, n.y3, n.y4)
        return Travel(n.x0, x1, x2, x3, x4, n.y0, y1, y2, y3, y4, n.delta), (*deltas, n.delta)

    def dip(c: Any, u: Any, v: Any) -> Any:
        m, _ = turn_before(c[0], u, v)
        t = enter(c[1], m)
        y, d1, d2 = dip_here(c[2], t.u, t.v)
        return y, t.t1 * d1, t.t2 * d1 + t.t1 * t.t1 * d2

    def before(c: Any, u: Any, v: Any) -> Any:
        _, deltas = turn_before(c[0], u, v)
        return deltas

    def blur(c: Any, u: Any, v: Any) -> Any:
        m, b0, b1, b2, b3 = blur_before(c[0], u, v)
        t = enter(c[1], m)
        n = travel_here(c[2], t.u, t.v)
        e0, e1, e2, e3, f0, f1, f2, f3, g = blur_here(c[2], t.u, t.v, n.x1, n.x2, n.x3)
        e0, e1, e2, e3 = blurred_through(t, b0, b1, b2, b3, n.x1, n.x2, n.x3, n.x4, (e0, e1, e2, e3))
        f0, f1, f2, f3 = blurred_through(t, b0, b1, b2, b3, n.y1, n.y2, n.y3, n.y4, (f0, f1, f2, f3))
        _, slope, _ = dip_here(c[2], t.u, t.v)
        return e0, e1, e2, e3, f0, f1, f2, f3, g + abs(slope) * b0

    made = [_made(f.__name__, f"{record.name}_ended", f) for f in (travel, dip, before, blur)]
    return Chained(stages, record, *made)


def _recorded(before: Record, form: Form) -> Record:
    """Return the constants of some stages and of one more, coupled to them."""
    start, end = before.columns, before.columns + form.columns
    link_row, stage_row = before.numbers * STRIDE, (before.numbers + NUMBERS) * STRIDE
    constants_before, put_before, get_before, doubts_before = before.constants, before.put, before.get, before.doubts
    constants_here, put_here, get_here = form.constants, form.put, form.get

    def constants(designs: Any, i: int) -> Any:
        return constants_before(designs, i), link_of(designs, i, end), constants_here(designs[:, start:end], i)

    def put(at: Any, place: int, c: Any) -> None:
        put_before(at, place, c[0])
        put_link(at, place + link_row, c[1])
        put_here(at, place + stage_row, c[2])

    def get(at: Any, place: int) -> Any:
        return get_before(at, place), get_link(at, place + link_row), get_here(at, place + stage_row)

    def doubts(c: Any) -> Any:
        return (*doubts_before(c[0]), c[2].doubt + 0.0 * c[1].kappa)

    name = f"{before.name}_{form.name}"
    made = [_made(f.__name__, name, f) for f in (constants, put, get, doubts)]
    return Record(name, end + COUPLING, before.numbers + NUMBERS + form.numbers, *made)


def _made(what: str, chain: str, function: Helper) -> Helper:
    return generated_inline(f"{what}_{chain}", function)
