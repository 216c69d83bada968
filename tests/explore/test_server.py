"""The server of `sweep explore` from outside: what it answers, and whom it refuses."""

from __future__ import annotations

import http.client
import json
import time
import tomllib
from itertools import pairwise
from urllib.error import HTTPError
from urllib.parse import urlparse
from urllib.request import Request, urlopen

import numpy as np
import pytest
from click.testing import CliRunner
from numba.core.event import trigger_event

import sweep
from sweep.cli.main import main
from sweep.explore.hand import Hand
from sweep.explore.server import Server
from sweep.report.quantities import quantity
from sweep.study import study_from_data
from tests.explore.conftest import BARS
from tests.support.explorer import asked, explored

DESIGN = {"a": 9.5, "b": 36.25, "c": 31.0, "e": 32.0, "xi": 20.0, "eta": 5.0}
FREE = {"a": [8.0, 12.0], "b": [30.0, 40.0]}


def refused(address, what="", content=None, **headers):
    data = None if content is None else json.dumps(content).encode()
    with pytest.raises(HTTPError) as found:
        urlopen(Request(address + what, data, headers))
    return found.value.code, found.value.read().decode()


def test_what_is_compiled_before_the_address_is_told(monkeypatch):
    """A first page stood 15 seconds without a word."""

    def compiled(*_):
        for _ in range(2):
            with trigger_event("numba:compile"):
                pass
            time.sleep(2.2)  # progress is told of what takes more than two seconds

    monkeypatch.setattr(Hand, "answer", compiled)
    monkeypatch.setattr(Server, "run", lambda server: server.socket.close())
    said = CliRunner().invoke(main, ["explore", "slider_crank"])
    assert (
        said.exit_code == 0 and "compiling: 2 functions" in said.stderr and said.stdout.startswith("explore: http://")
    )


def test_numbers_are_those_of_summarise(address, study):
    found = asked(address, "answer", {"designs": [DESIGN], "names": ["in hand"]})
    true = sweep.summarise("four_bar", {n: [x] for n, x in DESIGN.items()}, list(study.want), accuracy=1e-6)
    units = {"max_abs_d2psi": "1", "max_pressure_angle": "rad", "swing": "rad"}
    shown = {row["name"]: row["values"][0] for row in found["outputs"]}
    assert shown == {name: quantity(name, unit).show(float(true[name].iloc[0])) for name, unit in units.items()}
    limits = {row["name"]: (row["states"][0], row["slack"][0]) for row in found["limits"]}
    missing = np.radians(35.0) - abs(float(true["swing"].iloc[0]))
    by = quantity("swing", "rad").show(abs(missing), 3)
    assert limits["swing"] == ("missed" if missing > 0 else "met", by)


def test_pins_come_along_and_a_mechanism_that_does_not_turn_has_no_invented_values(address):
    found = asked(address, "answer", {"designs": [DESIGN, {}, DESIGN | {"a": 90.0}], "names": ["in hand", "A", "B"]})
    assert [one["name"] for one in found["motion"]["designs"]] == ["in hand", "A", "B"]
    assert found["status"][:2] == ["", ""] and "turn fully" in found["status"][2]
    assert [row["values"][2] for row in found["outputs"]] == ["–", "–", "–"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"designs": [{"z": 1.0}], "names": ["x"]}, "z"),
        ({"designs": [{"a": -1.0}], "names": ["x"]}, "positive"),
        ({"designs": [{"a": "9"}], "names": ["x"]}, "finite number"),
        ({"names": ["x"]}, "designs"),
        ([1], "JSON object"),
    ],
)
def test_bad_questions_are_told_what_is_wrong(address, content, words):
    code, text = refused(address, "answer", content)
    assert code == 422 and words in json.loads(text)["error"]


@pytest.mark.parametrize(
    ("what", "content", "words"),
    [
        ("answer", {"designs": ["x"], "names": ["x"]}, "dimensions by their names"),
        ("save", {"as": "study", "design": [1], "free": {}}, "dimensions by their names"),
        ("cells", {"pairs": [["a", 5]], "bins": 20}, "allowed: design"),
        ("cells", {"pairs": [["a", "b"]], "bins": 20, "ranges": "a"}, "dictionary"),
        ("design", {"number": float("inf")}, "infinity"),
    ],
)
def test_what_is_of_another_kind_is_no_error_of_the_server(address, what, content, words):
    code, text = refused(address, what, content)
    assert code == 422 and words in json.loads(text)["error"]


