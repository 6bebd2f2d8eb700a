"""The modules that `kinegen.compile` made, as submodules: `kinegen.runtime.compiled.puma560_1f3a...`.

They lie in the user's cache folder, which is the path of this package. So a kernel that was pickled is found again by
another process of the same user, such as a worker of `multiprocessing` or Dask on this machine.
"""

from __future__ import annotations

from pathlib import Path

from kinegen.runtime.cache import Cache


def cache_folder() -> Path | None:
    """Where compiled modules are kept; None where there is no cache, or it may not be trusted."""
    cache = Cache()
    return None if cache.folder is None or cache.refusal else cache.folder / "modules"


__path__: list[str] = [str(folder)] if (folder := cache_folder()) else []
