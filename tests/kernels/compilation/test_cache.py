"""Compiled kernels on disk: never those of other sources, whatever is edited when, whoever else compiles."""

from __future__ import annotations

import ast
import subprocess
from pathlib import Path

import pytest

from tests.support.kernel_tree import HELPER, KERNEL, REPORT, SOURCES, edit, process, report
from tests.support.selection import mostly_long


def test_code_is_compiled_once_and_found_again(tree: Path) -> None:
    assert report(tree) == ["2.0", "0", "KernelCache"]
    assert report(tree) == ["2.0", "1", "KernelCache"]


def test_files_that_end_too_soon_are_made_anew(tree: Path) -> None:
    report(tree)
    for kind, length in (("nbc", 100), ("nbi", 0)):
        for file in (tree.parents[1] / "cache").rglob(f"*.{kind}"):
            file.write_bytes(file.read_bytes()[:length])
        assert report(tree) == ["2.0", "0", "KernelCache"]
    assert report(tree) == ["2.0", "1", "KernelCache"]


def test_an_index_that_names_what_only_its_writer_knew_is_made_anew(tree: Path) -> None:
    """A named tuple of a module that is not there any more is the type of an argument."""
    foreign = tree.parent / "foreign.py"
    foreign.write_text("from typing import NamedTuple\nclass Pair(NamedTuple):\n    low: float\n    high: float\n")
    (tree / "loop.py").write_text(KERNEL.replace("shifted(x)", "shifted(x[0])"))
    program = "from kernels.loop import run; from foreign import Pair; print(run(Pair(1.0, 2.0)))"
    assert report(tree, program) == ["2.0"]
    foreign.unlink()
    program = "from kernels.loop import run; print(run((1.0, 2.0)), len(run.stats.cache_hits))"
    assert report(tree, program) == ["2.0", "0"]
    assert report(tree, program) == ["2.0", "1"]


