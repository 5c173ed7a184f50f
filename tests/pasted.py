"""Texts that readers paste as a controller, and what each of them is.

A text is understood exactly, `UNDERSTOOD`, or refused for a reason, `REFUSED`. Beside each text
that is understood stands its transfer function.
"""

from __future__ import annotations

from numpy import exp, pi, sqrt

S1 = "s = tf('s');\n"


def lead(s):
    return (s + 0.02) / (s**2 + 0.1 * s)


def branches(s):
    return 3 / s + 1 / (s**2 + 1)


MATLAB_STATES = """sys =

  A =
         x1    x2
   x1  -0.1     0
   x2     1     0

  B =
       u1
   x1   1
   x2   0

  C =
         x1    x2
   y1     1  0.02

  D =
       u1
   y1   0
"""
PYTHON_STATES = """<StateSpace>: sys[3]
Inputs (1): ['u[0]']
Outputs (1): ['y[0]']
States (2): ['x[0]', 'x[1]']

A = [[-0.1  0. ]
     [ 1.   0. ]]

B = [[1.]
     [0.]]

C = [[1.   0.02]]

D = [[0.]]
"""
JULIA_STATES = """StateSpace{Continuous, Float64}
A =
 -0.1  0.0
  1.0  0.0
B =
 1.0
 0.0
C =
 1.0  0.02
D =
 0.0

Continuous-time state-space model
"""
SCIPY_STATES = """StateSpaceContinuous(
array([[-0.1,  0. ],
       [ 1. ,  0. ]]),
array([[1],
       [0]]),
array([[1.  , 0.02]]),
array([[0]]),
dt: None
)"""

