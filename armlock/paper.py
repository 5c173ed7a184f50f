"""Numbers of the paper, each with its place, and those it leaves open.

"Robustness Analysis and Controller Design of Arm-locking System in Space-based
Gravitational Wave Detectors", Y. Shao, X. Zhao, L. Ma, M. Xin.
"""

from __future__ import annotations

import math
from typing import Final

#: Round-trip delay of the longer arm in s (Sec. III.A, the example of Fig. 4a).
TAU1: Final = 20.1
#: Round-trip delay of the shorter arm in s (Sec. III.A, the example of Fig. 4a).
TAU2: Final = 19.9

#: Step of the semi-discretization in s (caption of Fig. 4b).
STEP: Final = 0.05

#: Largest perturbation of c1 and c2 the paper considers (Sec. IV.A).
PERTURBATION: Final = 1e-6

#: Corner frequency p of the dual sensor in rad/s. The paper gives none; this one is taken
#: from a public arm-locking code for arms of the same length.
DUAL_SENSOR_CORNER: Final = 2.0 * math.pi * 0.4

#: Arm length of Taiji in m (mission design: three million kilometres).
TAIJI_ARM_LENGTH: Final = 3.0e9

#: Gain of the controller (Table II).
CONTROLLER_GAIN: Final = 5000.0
#: Pole of the controller's first stage in rad/s (Table II; Eq. 11 for its role).
TABLE_2_STAGE_1_POLE: Final = 2.0 * math.pi * 1e-6
#: Zeros of the controller in rad/s (Table II; Eq. 11 for their roles).
TABLE_2_ZEROS: Final = tuple(2.0 * math.pi * f for f in (1e-8, 5e-6, 5e-6, 5e-6))
#: Poles of the controller in rad/s (Table II; Eq. 11 for their roles).
TABLE_2_POLES: Final = tuple(2.0 * math.pi * f for f in (1e-6, 5e-5, 4e-4, 5e-5))

#: Frequency noise of the free-running laser at 1 Hz in Hz/sqrt(Hz); it falls as 1/f
#: (Sec. IV.C).
LASER_NOISE: Final = 30.0

#: Sample rate of the simulation in Hz (Sec. IV.C).
SAMPLE_RATE: Final = 200.0
#: Duration of the simulation in s (Sec. IV.C).
DURATION: Final = 200_000.0

#: Phase noise level in rad/sqrt(Hz) (Appendix, the spectrum taken for the perturbations).
PHASE_NOISE_LEVEL: Final = 3.6e-5
#: Corner of the phase noise in Hz (Appendix, the spectrum taken for the perturbations).
PHASE_NOISE_CORNER: Final = 2.8e-3
