"""How far a loop is from instability: in gain, phase, delay, distance and perturbations.

Each margin comes from a certified search of the axis; what cannot be certified is refused.
"""
