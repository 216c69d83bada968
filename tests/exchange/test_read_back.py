"""What `sweep export` wrote is read back as the design, in mm, by `sweep points`; files of others are refused."""

from __future__ import annotations

import tomllib

import ezdxf
import mujoco
import pytest
import trimesh
from click.testing import CliRunner

import sweep
from sweep.cli import main
from sweep.exchange.points import read_points, reader_of
from sweep.families import family
from tests.exchange.test_export import LINKED, MM, chain_design, scaled

PRECISION = {
    "csv": 1e-11,
    "dxf": 1e-10,
    "glb": 2e-3,
}  # glb: float32 of 300 mm, less what the common perpendicular costs


@pytest.mark.parametrize("kind", PRECISION)
@pytest.mark.parametrize("name", ["rssr", "rssp", "four_bar", "guide", "slider_crank"])
def test_exports_are_read_back_as_the_design(name, kind, tmp_path):
    design, bound = scaled(name), PRECISION[kind]
    file = sweep.export(name, design, tmp_path / f"points.{kind}", phi=0.3)
    found = sweep.from_points(name, **read_points(file, reader_of(name)))
    for key, value in design.items():
        assert found.parameters[key] == pytest.approx(value, abs=bound), key
    assert found.phi == pytest.approx(0.3, abs=bound)


@pytest.mark.parametrize("kind", PRECISION)
def test_exports_in_metres_are_read_back_in_mm(kind, tmp_path):
    file = sweep.export("rssr", scaled("rssr", 0.001 * MM), tmp_path / f"points.{kind}", unit="m")
    found = sweep.from_points("rssr", **read_points(file, reader_of("rssr")))
    for key, value in scaled("rssr").items():
        assert found.parameters[key] == pytest.approx(value, abs=10.0 * PRECISION[kind]), key


@pytest.mark.parametrize("kind", PRECISION)
def test_verb_reads_one_stage_of_an_exported_chain(kind, tmp_path):
    file = sweep.export(["rssr", "guide"], chain_design(), tmp_path / f"chain.{kind}")
    for name, part in (("rssr", "stage 1"), ("guide", "stage 2")):
        done = CliRunner().invoke(main, ["points", name, str(file), "--part", part])
        assert done.exit_code == 0, done.output
        a = tomllib.loads(done.output)["design"]["a"].removesuffix(" mm")
        assert float(a) == pytest.approx(scaled(name)["a"], abs=1e-4)
    for options in ([], ["--part", "stage 3"]):
        done = CliRunner().invoke(main, ["points", "rssr", str(file), *options])
        assert done.exit_code == 2 and "one of stage 1, stage 2" in done.output


def test_files_of_other_programs_are_refused_as_points(tmp_path):
    drawing = ezdxf.new()
    drawing.modelspace().add_point((0.0, 0.0, 0.0))
    drawing.saveas(tmp_path / "other.dxf")
    (tmp_path / "text.dxf").write_text("no drawing")
    trimesh.creation.box().export(tmp_path / "other.glb")
    (tmp_path / "text.glb").write_text("no model")
    (tmp_path / "empty.csv").write_text("name,x,y,z\n")
    (tmp_path / "twice.csv").write_text("name,x,y,z\nA,0,0,0\nA,1,0,0\n")
    for name, match in (
        ("other.dxf", "named points"), ("text.dxf", "a DXF drawing"), ("other.glb", "by sweep export"),
        ("text.glb", "by sweep export"), ("empty.csv", "a row for each point"), ("twice.csv", "each name once"),
    ):  # fmt: skip
        with pytest.raises(sweep.InputError, match=match):
            read_points(tmp_path / name)


@pytest.mark.parametrize("name", LINKED)
def test_mujoco_takes_bars_of_a_mechanism_of_a_few_millimetres(name, tmp_path):
    """It refused them: the inertia of such a bar along itself is 4e-17 kg m^2, and it takes none below 1e-15."""
    model = mujoco.MjModel.from_xml_path(str(sweep.export(name, dict(family(name).example), tmp_path / "m.xml")))
    assert model.body_inertia[1:].min() >= 2e-15 and model.body_inertia[1:].max() < 1e-10
