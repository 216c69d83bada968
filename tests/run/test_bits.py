"""The same bits whoever computes them: any number of workers, threads or processes; rows as asked for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
import pytest

import sweep.chunks.plan
from kernels import status as codes
from sweep.chunks.cascade import Batch, Cascade, Level, levels
from sweep.chunks.chunk import compute_chunk, output_columns
from sweep.chunks.parameters import leading_columns, parameter_matrix
from sweep.chunks.plan import make_plan
from sweep.dataset.files import beside, read_plan, read_runs
from sweep.dataset.store import is_complete, load
from sweep.engine.run import run
from sweep.errors import InputError
from sweep.evaluation.summaries import Route, design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.families import family
from sweep.families.base import Accuracy, Array, Columns, Family
from sweep.quantities.limits import meets
from sweep.study import Limit, Study, load_study, study_from_data
from sweep.study.study import OutputSettings
from tests.support.engine_study import CHUNK, SMALL_CHUNKS, chunk_bytes, write_study

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in SMALL_CHUNKS.items():
        monkeypatch.setattr(sweep.chunks.plan, name, value)


@pytest.fixture
def study(tmp_path: Path) -> Study:
    return load_study(write_study(tmp_path / "study"))


def test_chunks_have_same_bytes_with_one_and_two_threads_and_processes(study: Study, tmp_path: Path) -> None:
    one = run(study, tmp_path / "one", jobs=1)
    threads = run(study, tmp_path / "threads", jobs=2)
    processes = run(study, tmp_path / "processes", jobs=2, backend="loky")
    assert len(chunk_bytes(one)) == -(-study.space.count // CHUNK) > 10
    assert chunk_bytes(threads) == chunk_bytes(one)
    assert chunk_bytes(processes) == chunk_bytes(one)
    assert (beside(threads) / "_plan.json").read_bytes() == (beside(one) / "_plan.json").read_bytes()


def test_rows_equal_a_direct_computation_of_all_designs(study: Study, tmp_path: Path) -> None:
    """No cascade, no blocks, no chunks: every output of every design at once, the limits by plain numpy."""
    matrix, _ = design_matrix(study.family, study.space.columns(0, study.space.count))
    found = design_outputs(study.family, matrix, study.want, study.accuracy, study.window)
    expected = np.array(found["status"])
    good = (found["rotatable"] == 1) & (found["max_pressure_angle"] <= np.radians(50.0))
    expected[(expected == codes.OK) & ~good] = codes.LIMIT_EXCEEDED

    frame = load(run(study, tmp_path / "out"))
    assert frame["design"].tolist() == list(range(study.space.count))
    np.testing.assert_array_equal(frame[list(study.family.parameter_names)].to_numpy(), matrix)
    ok = expected == codes.OK
    np.testing.assert_array_equal(frame["status"].to_numpy() == codes.OK, ok)
    np.testing.assert_array_equal(frame["status"], expected)
    for name in study.want:
        np.testing.assert_array_equal(frame.loc[ok, name].to_numpy(), np.asarray(found[name], float)[ok], name)
    assert 0.01 < ok.mean() < 0.9, "the study must have designs on both sides of its limits"
    assert frame.loc[ok].notna().all().all()


class Recorder:
    """Stands for a family with three routes: outputs x (the design's a), y (its b), z (1); a > 50 does not turn."""

    def __init__(self) -> None:
        self.ran: dict[str, list[int]] = {}

    def routes(self, *_: object) -> tuple[Route, ...]:
        return tuple(Route(name, (name,), 1.0, lambda *_: {}) for name in "xyz")

    def design_outputs(
        self, family: object, designs: Array, wanted: tuple[str, ...], accuracy: object, window: object
    ) -> Columns:
        self.ran.setdefault(wanted[0], []).append(len(designs))
        status = np.zeros(len(designs), np.uint8)
        if wanted == ("x",):
            status[designs[:, 0] > 50.0] = codes.NOT_ROTATABLE
            status[designs[:, 0] < 15.0] = codes.NOT_OSCILLATING
        return {
            wanted[0]: {"x": designs[:, 0], "y": designs[:, 1], "z": designs[:, 2] ** 0}[wanted[0]],
            "status": status,
        }


def fed(cascade: Cascade, matrix: Array, status: np.ndarray, pieces: int) -> Batch:
    for low in range(0, len(matrix), pieces):
        part = slice(low, low + pieces)
        cascade.feed(np.arange(len(matrix))[part], matrix[part], status[part])
    return cascade.end(tuple(output_columns(cascade.study)))


@pytest.mark.parametrize("keep", ["all", "feasible"])
def test_cascade_runs_a_route_only_on_survivors(
    study: Study, monkeypatch: pytest.MonkeyPatch, keep: Literal["all", "feasible"]
) -> None:
    recorder = Recorder()
    monkeypatch.setattr("sweep.chunks.cascade.routes", recorder.routes)
    monkeypatch.setattr("sweep.chunks.cascade.design_outputs", recorder.design_outputs)
    limits = (Limit("x", 20.0, None), Limit("y", None, 100.0))
    tiny = replace(study, want=("x", "y", "z"), limits=limits, output=OutputSettings(keep))
    matrix, made = parameter_matrix(tiny, 0, tiny.space.count)
    a, b = matrix[:, 0], matrix[:, 1]
    cascade = Cascade(tiny)
    found = fed(cascade, matrix, made, len(matrix))

    after_x = (a >= 20.0) & (a <= 50.0)
    expected = np.select(
        [a > 50.0, a < 15.0, a < 20.0, b > 100.0],
        [codes.NOT_ROTATABLE, codes.NOT_OSCILLATING, codes.LIMIT_EXCEEDED, codes.LIMIT_EXCEEDED],
        codes.OK,
    )
    go_on = after_x | (a < 15.0) if keep == "all" else after_x
    last = (after_x & (b <= 100.0)) | ((a < 15.0) & (keep == "all"))
    np.testing.assert_array_equal(found.status, expected)
    ran = {name: sum(sizes) for name, sizes in recorder.ran.items()}
    assert ran == {"x": len(a), "y": int(go_on.sum()), "z": int(last.sum())}
    assert cascade.reached == list(ran.values())
    assert cascade.counts.tolist() == np.bincount(expected, minlength=256).tolist()
    # A design counts with the first limit it misses.
    assert cascade.missed == {"x": int(((a >= 15.0) & (a < 20.0)).sum()), "y": int((after_x & (b > 100.0)).sum())}
    assert 0 < last.sum() < go_on.sum() < len(a), "every route must lose some designs"
    np.testing.assert_array_equal(np.isnan(found.outputs["y"]), ~go_on)
    np.testing.assert_array_equal(np.isnan(found.outputs["z"]), ~last)


def test_survivors_wait_until_they_are_enough(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    """Twenty pieces, but each route is called with full batches and once with what is left over."""
    recorder = Recorder()
    monkeypatch.setattr("sweep.chunks.cascade.routes", recorder.routes)
    monkeypatch.setattr("sweep.chunks.cascade.design_outputs", recorder.design_outputs)
    monkeypatch.setattr(Level, "batch", 1000)
    tiny = replace(study, want=("x", "y", "z"), limits=(Limit("y", None, 80.0),), output=OutputSettings("feasible"))
    matrix, made = parameter_matrix(tiny, 0, 20_000)
    at_once = fed(Cascade(tiny), matrix, made, 20_000)
    recorder.ran.clear()
    in_pieces = fed(Cascade(tiny), matrix, made, 990)
    swings = matrix[:, 0] >= 15.0
    first, second = int(swings.sum()), int((swings & (matrix[:, 1] <= 80.0)).sum())
    assert 2000 < second < first < 20_000
    assert recorder.ran["x"] == [1000] * 20
    assert recorder.ran["y"] == [1000] * (first // 1000) + [first % 1000]
    assert recorder.ran["z"] == [1000] * (second // 1000) + [second % 1000]
    assert in_pieces.index.tolist() == list(range(20_000)), "order in = order out"
    for name in at_once.outputs:
        np.testing.assert_array_equal(in_pieces.outputs[name], at_once.outputs[name])


def test_dear_routes_get_small_batches_and_cheap_ones_no_more_than_the_caches_hold(study: Study) -> None:
    assert [Level(None, ns).batch for ns in (0.0, 40.0, 1e5, 1e9)] == [16384, 16384, 1000, 8]
    assert all(level.batch == 16384 for level in levels(study))


def test_no_nan_without_a_status(study: Study, tmp_path: Path) -> None:
    frame = load(run(study, tmp_path / "out"))
    assert (frame["status"] == codes.NOT_ROTATABLE).any() and (frame["status"] == codes.LIMIT_EXCEEDED).any()
    assert frame.loc[frame["status"] == codes.OK].notna().all().all()
    stuck = frame[frame["status"] == codes.NOT_ROTATABLE]
    assert not (stuck["rotatable"] == 1).any() and stuck["max_abs_d2psi"].isna().all()


def test_error_estimates_stand_beside_refined_results(tmp_path: Path) -> None:
    folder = run(write_study(tmp_path / "s", keep="feasible", count=2), tmp_path / "out", accuracy=1e-9)
    frame = load(folder)
    assert len(frame) and "err_rotatable" not in frame
    assert frame["err_max_abs_d2psi"].dtype == np.float32
    assert (frame["err_max_abs_d2psi"] <= 1e-9 * frame["max_abs_d2psi"] * 1.001).all()


def test_keep_feasible_drops_and_counts_the_others(tmp_path: Path) -> None:
    every = run(write_study(tmp_path / "all"), tmp_path / "out-all")
    feasible = run(write_study(tmp_path / "feasible", keep="feasible"), tmp_path / "out-feasible")
    frame = load(every)
    pd.testing.assert_frame_equal(load(feasible), frame[frame["status"] == codes.OK].reset_index(drop=True))
    codes_found, numbers = np.unique(frame["status"], return_counts=True)
    counts = dict(zip(codes_found.tolist(), numbers.tolist(), strict=True))
    names = {getattr(codes, name): number for name, number in (read_plan(feasible) or {})["counts"].items()}
    assert names == counts == {getattr(codes, k): v for k, v in (read_plan(every) or {})["counts"].items()}
    assert sum(counts.values()) == len(frame)
    missed = (read_plan(every) or {})["missed"]
    assert missed == (read_plan(feasible) or {})["missed"] == {"max_pressure_angle": counts[codes.LIMIT_EXCEEDED]}


def test_float32_is_for_results_only(tmp_path: Path) -> None:
    wide = load(run(write_study(tmp_path / "a"), tmp_path / "wide"))
    narrow = load(run(write_study(tmp_path / "b", dtype="float32"), tmp_path / "narrow"))
    pd.testing.assert_frame_equal(narrow[["a", "b", "alpha"]], wide[["a", "b", "alpha"]])
    np.testing.assert_array_equal(narrow["status"], wide["status"])
    assert narrow["max_abs_d2psi"].dtype == np.float32
    np.testing.assert_array_equal(narrow["max_abs_d2psi"], wide["max_abs_d2psi"].astype(np.float32))


def test_pandas_reads_the_folder_and_the_run_is_noted(study: Study, tmp_path: Path) -> None:
    folder = run(study, tmp_path / "out")
    pd.testing.assert_frame_equal(pd.read_parquet(folder), load(folder))
    assert is_complete(folder)
    start, end = read_runs(folder)
    assert (start["event"], end["outcome"], start["jobs"]) == ("start", "complete", 2)
    assert start["command"] == f"sweep run {study.path} --out {folder}"
    before = chunk_bytes(folder)
    run(study, folder)
    assert read_runs(folder)[-1]["text"] == "0 chunks computed"
    assert chunk_bytes(folder) == before


@pytest.mark.parametrize("accuracy", [Accuracy(samples=720), Accuracy(target=1e-8)])
def test_a_machine_has_the_bits_it_has_alone_where_all_designs_share_a_member(accuracy: Accuracy) -> None:
    """Sums over the turn: poses of the shared member are computed once, and lie in memory as those of one design."""
    machine = family({"shared": "rssr", "other": "rssr"})
    designs = np.tile(design_matrix(machine, _pair_of(machine))[0], (7, 1))
    designs[:, machine.parameter_names.index("other.b")] *= np.linspace(0.99, 1.01, 7)
    wanted = ["shared.rms_dpsi", "shared.rms_d2psi", "shared.rms_discriminant"]
    together = design_outputs(machine, designs, wanted, accuracy)
    alone = [design_outputs(machine, designs[[k]], wanted, accuracy) for k in range(7)]
    for name in wanted:
        assert np.isfinite(np.asarray(together[name], np.float64)).all()
        assert np.array_equal(together[name], [found[name][0] for found in alone])


def _pair_of(machine: Family) -> dict[str, float]:
    example = family("rssr").example
    return {f"{member}.{name}": value for member in ("shared", "other") for name, value in example.items()}


def test_chunk_in_pieces_equals_chunk_at_once(study: Study) -> None:
    whole = compute_chunk(study, 1000, 12000)
    pieces = [compute_chunk(study, 1000, 7001), compute_chunk(study, 7001, 7001), compute_chunk(study, 7001, 12000)]
    for name, column in whole.columns.items():
        np.testing.assert_array_equal(np.concatenate([piece.columns[name] for piece in pieces]), column, name)


@pytest.mark.parametrize("known_swing", [True, False])
def test_feasible_rows_have_the_bits_of_those_whose_parameters_were_all_made_at_once(
    monkeypatch: pytest.MonkeyPatch, known_swing: bool
) -> None:
    """Of a chain with a fit only survivors get all their parameters, and the fit the swing that a limit has tested."""
    needle = load_study(ROOT / "studies" / "needle208")
    every = compute_chunk(replace(needle, output=OutputSettings("all")), 5000, 45000)
    if not known_swing:
        monkeypatch.setattr("sweep.chunks.cascade.driving_outputs", lambda family: ())
    feasible = compute_chunk(needle, 5000, 45000)
    assert feasible.missed_by_limit == every.missed_by_limit
    good = every.columns["status"] == codes.OK
    assert good.sum() > 20
    for name, column in feasible.columns.items():
        assert column.tobytes() == every.columns[name][good].tobytes(), name


def test_a_bad_value_of_a_space_is_refused_before_it_is_met(study: Study) -> None:
    """Parameters made late are not looked at one by one: the ends of their axes are."""
    needle = load_study(ROOT / "studies" / "needle208", smoke=True)
    assert leading_columns(needle, 8) == 8
    assert leading_columns(needle, None) == leading_columns(study, None) + 13 == 21
    axes = tuple(replace(axis, low=-1.0) if axis.name == "b2" else axis for axis in needle.space.axes)
    bad = replace(needle, space=replace(needle.space, axes=axes))
    assert leading_columns(bad, 8) == 21
    with pytest.raises(InputError, match="b2"):
        compute_chunk(bad, 0, bad.space.count)
    signs = tuple(
        replace(axis, values=np.array([1.0, 0.5])) if axis.name == "branch2" else axis for axis in needle.space.axes
    )
    assert leading_columns(replace(needle, space=replace(needle.space, axes=signs)), 8) == 21


def test_chunk_outside_the_space_is_refused(study: Study) -> None:
    with pytest.raises(InputError, match="designs"):
        compute_chunk(study, 0, study.space.count + 1)


def test_plan_does_not_depend_on_jobs_and_knows_its_bounds(study: Study) -> None:
    plan = make_plan(study)
    ranges = [plan.bounds(k) for k in range(plan.chunks)]
    assert [r[0] for r in ranges[1:]] == [r[1] for r in ranges[:-1]]
    assert (ranges[0][0], ranges[-1][1]) == (0, study.space.count)
    assert make_plan(study) == plan


def test_chunk_size_follows_cost_and_memory(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep.chunks.plan, "CHUNK_SECONDS", 1e9)
    monkeypatch.setattr(sweep.chunks.plan, "CHUNKS_AT_LEAST", 1e-9)
    size = make_plan(study).chunk_size
    row = sweep.chunks.plan.row_bytes(study)
    assert sweep.chunks.plan.CHUNK_BYTES - CHUNK * row < size * row <= sweep.chunks.plan.CHUNK_BYTES


@pytest.mark.parametrize("name", ["swing", "stroke", "swing1", "stroke2"])
def test_limits_on_swing_and_stroke_compare_magnitudes(name: str) -> None:
    values = np.array([-25.0, 25.0, -23.0, np.nan])
    assert meets(Limit(name, 24.0, 26.0), values).tolist() == [True, True, False, False]


def test_other_limits_compare_signed_values_and_nan_never_meets_one() -> None:
    values = np.array([-25.0, 25.0, 24.0, np.nan, np.inf])
    assert meets(Limit("stroke_ratio", 24.0, None), values).tolist() == [False, True, True, False, False]
    assert meets(Limit("margin", None, 24.0), values).tolist() == [True, False, True, False, False]


@pytest.mark.parametrize(
    ("argument", "value"), [("jobs", 0), ("jobs", 1.5), ("jobs", True), ("backend", "threads"), ("backend", "dusk")]
)
def test_bad_argument_is_named(study: Study, tmp_path: Path, argument: str, value: object) -> None:
    with pytest.raises(InputError, match=argument):
        run(study, tmp_path / "out", **{argument: value})  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


def test_row_that_lacks_an_output_has_all_others_where_all_rows_are_kept() -> None:
    """As `summarise` has them: what has no dwell, or no event, has its extrema."""
    scene = {"want": ["dwell_angle", "max_abs_d2psi", "rms_dpsi"]}
    design = {"k": {"values": [0.5, 1.0]}, "a": {"values": [0.6, 4.0]}}
    asked = {"study": {"name": "dwell"}, "mechanism": {"family": "geared_dwell"}, "scene": scene, "design": design}
    study = study_from_data(asked | {"accuracy": {"samples": 64}, "output": {"keep": "all"}}, Path("study.toml"))
    rows = compute_chunk(study, 0, 4).columns
    direct = sweep.summarise("geared_dwell", {"k": rows["k"], "a": rows["a"]}, study.want, samples=64)
    assert rows["status"].tolist() == [codes.OK, codes.NO_DWELL] * 2
    for name in (*study.want, "status"):
        np.testing.assert_array_equal(rows[name], direct[name], err_msg=name)
