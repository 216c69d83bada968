"""The generator: closures of stages composed into closures of their chain.

Every generated function is named after its families in order: two chains of the same families share their machine code
(`kernels.jit.generated`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from kernels.arithmetic.sincos import rounded_sincos
from kernels.chains.form import BLOCK, STRIDE, Form, Helper, Travel, Turned
from kernels.chains.links import NUMBERS, Input, blurred_through, enter, get_link, link_of, put_link, through
from kernels.jit import generated_inline

COUPLING = 2  # columns kappa and offset of the design matrix, behind the columns of each stage but the first


@dataclass(frozen=True)
class Record:
    """Constants of consecutive stages, as nested tuples: (stage 1), ((stage 1), link, stage 2), ...

    ``constants(designs, i)`` computes the constants of a design.  So does ``loaded(block, k)``, as vector code, from
    the columns that ``load(designs, i, block, k)`` has copied to place k of a block of ``wide`` rows; only sines and
    cosines of angles among the columns come from `rounded_sincos` instead of the C library.  ``doubts(c)`` bounds the
    rounding error of each stage's discriminant, nan where the stage is not valid.
    """

    name: str
    columns: int
    wide: int
    numbers: int
    constants: Helper
    load: Helper
    loaded: Helper
    put: Helper
    get: Helper
    doubts: Helper


@dataclass(frozen=True)
class Driving:
    """Consecutive stages of which the last one drives a further stage.

    ``turn(c, kappa, u, v)`` gives kappa times the output angle, as `Turned` by the crank angle of the chain, and the
    discriminants of all stages; ``blur(c, kappa, u, v)`` the same `Turned` and the rounding errors of its angle and
    first three derivatives.
    """

    record: Record
    turn: Helper
    blur: Helper


@dataclass(frozen=True)
class Chained:
    """A whole chain; c are its constants, (u, v) cosine and sine of its crank angle.

    Parameters
    ----------
    stages : number of stages
    record : their constants
    travel : (c, u, v) -> `Travel` by the crank angle of the chain, discriminants of all stages
    drive : (c, u, v) -> `Input` of the last stage, discriminants of the stages before
    land : (c, input) -> `Travel` by the crank angle of the chain
    dip : (c, input) -> squared cosine of the last stage's pressure angle and its first two derivatives
    blur : (c, u, v) -> rounding errors of x, x', x'', x''', y, y', y'', y''' and of that squared cosine
    """

    stages: int
    record: Record
    travel: Helper
    drive: Helper
    land: Helper
    dip: Helper
    blur: Helper


@lru_cache(maxsize=64)
def chained(forms: tuple[Form, ...]) -> Chained:
    """Compose the closures of stages of which each drives the next; a single stage is driven by the crank itself."""
    if len(forms) == 1:
        return _alone(forms[0])
    driving = _first(forms[0])
    for form in forms[1:-1]:
        driving = _longer(driving, form)
    return _ended(driving, forms[-1], len(forms))


def _first(form: Form) -> Driving:
    turn_alone, blur_alone = form.turn, form.turn_blur
    assert turn_alone is not None and blur_alone is not None

    def turn(c: Any, kappa: Any, u: Any, v: Any) -> Any:
        m = turn_alone(c, kappa, u, v)
        return m, (m.delta,)

    def blur(c: Any, kappa: Any, u: Any, v: Any) -> Any:
        m = turn_alone(c, kappa, u, v)
        b0, b1, b2, b3 = blur_alone(c, u, v, m.d1, m.d2, m.d3)
        return m, b0, b1, b2, b3

    return Driving(_recorded_first(form), _made("turn", form.name, turn), _made("blur", form.name, blur))


def _alone(form: Form) -> Chained:
    travel_here, dip_here, blur_here = form.travel, form.dip, form.travel_blur

    def drive(c: Any, u: Any, v: Any) -> Any:
        return Input(u, v, 1.0, 0.0, 0.0, 0.0), ()

    def land(c: Any, t: Any) -> Any:
        return travel_here(c, t.u, t.v)

    def travel(c: Any, u: Any, v: Any) -> Any:
        n = travel_here(c, u, v)
        return n, (n.delta,)

    def dip(c: Any, t: Any) -> Any:
        return dip_here(c, t.u, t.v)

    def blur(c: Any, u: Any, v: Any) -> Any:
        n = travel_here(c, u, v)
        return blur_here(c, u, v, n.x1, n.x2, n.x3)

    made = [_made(f.__name__, f"{form.name}_alone", f) for f in (travel, drive, land, dip, blur)]
    return Chained(1, _recorded_first(form), *made)


def _longer(driving: Driving, form: Form) -> Driving:
    record = _recorded(driving.record, form)
    turn_before, blur_before, turn_here, blur_here = driving.turn, driving.blur, form.turn, form.turn_blur
    assert turn_here is not None and blur_here is not None

    def turn(c: Any, kappa: Any, u: Any, v: Any) -> Any:
        m, deltas = turn_before(c[0], c[1].kappa, u, v)
        t = enter(c[1], m)
        n = turn_here(c[2], kappa, t.u, t.v)
        d1, d2, d3, d4 = through(t, n.d1, n.d2, n.d3, n.d4)
        return Turned(n.cos, n.sin, d1, d2, d3, d4, n.delta), (*deltas, n.delta)

    def blur(c: Any, kappa: Any, u: Any, v: Any) -> Any:
        m, b0, b1, b2, b3 = blur_before(c[0], c[1].kappa, u, v)
        t = enter(c[1], m)
        n = turn_here(c[2], kappa, t.u, t.v)
        e = blur_here(c[2], t.u, t.v, n.d1, n.d2, n.d3)
        b0, b1, b2, b3 = blurred_through(t, b0, b1, b2, b3, n.d1, n.d2, n.d3, n.d4, e)
        d1, d2, d3, d4 = through(t, n.d1, n.d2, n.d3, n.d4)
        return Turned(n.cos, n.sin, d1, d2, d3, d4, n.delta), b0, b1, b2, b3

    return Driving(record, _made("turn", record.name, turn), _made("blur", record.name, blur))


def _ended(driving: Driving, form: Form, stages: int) -> Chained:
    record = _recorded(driving.record, form)
    turn_before, blur_before = driving.turn, driving.blur
    travel_here, dip_here, blur_here = form.travel, form.dip, form.travel_blur

    def drive(c: Any, u: Any, v: Any) -> Any:
        m, deltas = turn_before(c[0], c[1].kappa, u, v)
        return enter(c[1], m), deltas

    def land(c: Any, t: Any) -> Any:
        n = travel_here(c[2], t.u, t.v)
        x1, x2, x3, x4 = through(t, n.x1, n.x2, n.x3, n.x4)
        y1, y2, y3, y4 = through(t, n.y1, n.y2, n.y3, n.y4)
        return Travel(n.x0, x1, x2, x3, x4, n.y0, y1, y2, y3, y4, n.delta)

    drive, land = (_made(f.__name__, f"{record.name}_ended", f) for f in (drive, land))

    def travel(c: Any, u: Any, v: Any) -> Any:
        t, deltas = drive(c, u, v)
        n = land(c, t)
        return n, (*deltas, n.delta)

    def dip(c: Any, t: Any) -> Any:
        y, d1, d2 = dip_here(c[2], t.u, t.v)
        return y, t.t1 * d1, t.t2 * d1 + t.t1 * t.t1 * d2

    def blur(c: Any, u: Any, v: Any) -> Any:
        m, b0, b1, b2, b3 = blur_before(c[0], c[1].kappa, u, v)
        t = enter(c[1], m)
        n = travel_here(c[2], t.u, t.v)
        e0, e1, e2, e3, f0, f1, f2, f3, g = blur_here(c[2], t.u, t.v, n.x1, n.x2, n.x3)
        e0, e1, e2, e3 = blurred_through(t, b0, b1, b2, b3, n.x1, n.x2, n.x3, n.x4, (e0, e1, e2, e3))
        f0, f1, f2, f3 = blurred_through(t, b0, b1, b2, b3, n.y1, n.y2, n.y3, n.y4, (f0, f1, f2, f3))
        _, slope, _ = dip_here(c[2], t.u, t.v)
        return e0, e1, e2, e3, f0, f1, f2, f3, g + abs(slope) * b0

    travel, dip, blur = (_made(f.__name__, f"{record.name}_ended", f) for f in (travel, dip, blur))
    return Chained(stages, record, travel, drive, land, dip, blur)


def _recorded_first(form: Form) -> Record:
    """Record of the first stage alone."""

    def doubts(c: Any) -> Any:
        return (c.doubt,)

    constants, load, loaded = _from_columns(form, form.name, 0, 0)
    return Record(
        form.name,
        form.columns,
        form.columns,
        form.numbers,
        constants,
        load,
        loaded,
        form.put,
        form.get,
        _made("doubts", form.name, doubts),
    )


def _recorded(before: Record, form: Form) -> Record:
    """Record of consecutive stages and of one more, coupled to the last of them."""
    end, link = before.columns + form.columns, before.wide + form.columns
    link_row, stage_row = before.numbers * STRIDE, (before.numbers + NUMBERS) * STRIDE
    constants_before, put_before, get_before, doubts_before = before.constants, before.put, before.get, before.doubts
    load_before, loaded_before, put_here, get_here = before.load, before.loaded, form.put, form.get
    name = f"{before.name}_{form.name}"
    constants_here, load_here, loaded_here = _from_columns(form, f"last_{name}", before.columns, before.wide)

    def constants(designs: Any, i: int) -> Any:
        return constants_before(designs, i), link_of(designs[i, end], designs[i, end + 1]), constants_here(designs, i)

    def load(designs: Any, i: int, block: Any, k: int) -> None:
        load_before(designs, i, block, k)
        load_here(designs, i, block, k)
        block[link * BLOCK + k], block[(link + 1) * BLOCK + k] = designs[i, end], designs[i, end + 1]

    def loaded(block: Any, k: int) -> Any:
        coupling = link_of(block[link * BLOCK + k], block[(link + 1) * BLOCK + k])
        return loaded_before(block, k), coupling, loaded_here(block, k)

    def put(at: Any, place: int, c: Any) -> None:
        put_before(at, place, c[0])
        put_link(at, place + link_row, c[1])
        put_here(at, place + stage_row, c[2])

    def get(at: Any, place: int) -> Any:
        return get_before(at, place), get_link(at, place + link_row), get_here(at, place + stage_row)

    def doubts(c: Any) -> Any:
        return (*doubts_before(c[0]), c[2].doubt + 0.0 * c[1].kappa)

    made = [_made(f.__name__, name, f) for f in (constants, load, loaded, put, get, doubts)]
    return Record(name, end + COUPLING, link + COUPLING, before.numbers + NUMBERS + form.numbers, *made)


def _from_columns(form: Form, name: str, start: int, row: int) -> tuple[Helper, ...]:
    """Make ``constants``, ``load`` and ``loaded`` of one stage, as a `Record` has them.

    The stage's columns begin at column ``start`` of the designs, and at row ``row`` of a block.
    """
    constants_here, columns = form.constants, form.columns
    angle = None if form.angle is None else start + form.angle
    angle_row = row + (form.angle or 0)

    def nothing(at: Any, i: int) -> tuple[float, float]:
        return 1.0, 0.0

    def library(designs: Any, i: int) -> tuple[float, float]:
        return np.cos(designs[i, angle]), np.sin(designs[i, angle])

    def vectorised(block: Any, k: int) -> tuple[float, float]:
        sine, cosine = rounded_sincos(block[angle_row * BLOCK + k])
        return cosine, sine

    called = _made("library", name, nothing if angle is None else library)
    computed = _made("turned", name, nothing if angle is None else vectorised)

    def constants(designs: Any, i: int) -> Any:
        cos, sin = called(designs, i)
        return constants_here(designs[i], start, 1, cos, sin)

    def load(designs: Any, i: int, block: Any, k: int) -> None:
        for column in range(columns):
            block[(row + column) * BLOCK + k] = designs[i, start + column]

    def loaded(block: Any, k: int) -> Any:
        cos, sin = computed(block, k)
        return constants_here(block, row * BLOCK + k, BLOCK, cos, sin)

    return tuple(_made(f.__name__, name, f) for f in (constants, load, loaded))


def _made(what: str, chain: str, function: Helper) -> Helper:
    return generated_inline(f"{what}_{chain}", function)
