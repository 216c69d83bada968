"""Exports, each read back by a program not written here: trimesh and pygltflib, ezdxf, MuJoCo, pandas."""

from __future__ import annotations

import math

import ezdxf
import mujoco
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pygltflib
import pytest
import trimesh

import sweep
from sweep.evaluation.joints import parts
from sweep.exchange.scene import over, shown_name, turn
from sweep.families import NAMES, family
from sweep.families.base import Interval, March
from tests.support.selection import mostly_long

LINKED = ("rssr", "rssp", "guide", "four_bar", "slider_crank", "kim_dison")  # crank, coupler, rocker or slider
MM = 20.0  # the examples as linkages of a machine: their lengths in units of 20 mm


def scaled(name, factor=MM):
    units = {p.name: p.unit for p in family(name).parameters}
    if {"1/length", "force", "mass"} & set(units.values()):
        factor = 1.0  # more than lengths would have to change
    return {k: v * factor if units[k] == "length" else v for k, v in family(name).example.items()}


def chain_design():
    design = {f"{k}1": v for k, v in scaled("rssr").items()} | {f"{k}2": v for k, v in scaled("guide").items()}
    return design | {"kappa2": -1.0, "offset2": 0.7}


def values_of(model, accessor):
    """Numbers of an accessor, by the buffer views of the file alone."""
    entry = model.accessors[accessor]
    view = model.bufferViews[entry.bufferView]
    width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[entry.type]
    data = model.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
    return np.frombuffer(data, np.float32).reshape(entry.count, width)


@pytest.mark.parametrize("name", mostly_long(NAMES, NAMES[::3]))
def test_animated_model_of_every_family_carries_its_joints(name, tmp_path):
    file = sweep.export(name, scaled(name), tmp_path / "model.glb", poses=36, speed=4.0 * math.pi)
    model = pygltflib.GLTF2().load(file)
    assert model.asset.version == "2.0"
    (part,) = over(name, scaled(name), 0.0, 36)
    nodes = {node.name: k for k, node in enumerate(model.nodes)}
    turn = model.animations[0]
    tracks = {(c.target.node, c.target.path): turn.samplers[c.sampler] for c in turn.channels}
    for joint, path in part.joints.items():
        node = nodes[joint.upper() if len(joint) < 3 else joint]
        np.testing.assert_allclose(model.nodes[node].translation, path[0], atol=1e-4)
        if joint not in part.kinds:
            sampler = tracks[node, "translation"]
            # float32 carries coordinates of 300 mm to 2e-5
            np.testing.assert_allclose(values_of(model, sampler.output), path, atol=5e-5)
            times = values_of(model, sampler.input)[:, 0]
            np.testing.assert_allclose(times, np.linspace(0.0, 0.5, 37), atol=1e-7)
    # of no length, or a body about one fixed axis
    bare = {("slotted", "arm"), ("heddle", "link"), ("cam", "cam"), ("cam_lever", "cam")}
    long = [link for link in part.links if (name, link.name) not in bare]
    assert {link.name for link in long} <= set(nodes)
    scene = trimesh.load(file)
    size = np.ptp(np.vstack(list(part.joints.values())), axis=0).max() / 1000.0
    assert 0.2 * size < scene.scale < 5.0 * size  # metres
    assert all(np.isfinite(mesh.vertices).all() for mesh in scene.geometry.values())


def test_bars_of_the_model_run_from_joint_to_joint(tmp_path):
    design = scaled("rssr")
    model = pygltflib.GLTF2().load(sweep.export("rssr", design, tmp_path / "m.glb", poses=90))
    (part,) = parts("rssr", design, np.linspace(0.0, 2.0 * math.pi, 91))
    node = next(k for k, n in enumerate(model.nodes) if n.name == "coupler B-C")
    tracks = {c.target.path: model.animations[0].samplers[c.sampler].output
              for c in model.animations[0].channels if c.target.node == node}  # fmt: skip
    turn, start = values_of(model, tracks["rotation"]).astype(float), values_of(model, tracks["translation"])
    np.testing.assert_allclose(np.linalg.norm(turn, axis=1), 1.0, atol=1e-6)
    assert (np.einsum("ij,ij->i", turn[1:], turn[:-1]) > 0.9).all()  # neighbours on one side: viewers interpolate
    x, y, z, w = turn.T
    along = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)  # z, turned
    end = start + along * model.nodes[node].scale[2]
    np.testing.assert_allclose(end, part.joints["c"], atol=1e-4)