@pytest.mark.parametrize("kind", mostly_long(["nbc", "nbi"], ["nbc"]))
def test_a_changed_bit_anywhere_in_a_file_is_found_and_the_code_made_anew(tree: Path, kind: str) -> None:
    report(tree)
    (file,) = (tree.parents[1] / "cache").rglob(f"*run-*.{kind}")
    data = bytearray(file.read_bytes())
    for place in (0, len(data) // 2, len(data) - 1):
        file.write_bytes(data[:place] + bytes([data[place] ^ 16]) + data[place + 1 :])
        assert report(tree) == ["2.0", "0", "KernelCache"]
        assert report(tree) == ["2.0", "1", "KernelCache"]


def test_the_code_of_another_kernel_is_not_loaded_though_its_file_is_whole(tree: Path) -> None:
    report(tree)
    (run,) = (tree.parents[1] / "cache").rglob("*run-*.nbc")
    (helper,) = (tree.parents[1] / "cache").rglob("*shifted-*.nbc")
    run.write_bytes(helper.read_bytes())
    assert report(tree) == ["2.0", "0", "KernelCache"]


def test_without_compiling_a_kernel_is_its_python_source(tree: Path) -> None:
    program = "from kernels.loop import run; print(run(1.0), type(run).__name__)"
    assert report(tree, program, NUMBA_DISABLE_JIT="1") == ["2.0", "function"]


OTHER_ARGUMENTS = """
def changed(dispatcher):
    raise TypeError("other arguments")
keep = changed
"""


@pytest.mark.parametrize("change", [OTHER_ARGUMENTS, "from numba.core.caching import NamedOtherwise"])
def test_a_numba_with_another_cache_keeps_code_in_its_own_way_and_says_so_once(tree: Path, change: str) -> None:
    source = tree / "cache.py"
    source.write_text(f"{source.read_text()}\n{change}\n")
    program = "from kernels.loop import run; print(run(1.0), type(run._cache).__name__)"
    with process(tree, program, subprocess.PIPE) as running:
        found, said = running.communicate(timeout=60)
    assert found.split() == ["2.0", "FunctionCache"], said
    assert said.count("in another way") == 1


def test_a_kernel_outside_of_the_package_is_compiled_and_not_kept(tree: Path) -> None:
    (tree.parent / "bench.py").write_text(KERNEL)
    program = "from bench import run; print(run(1.0), len(run.stats.cache_hits), type(run._cache).__name__)"
    for _ in range(2):
        assert report(tree, program) == ["2.0", "0", "NullCache"]


def test_an_edit_of_a_helper_gives_its_new_result_and_back_again_the_old(tree: Path) -> None:
    assert report(tree)[0] == "2.0"
    edit(tree, 55)
    assert report(tree)[:2] == ["56.0", "0"]
    edit(tree, 1)
    assert report(tree)[:2] == ["2.0", "1"]


def test_an_edit_that_python_itself_overlooks_leaves_no_trace(tree: Path) -> None:
    """Same size, same second: Python runs the old .pyc, which is its affair; the cache must not keep it as the new."""
    assert report(tree)[0] == "2.0"
    edit(tree, 7, same_time=True)
    assert report(tree)[2] == "NullCache", "old code under the new sources' name"
    assert report(tree, PYTHONPYCACHEPREFIX=str(tree.parent / "none"))[:2] == ["8.0", "0"]


def test_a_pyc_that_python_does_not_take_is_no_reason_for_doubt(tree: Path) -> None:
    """Edited where no .pyc may be written: the old ones stay behind and are older than their sources."""
    report(tree)
    edit(tree, 55)
    assert report(tree, PYTHONDONTWRITEBYTECODE="1") == ["56.0", "0", "KernelCache"]
    assert report(tree, PYTHONDONTWRITEBYTECODE="1") == ["56.0", "1", "KernelCache"]


def test_sources_edited_while_they_are_imported_are_not_kept(tree: Path) -> None:
    """The helper changes between the hash and its import; then it changes back."""
    during = f"""
    import kernels.jit
    from pathlib import Path
    Path({str(tree / "helper.py")!r}).write_text({HELPER.format(step=55)!r})
    {REPORT}
    """
    assert report(tree, during) == ["56.0", "0", "NullCache"]
    edit(tree, 1)
    assert report(tree)[:2] == ["2.0", "0"]


def test_an_edit_after_the_import_changes_nothing_for_this_process(tree: Path) -> None:
    after = f"""
    from kernels.loop import run
    from pathlib import Path
    Path({str(tree / "helper.py")!r}).write_text({HELPER.format(step=55)!r})
    {REPORT}
    """
    assert report(tree, after) == ["2.0", "0", "KernelCache"]
    assert report(tree)[:2] == ["56.0", "0"]


def test_copies_of_the_same_sources_share_their_code(tree: Path, tmp_path: Path) -> None:
    report(tree)
    copy = tmp_path / "copy" / "kernels"
    copy.parent.mkdir()
    subprocess.run(["cp", "-r", str(tree), str(copy)], check=True)
    assert report(copy)[:2] == ["2.0", "1"]


def test_processes_that_compile_at_the_same_time_do_not_mix_their_signatures(tree: Path) -> None:
    """A slow disk between looking for a free name and taking it; afterwards each signature loads its own code."""
    slow = """
    import numpy, time
    from kernels.cache import _CheckedFile as File
    from kernels.loop import run
    save = File._save_index
    File._save_index = lambda *given: (time.sleep(2), save(*given))
    run({value})
    """
    both = [process(tree, slow.format(value=value)) for value in ("numpy.float64(1)", "numpy.complex128(1)")]
    for running in both:
        with running:
            assert running.wait(60) == 0
    again = "import numpy; from kernels.loop import run; print(run(numpy.float64(1)), run(numpy.complex128(1)))"
    assert report(tree, f"{again}; print(len(run.stats.cache_hits))") == ["2.0", "(2+0j)", "2"]


def test_where_nothing_can_be_written_kernels_run_all_the_same(tree: Path, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert report(tree, XDG_CACHE_HOME=str(tmp_path / "file")) == ["2.0", "0", "NullCache"]


def test_where_there_are_no_locks_it_is_said_once_and_nothing_is_kept(tree: Path) -> None:
    program = f"""
    import errno, fcntl
    def missing(*_):
        raise OSError(errno.ENOSYS, "Function not implemented")
    fcntl.flock = missing
    {REPORT}
    """
    with process(tree, program, errors=subprocess.PIPE) as running:
        found, said = running.communicate(timeout=60)
    assert running.returncode == 0 and found.split()[0] == "2.0"
    assert len(said.splitlines()) == 1 and "has no locks" in said
    assert report(tree)[1] == "0"


MADE = """
from kernels.jit import generated, generated_inline


def adder(step):
    def shift(x):
        return x + step

    shifted = generated_inline(f"shift_{step}", shift)

    def run(x):
        return shifted(x)

    return generated(f"run_{step}", run)
"""


def test_generated_kernels_are_kept_under_their_names_with_what_they_close_over(tree: Path) -> None:
    (tree / "made.py").write_text(MADE)
    program = (
        "from kernels.made import adder; a, b = adder(1), adder(2); "
        "print(a(1.0), b(1.0), len(a.stats.cache_hits), len(b.stats.cache_hits))"
    )
    assert report(tree, program) == ["2.0", "3.0", "0", "0"]
    assert report(tree, program) == ["2.0", "3.0", "1", "1"]


LARGE = """
import numpy as np
from kernels.jit import kernel

TABLE = np.ones(2_000_000)  # numba does not write an array of more than a million bytes into the machine code


@kernel
def run(x):
    return x + TABLE[1]
"""


def test_a_kernel_whose_code_cannot_be_kept_is_named(tree: Path) -> None:
    """The locator had no name of the source for numba's warning; the error of that was taken for a damaged file."""
    (tree / "loop.py").write_text(LARGE)
    with process(tree, REPORT, subprocess.PIPE) as running:
        found, said = running.communicate(timeout=60)
    assert found.split() == ["2.0", "0", "KernelCache"]
    assert "loop.py" in said and 'Cannot cache compiled function "run"' in said


def test_what_is_handed_a_function_is_folded_in() -> None:
    """numba keeps no code of a kernel that hands a function on to another one; whether LLVM folds a part is its affair.

    The warning of the test before is an error in every other test, so one that is handed a function otherwise is found.
    """
    handed, folded = set[str](), set[str]()
    for path in SOURCES.rglob("*.py"):
        for function in ast.walk(ast.parse(path.read_text())):
            if isinstance(function, ast.FunctionDef) and function.decorator_list:
                takes = [*function.args.args, *([function.args.vararg] if function.args.vararg else ())]
                if any(one.annotation and "Callable" in ast.unparse(one.annotation) for one in takes):
                    by = {ast.unparse(one) for one in function.decorator_list}
                    of = folded if by & {"inline", "folded"} else handed if by & {"part", "kernel"} else set[str]()
                    of.add(f"{path.name}: {function.name}")
    assert len(folded) > 10 and not handed
