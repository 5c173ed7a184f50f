"""Certified decisions about functions with any number of delays, on the imaginary axis.

`polynomials` and `functions` say what a function is, `inclusion` encloses it on an interval,
`decide` counts zeros and excludes them, `margins` and `roots` ask for both. The lemmas that
these modules name are proved in the book's appendix "The lemmas behind a count".
"""
