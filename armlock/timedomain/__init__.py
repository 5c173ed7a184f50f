"""A loop in time: noise of the laser, simulation of the locked laser, and spectra.

A simulation does not decide stability, because growth may take days. Counts of unstable roots
decide it.
"""
