"""The file of a sweep: no other sweep's results, no damaged ones, and none lost."""

import os
import subprocess
import sys
import textwrap
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from armlock import CommonArm, sweep

h5py = pytest.importorskip("h5py")
ROOT = Path(__file__).parents[1]
POINTS = [0.0, 1.5]


@dataclass
class Scaled:
    """A class of the module of the function that is swept."""

    by: float

    @cached_property
    def half(self):
        return 0.5 * self.by

    def at(self, x):
        return self.half * x


def scale(by, x):
    return np.sum(by) * x


def closure(by):
    inside = {"some", "names"}
    return lambda x: by * x if "some" in inside else 0.0


def nested(by):
    def inner(x):
        return sum(y * by for y in (x,))

    return lru_cache(inner)


def compiled(by):
    return njit(lambda x: by * x)


def long_array(by):
    return partial(scale, np.linspace(0.0, by, 5001))


#: Functions made with one number, of all kinds; their results differ where the number does.
MADE: list[Callable[[float], Callable[[float], float]]] = [
    lambda by: CommonArm(by).chain_reserve.__self__.controller.gain.__mul__,
    lambda by: partial(scale, by),
    lambda by: Scaled(by).at,
    lambda by: partial(Scaled.at, Scaled(by)),
    closure,
    nested,
    compiled,
    long_array,
]


def kept(path, make, by, points=POINTS):
    return sweep(make(by), points, store=path)


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(MADE),
    st.floats(0.1, 10.0),
    st.sampled_from([2.0, 1e-3, 1e-12, 2.5e-16]),
)
def test_only_the_same_function_takes_the_results(tmp_path_factory, make, by, change):
    path, other = tmp_path_factory.mktemp("kept") / "file.h5", by * (1.0 + change)
    found = kept(path, make, by)
    assert found == [make(by)(x) for x in POINTS] == kept(path, make, by)
    if other != by:
        with pytest.raises(ValueError, match=r"store must be .* another function"):
            kept(path, make, other)


def test_an_object_that_was_used_is_the_same(tmp_path):
    thing = Scaled(3.0)
    found = sweep(thing.at, POINTS, store=tmp_path / "a.h5")
    assert "half" in vars(thing)
    assert sweep(thing.at, POINTS, store=tmp_path / "a.h5") == found


number = st.one_of(
    st.integers(-(2**63), 2**63 - 1), st.floats(), st.booleans(), st.text(), st.none()
)
some_points = st.lists(st.one_of(number, st.tuples(number, number)), min_size=1, max_size=4)


def nothing(_):
    return 1.0


@settings(max_examples=60, deadline=None)
@given(some_points, some_points)
def test_points_are_told_apart_by_their_last_bit_and_type(tmp_path_factory, some, others):
    """Not a number, text beyond ASCII and integers past 2^53 among them."""
    path = tmp_path_factory.mktemp("kept") / "file.h5"
    assert sweep(nothing, some, store=path) == sweep(nothing, some, store=path)
    if repr(some) != repr(others):
        with pytest.raises(ValueError, match="another points"):
            sweep(nothing, others, store=path)


@pytest.mark.parametrize(
    ("some", "others"),
    [
        ([2**53], [2**53 + 1]),
        ([0.0], [-0.0]),
        ([1], [1.0]),
        ([np.float32(0.5)], [np.float64(0.5)]),
        (np.zeros((2, 3000)), np.zeros((2, 3000)) + 1e-300 * np.eye(2, 3000, 1500)),
    ],
)
def test_points_that_print_or_compare_alike_differ(tmp_path, some, others):
    sweep(np.sum, some, store=tmp_path / "a.h5")
    with pytest.raises(ValueError, match="another points"):
        sweep(np.sum, others, store=tmp_path / "a.h5")


SCRIPT = """
    import sys
    from dataclasses import dataclass
    import numpy as np
    from numba import njit
    from armlock import CommonArm, sweep

    NAMES, LOOP = {{"one", "two", "three", "µ"}}, CommonArm(0.5)

    @dataclass(frozen=True)
    class Point:
        value: float
        @property
        def half(self):
            return self.value / {divisor}

    @njit
    def compiled(x):
        return x + {added}

    def function(point):
        print("called")
        known = "one" in NAMES or point in {{"four", "five"}}
        return compiled(abs(LOOP.open_loop(1j * point.half)))

    sweep(function, [Point(x / 7) for x in range(1, 4)], store="script.h5")
"""


