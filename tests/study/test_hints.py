"""Which name is meant by a word that is none: the hint in messages."""

from __future__ import annotations

import errno
from pathlib import Path

import pandas as pd
import pytest

import sweep
from sweep.cli.tables import write_table
from sweep.errors import StoreError, StudyError, closest, nearest
from sweep.families import NAMES
from sweep.quantities.units import SYMBOLS, UnitFault, factor
from sweep.study import load_study

OUTPUTS = [
    "psi", "eps_y", "dpsi", "d2psi", "swing", "margin", "max_abs_d2psi", "max_crank_acceleration", "max_pressure_angle",
]  # fmt: skip
PARAMETERS = ["a", "b", "c", "e", "f", "g", "alpha", "branch"]


@pytest.mark.parametrize(
    ("word", "known", "meant"),
    [
        ("psy", OUTPUTS, "psi"),
        ("crank", PARAMETERS, "a"),
        ("coupler", PARAMETERS, "b"),
        ("max_acceleration", OUTPUTS, "max_abs_d2psi"),
        ("transmission angle", OUTPUTS, "max_pressure_angle"),
        ("max_abs_dspi", OUTPUTS, "max_abs_d2psi"),
        ("arcmin", SYMBOLS, "deg"),
        ("inches", SYMBOLS, "in"),
        ("thread", ["threading", "loky"], "threading"),
        ("rmp", SYMBOLS, "rpm"),
        ("E1", ["e1", "f1", "g1"], "e1"),
        ("RSRR", NAMES, "rssr"),
        ("alhpa", PARAMETERS, "alpha"),
        ("crosshead", ["branch"], None),
        ("zzz", OUTPUTS, None),
        ("box", ["size", "box_x", "box_y"], "box_x"),
        ("crank_rocker", NAMES, "rssr"),
        ("Spatial crank-rocker", NAMES, "rssr"),
        ("", OUTPUTS, None),
    ],
)
def test_hint_is_what_is_meant_or_nothing(word: str, known: list[str], meant: str | None) -> None:
    assert closest(word, known) == meant


def test_hint_names_every_stage_and_the_one_member_that_has_a_word() -> None:
    assert nearest("a", ["a1", "b1", "a2", "b2"]) == ", did you mean a1, a2?"
    assert nearest("g", ["needle.a", "looper.g"]) == ", did you mean looper.g?"


def test_a_function_in_other_spelling_leads_to_ours() -> None:
    with pytest.raises(AttributeError, match="no attribute 'summarize', did you mean 'summarise'"):
        sweep.summarize  # noqa: B018


@pytest.mark.parametrize(
    ("unit", "internal", "hint"),
    [
        ("ft", "mm", "m or inch"),
        ("mmm", "mm", "did you mean 'mm'?"),
        ("KG", "t", "did you mean 'kg'?"),
        ("N-mm", "N*mm", "did you mean 'N*mm'?"),
        ("mm/ss", "mm/s^2", "did you mean 'mm/s^2'?"),
        ("rmp", "rad/s", "did you mean 'rpm'?"),
    ],
)
def test_hint_about_a_unit_is_one_that_may_stand_there(unit: str, internal: str, hint: str) -> None:
    with pytest.raises(UnitFault) as fault:
        factor(unit, internal)
    assert str(fault.value).endswith(hint)


CRANK_ROCKER = """[study]
name = "hints"
[mechanism]
family = "rssr"
[scene]
want = ["kinetostatics"]
[design]
a = "10 mm"
b = "36 mm"
c = "26 mm"
e = "40 mm"
f = "6 mm"
g = "-4 mm"
alpha = "40 deg"
[bodies]
m_coupler = "20 g"
"""


@pytest.mark.parametrize(
    ("before", "behind", "said"),
    [
        ('"40 deg"', '"40 rad"', 'design.alpha = 40.0; allowed: an angle within one turn if the unit is rad; 40 with'),
        ('"40 deg"', '{ value = -40, unit = "rad" }', "design.alpha = -40.0; allowed: an angle within one turn"),
        ('"40 deg"', '{ values = [1, 7], unit = "rad" }', "design.alpha.values[1] = 7.0; allowed: an angle within"),
        ('"40 deg"', '{ from = 0, to = 90, count = 2, unit = "rad" }', "design.alpha.to = 90.0; allowed: an angle"),
        ("[bodies]", '[limits]\nmax_pressure_angle = "<= 45 rad"\n[bodies]',
         "limits.max_pressure_angle = 45.0; allowed: an angle within one turn if the unit is rad; 45 with"),
        ("[bodies]", '[limits]\nmax_pressure_angle = { max = 45, unit = "rad" }\n[bodies]',
         "limits.max_pressure_angle.max = 45.0; allowed: an angle within one turn if the unit is rad; 45 with"),
        # Both what was written and what is still missing are named.
        ("m_coupler", "m_arm", "m_arm: unknown input of the effects of rssr; allowed: m_coupler, m_crank, m_rocker"),
        ("m_coupler", "m_arm", 'm_coupler is missing; needed: mass of the coupler; for kinetostatics: a mass with its'
                               ' unit, as "40.0 g"'),
        ("m_coupler", "inertia_rocker", "allowed: j_rocker_xx, j_rocker_xy, j_rocker_xz, j_rocker_yy, j_"),
        ("m_coupler", "mass_coupler", "effects of rssr; allowed: m_coupler, did you mean 'm_coupler'?"),
        ("m_coupler", "friction_a", "unknown input of the effects of rssr; allowed: mu_a"),
        ('"kinetostatics"', '"stroke"', "; stroke is an output of rssp, guide, swivel, slider_crank, "),
        ('"kinetostatics"', '"psi"', "ask `evaluate`, or for one of max_abs_psi, max_psi, min_psi, range_psi, rms_psi"),
    ],
)  # fmt: skip
def test_a_message_leads_to_what_is_meant(before: str, behind: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(CRANK_ROCKER.replace(before, behind), encoding="utf-8")
    with pytest.raises(StudyError) as fault:
        load_study(tmp_path)
    assert said in str(fault.value)


@pytest.mark.parametrize("chain", [["rssr", "guidee"], ["rsr"], ["rssr", "four_barr", "guide"]])
def test_a_misspelt_family_whose_closest_match_does_not_fit_is_one_fault(chain: list[str], tmp_path: Path) -> None:
    """The match has other parameters than the tables: each of them was told as a fault, and none was one."""
    text = CRANK_ROCKER.replace('family = "rssr"', f"chain = {chain}") + 'm_slide = "20 g"\n[objectiv]\n'
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    with pytest.raises(StudyError) as caught:
        load_study(tmp_path)
    (index,) = (k for k, name in enumerate(chain) if name not in NAMES)
    told = [fault.split()[1] for fault in caught.value.faults]
    assert told == ["objectiv:", f"mechanism.chain[{index}]"]


def test_the_name_of_an_effect_leads_to_the_one_of_the_family(tmp_path: Path) -> None:
    text = CRANK_ROCKER.replace('"rssr"', '"rssp"').replace('"kinetostatics"', '"friction"')
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    with pytest.raises(StudyError, match="; friction is the effect slider_friction here\n"):
        load_study(tmp_path)


def test_a_disk_that_can_only_be_read_is_an_error_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Such a disk refuses to delete the file that it has refused to make, too."""

    def refuse(*given: object, **more: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(pd.DataFrame, "to_csv", refuse)
    monkeypatch.setattr(Path, "unlink", refuse)
    with pytest.raises(StoreError, match="Read-only file system"):
        write_table(pd.DataFrame({"a": [1.0]}), tmp_path / "out.csv")
