"""Controllers and actuators, as exact quotients of polynomials.

Given factors are kept, not multiplied out: with poles at 1e-6 rad/s and crossings at some
rad/s, the factors stay exact where expanded coefficients do not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from armlock import paper
from armlock.checks import (
    ComplexArray,
    complex_array,
    one_of,
    positive_number,
    real_array,
    real_number,
    whole_number,
)
from armlock.engine import statespace
from armlock.engine.polynomials import Polynomial


def _of_systems(name: str) -> Callable[..., Any]:
    """Return an operator of `armlock.System`, which keeps a rational result a controller."""

    def operator(self: Controller, *others: Any, **more: Any) -> Any:
        from armlock.systems import System

        found = getattr(System.of(self), name)(*others, **more)
        return found if found.parameters or found.longest_delay else rational(found)

    operator.__name__, operator.__doc__ = name, f"Do what `System.{name}` does, exactly."
    return operator


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

    Notes
    -----
    Controllers are combined by ``+ - * / **`` and `feedback` as a `System` is, with numbers,
    systems of python-control, delays and parameters. What holds no delay and no parameter is a
    controller again. Where python-control's own operator comes first and raises, as in
    ``plant / controller``, write ``System.of(plant)`` for ``plant``.

    Examples
    --------
    >>> from armlock import Controller
    >>> lag = Controller(zeros=[-2.0], poles=[-1.0], gain=3.0)
    >>> complex(lag(0.0))
    (6+0j)
    """

    # numpy leaves arithmetic with such an object to it.
    __array_ufunc__ = None

    numerator: Polynomial
    denominator: Polynomial

    def __init__(self, zeros: Sequence[complex], poles: Sequence[complex], gain: float) -> None:
        above, below = _factors("zeros", zeros), _factors("poles", poles)
        gain = real_number("gain", gain)
        if gain == 0.0:
            raise ValueError("gain must not be zero: there would be no loop")
        object.__setattr__(self, "numerator", Polynomial.of_roots(above, gain))
        object.__setattr__(self, "denominator", Polynomial.of_roots(below))

    @staticmethod
    def of_polynomials(numerator: Polynomial, denominator: Polynomial) -> Controller:
        """Return the quotient of two polynomials, which may be zero."""
        found = object.__new__(Controller)
        object.__setattr__(found, "numerator", numerator)
        object.__setattr__(found, "denominator", denominator)
        return found

    @property
    def zeros(self) -> tuple[complex, ...]:
        """Zeros in rad/s, as given, or rounded."""
        return self.numerator.roots

    @property
    def poles(self) -> tuple[complex, ...]:
        """Poles in rad/s, as given, or rounded."""
        return self.denominator.roots

    @property
    def gain(self) -> float:
        """Factor in front."""
        return float(self.numerator.lead / self.denominator.lead)

    def __repr__(self) -> str:
        """List zeros, poles and gain."""
        return f"Controller(zeros={self.zeros}, poles={self.poles}, gain={self.gain})"

    @staticmethod
    def of(
        controller: Any, integrators: int | None = None, zeros: int | None = None
    ) -> Controller:
        """Return a controller given as one, as a python-control system, or as a triple.

        Parameters
        ----------
        controller : Controller, python-control system, (zeros, poles, gain), or System
            A transfer function or state space of python-control must be continuous in time,
            with one input and output. A `System` must hold no delay and no parameter.
        integrators : int, optional
            How many poles of a python-control system are zero: 0, 1 or 2. It is needed where
            rounding may have moved such poles.
        zeros : int, optional
            The same for its zeros, for instance 1 for a high-pass filter, or for an integrator
            that the input does not reach.

        Raises
        ------
        TypeError, ValueError
            If it is none of these, is zero, is in discrete time, has several inputs or outputs,
            if rounding hides whether a pole or zero is at s = 0, or if the coefficients
            contradict `integrators` or `zeros` by more than rounding.

        Notes
        -----
        Coefficients and matrices are taken as the binary numbers that they are, exactly.

        Rounding leaves some 1e-17 in place of a coefficient that is meant to be zero, for
        instance of a state space in other coordinates, or of polynomials that were multiplied
        out. A system whose lowest coefficient is as small is refused until `integrators` and
        `zeros` say what is meant. What is stated is set to zero: a true pole at 1e-9 rad/s is
        then lost. The next coefficient is asked in the same way. With ``integrators=0`` the
        coefficients are taken as they are.

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
        found = rational(controller, integrators, zeros)
        if not found.numerator:
            raise ValueError(f"controller must not be zero, got {controller!r:.200}")
        return found

    def __call__(self, s: npt.ArrayLike, squeeze: Any = None) -> ComplexArray:
        """Evaluate K(s), factor by factor; `s` in rad/s, any shape."""
        return self.numerator.over(self.denominator, complex_array("s", s))

    def __mul__(self, other: Any) -> Any:
        """Do what `System.__mul__` does; factors of controllers stay as they are given."""
        if not isinstance(other, Controller):
            return self.__rmul__(other)
        return Controller.of_polynomials(
            self.numerator * other.numerator, self.denominator * other.denominator
        )

    __add__ = __radd__ = _of_systems("__add__")
    __sub__, __rsub__ = _of_systems("__sub__"), _of_systems("__rsub__")
    __rmul__ = _of_systems("__mul__")
    __truediv__, __rtruediv__ = _of_systems("__truediv__"), _of_systems("__rtruediv__")
    __neg__, __pow__ = _of_systems("__neg__"), _of_systems("__pow__")
    feedback = _of_systems("feedback")

    def update_names(self, **names: Any) -> None:
        """Keep no names of signals, so that ``control.series`` takes the controller."""
        return


def rational(
    system: Any, integrators: int | None = None, zeros: int | None = None
) -> Controller:
    """Return what `Controller.of` does, but of a system that is zero too."""
    from armlock.systems import System

    if isinstance(system, tuple) and len(system) == 3:
        system = Controller(*system)
    if isinstance(system, System):
        system = _of_system(system)
    if isinstance(system, Controller):
        for name, given in (("integrators", integrators), ("zeros", zeros)):
            if given is not None:
                raise TypeError(
                    f"{name} is for a state space or transfer function of python-control, got "
                    f"{given} and {system!r:.200}"
                )
        return system
    import control

    check_system("controller", system, "a Controller, a triple (zeros, poles, gain)")
    if isinstance(system, control.StateSpace):
        matrices = (real_array("controller", getattr(system, name)).tolist() for name in "ABCD")
        parts = statespace.of_matrices([*matrices], integrators, zeros)
    else:
        powers = (
            real_array("controller", p[0][0])[::-1].tolist() for p in (system.num, system.den)
        )
        above, below = powers
        parts = statespace.of_coefficients(above, below, integrators, zeros)
    return Controller.of_polynomials(*parts)


def _of_system(system: Any) -> Controller:
    """Return a system without delays and parameters as a controller."""
    if system.parameters or system.longest_delay or system.is_equation:
        raise ValueError(f"controller must hold no delay and no parameter, got {system!r:.200}")
    parts = (p.whole() for p in (system.numerator, system.denominator))
    return Controller.of_polynomials(*map(Polynomial.of, parts))


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
            f"{system.noutputs}: return_difference(plant, [k1 * delay(h), k2]) takes a plant "
            "of several, with the delays in its controllers"
        )
    check_continuous(name, system)


def check_continuous(name: str, system: Any) -> None:
    """Raise if a system of python-control is in discrete time."""
    if system.isdtime(strict=True):
        raise ValueError(
            f"{name} must be continuous in time, got sampling time {system.dt}: give the "
            "continuous system from which it was sampled; for a controller that is born "
            'discrete see the recipe "A digital controller"'
        )


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
    found: Controller = stage_one(gain) * Controller(zeros, poles, 1.0)
    return found


@lru_cache
def _parallel_branches() -> Controller:
    """Return the low-pass filter of the white paper and the nine branches beside it."""
    turn = 2.0 * np.pi
    low, high = turn * 3e-3, turn * 0.238
    gains = (1.3e-3, 3.7e-3, 4.2e-3, 16e-3, 30e-3, 69e-3, 0.11, 0.33, 0.70)
    # The first branch has a pole of the filter, and that pole is one.
    total = Controller((-high - low * high / gains[0],), (-low, -high), gains[0])
    for k, gain in enumerate(gains[1:], 2):
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
    found: Controller = high_pass * lead * _parallel_branches()
    return found


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
