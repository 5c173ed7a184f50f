"""How functions are compiled: by numba, which keeps the result for the next process.

numba keeps compiled functions beside the source, in the user's cache, or in the folder that
NUMBA_CACHE_DIR names. `make clean` removes those beside the source.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba


def njit(
    *,
    nogil: bool = False,
    error_model: str = "python",
    inner: bool = False,
    inlined: bool = False,
    allocates: bool = True,
) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function when it is first called with arguments of these types.

    Parameters
    ----------
    nogil : bool, optional
        Whether other threads run while the function does.
    error_model : str, optional
        What a division by zero does: it raises, or with "numpy" gives inf or nan.
    inner : bool, optional
        Whether only compiled functions call it. Then it compiles in less time.
    inlined : bool, optional
        Whether it becomes part of the functions that call it. numba passes each array of an
        argument as eight numbers, which takes longer than a short function runs.
    allocates : bool, optional
        Whether it makes or returns arrays. If not, numba does not count references to arrays,
        which takes as long as a short loop.

    Returns
    -------
    callable
        The decorator.
    """
    options = {
        "nogil": nogil,
        "error_model": error_model,
        "no_cfunc_wrapper": True,
        "no_cpython_wrapper": inner,
        "inline": "always" if inlined else "never",
        "_nrt": allocates,
    }

    def decorate(function: Callable[..., Any]) -> Any:
        try:
            return numba.njit(cache=True, **options)(function)
        except RuntimeError:
            # No folder can be written: each process compiles for itself.
            return numba.njit(**options)(function)

    return decorate