def test_a_question_of_brackets_alone_is_refused(address):
    with pytest.raises(HTTPError, match="422"):
        urlopen(Request(address + "answer", b"[" * 50_000))


def test_strangers_get_nothing(address):
    question = {"designs": [DESIGN], "names": ["x"]}
    own = urlparse(address)
    origin = f"http://{own.netloc}"
    assert asked(address, "answer", question, Origin=origin)["status"] == [""]
    for stranger in (
        "https://evil.example",
        "null",
        f"http://localhost:{own.port}",
        f"http://127.0.0.1:{own.port + 1}",
    ):
        assert refused(address, "answer", question, Origin=stranger) == (403, "not for you\n")
    assert refused(address, "", None, Origin="https://evil.example")[0] == 403
    assert refused(address, "answer", question, Host=f"rebound.example:{own.port}")[0] == 403
    guessed = f"{origin}/{'A' * 32}/"
    for there in (origin + "/", guessed, guessed + "answer", address[:-2] + "/"):
        assert refused(there, "", question)[0] == 403
    with urlopen(address) as page:
        policy = page.headers["Content-Security-Policy"]
        assert "default-src 'none'" in policy and "frame-ancestors 'none'" in policy
        assert page.headers["Referrer-Policy"] == "no-referrer" and page.headers["Cache-Control"] == "no-store"


def test_it_listens_on_this_machine_only(address):
    assert urlparse(address).hostname == "127.0.0.1"


def improved(address, **content):
    request = Request(address + "improve", json.dumps({"design": DESIGN, "free": FREE} | content).encode())
    with urlopen(request, timeout=120) as reply:
        return [json.loads(line) for line in reply]


def test_improves_within_the_sliders_and_tells_how_far_it_is(address):
    *progress, last = improved(address)
    assert progress and {"looks", "seconds"} <= progress[0].keys()
    assert last["feasible"] and last["ended"] == "converged"
    for name, (low, high) in FREE.items():
        assert low <= last["design"][name] <= high
    assert all(last["design"][name] == DESIGN[name] for name in ("c", "e", "xi", "eta"))
    before, after = (
        float(sweep.summarise("four_bar", {n: [d[n]] for n in DESIGN}, ["max_abs_d2psi"], accuracy=1e-6).iloc[0, 0])
        for d in (DESIGN | {"a": 12.0}, last["design"])
    )
    assert after < before
    best = sweep.mechanism("four_bar", **{n: last["design"][n] for n in DESIGN}).outputs("swing")["swing"]
    assert abs(best) >= np.radians(35.0) * (1.0 - 1e-6)  # as near as a limit is called active


def test_a_search_that_finds_no_feasible_design_names_the_limits_that_it_misses(address):
    last = improved(address, free={"a": [8.0, 8.1]}, design=DESIGN | {"a": 8.0, "c": 50.0})[-1]
    assert not last["feasible"] and last["missed"] == ["max_pressure_angle", "swing"]
    nearest = sweep.mechanism("four_bar", **{n: last["design"][n] for n in DESIGN})
    found = nearest.outputs(["max_pressure_angle", "swing"])
    assert abs(found["swing"]) < np.radians(35.0) and found["max_pressure_angle"] > np.radians(50.0)


def test_nothing_to_vary_is_said(address):
    assert "ticked" in refused(address, "improve", {"design": DESIGN, "free": {}})[1]


def test_who_goes_away_ends_his_own_search_alone(address):
    own = urlparse(address)
    connection = http.client.HTTPConnection(own.hostname, own.port)
    connection.request("POST", own.path + "improve", json.dumps({"design": DESIGN, "free": FREE}))
    connection.sock.close()
    assert improved(address)[-1]["feasible"]
    assert asked(address, "answer", {"designs": [DESIGN], "names": ["x"]})["status"] == [""]


