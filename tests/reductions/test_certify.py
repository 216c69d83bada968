"""Proof of the maxima where it is asked for: API, study file, dataset, command line; refused where there is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner

import sweep
from kernels import status as st
from sweep.cli import main
from sweep.engine.estimate import other_accuracies
from sweep.errors import InputError, StudyError
from sweep.evaluation.summaries import routes
from sweep.families import rssr as entry
from sweep.families.base import Accuracy
from sweep.study.load import load_study, with_accuracy
from tests.support.rssr_designs import random_designs

COLUMNS = ("a", "b", "c", "e", "f", "g", "alpha", "branch")
PROVABLE = "max_abs_dpsi, max_abs_d2psi, max_abs_d3psi"
WANTED = ["max_abs_dpsi", "max_abs_d2psi", "phi_max_abs_d2psi", "max_abs_d3psi", "swing", "margin"]

# Twin peaks closer than the samples, of which a search by height alone takes the lower: found by proving designs.
TWINS = {
    3: [
        [0.4269867973111896, 3.124678962703731, 1.241868905121866, 2.464459657513995, 1.4233146418966562,
         1.6804687377796221, 1.8195888943385803, -1.0],
    ],
    2: [
        [0.5790086397905193, 3.846129461632258, 3.845174843371806, -0.4729861901017536, 0.40892668220155404,
         -0.6087279548247926, 1.5635158001989042, 1.0],
        [0.997724343238998, 3.880836265223359, 2.871175934100445, -0.6197125739809382, -1.7491869558411017,
         1.0537598068386234, 1.447507179463632, -1.0],
    ],
}  # fmt: skip

STUDY = """
[study]
name = "proof"
[mechanism]
family = "rssr"
[scene]
want = ["swing", "max_abs_d2psi"]
[design]
a = { from = 10, to = 60, count = 16, unit = "mm" }
b = { from = 50, to = 150, count = 16, unit = "mm" }
alpha = { from = 0, to = 90, count = 4, unit = "deg" }
c = "60 mm"
e = "100 mm"
f = "5 mm"
g = "10 mm"
[limits]
max_pressure_angle = { max = 50, unit = "deg" }
[accuracy]
target = 1e-8
certify = true
"""


def table(designs):
    return dict(zip(COLUMNS, np.asarray(designs, float).T, strict=True))


def write(folder: Path, text: str) -> Path:
    (folder / "study.toml").write_text(text)
    return folder / "study.toml"


def test_proven_maxima_are_the_searched_ones_with_bounds():
    designs = table(random_designs(40, 61, rotatable=True))
    proven = sweep.summarise("rssr", designs, WANTED, accuracy=1e-8, certify=True)
    searched = sweep.summarise("rssr", designs, WANTED, accuracy=1e-8)
    assert list(proven.columns) == list(searched.columns)
    assert (proven["status"] == st.OK).all()
    for name in WANTED:
        np.testing.assert_allclose(proven[name], searched[name], rtol=1e-8)
    for name in ("max_abs_dpsi", "max_abs_d2psi", "max_abs_d3psi"):
        assert (proven[f"err_{name}"] > 0.0).all()
        assert (proven[f"err_{name}"] <= 1e-8 * proven[name]).all()
    # What is exact anyway is computed as before.
    for name in ("swing", "margin", "err_margin"):
        assert (proven[name] == searched[name]).all()


@pytest.mark.parametrize("certify", [False, True])
@pytest.mark.parametrize("order", TWINS)
def test_higher_one_of_twin_peaks_is_found(order, certify):
    name = {2: "d2psi", 3: "d3psi"}[order]
    designs = table(TWINS[order])
    found = sweep.summarise("rssr", designs, [f"max_abs_{name}", f"phi_max_abs_{name}"], certify=certify)
    phi = np.arange(65536) * (2.0 * np.pi / 65536)
    poses = sweep.evaluate("rssr", designs, [name], phi)
    sampled = poses[name].abs().groupby(poses["design"]).max().to_numpy()
    np.testing.assert_allclose(found[f"max_abs_{name}"], sampled, rtol=1e-8)
    at = poses[name].abs().groupby(poses["design"]).idxmax()
    place = found[f"phi_max_abs_{name}"] - poses["phi"][at].to_numpy()
    assert (place.abs() < found[f"err_phi_max_abs_{name}"] + 2.0 * np.pi / 65536).all()


def test_unproven_maximum_keeps_its_value_and_says_so(monkeypatch):
    monkeypatch.setattr(entry, "MOST_CELLS", 3)
    designs = table(random_designs(5, 67, rotatable=True))
    found = sweep.summarise("rssr", designs, ["max_abs_d2psi", "swing"], certify=True)
    assert (found["status"] == st.NOT_CONVERGED).all()
    assert found["max_abs_d2psi"].notna().all()
    assert found["err_max_abs_d2psi"].isna().all()
    assert found["swing"].notna().all()


def test_crank_that_does_not_turn_is_not_proven():
    designs = table(random_designs(30, 71))
    found = sweep.summarise("rssr", designs, ["rotatable", "max_abs_d2psi"], certify=True)
    turns = found["rotatable"].to_numpy(bool)
    assert 0 < turns.sum() < 30
    assert (found["max_abs_d2psi"].notna() == turns).all()
    assert (found["status"][~turns] != st.OK).all()


@pytest.mark.parametrize(
    ("family", "want", "message"),
    [
        ("rssr", ["max_abs_psi", "max_abs_d2psi"], f"of rssr: {PROVABLE}; not of max_abs_psi"),
        ("rssr", ["margin"], f"of rssr: {PROVABLE}; none of them is wanted"),
        ("geared_dwell", ["max_abs_d2psi"], "of geared_dwell: none; none of them is wanted"),
        ("rssp", ["max_abs_d2s"], "of rssp: none; not of max_abs_d2s"),
        ("rssr", ["max_abs_d2psy"], "did you mean 'max_abs_d2psi'?"),
    ],
)  # fmt: skip
def test_what_has_no_proof_is_refused(family, want, message):
    with pytest.raises(InputError) as caught:
        sweep.summarise(family, {}, want, certify=True)
    assert message in str(caught.value)


def test_first_stage_of_a_chain_is_proven():
    designs = random_designs(10, 73, rotatable=True)
    numbered = {f"{name}1": x for name, x in table(designs).items()}
    numbered |= {f"{name}2": x for name, x in table(designs).items()}
    chain = sweep.summarise(["rssr", "rssr"], numbered, ["max_abs_d2psi1"], certify=True)
    alone = sweep.summarise("rssr", table(designs), ["max_abs_d2psi"], certify=True)
    np.testing.assert_array_equal(chain.to_numpy(), alone.to_numpy())


def test_a_grid_proves_nothing(tmp_path):
    with pytest.raises(InputError, match="a grid proves nothing"):
        sweep.summarise("rssr", {}, ["max_abs_d2psi"], samples=90, certify=True)
    with pytest.raises(StudyError, match=r"accuracy.certify = true; allowed: false where samples is given"):
        load_study(write(tmp_path, STUDY.replace("target = 1e-8", "samples = 90")))


def test_study_that_asks_for_what_has_no_proof_is_refused(tmp_path):
    text = STUDY.replace('"max_abs_d2psi"', '"max_abs_psi", "max_abs_d2psi"')
    with pytest.raises(StudyError, match=r"accuracy.certify = true; allowed: .*max_abs_d3psi; not of max_abs_psi"):
        load_study(write(tmp_path, text))
    with pytest.raises(StudyError, match=r"accuracy.certify = 1; allowed: true or false"):
        load_study(write(tmp_path, STUDY.replace("certify = true", "certify = 1")))


def test_proof_of_some_maxima_only(tmp_path):
    designs = table(TWINS[2])
    wanted = ["max_abs_dpsi", "max_abs_d2psi", "max_abs_psi"]
    proven = sweep.summarise("rssr", designs, wanted, certify=["max_abs_d2psi"])
    searched = sweep.summarise("rssr", designs, wanted)
    assert (proven["err_max_abs_d2psi"] != searched["err_max_abs_d2psi"]).all()
    for name in ("max_abs_dpsi", "max_abs_psi", "err_max_abs_dpsi"):
        assert (proven[name] == searched[name]).all()
    for names in (["max_abs_psi"], ["max_abs_d3psi"], ["max_abs_d2psy"]):
        with pytest.raises(InputError, match=f"certify = '{names[0]}'; allowed: .* as far as they are wanted"):
            sweep.summarise("rssr", designs, wanted, certify=names)
    with pytest.raises(InputError, match="certify = 1; allowed: True, False, or names of maxima"):
        sweep.summarise("rssr", designs, wanted, certify=1)
    text = STUDY.replace('"max_abs_d2psi"', '"max_abs_psi", "max_abs_d2psi"')
    study = load_study(write(tmp_path, text.replace("certify = true", 'certify = ["max_abs_d2psi"]')))
    assert study.accuracy == Accuracy(target=1e-8, certify=True, proven=("max_abs_d2psi",))
    assert study.data["accuracy"] == {"target": 1e-8, "certify": ["max_abs_d2psi"]}
    assert with_accuracy(study, 1e-6).accuracy.proven == ("max_abs_d2psi",)
    assert dict(other_accuracies(study, 1))["without the proof"] > 0.0
    assert "with the proof that no peak is missed" in dict(other_accuracies(with_accuracy(study, certify=False), 1))
    with pytest.raises(StudyError, match=r"accuracy.certify = 'max_abs_psi'; allowed: a proof"):
        load_study(write(tmp_path, text.replace("certify = true", 'certify = ["max_abs_psi"]')))


def test_proof_is_part_of_the_study_and_its_price_is_named(tmp_path):
    proven = load_study(write(tmp_path, STUDY))
    assert proven.accuracy == Accuracy(target=1e-8, certify=True)
    without = with_accuracy(proven, certify=False)
    assert without.accuracy == Accuracy(target=1e-8)
    assert without.data["accuracy"] == {"target": 1e-8}
    assert without.fingerprint != proven.fingerprint
    assert with_accuracy(without, certify=True).fingerprint == proven.fingerprint
    assert with_accuracy(proven, 1e-10).accuracy == Accuracy(target=1e-10, certify=True)
    assert routes(proven.family, proven.want, proven.accuracy)[-1].name == "certified maxima"
    prices = dict(other_accuracies(proven, 1)), dict(other_accuracies(without, 1))
    assert prices[0]["without the proof"] < prices[1]["with the proof that no peak is missed"]


def test_dataset_holds_proven_bounds(tmp_path):
    study = write(tmp_path, STUDY)
    proven = sweep.run(study, out=tmp_path / "proven", jobs=1)
    searched = sweep.run(with_accuracy(load_study(study), certify=False), out=tmp_path / "searched", jobs=1)
    ours, theirs = sweep.load(proven), sweep.load(searched)
    assert len(ours) > 20
    assert list(ours["design"]) == list(theirs["design"])
    np.testing.assert_allclose(ours["max_abs_d2psi"], theirs["max_abs_d2psi"], rtol=1e-8)
    words = [_definition(folder, "err_max_abs_d2psi") for folder in (proven, searched)]
    assert words == ["proven bound of the absolute error of max_abs_d2psi", "absolute error estimate of max_abs_d2psi"]
    assert "estimate" in _definition(proven, "err_swing")


def _definition(folder: Path, name: str) -> str:
    schema = pq.read_schema(next(folder.glob("part-*.parquet")))
    return schema.field(name).metadata[b"definition"].decode()


def test_command_line_proves(tmp_path):
    path = tmp_path / "designs.csv"
    pd.DataFrame(table(TWINS[2])).to_csv(path, index=False)
    lines = []
    for option in ((), ("--certify",)):
        result = CliRunner().invoke(main, ["summarise", "rssr", str(path), "--want", "max_abs_d2psi", *option])
        assert result.exit_code == 0, result.output
        lines.append([[float(value) for value in line.split(",")] for line in result.output.splitlines()[1:]])
    searched, proven = (np.array(rows) for rows in lines)
    np.testing.assert_allclose(proven[:, 0], searched[:, 0], rtol=1e-8)
    assert (proven[:, 1] != searched[:, 1]).all()  # err_max_abs_d2psi
    study = write(tmp_path, STUDY.replace("certify = true", ""))
    plan = CliRunner().invoke(main, ["check", str(study)]).output
    assert "with the proof that no peak is missed" in plan
    out = tmp_path / "data"
    assert CliRunner().invoke(main, ["run", str(study), "--certify", "--out", str(out)]).exit_code == 0
    assert _definition(out, "err_max_abs_d2psi").startswith("proven")
