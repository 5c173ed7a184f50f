"""A few of the random loops of `tests.attack`; `make attack` takes ten thousand."""

import numpy as np
import pytest

from tests import attack


def listed(tally):
    return [(*entry[:1], entry[1][0], *entry[2:]) for entry in (*tally.wrong, *tally.refused)]


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """Times are held against a limit, in which the compiler has no part."""
    attack.compile_all()


@pytest.fixture(autouse=True)
def quiet():
    with np.errstate(all="ignore"):
        yield


def test_what_was_wrong_once_is_right():
    tally = attack.Tally(patient=False)
    attack.attack_fixed(tally)
    assert listed(tally) == []


@pytest.mark.parametrize("kind", list(attack.CHECKS))
def test_random_loops_agree_with_brute_force(kind):
    # Few random loops are stable at (1, 1), as a critical perturbation needs: seed 8 has one.
    seed = 8 if kind == "critical" else 7
    tally = attack.attack(seed, range(10), (kind,), attack.Tally(patient=False))
    assert tally.calls.total() > tally.calls["loops"]
    assert listed(tally) == []


@pytest.mark.parametrize(
    ("seed", "loop", "kind"),
    [
        (8, 931, "rays"),  # a walk crawled where terms cancel to rounding
        (8, 6441, "margins"),  # the last frequency was bounded ten times too high
        (9, 394, "margins"),  # the nearest gain lies far above the first turns
    ],
)
def test_loops_that_were_refused_or_late_are_answered(seed, loop, kind):
    tally = attack.attack(seed, [loop], (kind,), attack.Tally(patient=False))
    assert listed(tally) == []