UNDERSTOOD = [
    # MATLAB, written
    ("tf([1 0.02], [1 0.1 0])", lead),
    ("num = [1 0.02];\nden = [1 0.1 0];\nC = tf(num, den)", lead),
    ("num = [1 0.02]\nden = [1 0.1 0]", lead),
    ("num =\n\n    1.0000    0.0200\n\nden =\n\n    1.0000    0.1000         0\n", lead),
    ("num =\n\n   1.0e+03 *\n\n    0.0010    2.0000\n\nden = [1 0]", lambda s: 1 + 2000 / s),
    ("C = tf(5, [1 0]);", lambda s: 5 / s),
    ("tf(-2, [1 -0.5])", lambda s: -2 / (s - 0.5)),
    ("tf([1 - 0.5 2], [1 0 0])", lambda s: (0.5 * s + 2) / s**2),
    ("tf([1 -0.5 2], [1 0 0])", lambda s: (s**2 - 0.5 * s + 2) / s**2),
    ("tf(10, conv([1 0], [1 2]))", lambda s: 10 / (s * (s + 2))),
    ("tf(1, poly([-1 -2]))", lambda s: 1 / ((s + 1) * (s + 2))),
    ("tf([2*pi*0.1], [1 2*pi*0.1])", lambda s: 0.2 * pi / (s + 0.2 * pi)),
    ("tf(1, [1 1], 'InputDelay', 0.05)", lambda s: exp(-0.05 * s) / (s + 1)),
    ("tf(1,[1 1],'OutputDelay',0.2,'IODelay',0.1)", lambda s: exp(-0.3 * s) / (s + 1)),
    ("tf(1, [1 1], 'Name', 'C', 'TimeUnit', 'seconds')", lambda s: 1 / (s + 1)),
    ("tf(1, [1 1], 'Ts', 0)", lambda s: 1 / (s + 1)),
    ("zpk(-0.02, [0 -0.1], 1)", lead),
    ("zpk([], [-1e-3 -1e-3 -1e-3], 2)", lambda s: 2 / (s + 1e-3) ** 3),
    (
        "zpk([-1+2i -1-2i], [0 -3], 4)",
        lambda s: 4 * (s + 1 - 2j) * (s + 1 + 2j) / (s * (s + 3)),
    ),
    ("zpk([], -2*pi*[1 10], 5)", lambda s: 5 / ((s + 2 * pi) * (s + 20 * pi))),
    (S1 + "C = 5*(s+1)/s^2;", lambda s: 5 * (s + 1) / s**2),
    ("s = tf('s'); C = (s+0.02)/(s^2+0.1*s)", lead),
    (S1 + "T = 0.2;\nC = 2*exp(-s*T)/s", lambda s: 2 * exp(-0.2 * s) / s),
    ("Kp = 2; Ki = 3; s = tf('s'); C = Kp + Ki/s", lambda s: 2 + 3 / s),
    ("C = pid(2, 3)", lambda s: 2 + 3 / s),
    ("pid(2,3,4,0.1)", lambda s: 2 + 3 / s + 4 * s / (0.1 * s + 1)),
    ("feedback(tf(2,[1 0]), 1)", lambda s: 2 / (s + 2)),
    ("feedback(tf(2,[1 0]), tf(1,[1 1]), 1)", lambda s: 2 * (s + 1) / (s**2 + s - 2)),
    ("series(tf(2,[1 0]), tf(1,[1 1]))", lambda s: 2 / (s * (s + 1))),
    ("parallel(tf(2,[1 0]), tf(1,[1 1]))", lambda s: 2 / s + 1 / (s + 1)),
    ("A = [-0.1 0; 1 0]; B = [1; 0]; C = [1 0.02]; D = 0; sys = ss(A, B, C, D)", lead),
    ("ss([-0.1 0; 1 0], [1; 0], [1 0.02], 0)", lead),
    ("ss(-2, 1, 3, 5)", lambda s: 5 + 3 / (s + 2)),
    ("ss(-2,1,3,5,'InputDelay',0.5)", lambda s: exp(-0.5 * s) * (5 + 3 / (s + 2))),
    ("C = tf(5, [1 0]); % integrator", lambda s: 5 / s),
    ("C = tf([1 ...\n 0.02], [1 0.1 0])", lead),
    ("C = tf(5, [1 0]) * db2mag(20)", lambda s: 50 / s),
    # MATLAB, printed
    ("\nsys =\n \n  1\n  -\n  s\n \nContinuous-time transfer function.\n", lambda s: 1 / s),
    (
        "ans =\n\n    s + 0.02\n  -----------\n  s^2 + 0.1 s\n\n"
        "Continuous-time transfer function.\nModel Properties\n",
        lead,
    ),
    (
        " 5 (s+0.02)\n ----------\n  s (s+0.1)\n\nContinuous-time zero/pole/gain model.",
        lambda s: 5 * lead(s),
    ),
    (
        "  5 (s+0.02) (s^2 + 0.2s + 1)\n  ---------------\n    s^2 (s+0.1)^2",
        lambda s: 5 * (s + 0.02) * (s**2 + 0.2 * s + 1) / (s**2 * (s + 0.1) ** 2),
    ),
    (
        "C =\n\n                 1\n  exp(-2*s) * -------\n              s^2 + s\n\n"
        "Continuous-time transfer function.",
        lambda s: exp(-2 * s) / (s**2 + s),
    ),
    ("C =\n\n              1\n  exp(-2*s) * -\n              s\n", lambda s: exp(-2 * s) / s),
    (
        "From input 'u' to output 'y':\n                 5 (s+0.02)\n"
        "  exp(-0.05*s) * ----------\n                 s (s+0.1)\n",
        lambda s: 5 * exp(-0.05 * s) * lead(s),
    ),
    (
        "  1.5 s + 1e-05\n  -------------\n  s^2 + 2e-06 s",
        lambda s: (1.5 * s + 1e-5) / (s**2 + 2e-6 * s),
    ),
    (MATLAB_STATES + "\nContinuous-time state-space model.\n", lead),
    (MATLAB_STATES + "\nInput delays (seconds): 0.25\n", lambda s: exp(-0.25 * s) * lead(s)),
    (
        "  s^3 + 2 s^2\n\n        + 3 s + 4\n  -----------\n  s^4",
        lambda s: (s**3 + 2 * s**2 + 3 * s + 4) / s**4,
    ),
    (S1 + "C = 2/s;\nC.InputDelay = 0.05", lambda s: 2 * exp(-0.05 * s) / s),
    ("C = tf(1,[1 0]);\nC.InputDelay = 0.1;\nC.OutputDelay = 0.2", lambda s: exp(-0.3 * s) / s),
    (
        "C =\n \n             1            s    \n  Kp + Ki * --- + Kd * --------\n"
        "             s          Tf*s+1 \n\n  with Kp = 2, Ki = 3, Kd = 4, Tf = 0.1\n \n"
        "Continuous-time PIDF controller in parallel form.",
        lambda s: 2 + 3 / s + 4 * s / (0.1 * s + 1),
    ),
    (
        "C =\n \n             1 \n  Kp + Ki * ---\n             s \n\n"
        "  with Kp = 0.5, Ki = 1.2e-05\n \nContinuous-time PI controller in parallel form.",
        lambda s: 0.5 + 1.2e-5 / s,
    ),
    (
        "C =\n \n             1      1              \n  Kp * (1 + ---- * --- + Td * s)\n"
        "             Ti     s              \n\n  with Kp = 2, Ti = 3, Td = 0.5\n",
        lambda s: 2 * (1 + 1 / (3 * s) + 0.5 * s),
    ),
    # Octave
    (
        "Transfer function 'C' from input 'u1' to output ...\n\n      s + 0.02\n"
        " y1:  -----------\n      s^2 + 0.1 s\n\nContinuous-time model.",
        lead,
    ),
    (
        "sys.a =\n         x1    x2\n   x1  -0.1     0\n   x2     1     0\n\n"
        "sys.b =\n       u1\n"
        "   x1   1\n   x2   0\n\nsys.c =\n         x1    x2\n   y1     1  0.02\n\nsys.d =\n"
        "       u1\n   y1   0\n\nContinuous-time model.",
        lead,
    ),
    # python-control, written and printed
    (
        "control.tf([20.0, 2.0], [10.0, 0.0]) * control.tf([1.0], [10.0, 1.0]) * delay(3.0)",
        lambda s: (20 * s + 2) / (10 * s) / (10 * s + 1) * exp(-3 * s),
    ),
    ("import control as ct\nC = ct.tf([1, 0.02], [1, 0.1, 0], dt=0)", lead),
    ("from control import tf\ns = tf('s')\nK = 10*(s + 2)/s", lambda s: 10 * (s + 2) / s),
    ("s = control.TransferFunction.s\nC = 1/(s+1)", lambda s: 1 / (s + 1)),
    ("10*tf([1, 2], [1, 0])", lambda s: 10 * (s + 2) / s),
    ("-tf([1, 2], [1, 0])", lambda s: -(s + 2) / s),
    ("tf([1, 2], [1, 0])*-3", lambda s: -3 * (s + 2) / s),
    ("1/tf([1, 2], [1, 5])", lambda s: (s + 5) / (s + 2)),
    ("tf([1], [1, 1]) - tf([2], [1, 2])", lambda s: 1 / (s + 1) - 2 / (s + 2)),
    ("tf([1], [1, 1])**3", lambda s: 1 / (s + 1) ** 3),
    ("tf([1], [1, 1])**-1 * tf([1], [1, 0, 0])", lambda s: (s + 1) / s**2),
    ("control.zpk([-0.02], [0, -0.1], gain=1)", lead),
    ("control.zpk([], [-1e-3]*1, 1)", lambda s: 1 / (s + 1e-3)),
    (
        "<TransferFunction>: sys[0]\nInputs (1): ['u[0]']\nOutputs (1): ['y[0]']\n\n"
        "   s + 0.02\n  -----------\n  s^2 + 0.1 s",
        lead,
    ),
    (
        "TransferFunction(\narray([1.  , 0.02]),\narray([1. , 0.1, 0. ]),\n"
        "outputs=1, inputs=1)",
        lead,
    ),
    (
        "  5 (s + 0.02) (s + (0.1-1j)) (s + (0.1+1j))\n"
        "  ------------------------------------------\n            (s) (s + 0.1) (s + 3)",
        lambda s: 5 * (s + 0.02) * ((s + 0.1) ** 2 + 1) / (s * (s + 0.1) * (s + 3)),
    ),
    (PYTHON_STATES, lead),
    (
        "StateSpace(\narray([[-0.1,  0. ],\n       [ 1. ,  0. ]]),\n"
        "array([[1.],\n       [0.]]),\n"
        "array([[1.  , 0.02]]),\narray([[0.]]),\nstates=2, outputs=1, inputs=1)",
        lead,
    ),
    ("control.ss([[-0.1, 0], [1, 0]], [[1], [0]], [[1, 0.02]], [[0]])", lead),
    ("C = control.tf([5], [1, 0])  # integrator", lambda s: 5 / s),
    # scipy
    (
        "TransferFunctionContinuous(\narray([1.  , 0.02]),\n"
        "array([1. , 0.1, 0. ]),\ndt: None\n)",
        lead,
    ),
    (
        "ZerosPolesGainContinuous(\narray([-0.02]),\narray([ 0. , -0.1]),\n5,\ndt: None\n)",
        lambda s: 5 * lead(s),
    ),
    (SCIPY_STATES, lead),
    ("signal.TransferFunction([1, 0.02], [1, 0.1, 0])", lead),
    ("(array([-0.02]), array([-0.1,  0. ]), np.float64(1.0))", lead),
    ("(array([1.  , 0.02]), array([1. , 0.1, 0. ]))", lead),
    ("[1, 0.02], [1, 0.1, 0]", lead),
    ("[-0.02], [0, -0.1], 7", lambda s: 7 * lead(s)),
    (
        "(array([-0.1+2.j, -0.1-2.j]), array([ 0., -1.]), 3.0)",
        lambda s: 3 * ((s + 0.1) ** 2 + 4) / (s * (s + 1)),
    ),
    # armlock
    (
        "Controller(zeros=((-1+0j),), poles=(0j, (-0.5+1j), (-0.5-1j)), gain=3.0)",
        lambda s: 3 * (s + 1) / (s * ((s + 0.5) ** 2 + 1)),
    ),
    (
        "from math import pi\nhertz = 2 * pi\ncontroller = Controller(\n"
        "    zeros=[0, -1e-8 * hertz],\n"
        "    poles=[-1e-6 * hertz, -1e-6 * hertz],\n    gain=5000,\n)",
        lambda s: 5000 * s * (s + 2e-8 * pi) / (s + 2e-6 * pi) ** 2,
    ),
    # Julia
    (
        "TransferFunction{Continuous, ControlSystemsBase.SisoZpk{Float64, Float64}}\n"
        "   (1.0s + 1.0)(1.0s - 1.0)\n2.0-------------------------\n"
        "   (1.0s + 5.0)(1.0s + 10.0)\n\nContinuous-time transfer function model",
        lambda s: 2 * (s + 1) * (s - 1) / ((s + 5) * (s + 10)),
    ),
    (
        "TransferFunction{Continuous, ControlSystemsBase.SisoRational{Float64}}\n1.0s + 0.02\n"
        "-------------\n1.0s^2 + 0.1s\n\nContinuous-time transfer function model",
        lead,
    ),
    ("using ControlSystems\nC = tf([1, 0.02], [1, 0.1, 0])", lead),
    ("julia> C = zpk([-0.02], [0, -0.1], 1)", lead),
    (JULIA_STATES, lead),
    # sympy and Maxima
    ("s + 1 \n──────\n 2    \ns  + s", lambda s: 1 / s),
    ("10⋅s + 0.2\n──────────\n 2        \ns  + 0.1⋅s", lambda s: 10 * lead(s)),
    ("  1      3\n────── + ─\n 2       s\ns  + 1    ", branches),
    (
        "         2\n4⋅(s + 1) \n──────────\n  3       \n s  + 2⋅s ",
        lambda s: 4 * (s + 1) ** 2 / (s**3 + 2 * s),
    ),
    ("  s + 1  \n---------\n 10      \ns   + 2*s", lambda s: (s + 1) / (s**10 + 2 * s)),
    ("TransferFunction(s + 0.02, s**2 + 0.1*s, s)", lead),
    ("(10*s + 0.2)/(s**2 + 0.1*s)", lambda s: 10 * lead(s)),
    ("exp(-2*s)*(s + 0.02)/(s**2 + 0.1*s)", lambda s: exp(-2 * s) * lead(s)),
    ("s = sympy.symbols('s')\nC = (s + 0.02)/(s**2 + 0.1*s)", lead),
    ("     s + 0.02\nC = -----------\n    s^2 + 0.1 s", lead),
    # expressions
    ("(s + 0.02)/(s^2 + 0.1 s)", lead),
    ("(s + 0.02) / (s² + 0.1 s)", lead),
    ("K(s) = 5 (s + 0.02) / (s (s + 0.1))", lambda s: 5 * lead(s)),
    ("0.3 + 5/s", lambda s: 0.3 + 5 / s),
    ("1/s*(s+1)", lambda s: (s + 1) / s),
    ("2.5e-3 s**2 - 1", lambda s: 2.5e-3 * s**2 - 1),
    ("-(s + 1)^2/s^2", lambda s: -((s + 1) ** 2) / s**2),
    ("-2^2/s", lambda s: -4 / s),
    ("2s^2/(s+1)^3", lambda s: 2 * s**2 / (s + 1) ** 3),
    ("5 (s+1) (s+2) / s^3", lambda s: 5 * (s + 1) * (s + 2) / s**3),
    ("(s+1)^-2", lambda s: (s + 1) ** -2),
    ("exp(-s)/s + exp(-s)", lambda s: exp(-s) * (1 / s + 1)),
    ("exp(-3*s)/exp(-s)/s", lambda s: exp(-2 * s) / s),
    ("exp(-12.3e-6 s)/s", lambda s: exp(-12.3e-6 * s) / s),
    ("e^(-0.3 s)/s", lambda s: exp(-0.3 * s) / s),
    ("T = 0.3; 2e**(-T*s)/s", lambda s: 2 * exp(-0.3 * s) / s),
    (
        "e^{-0.3 s} \\frac{10 s + 0.2}{s^{2} + 0.1 s}",
        lambda s: exp(-0.3 * s) * (10 * s + 0.2) / (s**2 + 0.1 * s),
    ),
    ("$K(s) = \\frac{5}{s}\\, e^{-2s}$", lambda s: 5 * exp(-2 * s) / s),
    ("\\dfrac{1}{s \\cdot \\left(s + 1\\right)}", lambda s: 1 / (s * (s + 1))),
    ("2 tf(1,[1 0])", lambda s: 2 / s),
    ("(1/s) (1/(s+1))", lambda s: 1 / (s * (s + 1))),
    ("--s", lambda s: s),
    ("sqrt(2)/(s + sqrt(2))", lambda s: sqrt(2) / (s + sqrt(2))),
    (
        "(1+2j)/(s+1-3j) + (1-2j)/(s+1+3j)",
        lambda s: (1 + 2j) / (s + 1 - 3j) + (1 - 2j) / (s + 1 + 3j),
    ),
    ("1/(s^4 + 5 s^2 + 4)", lambda s: 1 / (s**4 + 5 * s**2 + 4)),
    ("1/(s^3 + 3e-6 s^2 + 3e-12 s + 1e-18)", lambda s: 1 / (s + 1e-6) ** 3),
    ("5−3/s·2", lambda s: 5 - 6 / s),
    ("7", lambda s: 7.0 + 0 * s),
]