def test_stages_of_a_chain_stand_in_one_frame(tmp_path):
    design = chain_design() | {"shift2": 7.5, "turn2": 0.3}
    model = pygltflib.GLTF2().load(sweep.export(["rssr", "guide"], design, tmp_path / "chain.glb"))
    shifts = {node.name: node.translation for node in model.nodes if node.name.startswith("stage")}
    assert shifts["stage 1"] == shifts["stage 2"] == [0.0, 0.0, 0.0]
    found = parts(["rssr", "guide"], design, 0.0)
    nodes = {(k, node.name): node for k, node in enumerate(model.nodes)}
    pivots = [node.translation for (_, name), node in nodes.items() if name == "A"]
    np.testing.assert_allclose(pivots, [part.joints["a"][0] for part in found], atol=1e-5)
    np.testing.assert_allclose(found[1].joints["a"][0], [design["e1"], 0.0, 7.5], atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_drawing_of_every_family_passes_the_audit_and_has_its_joints(name, tmp_path):
    design, phi = scaled(name), 0.0 if isinstance(family(name).domain, March) else 0.4
    document = ezdxf.readfile(sweep.export(name, design, tmp_path / "drawing.dxf", phi=phi))
    audit = document.audit()
    assert not audit.errors and not audit.fixes
    assert document.header["$INSUNITS"] == 4
    points = np.array([p.dxf.location for p in document.modelspace().query("POINT")])[:, :2]
    (part,) = over(name, design, phi, 120)
    for path in part.joints.values():  # the front view stands at its own coordinates
        assert np.linalg.norm(points - path[0, :2], axis=1).min() < 1e-12 * 1000.0
    words = {t.dxf.text for t in document.modelspace().query("TEXT")}
    assert {j.upper() if len(j) < 3 else j for j in part.joints} <= words


def test_drawing_of_a_spatial_stage_has_three_views_and_of_a_planar_one_the_front(tmp_path):
    for name, views in (("rssr", 3), ("four_bar", 1)):
        document = ezdxf.readfile(sweep.export(name, scaled(name), tmp_path / f"{name}.dxf"))
        links = document.modelspace().query('LWPOLYLINE[layer=="LINKS"]')
        assert len(links) == 3 * views


def test_views_are_seen_from_in_front_from_the_left_and_from_above_and_are_no_mirror_images(tmp_path):
    document = ezdxf.readfile(sweep.export("rssr", scaled("rssr"), tmp_path / "views.dxf", phi=0.7))
    cranks = [np.array(x.get_points("xy")) for x in document.modelspace().query('LWPOLYLINE[layer=="LINKS"]')][::3]
    at = sweep.joints("rssr", scaled("rssr"), 0.7).set_index("joint")[["x", "y", "z"]].astype(float)
    x, y, z = at.loc["b"] - at.loc["a"]
    for crank, sides in zip(cranks, ([x, y], [z, y], [x, -z]), strict=True):
        np.testing.assert_allclose(crank[1] - crank[0], sides, atol=1e-9)
    (axes,) = sweep.plot.mechanism("rssr", scaled("rssr"), view="xz")
    assert axes.yaxis_inverted() and not axes.xaxis_inverted()


def solved(model, data, phi, crank="crank"):
    """Joint positions that close MuJoCo's own loop at a crank angle, by Newton with MuJoCo's own Jacobians."""
    data.qpos[model.joint(crank).qposadr[0]] = phi
    for _ in range(30):
        mujoco.mj_forward(model, data)
        rows = data.efc_J.reshape(-1, model.nv)[: data.ne]
        gap = data.efc_pos[: data.ne].copy()
        free = [k for k in range(model.nv) if k != model.joint(crank).dofadr[0]]
        step = np.zeros(model.nv)
        step[free] = np.linalg.lstsq(rows[:, free], -gap, rcond=None)[0]
        mujoco.mj_integratePos(model, data.qpos, step, 1.0)
        if np.abs(gap).max() < 1e-15:
            break
    mujoco.mj_forward(model, data)
    return rows


@pytest.mark.parametrize("name", LINKED)
def test_mujoco_closes_the_loop_where_we_do(name, tmp_path):
    design = scaled(name)
    file = sweep.export(name, design, tmp_path / "model.xml", phi=0.2)
    model = mujoco.MjModel.from_xml_path(str(file))
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    data = mujoco.MjData(model)
    position = family(name).position
    follower = "slider" if position == "s" and name != "guide" else "rocker"
    for phi in np.linspace(0.2, 6.4, 25):
        solved(model, data, phi)
        (part,) = parts(name, design, phi)
        assert model.nsite == len(part.joints)
        for joint, path in part.joints.items():  # points of the coupler and of the slide line, too
            np.testing.assert_allclose(1000.0 * data.site(shown_name(joint)).xpos, path[0], atol=1e-9)
        ours = part.position[0] if name != "guide" else math.atan2(*(part.joints["c"][0] - part.joints["d"][0])[[1, 0]])
        theirs = data.qpos[model.joint(follower).qposadr[0]]
        gap = 1000.0 * theirs - ours if follower == "slider" else math.remainder(theirs - ours, 2.0 * math.pi)
        assert abs(gap) < 1e-9


RODS = {"m_crank": 1e-4, "m_coupler": 2e-4, "m_rocker": 1.5e-4}  # t
EVERY = RODS | {f"rod_{body}": 1.0 for body in ("crank", "coupler", "rocker")} | {"com_crank_x": 0.0, "j_crank_zz": 0.0}
THICK = RODS | {"m_crank": 0.0, "line_mass_crank": 2e-6, "gyration_coupler": 1.5}
SHAPED = RODS | {"com_crank_y": 2.0, "com_rocker_z": -3.0, "j_rocker_xz": 0.02}
for body, inertia in (("crank", 0.03), ("coupler", 0.2), ("rocker", 0.15)):  # t mm^2
    SHAPED |= {f"com_{body}_x": 9.0, f"j_{body}_xx": 0.6 * inertia, f"j_{body}_yy": inertia, f"j_{body}_zz": inertia}


@pytest.mark.parametrize(
    ("masses", "rel"),
    [(SHAPED, 1e-13), (RODS, 1e-6), (EVERY, 1e-6), (THICK, 1e-13)],  # a study gives every column
    ids=["shaped", "rods", "rods of a study", "thick rods"],
)
def test_mujoco_has_the_reduced_inertia_of_the_masses(masses, rel, tmp_path):
    design = scaled("rssr") | {"speed": 100.0} | masses
    plain = {key: value for key, value in design.items() if key != "speed"}
    model = mujoco.MjModel.from_xml_path(str(sweep.export("rssr", plain, tmp_path / "m.xml")))
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    data = mujoco.MjData(model)
    crank = model.joint("crank").dofadr[0]
    free = [k for k in range(model.nv) if k != crank]
    phis = np.linspace(0.0, 6.2, 32)
    ours = sweep.evaluate("rssr", design, "reduced_inertia", phi=phis)["reduced_inertia"].to_numpy()
    for phi, expected in zip(phis, ours, strict=True):
        rows = solved(model, data, phi)
        rates = np.zeros(model.nv)
        rates[crank] = 1.0
        rates[free] = np.linalg.lstsq(rows[:, free], -rows[:, crank], rcond=None)[0]
        momentum = np.zeros(model.nv)
        mujoco.mj_mulM(model, data, momentum, rates)
        # t mm^2 are 1e-3 kg m^2
        assert rates @ momentum == pytest.approx(1e-3 * expected, rel=rel)


def test_mujoco_couples_the_stages_of_a_chain(tmp_path):
    design = chain_design()
    model = mujoco.MjModel.from_xml_path(str(sweep.export(["rssr", "guide"], design, tmp_path / "m.xml")))
    assert model.neq == 3
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert np.abs(data.efc_pos[: data.ne]).max() < 1e-12
    first, _ = parts(["rssr", "guide"], design, 0.0)
    psi = data.qpos[model.joint("rocker 1").qposadr[0]]
    assert psi == pytest.approx(first.position[0], abs=1e-15)
    assert data.qpos[model.joint("crank 2").qposadr[0]] == pytest.approx(0.7 - psi, abs=1e-15)


def test_mujoco_moves_the_members_of_a_machine_together(tmp_path):
    place = {"at": [1.0, 30.0, 12.0], "axis": [0.0, 1.0, 1.0], "zero": [1.0, 0.0, 0.0]}
    machine = sweep.machine(
        {
            "needle": ["rssr", "guide"],
            "looper": {"family": "rssr", "ratio": -2, "offset": 0.4, "place": place, "tip": [30.0, 2.0, 1.0]},
            "feed": {"family": "four_bar", "driver": "needle.psi1", "ratio": 1},
        }
    )
    design = {f"needle.{key}": value for key, value in chain_design().items()}
    design |= {f"{member}.{key}": value for member, name in (("looper", "rssr"), ("feed", "four_bar"))
               for key, value in scaled(name).items()}  # fmt: skip
    model = mujoco.MjModel.from_xml_path(str(sweep.export(machine, design, tmp_path / "m.xml")))
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    data = mujoco.MjData(model)
    assert model.neq == 4 + 3  # loops, and shafts of stage 2, looper and feed
    mujoco.mj_forward(model, data)
    assert np.abs(data.efc_pos[: data.ne]).max() < 1e-12
    for phi in np.linspace(0.05, 0.6, 12):  # on from pose to pose: Newton stays in its assembly
        solved(model, data, phi, "crank needle 1")
        for part in parts(machine, design, phi):
            if part.member != "needle":  # the stages of the needle stand side by side
                for joint, path in part.joints.items():
                    at = 1000.0 * data.site(f"{shown_name(joint)} {part.member}").xpos
                    np.testing.assert_allclose(at, path[0] + shift_of(part, machine, design), atol=1e-9)


def shift_of(part, machine, design):
    (one,) = (one for one in turn(machine, design, 0.0, 120) if one.member == part.member)
    return one.shift


@pytest.mark.parametrize(
    "given",
    [
        lambda design: pd.DataFrame([design]),
        lambda design: {name: np.array([value]) for name, value in design.items()},
        lambda design: {name: np.int64(value) if isinstance(value, int) else value for name, value in design.items()},
    ],
    ids=["DataFrame", "arrays", "numpy"],
)
def test_mujoco_gets_masses_of_any_table(given, tmp_path):
    design = scaled("rssr") | {"finger": 1, "m_crank": 1, "j_crank_zz": 500}
    texts = [
        sweep.export("rssr", one, tmp_path / f"{k}.xml").read_text()
        for k, one in enumerate((design, given(design), scaled("rssr")))
    ]
    assert texts[0] == texts[1] != texts[2]


def test_mujoco_is_refused_where_there_is_no_such_linkage_and_for_a_mass_without_inertia(tmp_path):
    with pytest.raises(sweep.InputError, match="crank, coupler and rocker"):
        sweep.export("slotted", scaled("slotted"), tmp_path / "m.xml")
    with pytest.raises(sweep.InputError, match="no mass without"):
        sweep.export("rssr", scaled("rssr") | {"m_crank": 1e-4, "com_crank_x": 5.0}, tmp_path / "m.xml")
    with pytest.raises(sweep.InputError, match="a positive mass"):
        sweep.export("rssr", scaled("rssr") | {"m_crank": 0.0}, tmp_path / "m.xml")
    plate = {"m_coupler": 1e-4, "j_coupler_xx": 0.1, "j_coupler_yy": 0.01, "j_coupler_zz": 0.01}
    with pytest.raises(sweep.InputError, match="none exceeds the sum of the others"):
        sweep.export("rssr", scaled("rssr") | plate, tmp_path / "m.xml")
    machine = {f"needle.{name}": x for name, x in scaled("rssp").items()}
    machine |= {f"looper.{name}": x for name, x in scaled("slotted").items()}
    with pytest.raises(sweep.InputError, match="mjcf of looper"):
        sweep.export({"needle": "rssp", "looper": "slotted"}, machine, tmp_path / "m.xml")
    assert not list(tmp_path.iterdir())


def test_law_has_units_in_its_headings_and_its_metadata(tmp_path):
    design = scaled("slider_crank")
    table = pd.read_csv(sweep.export("slider_crank", design, tmp_path / "law.csv", "law", poses=72, speed=10.0))
    assert list(table.columns[:4]) == ["phi [rad]", "t [s]", "s [mm]", "ds [mm/rad]"]
    assert {"d2s [mm/rad^2]", "d3s [mm/rad^3]", "pressure_angle [rad]"} <= set(table.columns)
    poses = sweep.evaluate("slider_crank", design, ["s", "d2s"], phi=table["phi [rad]"].to_list())
    np.testing.assert_allclose(table["s [mm]"], poses["s"], rtol=1e-15)
    np.testing.assert_allclose(table["t [s]"], table["phi [rad]"] / 10.0, rtol=1e-15)
    file = sweep.export("slider_crank", design, tmp_path / "law.parquet", "law", poses=72)
    schema = pq.read_schema(file)
    assert schema.field("s").metadata[b"unit"] == b"mm"
    assert schema.field("s").metadata[b"definition"].startswith(b"slider displacement")
    np.testing.assert_array_equal(pd.read_parquet(file)["d2s"], poses["d2s"])
    head = sweep.export("rssr", scaled("rssr"), tmp_path / "angle.csv", "law").read_text().splitlines()[0]
    assert head.startswith("phi [rad],psi [rad],dpsi [rad/rad],d2psi [rad/rad^2],d3psi [rad/rad^3],")


def test_time_of_a_march_is_from_0_wherever_a_turn_begins(tmp_path):
    design = scaled("free_cam_friction")
    options = {"poses": 48, "speed": 10.0, "phi": 0.5}
    table = pd.read_csv(sweep.export("free_cam_friction", design, tmp_path / "law.csv", "law", **options))
    np.testing.assert_allclose(table["t [s]"], table["phi [rad]"] / 10.0, rtol=1e-15)


@pytest.mark.parametrize("name", mostly_long(NAMES, NAMES[::3]))
def test_law_of_every_family_runs_over_its_whole_domain(name, tmp_path):
    design, domain = scaled(name), family(name).domain
    table = pd.read_csv(sweep.export(name, design, tmp_path / "law.csv", "law", poses=48, speed=10.0))
    assert (table["status"] == 0).all() and len(table) == 48
    steps = table[f"{domain.name} [{domain.unit.replace('length', 'mm')}]"].to_numpy()
    if isinstance(domain, Interval):
        ends = domain.ends(np.array([[design.get(p.name, p.default) for p in family(name).parameters]], float))
        assert [steps[0], steps[-1]] == pytest.approx([end[0] for end in ends])
        assert not any(column.startswith("t ") for column in table)
    else:
        np.testing.assert_allclose(steps, 2.0 * math.pi / 48 * np.arange(48), atol=1e-15)
        np.testing.assert_allclose(table["t [s]"], steps / 10.0, rtol=1e-15)
    assert sum(column.startswith(f"{family(name).position} [") for column in table) == 1


def test_bad_requests_are_refused(tmp_path):
    design = scaled("four_bar")
    for arguments, match in (
        ({"path": tmp_path / "a.step"}, "a file ending in"),
        ({"path": tmp_path / "a.glb", "format": "stl"}, "csv, glb"),
        ({"path": tmp_path / "a.txt", "format": "dxf"}, "ending in .dxf"),
        ({"path": tmp_path / "a.glb", "unit": "inch"}, "mm or m"),
        ({"path": tmp_path / "a.glb", "poses": 2}, "a whole number from 3"),
        ({"path": tmp_path / "a.glb", "poses": 12.5}, "a whole number"),
        ({"path": tmp_path / "a.glb", "poses": 100_001}, "to 100000"),
        ({"path": tmp_path / "a.glb", "phi": math.inf}, "phi = inf; allowed: a finite angle"),
        ({"path": tmp_path / "a.glb", "speed": -1.0}, "positive"),
    ):
        with pytest.raises(sweep.InputError, match=match):
            sweep.export("four_bar", design, **arguments)
    stuck = {"a": 3.0, "b": 1.0, "c": 1.0, "e": 4.5}
    with pytest.raises(sweep.InputError, match="whose crank turns fully"):
        sweep.export("four_bar", stuck, tmp_path / "a.glb")
    with pytest.raises(sweep.errors.StoreError):
        sweep.export("four_bar", design, tmp_path / "nowhere" / "a.glb")
