"""What noise is left on the locked laser, and how far its frequency is pulled.

Responses are evaluated at the frequencies asked for, of a loop whose stability was counted.
"""

from armlock.performance.budget import NoiseBudget, noise_budget
from armlock.performance.pulling import pulling
from armlock.performance.transfer import closed_loop, transfer

__all__ = ["NoiseBudget", "closed_loop", "noise_budget", "pulling", "transfer"]
