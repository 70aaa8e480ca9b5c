"""What the command says on standard error, as Python's warnings."""
from __future__ import annotations

import warnings
from collections.abc import Iterable

from . import _itn


def tell(texts: Iterable[str], stacklevel: int = 1) -> None:
    """A warning each. stacklevel: 1 is the line that calls the function which calls this one."""
    for text in texts:
        warnings.warn(text, _itn.Warning, stacklevel=stacklevel + 2)
