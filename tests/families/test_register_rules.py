"""Every rule of an entry of the register: what breaks it is refused with a message that names the remedy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import sweep
from sweep.families import NAMES, family
from sweep.families.base import Event, Family, Interval, March, Output, Parameter, Step
from sweep.families.capabilities import (
    Assembly,
    Dimensions,
    JointRecords,
    Link,
    MovingPoint,
    OutputLink,
    PresserFoot,
    Skeleton,
)
from sweep.families.check import FamilyError, check_family
from sweep.families.skeletons import ORIGIN
from sweep.quantities.units import factor, internal_unit


def yoke(designs: Any, angles: Any, wanted: frozenset[str]) -> dict[str, Any]:
    a = designs[:, :1]
    values = {"s": a * angles.cos, "ds": -a * angles.sin, "d2s": -a * angles.cos}
    return {name: values[name] for name in wanted} | {"status": np.zeros((len(a), angles.cos.shape[1]), np.uint8)}


SKELETON = Skeleton(
    {"o": ORIGIN}, (Link("crank", ("o", "p")),), {"p": MovingPoint(("s",), lambda d, a, m: np.zeros(1))}
)
OUTPUTS = (
    Output("s", "length", "displacement"),
    Output("ds", "length", "ds/dphi"),
    Output("d2s", "length", "d2s/dphi2"),
)
KEPT = Family(
    name="yoke",
    title="Scotch yoke",
    parameters=(Parameter("a", "length", "crank", positive=True),),
    position="s",
    pose_outputs=OUTPUTS,
    poses=yoke,
    derivative_of={"s": "ds", "ds": "d2s"},
    capabilities=(SKELETON,),
    example={"a": 2.0},
)
RADIUS = Interval("r", "length", "radius", lambda designs: (designs[:, 0], 2.0 * designs[:, 0]))
SIGN = Parameter("side", "sign", "side of the guide", default=1.0, choices=(-1.0, 1.0))


def test_an_entry_that_keeps_the_rules_is_accepted_and_answers() -> None:
    assert check_family(KEPT) is KEPT
    # s = a cos(phi) with a = 2: the stroke is 2 a, to the accuracy asked
    assert sweep.summarise(KEPT, {"a": 2.0}, ["stroke"], accuracy=1e-10)["stroke"][0] == pytest.approx(4.0, abs=1e-9)


def test_choices_in_words_are_short() -> None:
    assert SIGN.choice == "-1 or +1"
    assert Parameter("n", "count", "teeth", choices=tuple(map(float, range(1, 65)))).choice == "a whole number, 1 to 64"
    assert Parameter("n", "count", "teeth", choices=(1.0, 2.0, 3.0, 5.0, 8.0)).choice == "1 or 2 or 3 or 5 or 8"


def outputs(**changed: Output) -> dict[str, Any]:
    return {"pose_outputs": tuple(changed.get(o.name, o) for o in OUTPUTS)}


def more(*added: Output, **fields: Any) -> dict[str, Any]:
    return {"pose_outputs": (*OUTPUTS, *added)} | fields


PSI = Output("psi", "rad", "angle", wraps=True)
BROKEN = {
    "no drawing": ({"capabilities": ()}, "no Skeleton among the capabilities: give fixed points"),
    "no links": ({"capabilities": (Skeleton({"o": ORIGIN}, ()),)}, "has no links: name each"),
    "unknown joint": (
        {"capabilities": (Skeleton({"o": ORIGIN}, (Link("crank", ("o", "q")),)),)},
        "'q' is no point: name it in points",
    ),
    "point without output": (
        {"capabilities": (replace(SKELETON, moving={"p": MovingPoint(("x",), lambda d, a, m: d)}),)},
        "point p needs 'x', which is no pose output",
    ),
    "no unit": (outputs(s=Output("s", "", "displacement")), "output s: give its unit"),
    "no definition": (outputs(s=Output("s", "length", "")), "output s: give its unit and its definition"),
    "unit nobody converts": (
        outputs(s=Output("s", "cubit", "x")),
        "nothing converts 'cubit': use 1, rad, s, N, length",
    ),
    "unit of a derivative": (
        outputs(ds=Output("ds", "1", "ds/dphi")),
        "'ds' is d s / d phi, so its unit is 'length', not '1': mend one",
    ),
    "unit of a derivative over an interval": (
        {"domain": RADIUS},
        "'ds' is d s / d r, so its unit is '1', not 'length': mend one",
    ),
    "derivatives over a march": ({"domain": March()}, "their own grid only, so leave it out"),
    "derivative that is none": ({"derivative_of": {"s": "v"}}, "derivative_of names 'v', which is no pose output: add"),
    "derivative that wraps": (
        outputs(d2s=Output("d2s", "length", "x", wraps=True)),
        "neither wraps nor jumps, so leave these marks out",
    ),
    "derivative of itself": ({"derivative_of": {"s": "ds", "ds": "s"}}, "its own derivative: name another output"),
    "forgotten derivative": (
        more(Output("x", "length", "x"), Output("dx", "length", "dx/dphi")),
        "'dx' looks like the derivative of 'x': name it in derivative_of, or rename it",
    ),
    "too few orders": ({"derivative_of": {"s": "ds"}}, "derivative_of has 1 orders of 's': name 2, for extrema"),
    "too few orders of an angle": (
        more(PSI, position="psi"),
        "derivative_of has 0 orders of 'psi': name 3, for extrema, limit positions, a next stage",
    ),
    "angle that does not wrap": (more(replace(PSI, wraps=False), position="psi"), "mark it wraps=True"),
    "length that wraps": (outputs(s=replace(OUTPUTS[0], wraps=True)), "wraps, but its unit is length: only angles do"),
    "window of an angle": (
        more(PSI, Output("dev", "length", "x", windowed=True), position="psi"),
        "a window is a part of a stroke",
    ),
    "no position": ({"position": "x"}, "position 'x' is no pose output: name the follower's coordinate"),
    "outward": ({"outward": "side"}, "'side' is no parameter with the choices -1 and +1"),
    "dear": ({"dear": {"x": ("x", 1.0)}}, "dear names 'x', which is no pose output"),
    "error column": (more(Output("err_s", "length", "x")), "stand before names of errors and negatives: rename it"),
    "event of nothing": ({"events": (Event("lift", "x", "x"),)}, "event lift is about 'x', which is no pose output"),
    "events of one name": ({"events": (Event("lift", "s", "x"),) * 2}, "two events are called 'lift': rename one"),
    "steps of one name": ({"steps": (Step("one", (), yoke),) * 2}, "two steps are called 'one': rename one"),  # type: ignore[arg-type]
    "step of a pose": ({"steps": (Step("one", OUTPUTS[:1], yoke),)}, "provides 's', which is a pose output: rename"),  # type: ignore[arg-type]
    "step size": ({"steps": (Step("size", (), yoke),)}, "as one that every family is given: rename it"),  # type: ignore[arg-type]
    "name": ({"name": "Scotch yoke"}, "use a-z, 0-9 and _, a letter first"),
    "dotted output": (more(Output("a.x", "length", "x")), "dots are for members of machines"),
    "output twice": (more(OUTPUTS[0]), "stands twice among parameters and pose outputs: rename one"),
    "column of every table": (more(Output("phi", "rad", "x")), "is a column of every table: choose another name"),
    "parameter without words": ({"parameters": (Parameter("a", "length", ""),)}, "say in words what it is"),
    "default": (
        {"parameters": (*KEPT.parameters, replace(SIGN, default=0.0))},
        "parameter side: its default 0 is none of its choices",
    ),
    "unknown unit": (
        {"parameters": (Parameter("a", "lenght", "crank"),)},  # type: ignore[arg-type]
        "parameter a: 'lenght' is no unit: use one of length, ",
    ),
    "example lacks": ({"example": {}}, "example lacks 'a': give an ordinary design"),
    "example has more": ({"example": {"a": 1.0, "b": 1.0}}, "example has 'b', which is no parameter"),
    "example of the wrong sign": ({"example": {"a": -1.0}}, "example has a = -1: give a positive number"),
    "example beside the choices": (
        {"parameters": (*KEPT.parameters, SIGN), "example": {"a": 1.0, "side": 3.0}},
        "example has side = 3: give -1 or +1",
    ),
    "assembly": (
        {"capabilities": (SKELETON, Assembly("discriminant", "pressure_angle", lambda d: d))},
        "Assembly names 'discriminant', which is no pose output: add it",
    ),
    "discriminant": (more(Output("discriminant", "1", "x")), "say what divides it"),
    "joints": (
        {"capabilities": (SKELETON, JointRecords(lambda *given: None, ("x",), "slider"))},
        "JointRecords needs 'x', which is no pose output",
    ),
    "coordinate": (
        {"points": {"b": ("x_b", None, None)}},
        "point b: 'x_b' is no pose output; None is a coordinate 0",
    ),
    "dimensions": ({"capabilities": (SKELETON, Dimensions((("c",),)))}, "Dimensions names 'c', which is no length"),
    "link that turns": (
        {"capabilities": (SKELETON, OutputLink(lambda d: d))},
        "OutputLink turns by the position, which is no angle: mark it",
    ),
    "turn only": (
        {"capabilities": (SKELETON, OutputLink(lambda d: d)), "domain": RADIUS},
        "OutputLink is about a closed turn: leave it out over another domain",
    ),
}


@pytest.mark.parametrize("rule", BROKEN)
def test_an_entry_that_breaks_a_rule_is_refused_with_the_remedy(rule: str) -> None:
    fields, message = BROKEN[rule]
    with pytest.raises(FamilyError) as caught:
        check_family(replace(KEPT, **fields))
    assert message in str(caught.value)


def test_all_faults_of_an_entry_are_said_at_once() -> None:
    broken = Family("Bad name", "", (Parameter("phi", "angle", ""),), "x", (Output("y", "", ""),), yoke)
    with pytest.raises(FamilyError, match="family Bad name: 7 faults") as caught:
        check_family(broken)
    for word in ("use a-z", "column of every table", "position 'x'", "give its unit", "say in words", "no Skeleton"):
        assert word in str(caught.value)


@pytest.mark.parametrize("name", NAMES)
def test_units_of_all_outputs_are_converted_in_studies_and_named_in_results(name: str) -> None:
    """A unit that nothing converts would read as a pure number."""
    mechanism = family(name)
    for o in (*mechanism.pose_outputs, *(o for step in mechanism.steps for o in step.provides)):
        unit = internal_unit(o.unit)
        assert factor(unit, unit) == 1.0
        assert (unit == "1") == (o.unit == "1"), o.name


def test_a_capability_that_a_family_lacks_is_named():
    with pytest.raises(TypeError, match="guide has no PresserFoot"):
        family("guide").the(PresserFoot)


def test_families_chains_and_machines_are_shown_by_their_names():
    """At the end of a cell of a notebook they printed all their parts, a machine three million letters."""
    shown = [family("rssr"), family(["rssr", "guide"]), sweep.machine({"needle": ["rssr", "guide"], "looper": "rssr"})]
    assert list(map(repr, shown)) == [
        "Family('rssr')", "Chain('rssr+guide')", "Machine('machine (needle: rssr+guide, looper: rssr)')",
    ]  # fmt: skip
