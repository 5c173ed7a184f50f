"""How many roots are unstable, where they are, and which parameters put one on the axis.

Counts, and the charts made of them, are certified: what rounding hides is -1, and a neutral
root chain that is not confined is -2.
"""
