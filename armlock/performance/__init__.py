"""Noise of the locked laser, and how far Doppler errors pull its frequency.

Both need a stable loop and refuse others.
"""
