"""How far a loop is from instability: in gain, phase, delay, distance and perturbations.

Each margin comes from a certified search of the axis and is confirmed by counts of roots; what
cannot be certified is refused.
"""
