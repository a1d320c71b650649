"""Programs as compiled C, and ``auto``, which compiles when that is worth it."""

from __future__ import annotations

import logging
import shlex
import shutil
import subprocess
import warnings

import numpy as np
import pytest

from alight.kernels import auto, runner, toolchain
from alight.kernels.auto import TRIAL, Auto
from alight.kernels.compiled import FLAGS, Compiled, source_of
from alight.kernels.compilers import CompilerUnavailable, compilers
from alight.kernels.toolchain import is_kept
from tests.compiler import NEEDS_COMPILER
from tests.kernels.compilers import broken_compilers, kept, script
from tests.kernels.programs import NOISY, TRIP, Prepared, counting, loops, noise_of, prepared, tiny


@pytest.fixture(scope="module")
def program() -> Prepared:
    return tiny()


@pytest.fixture
def fresh(monkeypatch, tmp_path):
    """An empty cache folder, and a process in which nothing was compiled or missed yet."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(toolchain, "_told", set())
    monkeypatch.setattr(auto, "_in_vain", set())
    return tmp_path


@pytest.fixture
def impatient(monkeypatch):
    """Compiling seems to cost nothing."""
    monkeypatch.setattr(auto, "COMPILED_PER_SECOND", 1e12)


def compiles(monkeypatch, speed: float) -> None:
    monkeypatch.setattr(auto, "COMPILED_PER_SECOND", speed)


# The same program


@NEEDS_COMPILER
def test_a_program_is_compiled_once(fresh, program):
    first = Compiled(program.program)
    (library,) = kept()
    built = library.stat().st_mtime_ns
    second = Compiled(program.program)
    assert kept() == [library] and library.stat().st_mtime_ns == built
    noise = noise_of(100)
    np.testing.assert_array_equal(program.run(first, noise)[1], program.run(second, noise)[1])


def test_other_numbers_are_the_same_program_and_other_structures_are_not():
    one, same = prepared(counting()), prepared(counting(trip_at=5.0))
    other = prepared(counting(), channels=("q",))
    assert source_of(same.program) == source_of(one.program)
    assert source_of(other.program) != source_of(one.program)


@NEEDS_COMPILER
def test_every_compiler_of_this_machine_gives_the_bits_of_the_virtual_machine(fresh, monkeypatch):
    """Those on the path and the one from PyPI; a program that has tanh, sin and friction."""
    program = prepared(loops()["friction"], ("q", "F_m", "tau"))
    noise = noise_of(700)
    _, expected = program.run(runner(program.program, "vm"), noise)
    for compiler in compilers():
        monkeypatch.setenv("CC", shlex.join(compiler.command))
        _, y = program.run(Compiled(program.program), noise)
        assert y.tobytes() == expected.tobytes(), compiler.name


@NEEDS_COMPILER
@pytest.mark.skipif(shutil.which("nm") is None, reason="nothing here lists the names of a library")
def test_a_library_holds_no_name_but_its_entry(fresh, program):
    """A function named tick in the process would be called instead of the library's own."""
    Compiled(program.program)
    named = subprocess.run(["nm", "-D", str(kept()[0])], capture_output=True, text=True, check=True)
    entries = [line.split()[-1] for line in named.stdout.splitlines() if " T " in line]
    assert entries == ["alight_run"]


# When it is worth it


def test_a_short_run_is_not_worth_compiling(fresh, program):
    made = Auto(program.program)
    program.run(made, noise_of(2 * TRIAL))
    assert not made.compiled and kept() == []


@NEEDS_COMPILER
def test_a_program_that_was_compiled_before_is_compiled_c_from_the_start(fresh, program):
    Compiled(program.program)
    made = Auto(program.program)
    assert made.compiled
    assert len(program.run(made, noise_of(3))[1]) == 3


@NEEDS_COMPILER
def test_long_work_is_compiled_with_one_line_that_says_so(fresh, program, caplog):
    made = runner(program.program, "auto", ticks=10**9)
    assert isinstance(made, Auto) and not made.compiled
    with caplog.at_level(logging.INFO, "alight"):
        program.run(made, noise_of(4 * TRIAL))
    assert made.compiled
    (line,) = caplog.messages
    assert line.startswith("compiling with ") and str(kept()[0].parent) in line


@NEEDS_COMPILER
def test_many_short_runs_are_long_work(fresh, program, monkeypatch):
    """What was spent counts, and nobody has to know how much will follow."""
    made = Auto(program.program)
    program.run(made, noise_of(500))
    assert not made.compiled
    compiles(monkeypatch, len(source_of(program.program)) / (3 * made._spent))
    compiled = []
    for _ in range(300):
        program.run(made, noise_of(500))
        compiled.append(made.compiled)
    assert not compiled[0] and compiled[-1]


