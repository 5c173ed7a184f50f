"""What happens along s = j omega, for certain: sums of exponentials, walks, counts.

Each walk bounds its steps by the curvature and by the rounding of what it follows, so that no
zero and no turn is stepped over; it knows no loop.
"""