def test_another_process_tells_the_same_function_from_an_edited_one(tmp_path):
    """Classes, sets of text, compiled functions; and lines that moved, from another file."""

    def run(divisor=2.0, added=1.0, name="script.py", before=""):
        script = SCRIPT.format(divisor=divisor, added=added)
        (tmp_path / name).write_text(before + textwrap.dedent(script))
        return subprocess.run(
            [sys.executable, name],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=False,
        )

    assert run().stdout == 3 * "called\n"
    for again in (run(), run(name="moved.py", before="# A line more.\n\n")):
        assert (again.returncode, again.stdout) == (0, "")
    assert "another points" in run(divisor=3.0).stderr
    assert "another function" in run(added=2.0).stderr


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ([0, 1.5], "got 1.5 at point 1 after int64"),
        ([True, 1], "got 1 at point 1 after bool"),
        ([1.0, [1.0, 2.0]], "at point 1 after float64"),
        ([None, 1.0], "got None at point 0"),
        (["text", "more"], "got 'text' at point 0"),
        ([[[1.0], [1.0, 2.0]], 1.0], "at point 0"),
        ([np.ma.array([1.0, 2.0], mask=[0, 1])] * 2, "got masked_array"),
    ],
)
def test_a_result_that_the_file_would_change_is_refused(tmp_path, values, message):
    with pytest.raises(TypeError, match=f"function must return numbers, .*{message}"):
        sweep(values.__getitem__, [0, 1], store=tmp_path / "a.h5")
    assert not list(tmp_path.glob("*.part"))


@pytest.mark.parametrize("kind", [bool, np.int8, np.float16, float, np.complex64, ">f8"])
def test_results_keep_their_type(tmp_path, kind):
    values = np.array([[0, 1], [1, 3]]).astype(kind)
    for _ in range(2):
        found = sweep(values.__getitem__, [0, 1], store=tmp_path / "a.h5")
        assert np.array_equal(found, values)
        assert found[1].dtype == values.dtype


def squares(path):
    return sweep(np.square, np.arange(12.0).reshape(4, 3), store=path, about={"axis": "µ"})


def test_flipped_bits_never_give_another_result(tmp_path):
    path, random = tmp_path / "a.h5", np.random.default_rng(1)
    expected, whole, refused = squares(path), path.read_bytes(), 0
    for _ in range(600):
        changed = bytearray(whole)
        for at in random.integers(0, len(whole), random.integers(1, 4)):
            changed[at] ^= 1 << random.integers(8)
        path.write_bytes(changed)
        found: Any = None
        with suppress(ValueError, TypeError):
            found = squares(path)
        assert found is None or np.array_equal(found, expected)
        refused += found is None
    assert 0 < refused < 500


def test_a_file_that_is_cut_or_lacks_something_is_named(tmp_path):
    path = tmp_path / "a.h5"
    squares(path)
    whole = path.read_bytes()
    for size in (0, 1, 100, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:size])
        with pytest.raises(ValueError, match=f"store must .*{path}"):
            squares(path)
    for name in ("results", "done"):
        path.write_bytes(whole)
        with h5py.File(path, "r+") as file:
            del file[name]
        with pytest.raises(ValueError, match=f"store must .*{path}"):
            squares(path)


def test_what_cannot_be_kept_is_refused_before_a_point_is_computed(tmp_path):
    def called(_):
        raise AssertionError

    path = tmp_path / "a.h5"
    cases: list[tuple[type[Exception], str, dict[str, Any]]] = [
        (ValueError, "store must .*nowhere", {"store": tmp_path / "nowhere" / "a.h5"}),
        (ValueError, "store must", {"store": tmp_path}),
        (TypeError, "about must .*'mine'", {"store": path, "about": {"mine": {"a": 1}}}),
        (TypeError, "about must .*None", {"store": path, "about": {"mine": None}}),
    ]
    for error, message, arguments in cases:
        with pytest.raises(error, match=message):
            sweep(called, [1.0], **arguments)
    with pytest.raises(TypeError, match="function must hold only what can be pickled"):
        sweep(lambda _, stream=sys.stderr: stream.closed, [1.0], store=path)
    assert not list(tmp_path.iterdir())
    with pytest.raises(TypeError, match="function must be callable, got 3"):
        sweep(3, [1.0])  # type: ignore[arg-type]


@pytest.mark.parametrize("begun", [False, True])
def test_two_sweeps_do_not_share_a_file(tmp_path, begun):
    """The second one ends at once, and the first one goes on."""
    path, said = tmp_path / "a.h5", tmp_path / "said"
    code = f"""
from armlock import sweep
sweep(abs, [1.0, 2.0], store={str(path)!r})
"""

    def function(point):
        if point == (2.0 if begun else 1.0):
            command = [sys.executable, "-c", code]
            env = os.environ | {"PYTHONPATH": str(ROOT)}
            done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
            with said.open("a") as file:
                file.write(done.stderr)
        return point

    assert sweep(function, [1.0, 2.0], store=path) == [1.0, 2.0]
    assert sweep(function, [1.0, 2.0], store=path) == [1.0, 2.0]
    assert said.read_text().count("store must not be in use: another sweep") == 1
