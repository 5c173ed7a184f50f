"""Controllers and actuators, as zeros, poles and gain.

The factors are kept, not multiplied out: with poles at 1e-6 rad/s and crossings at some
rad/s, the factors stay exact where expanded coefficients do not.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import TYPE_CHECKING, Any, Self

import mpmath
import numpy as np
import numpy.typing as npt
from numpy.polynomial import polynomial as poly

from armlock import paper
from armlock.checks import (
    ComplexArray,
    complex_array,
    one_of,
    positive_number,
    real_number,
    whole_number,
)
from armlock.engine.polynomials import quotients

if TYPE_CHECKING:
    import control

# Decimal digits in which the zeros of parallel branches are found.
_DIGITS = 80


@dataclass(frozen=True)
class Controller:
    r"""A rational function K(s) = gain prod(s - zeros) / prod(s - poles).

    With zeros :math:`z_i`, poles :math:`p_i` and gain :math:`g`

    .. math::

        K(s) = g\, \frac{\prod_i (s - z_i)}{\prod_i (s - p_i)} .

    Parameters
    ----------
    zeros, poles : sequence of complex
        In rad/s; complex ones in conjugate pairs.
    gain : float
        Factor in front, not zero.

    Raises
    ------
    TypeError, ValueError
        If a value is not finite, complex ones do not come in conjugate pairs, or the gain
        is zero.

    Examples
    --------
    >>> from armlock import Controller
    >>> lag = Controller(zeros=[-2.0], poles=[-1.0], gain=3.0)
    >>> complex(lag(0.0))
    (6+0j)
    """

    zeros: tuple[complex, ...]
    poles: tuple[complex, ...]
    gain: float

    def __init__(self, zeros: Sequence[complex], poles: Sequence[complex], gain: float) -> None:
        object.__setattr__(self, "zeros", _factors("zeros", zeros))
        object.__setattr__(self, "poles", _factors("poles", poles))
        object.__setattr__(self, "gain", real_number("gain", gain))
        if self.gain == 0.0:
            raise ValueError("gain must not be zero: there would be no loop")

    @classmethod
    def of(cls, controller: Any) -> Self:
        """Return a controller given as one, as a python-control system, or as a triple.

        Parameters
        ----------
        controller : Controller, python-control system, or (zeros, poles, gain)
            A transfer function or state space of python-control must be continuous in time,
            with one input and output.

        Raises
        ------
        TypeError, ValueError
            If it is none of these, is in discrete time, or has several inputs or outputs; or if
            the zeros and poles of a state space do not reproduce its response to a part in a
            million.

        Notes
        -----
        A `Controller` or a triple keeps repeated zeros and poles. python-control does not: it
        multiplies all factors out, those of `control.zpk` too. It turns
        ``control.zpk([], [-1e-3] * 5, 1)`` into five complex poles around -1e-3. Write
        ``Controller([], [-1e-3] * 5, 1)`` instead.

        Examples
        --------
        >>> import control
        >>> from armlock import Controller
        >>> Controller.of(control.tf([2.0, 1.0], [1.0, 0.5, 0.0]))
        Controller(zeros=((-0.5+0j),), poles=((-0.5+0j), 0j), gain=2.0)
        """
        if isinstance(controller, cls):
            return controller
        if isinstance(controller, tuple) and len(controller) == 3:
            return cls(*controller)
        import control

        check_system("controller", controller, "a Controller, a triple (zeros, poles, gain)")
        if isinstance(controller, control.StateSpace):
            zeros, poles, gain = _factored(controller)
            return cls(zeros.tolist(), poles.tolist(), gain)
        # It has no zeros in front of the highest power.
        gain = float(controller.num[0][0][0] / controller.den[0][0][0])
        return cls(controller.zeros(), controller.poles(), gain)

    def __call__(self, s: npt.ArrayLike) -> ComplexArray:
        """Evaluate K(s), factor by factor; `s` in rad/s, any shape."""
        return quotients(self.zeros, self.poles, self.gain, complex_array("s", s))

    def __mul__(self, other: Controller) -> Controller:
        """Return the two in series."""
        if not isinstance(other, Controller):
            return NotImplemented
        return Controller(
            self.zeros + other.zeros, self.poles + other.poles, self.gain * other.gain
        )

    def __add__(self, other: Controller) -> Controller:
        """Return the two in parallel, as zeros, poles and gain again.

        The zeros of the sum are found in extended precision, from the factors of both.
        """
        if not isinstance(other, Controller):
            return NotImplemented
        # Poles that both have are not doubled.
        mine, yours = Counter(self.poles), Counter(other.poles)
        only_mine, only_yours = (tuple(p.elements()) for p in (mine - yours, yours - mine))
        with mpmath.workdps(_DIGITS):
            total = poly.polyadd(
                _precise(self.zeros + only_yours, self.gain),
                _precise(other.zeros + only_mine, other.gain),
            )
            coefficients = [mpmath.re(value) for value in total]
            zeros = []
            if len(coefficients) > 1:
                zeros = mpmath.polyroots(coefficients, maxsteps=500, extraprec=400, asc=True)
            poles = self.poles + only_yours
            return Controller([complex(z) for z in zeros], poles, float(coefficients[-1]))


def check_system(name: str, system: Any, others: str) -> None:
    """Raise if this is no system of python-control in continuous time, with one channel."""
    import control

    if not isinstance(system, control.TransferFunction | control.StateSpace):
        raise TypeError(
            f"{name} must be {others}, or a transfer function or state space of "
            f"python-control, got {system!r:.200}"
        )
    if not system.issiso():
        raise ValueError(
            f"{name} must have one input and one output, got {system.ninputs} and "
            f"{system.noutputs}"
        )
    if system.isdtime(strict=True):
        raise ValueError(
            f"{name} must be continuous in time, got sampling time {system.dt}: give the "
            "continuous system from which it was sampled"
        )


def _factored(system: control.StateSpace) -> tuple[ComplexArray, ComplexArray, float]:
    """Return zeros, poles and gain of a state space, which give its response back.

    D, C B, C A B, ... are the coefficients of 1, 1/s, 1/s^2, ... at high frequency. The first
    of them that is not zero is the gain, and tells how many zeros there are.
    """
    poles, candidates = system.poles(), np.asarray(system.zeros())
    gain, size = float(system.D[0, 0]), 0.0
    column, number = system.B, poles.size
    while abs(gain) <= 1e-12 * size or gain == 0.0:
        if not number:
            raise ValueError(f"controller must not be zero, got {system!r:.200}")
        gain = (system.C @ column).item()
        size = float(np.linalg.norm(system.C) * np.linalg.norm(column))
        column, number = system.A @ column, number - 1
    zeros = candidates[np.argsort(np.abs(candidates))][:number]
    sizes = np.abs(np.concatenate((zeros, poles)))
    # What rounding left of a zero at s = 0 is none of the places to look at.
    sizes = sizes[sizes > 1e-12 * sizes.max()] if sizes.any() else np.ones(1)
    s = np.geomspace(0.1 * sizes.min(), 10.0 * sizes.max(), 40) * np.exp(0.7j)
    given, found = system(s), quotients(zeros.tolist(), poles.tolist(), gain, s)
    if not (np.abs(found - given) <= 1e-6 * np.abs(given)).all():
        raise ValueError(
            "controller must be a state space whose zeros and poles are found to a part in a "
            f"million, got {system!r:.200}: give it as (zeros, poles, gain)"
        )
    return zeros, poles, gain


def _factors(name: str, values: Sequence[complex]) -> tuple[complex, ...]:
    """Return finite roots as a tuple, complex ones checked to come in pairs."""
    roots = np.atleast_1d(complex_array(name, values))
    if roots.ndim != 1:
        raise ValueError(f"{name} must be one-dimensional, got shape {roots.shape}")
    upper = np.sort_complex(roots[roots.imag > 0.0])
    lower = np.sort_complex(roots[roots.imag < 0.0].conj())
    if upper.size != lower.size or (np.abs(upper - lower) > 1e-12 * np.abs(lower)).any():
        raise ValueError(f"{name} must be real or in conjugate pairs, got {values!r}")
    return tuple(complex(root) for root in roots)


def _precise(roots: tuple[complex, ...], gain: float) -> npt.NDArray[Any]:
    """Return the coefficients of gain prod(s - roots), ascending, in extended precision."""
    factors = [np.array([-mpmath.mpc(root), mpmath.mpf(1)]) for root in roots]
    return reduce(np.convolve, factors, np.array([mpmath.mpf(gain)]))


def integrating_actuator(gain: float = 1.0) -> Controller:
    r"""Return K(s) = gain / s, the gain and actuator of the paper's Secs. II and III.

    .. math::

        K(s) = \frac{g}{s}

    Parameters
    ----------
    gain : float, optional
        In rad/s, positive.
    """
    return Controller((), (0.0,), positive_number("gain", gain))


def stage_one(gain: float = paper.CONTROLLER_GAIN) -> Controller:
    r"""Return G_L, the gain and two high-pass filters of the paper's Stage I (Eq. 11).

    .. math::

        G_L(s) = g \left( \frac{s}{s + p_{11}} \right)^2

    Parameters
    ----------
    gain : float, optional
        The paper's g.
    """
    corner = paper.TABLE_2_STAGE_1_POLE
    return Controller((0.0, 0.0), (-corner, -corner), positive_number("gain", gain))


def table_two(gain: float = paper.CONTROLLER_GAIN, *, denominator: str = "table") -> Controller:
    r"""Return the complete controller of Table II, Stage I times Stage II.

    .. math::

        C(s) = G_L\, G_c = g\, \frac{s^2}{(s + p_{11})^2}
        \prod_{k=1}^{4} \frac{s + z_{2k}}{s + p_{2k}}

    Parameters
    ----------
    gain : float, optional
        The paper's g.
    denominator : {"table", "printed"}, optional
        "table" has the pole p24 of Table II; "printed" has s + z24 as Eq. (11) prints it,
        which cancels the last zero.

    Raises
    ------
    TypeError, ValueError
        If the gain is not positive and finite, or `denominator` is neither.
    """
    one_of("denominator", denominator, ("table", "printed"))
    zeros = [-z for z in paper.TABLE_2_ZEROS]
    poles = [-p for p in paper.TABLE_2_POLES]
    if denominator == "printed":
        zeros, poles = zeros[:-1], poles[:-1]
    return stage_one(gain) * Controller(zeros, poles, 1.0)


@lru_cache
def _parallel_branches() -> Controller:
    """Return the low-pass filter of the white paper and the nine branches beside it."""
    turn = 2.0 * np.pi
    low, high = turn * 3e-3, turn * 0.238
    total = Controller((), (-low, -high), low * high)
    gains = (1.3e-3, 3.7e-3, 4.2e-3, 16e-3, 30e-3, 69e-3, 0.11, 0.33, 0.70)
    for k, gain in enumerate(gains, 1):
        total = total + Controller((), (-turn * 3.0 * 10.0 ** (k - 4),), gain)
    return total


def white_paper(gain: float = 40.0) -> Controller:
    r"""Return the controller of the LISA Frequency Control White Paper, G*(s).

    .. math::

        G^*(s) &= \left( \frac{s}{s + p_1} \right)^3 \frac{g_2\, s}{s + p_2}
        \left( \frac{g_3 (s + z_3)}{s + p_3} \right)^5 \\
        &\quad \cdot \left[ \frac{g_4}{(s + p_{41})(s + p_{42})}
        + \sum_{k=1}^{9} \frac{g_{5k}}{s + p_{5k}} \right]

    with corners, in Hz, of 0.8e-6 (p1), 210e-6 (p2), 36.6e-6 (z3), 185e-6 (p3), 3e-3 (p41),
    0.238 (p42) and 3 10^(k-4) (p5k); g3 = p3 / z3 and g4 = p41 p42.

    Parameters
    ----------
    gain : float, optional
        The source's g2, which it does not print. At 40 the loop of `flight_loop` has the gain
        at 3 mHz and the lower unity-gain frequency that are printed.

    Raises
    ------
    TypeError, ValueError
        If the gain is not positive and finite.

    References
    ----------
    LISA Frequency Control White Paper (2009), Sec. 3.
    """
    p1, p2, z3, p3 = (2.0 * np.pi * f for f in (0.8e-6, 210e-6, 36.6e-6, 185e-6))
    high_pass = Controller((0.0,) * 4, (-p1, -p1, -p1, -p2), positive_number("gain", gain))
    lead = Controller((-z3,) * 5, (-p3,) * 5, (p3 / z3) ** 5)
    return high_pass * lead * _parallel_branches()


def roll_off(first: float, last: float, pairs: int, slope: float = 2.0 / 3.0) -> Controller:
    r"""Return a controller whose gain falls by a share of a power of the frequency.

    Poles and zeros alternate. With n pairs, and r = (last / first)^(1 / n), it is

    .. math::

        C(s) = \frac{1}{1 + s / p_n}
        \prod_{k=0}^{n-1} \frac{1 + s / z_k}{1 + s / p_k} , \qquad
        p_k = 2 \pi\, \mathrm{first}\; r^k , \quad z_k = r^{\mathrm{slope}}\, p_k .

    By Bode's relation its phase is near -90 degrees times the slope between the two ends.

    Parameters
    ----------
    first, last : float
        Frequencies of the first and the last pole in Hz.
    pairs : int
        Number of zeros; there is one pole more.
    slope : float, optional
        Power of the frequency by which the gain falls, between zero and one.

    Returns
    -------
    Controller
        With a gain of one at low frequency.

    Raises
    ------
    TypeError, ValueError
        If `first` or the slope is not positive, `last` is not above `first`, the slope is not
        below one, or `pairs` is not a positive whole number.

    Examples
    --------
    >>> import numpy as np
    >>> from armlock.controllers import roll_off
    >>> shallow = roll_off(1e-2, 1e4, 6)
    >>> print(f"{abs(complex(shallow(2j * np.pi * 10.0))):.4f}")
    0.0079
    """
    first, last = positive_number("first", first), positive_number("last", last)
    slope, pairs = positive_number("slope", slope), whole_number("pairs", pairs, 1)
    if last <= first:
        raise ValueError(f"last must be above first ({first}), got {last}")
    if slope >= 1.0:
        raise ValueError(f"slope must be below one, got {slope}")
    step = (last / first) ** (1.0 / pairs)
    poles = 2.0 * np.pi * first * step ** np.arange(pairs + 1)
    zeros = poles[:-1] * step**slope
    return Controller(
        (-zeros).tolist(), (-poles).tolist(), float(np.prod(poles / np.append(zeros, 1.0)))
    )
