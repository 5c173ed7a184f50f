"""Published controllers and actuators, by their factors."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from armlock import paper
from armlock.checks import one_of, positive_number, whole_number
from armlock.systems import Controller, System


def integrating_actuator(gain: float = 1.0) -> System:
    r"""Return K(s) = gain / s, the gain and actuator of the paper's Secs. II and III.

    .. math::

        K(s) = \frac{g}{s}

    Parameters
    ----------
    gain : float, optional
        In rad/s, positive.
    """
    return Controller((), (0.0,), positive_number("gain", gain))


def stage_one(gain: float = paper.CONTROLLER_GAIN) -> System:
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


def table_two(gain: float = paper.CONTROLLER_GAIN, *, denominator: str = "table") -> System:
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
    zeros = [0.0, 0.0, *(-z for z in paper.TABLE_2_ZEROS)]
    poles = [*[-paper.TABLE_2_STAGE_1_POLE] * 2, *(-p for p in paper.TABLE_2_POLES)]
    if denominator == "printed":
        zeros, poles = zeros[:-1], poles[:-1]
    return Controller(zeros, poles, positive_number("gain", gain))


@lru_cache
def _parallel_branches() -> System:
    """Return the low-pass filter of the white paper and the nine branches beside it."""
    turn = 2.0 * np.pi
    low, high = turn * 3e-3, turn * 0.238
    gains = (1.3e-3, 3.7e-3, 4.2e-3, 16e-3, 30e-3, 69e-3, 0.11, 0.33, 0.70)
    # The first branch has a pole of the filter, and that pole is one.
    total = Controller((-high - low * high / gains[0],), (-low, -high), gains[0])
    for k, gain in enumerate(gains[1:], 2):
        total = total + Controller((), (-turn * 3.0 * 10.0 ** (k - 4),), gain)
    return total


def white_paper(gain: float = 40.0) -> System:
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


def roll_off(first: float, last: float, pairs: int, slope: float = 2.0 / 3.0) -> System:
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
    System
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