REFUSED = [
    # another controller before
    ("tf([1 2],[1 0]) tf([1],[1 1]", "not closed"),
    ("tf([1 2],[1 0]); tf(1,[1 1])", "which of them"),
    (
        "s = tf('s');\nC = 5/s;\nP = 1/(s+1);",
        "which of them is the controller is not said: C, P",
    ),
    ("s2", "s2 is not known"),
    ("tf(1,[1 1]) + exp(-s)*tf(1,[1 1])", "different dead times"),
    ("1/(1 + exp(-s)/s)", "different dead times"),
    ("feedback(tf(1,[1 0])*delay(1), 1)", "feedback with a dead time"),
    ("tf(1,[1 1],0.1)", "discrete in time"),
    ("control.tf([1], [1, 0.1], dt=0.1)", "discrete in time"),
    ("dt = 0.1\n\n     1\n  -------\n  z + 0.1", "discrete in time"),
    (
        "  1\n  -\n  z\n\nSample time: 0.1 seconds\nDiscrete-time transfer function.",
        "discrete in time",
    ),
    ("TransferFunction{Discrete{Float64}, X}\n1.0\n----\n1.0z", "discrete in time"),
    ("z = tf('z', 0.1)", "discrete in time"),
    ("1/(z - 1)", "z is not s"),
    ("tf(1, [1 1], 'Variable', 'z')", "discrete in time"),
    ("Inputs (2): ['u[0]', 'u[1]']\n 1\n -\n s", "several inputs"),
    ("tf(1,[1 1],'TimeUnit','minutes')", "its unit of time is minutes"),
    ("tf(1,[1 1],'Gain',3)", "the option Gain is not known"),
    ("s^2\n---\ns\n---\n1", "more than one line of dashes"),
    ("1\n---\n", "numerator above its dashes and a denominator below"),
    ("  s + 0.02 / ------ / s^2", "here should be"),
    ("s + 0.02 ------ s^2 + 0.1 s =", ""),
    (" 2    s + 1\ns  * -------\n      s + 2", "neither above nor below"),
    ("2      1\n  s  + s\n  ------\n  s", "stands over no s"),
    ("Kp + Ki * 1/s", "Kp is not known"),
    ("pade(0.1, 3)", "pade(..) is not known"),
    ("minreal(tf(1,[1 1]))", "minreal(..) is not known"),
    ("tf(1)(2)", ""),
    ("exp(s)/s", "dead time is negative"),
    ("exp(-s^2)", "a dead time is exp of minus a number times s"),
    ("1/2 s", "two ways"),
    ("(s+1)/s (s+2)", "two ways"),
    ("s^2^3", "two ways"),
    ("s^0.5", "whole number"),
    ("0,5/s", "decimals with a point"),
    ("zpk([], [-0,1], 5)", "decimals with a point"),
    ("2 3/s", "a sign is missing"),
    ("tf([1 2]', [1 0])", "transpose"),
    ("tf([1 2; 3 4], [1 0])", "one list, not a matrix"),
    ("tf({[1],[2]}, [1 0])", "this sign is not known"),
    ("tf([1 2])", "a list of numbers is no transfer function"),
    ("tf()", "takes 2 things"),
    ("tf([], [1 0])", "it is zero"),
    ("tf(1, 0)", "denominator is zero"),
    ("1/0", "divided by zero"),
    ("0*s", "it is zero"),
    ("zpk(-1+2i, 0, 1)", "come in pairs"),
    ("s + 2j", "come in pairs"),
    ("2j/s", "its gain is not real"),
    ("ss([1 2; 3 4], [1; 2], [1 2 3], 0)", "2 by 2"),
    ("ss([0 1; 0 0], [0; 1], [1 0], [0 0])", "1 by 1"),
    ("[1 0.02]", "a list of numbers is no transfer function"),
    ("[s+1, s]", "a list"),
    ("C(2)", "is not known"),
    ("s = tf('s'); C = 1/s; D = C(2)", "a value of C is not understood"),
    ("s = 3", "s stands for the variable"),
    ("C = 1/s\nC = 2/s", "given twice"),
    ("G = 5/(S+1)", "S is not known"),
    ("\\frac{1}{s", "here should be"),
    ("\\frac12", "here should be"),
    ("e^2/s", "write the exponent of e in brackets"),
    # decimal commas
    ("tf([1 0,02],[1 0,1 0])", "write decimals with a point"),
    ("tf([1,0 0,02],[1 1])", "write decimals with a point"),
    ("007/s", "write decimals with a point"),
    # two controllers
    ("tf(1,[1 0])tf(1,[1 1])", "two things stand side by side"),
    ("tf([1 2],[1 3]) tf(1,[1 0])", "two things stand side by side"),
    ("C = 1/s; D = 1/(s+1); C D", "two things stand side by side"),
    ("C = tf(1,[1 0],'InputDelay',1);\nC.InputDelay = 0.05", "dead time is given twice"),
    ("C = tf(1,[1 0]); C.InputDelay = 1; C.InputDelay = 2", "dead time is given twice"),
    # more than a page can work on
    ("a" * 10_000, f"{'a' * 30}… is not known"),
    ("(" * 5000 + "s" + ")" * 5000, "more than 100 brackets stand in each other"),
    ("[" * 5000 + "1" + "]" * 5000, "more than 100 brackets stand in each other"),
    ("\n".join(f"tf([1 {k}],[1 0 2])" for k in range(500)), "which of them"),
    (
        S1
        + "\n".join(f"C{k + 1} = C{k} + 1/(s+{k})" for k in range(1, 500)).replace("C1 ", "1 "),
        "it takes too long to work out",
    ),
    ("12.3 us", "us is not known"),
    ("Hello, world!", ""),
    ("=", "here should be"),
    ("", "it is empty"),
    ("tf([1 0.02], [1 0.1 0]) with delay", "with is not known"),
    ("1e999/s", "too large"),
    ("print(tf(1,[1 1]))", "print(..) is not known"),
    ("A = [0 1; 0 0]\nB = [0; 1]\nC = [1 0]", "which of them"),
    ("import os; os.system('x')", ""),
]

