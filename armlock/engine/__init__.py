"""Certified decisions about functions with any number of delays, on the imaginary axis.

`polynomials`, `functions` and `affine` say what a function is, `statespace` what rounding makes
of one that is given as matrices. `values` evaluates functions anywhere. `inclusion` encloses
them on an interval of the axis, `chain` bounds them at its end, and `decide` counts zeros and
excludes them. Margins, counts and roots call these modules. The lemmas that they name are
proved in the book's appendix "The lemmas behind a count".
"""
