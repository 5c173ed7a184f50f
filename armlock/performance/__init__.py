"""Noise of the locked laser, and how far Doppler errors pull its frequency.

Both need a stable loop and refuse others.
"""

from armlock.performance.budget import NoiseBudget, noise_budget
from armlock.performance.pulling import pulling
from armlock.performance.transfer import transfer

__all__ = ["NoiseBudget", "noise_budget", "pulling", "transfer"]