def test_cells_hold_every_feasible_design_and_give_their_best(address, folder, study):
    rows = sweep.load(folder)
    rows = rows[rows["status"] == 0]
    question = {"pairs": [["a", "swing"], ["swing", "b"]], "bins": 20}
    found = asked(address, "cells", question)
    for pair in found["pairs"]:
        assert found["of"] == found["kept"] == len(rows) == sum(cell[2] for cell in pair)
    best = int(rows.loc[rows["max_abs_d2psi"].idxmin(), "design"])
    assert all(best in [cell[3] for cell in pair] for pair in found["pairs"])
    # A range of one column, in the unit shown, holds for all pairs.
    low, high = rows["a"].quantile([0.2, 0.6])
    within = rows[rows["a"].between(low, high)]
    some = asked(address, "cells", question | {"ranges": {"a": [low, high]}})
    assert some["kept"] == len(within) < len(rows) and some["of"] == len(rows)
    firsts = {cell[3] for pair in some["pairs"] for cell in pair}
    assert firsts <= set(within["design"]) and int(within.loc[within["max_abs_d2psi"].idxmin(), "design"]) in firsts
    design = asked(address, "design", {"number": best})["design"]
    assert design["a"] == rows.loc[rows["design"] == best, "a"].item()
    assert "allowed: design" in refused(address, "cells", {"pairs": [["nothing", "a"]], "bins": 20})[1]
    assert refused(address, "design", {"number": 10**9})[0] == 422


@pytest.mark.slow
def test_a_million_rows_are_sent_as_cells_that_hold_all_of_them(tmp_path):
    sizes = {"a": {"from": 8.0, "to": 11.0, "count": 1000, "unit": "mm"},
             "b": {"from": 36.0, "to": 40.0, "count": 1000, "unit": "mm"}}  # fmt: skip
    data = {key: BARS[key] for key in ("study", "mechanism", "scene", "objective")}
    study = study_from_data(data | {"design": BARS["design"] | sizes}, "study.toml")
    with explored(sweep.run(study, out=tmp_path / "designs", jobs=1)) as million:
        names = ["a", "b", "max_abs_d2psi", "swing"]
        question = {"pairs": list(pairwise(names)), "bins": 48}
        found = asked(million, "cells", question)
        assert found["kept"] == found["of"] == 1_000_000
        assert [sum(cell[2] for cell in pair) for pair in found["pairs"]] == [1_000_000] * 3
        assert len(json.dumps(found)) < 300_000  # bytes, of 3 x 48^2 cells; the rows would be 40 MB
        some = asked(million, "cells", question | {"ranges": {"a": [9.0, 9.5]}})
        firsts = {cell[3] for pair in some["pairs"] for cell in pair}
        rows = sweep.load(tmp_path / "designs")
        rows = rows[rows["a"].between(9.0, 9.5)]
        assert some["kept"] == len(rows) and firsts <= set(rows["design"])
        assert int(rows.loc[rows["max_abs_d2psi"].idxmin(), "design"]) in firsts


def test_saved_study_reads_back_around_the_design(address):
    text = asked(address, "save", {"as": "study", "design": DESIGN, "free": FREE})["text"]
    study = study_from_data(tomllib.loads(text), "study.toml")
    assert {axis.name: (axis.low, axis.high) for axis in study.space.axes} == {n: tuple(e) for n, e in FREE.items()}
    assert study.space.fixed["c"] == DESIGN["c"] and study.reference["b"] == DESIGN["b"]
    assert [limit.output for limit in study.limits] == ["max_pressure_angle", "swing"]
    reference = tomllib.loads(asked(address, "save", {"as": "reference", "design": DESIGN})["text"])
    assert reference["reference"]["design"]["a"] == "9.5 mm"


def test_file_of_the_design(address):
    request = Request(address + "export", json.dumps({"design": DESIGN, "format": "csv"}).encode())
    with urlopen(request) as reply:
        lines = reply.read().decode().splitlines()
    assert lines[0].startswith("member,") or "x" in lines[0]
    assert "formats" not in refused(address, "export", {"design": DESIGN, "format": "step"})[1]


def test_dragged_joint_comes_where_it_is_drawn_and_the_others_stay(address):
    names = list(DESIGN)
    before = sweep.joints("four_bar", DESIGN, 0.7).set_index("joint")[["x", "y"]]
    to = before.loc["c"].to_numpy() + np.array([0.8, -0.5])
    question = {"design": DESIGN, "phi": 0.7, "part": "", "joint": "C", "to": to.tolist()}
    found = asked(address, "drag", question)
    after = sweep.joints("four_bar", {n: found["design"].get(n, DESIGN[n]) for n in names}, found["phi"])
    after = after.set_index("joint")[["x", "y"]]
    np.testing.assert_allclose(after.loc["c"], to, atol=0.01)  # mm: little changes are asked for besides
    np.testing.assert_allclose(after.loc[["a", "b", "d"]], before.loc[["a", "b", "d"]], atol=0.05)
    assert found["design"]["b"] != DESIGN["b"] and found["design"]["c"] != DESIGN["c"]
    assert "A, " in refused(address, "drag", question | {"joint": "Z"})[1]
