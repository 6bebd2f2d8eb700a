"""Results by the name of a tip or of a frame: views of the array that a kernel gives. It needs NumPy alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ._engines import Array
from ._kernel import Kernel, Layout

Result = TypeVar("Result")


Places = dict[str, tuple[Any, ...]]
"""For each name, what each array of a result is indexed with."""

_LAYOUTS: tuple[Layout, ...] = ("4x4", "3x4", "joint_major")


class ByName(Mapping[str, Result], Generic[Result]):
    """The parts of a result by name, as a mapping that cannot be changed; each part is a view of `result`.

    Args:
        word: What the names are names of, for the message of an unknown one.
        result: The whole result of a kernel: an array, or a tuple of arrays.
        places: The names in the order of the result, with the place of their parts.
    """

    __slots__ = ("_places", "_word", "result")

    def __init__(self, word: str, result: Any, places: Places) -> None:
        self._word, self.result, self._places = word, result, places

    def __getitem__(self, name: str) -> Result:
        """The part of one name: what a kernel of this frame alone gives."""
        try:
            places = self._places[name]
        except KeyError:
            raise KeyError(f"there is no {self._word} {name!r} (there are {', '.join(self._places)})") from None
        whole: Any = self.result
        if type(whole) is tuple:
            parts: Any = tuple(array[place] for array, place in zip(whole, places, strict=True))
        else:
            parts = whole[places[0]]
        found: Result = parts
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)

    def __repr__(self) -> str:
        return f"<results of {len(self)} {self._word}s: {', '.join(self._places)}>"


class NamedKernel(Kernel[Result]):
    """A kernel whose results have an axis of tips or frames, which have names.

    Args:
        name: As for `Kernel`, and so are the other arguments.
        names: The names, in the order of that axis.
        word: What they are names of: "tip" or "frame".
        options: The other arguments of `Kernel`.
    """

    kind = "kernel"

    def __init__(self, name: str, *, names: tuple[str, ...] = (), word: str = "tip", **options: Any) -> None:
        super().__init__(name, **options)
        self.names, self._word = names, word
        self._places = {layout: _places(names, self.results, layout) for layout in _LAYOUTS}

    def by_name(
        self,
        *inputs: ArrayLike,
        params: Any = None,
        out: Any = None,
        threads: int = 1,
        layout: Layout = "4x4",
    ) -> ByName[Result]:
        """Evaluate one configuration or a batch, for results by name.

        Args:
            inputs: As for a call of the kernel, and so are the other arguments.
            params: Values of the runtime parameters.
            out: Array for the whole result, or a tuple of arrays.
            threads: Number of threads that share a batch.
            layout: Order of the whole result.

        Returns:
            A mapping from each of `names` to its part of the result, a view; `.result` is the whole.
        """
        # A plain call goes to C without a detour; one with options does not.
        is_plain = params is None and out is None and threads == 1 and layout == "4x4"
        options: Any = {} if is_plain else {"params": params, "out": out, "threads": threads, "layout": layout}
        return ByName(self._word, self(*inputs, **options), self._places[layout])

    def named(self, result: Any, *, layout: Layout = "4x4") -> ByName[Result]:
        """The parts of a result that is there already, by name; nothing is copied or computed.

        Args:
            result: What this kernel gave, or will write through `bind`: an array, or a tuple where it has several.
            layout: The layout that it has.

        Returns:
            As `by_name`.

        Raises:
            TypeError: If it is not an array, or not as many as the kernel gives.
            ValueError: If it has another shape, or there is no such layout.
        """
        arrays = result if isinstance(result, tuple) else (result,)
        if len(arrays) != len(self.results) or isinstance(result, tuple) == (len(self.results) == 1):
            expected = "an array" if len(self.results) == 1 else f"a tuple of {len(self.results)} arrays"
            raise TypeError(f"{self.__name__}: the result is not {expected}")
        if layout not in _LAYOUTS:
            raise ValueError(f"{self.__name__}: no layout {layout!r} (there are {_LAYOUTS})")
        for described, array in zip(self.results, arrays, strict=True):
            self._check_shape(described, array, layout)
        return ByName(self._word, result, self._places[layout])

    def _check_shape(self, described: Array, array: Any, layout: str) -> None:
        if not isinstance(array, np.ndarray):
            raise TypeError(f"{self.__name__}: {described.name} is a {type(array).__name__}, expected a NumPy array")
        inner, major = described.laid_out(layout), layout == "joint_major"
        lead = array.ndim - len(inner)
        fits = array.ndim == 2 and array.shape[:1] == inner if major else array.shape[max(0, lead) :] == inner
        if not fits:
            expected = f"({inner[0]}, N)" if major else f"(..., {', '.join(map(str, inner))})"
            raise ValueError(f"{self.__name__}: {described.name} has shape {array.shape}, expected {expected}")


def _places(names: tuple[str, ...], results: tuple[Array, ...], layout: str) -> Places:
    """The places of the parts of each name in a layout."""
    if layout == "joint_major":
        sizes = [result.size // max(1, len(names)) for result in results]
        return {name: tuple(slice(i * size, (i + 1) * size) for size in sizes) for i, name in enumerate(names)}
    tails = [(slice(None),) * (len(result.shape) - 1) for result in results]
    return {name: tuple((..., i, *tail) for tail in tails) for i, name in enumerate(names)}