@NEEDS_COMPILER
@pytest.mark.parametrize("expected", [100, 10**9])
def test_what_is_expected_decides(fresh, program, monkeypatch, expected):
    made = Auto(program.program)
    program.run(made, noise_of(500))
    compiles(monkeypatch, len(source_of(program.program)) / (100 * made._spent))
    made.expect(expected)
    program.run(made, noise_of(10))
    assert made.compiled == (expected == 10**9)


@NEEDS_COMPILER
@pytest.mark.parametrize("length", [1, TRIAL - 1, TRIAL, TRIAL + 1, 3 * TRIAL])
def test_a_run_that_changes_over_in_its_midst_has_the_same_bits(fresh, program, impatient, length):
    noise = noise_of(length)
    made = Auto(program.program)
    x, y = program.run(made, noise)
    assert made.compiled == (length > TRIAL)
    x_vm, y_vm = program.run(runner(program.program, "vm"), noise)
    assert y.tobytes() == y_vm.tobytes() and x.tobytes() == x_vm.tobytes()


@pytest.mark.parametrize("last", [0, TRIAL - 1, TRIAL, TRIAL + 50])
def test_a_trip_ends_a_run_on_either_side_of_the_change(fresh, program, impatient, last):
    p = tiny(trip_at=float(last)).p
    noise = noise_of(2 * TRIAL)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # without a compiler it says so
        x, y = Auto(program.program).run(program.x, noise, p)
    assert len(y) == last + 1 and y[-1, -1] == TRIP
    x_vm, y_vm = runner(program.program, "vm").run(program.x, noise, p)
    np.testing.assert_array_equal(y, y_vm)
    np.testing.assert_array_equal(x, x_vm)


# Without a working compiler


BROKEN = pytest.mark.parametrize("how", ["missing", "failing", "not a program", "idle"])


@pytest.fixture
def broken(fresh, monkeypatch, how) -> str:
    """Break the compiler, and return what the error says of it."""
    chosen, said = broken_compilers(fresh)[how]
    monkeypatch.setenv("CC", chosen)
    return said


@BROKEN
def test_auto_stays_in_the_virtual_machine_with_one_warning_in_the_process(
    broken, program, impatient
):
    said = f"virtual machine, several times slower: .*{broken}"
    with pytest.warns(UserWarning, match=said) as told:
        made = runner(program.program, "auto", ticks=10**6)
        _, y = program.run(made, noise_of(2 * TRIAL))
    assert len(told) == 1
    other = tiny("s")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        program.run(made, noise_of(2 * TRIAL))
        other.run(runner(other.program, "auto", ticks=10**6), noise_of(2 * TRIAL))
    assert not made.compiled and kept() == []
    np.testing.assert_array_equal(
        y, program.run(runner(program.program, "vm"), noise_of(2 * TRIAL))[1]
    )


@NEEDS_COMPILER
@pytest.mark.parametrize("how", ["failing"])
def test_a_compiler_that_was_mended_is_tried_again(broken, program, impatient, monkeypatch):
    with pytest.warns(UserWarning, match=broken):
        program.run(Auto(program.program), noise_of(2 * TRIAL))
    monkeypatch.delenv("CC")
    made = Auto(program.program)
    program.run(made, noise_of(2 * TRIAL))
    assert made.compiled


@BROKEN
def test_who_runs_little_is_told_nothing(broken, program):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(program.run(runner(program.program), noise_of(20))[1]) == 20


@BROKEN
def test_who_insists_on_c_is_refused(broken, program):
    with pytest.raises(CompilerUnavailable, match=broken):
        runner(program.program, "c")


@BROKEN
def test_the_virtual_machine_asks_for_no_compiler(broken, program):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert runner(program.program, "vm").name == "vm"
    assert kept() == []


@NEEDS_COMPILER
def test_a_broken_compiler_is_not_asked_again_and_again(fresh, program, impatient, monkeypatch):
    count = fresh / "count"
    path = script(
        fresh / "cc-counts",
        f'echo "$1" >> {count}',
        'case "$1" in --version) echo 1.0;; *) exit 1;; esac',
    )
    monkeypatch.setenv("CC", path)
    with pytest.warns(UserWarning, match="cc-counts failed"):
        for each in (tiny(), tiny("s"), tiny("kg")):
            each.run(Auto(each.program), noise_of(2 * TRIAL))
    assert len(count.read_text().splitlines()) == 2
    assert not is_kept(source_of(program.program), flags=FLAGS)


def test_the_noise_of_these_programs_reaches_the_law():
    """The loops above are worth comparing: their transducer is noisy and quantised."""
    assert NOISY.transducer.noise > 0 and NOISY.transducer.resolution > 0
    program = prepared(counting(), channels=("x_m_measured",))
    vm = runner(program.program, "vm")
    one, other = (program.run(vm, noise_of(50, seed))[1] for seed in (1, 2))
    assert (one != other).any()