#: A rounded digit decides on which side of the axis a root is, or whether it is 0.
DOUBTFUL = [
    # A printed integrator: both rows should add up to 0.
    "ss([-0.1235 0.1234; 0.1235 -0.1234], [0; 1], [1 0], 0)",
    "A =\n        x1       x2\n x1  -0.1235   0.1234\n x2   0.1235  -0.1234\n\n"
    "B =\n     u1\n x1   1\n x2   0\n\n"
    "C =\n     x1  x2\n y1   1   0\n\nD =\n     u1\n y1   0\n",
    "tf(1, [1 0.1235 0.0000])",
    # Equal to four digits: (s^2 + 1.235) (s + 1).
    "1/(s^3 + s^2 + 1.235 s + 1.235)",
    "(s + 1.234)*(s - 0.0000)/(s + 1)^3",
    # What the package refuses: a PI controller in other coordinates, all digits printed, and
    # polynomials that were multiplied out.
    "ss([0.2639750240018368 0.15341104878230838; -0.6262933241092226 -0.36397502400183684], "
    "[-2.384531185626904; 0.9415187178512434], [-0.5360263721298273 -0.295449888980301], 0)",
    "tf([1 0.8 -1.3877787807814457e-17], [1 0.8 0.07])",
    "tf([2 5], [1 8 15 -1.3e-14])",
    "tf(1, [1 1e5 1e-4])",
]
CERTAIN = [
    "ss([1 1; 1 1], [1; 0], [1 0], 0)",
    "tf(1, [1 1e5 1])",
    "tf([1 1e-14], [1 0.8 0.07])",
    "tf([1 0.02], [1 0.1 0])",
    "1/(s^2 + 1.235)",
    "(s + 1.235)^3/(s^3 + 3.705 s^2 + 4.576 s + 1.884)",
    "ss([-0.1 0; 1 0], [1; 0], [1 0.02], 0)",
    "1/(s^3 + s^2 + s + 1)",
    "1/(s*(s + 1.234e-5))",
    # A zero in exponent form is exact, as python-control, numpy and scipy print it.
    "tf([1.00000000e+00 2.34567891e-05], [1.00000000e+00 1.23456789e-01 0.00000000e+00])",
    "array([1.00000000e+00, 2.34567891e-05]), "
    "array([1.00000000e+00, 1.23456789e-01, 0.00000000e+00])",
]
