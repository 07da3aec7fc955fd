"""Records of arrays in one block of memory, at places that the compiler knows.

The lanes need some ninety arrays. Handed over as arrays they are hundreds of pointers and sizes:
more than there are registers, so that LLVM reloads one before nearly every use, and cannot tell
that two of them never overlap. In a workspace each array lies at a fixed distance from one pointer,
and its sizes are constants but for the first. So a workspace costs a compiled function a pointer
and a few numbers, whatever it holds.

A `Layout` says which arrays there are. Compiled code makes a workspace from a block with ``over =
layout.over()`` and reads ``workspace.name`` like the attribute of a named tuple; an array's place
is only worked out where it is used.
"""

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numba import from_dtype, types
from numba.core import cgutils
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    models,
    register_model,
)
from numba.np.arrayobj import make_array, populate_array

from fastncm.kernels.cache import JIT_OFF

#: Bytes on whose multiples the arrays begin: a line of the cache.
_LINE = 64

#: Types of what an array holds.
NUMBER, INDEX, FLAG = np.float64, np.int64, np.bool_

#: A size of an array: a number, or the name of one that the workspace is made with.
Size = int | str


class Place(NamedTuple):
    """Where an array of a layout is: its type and sizes; bytes from the block's beginning; and the
    sizes of the arrays of open extent before it, in bytes but for their named sizes."""

    dtype: type
    shape: tuple[Size, ...]
    offset: int
    behind: tuple[tuple[int, tuple[str, ...]], ...]


class Layout:
    """The arrays of a workspace.

    most: the sizes that are named, and the most that each may be. arrays: name to (type, sizes). A
    named size may come first, for which there is room for the most; arrays with several named sizes
    take the room that they need, and lie behind all others.
    """

    def __init__(
        self,
        name: str,
        most: dict[str, int],
        arrays: dict[str, tuple[type, tuple[Size, ...]]],
    ):
        self.name, self.most = name, most
        self.places: dict[str, Place] = {}
        end = 0
        open_ended = {}
        for array, (dtype, shape) in arrays.items():
            if any(isinstance(size, str) for size in shape[1:]):
                open_ended[array] = (dtype, shape)
                continue
            self.places[array] = Place(dtype, shape, end, ())
            count = most[shape[0]] if isinstance(shape[0], str) else shape[0]
            rest = [size for size in shape[1:] if isinstance(size, int)]
            end += _round_up(int(np.prod([count, *rest])) * np.dtype(dtype).itemsize)
        behind: tuple[tuple[int, tuple[str, ...]], ...] = ()
        for array, (dtype, shape) in open_ended.items():
            self.places[array] = Place(dtype, shape, end, behind)
            numbers = [size for size in shape if isinstance(size, int)]
            names = tuple(size for size in shape if isinstance(size, str))
            behind = (*behind, (int(np.prod(numbers)) * np.dtype(dtype).itemsize, names))
        self._end, self._behind = end, behind

    def size_of(self, sizes: tuple[int, ...]) -> int:
        """Bytes that a workspace of these sizes needs."""
        return _LINE + self._end + _extent(self._behind, dict(zip(self.most, sizes, strict=True)))

    def over(self, begin: int = 0) -> Callable[..., Any]:
        """What makes a workspace from a block, an array of bytes, and a tuple of the named sizes.

        begin: bytes of the block that are left to others.
        """
        return _over_in_python(self, begin) if JIT_OFF else _over_in_compiled_code(self, begin)


def _round_up(size: int) -> int:
    return -(-size // _LINE) * _LINE


def _extent(behind: tuple[tuple[int, tuple[str, ...]], ...], sizes: dict[str, int]) -> int:
    return sum(unit * math.prod([sizes[name] for name in names]) for unit, names in behind)


def _over_in_python(layout: Layout, first: int) -> Callable[..., Any]:
    def over(block: np.ndarray, sizes: tuple[int, ...]) -> SimpleNamespace:
        named = dict(zip(layout.most, sizes, strict=True))
        workspace = SimpleNamespace()
        for array, place in layout.places.items():
            shape = [named[size] if isinstance(size, str) else size for size in place.shape]
            begin = first + place.offset + _extent(place.behind, named)
            end = begin + int(np.prod(shape)) * np.dtype(place.dtype).itemsize
            setattr(workspace, array, block[begin:end].view(place.dtype).reshape(shape))
        return workspace

    return over


class _WorkspaceType(types.Type):
    """A workspace in compiled code: the block's pointer and the named sizes."""

    def __init__(self, layout: Layout):
        self.layout = layout
        super().__init__(name=f"Workspace({layout.name})")


@register_model(_WorkspaceType)
class _WorkspaceModel(models.StructModel):
    def __init__(self, manager: Any, workspace: _WorkspaceType):
        sizes = [(name, types.intp) for name in workspace.layout.most]
        super().__init__(manager, workspace, [("block", types.CPointer(types.uint8)), *sizes])


def _over_in_compiled_code(layout: Layout, begin: int) -> Any:
    workspace = _WorkspaceType(layout)

    @intrinsic
    def over(typing: Any, block: Any, sizes: Any) -> Any:
        def make(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            block, sizes = arguments
            made = cgutils.create_struct_proxy(workspace)(context, builder)
            word = context.get_value_type(types.intp)
            data = make_array(signature.args[0])(context, builder, value=block).data
            rest = builder.and_(builder.neg(builder.ptrtoint(data, word)), word(_LINE - 1))
            made.block = builder.gep(builder.gep(data, [rest]), [word(begin)])
            for i, name in enumerate(layout.most):
                setattr(made, name, builder.extract_value(sizes, i))
            return made._getvalue()

        return workspace(block, sizes), make

    return over


@infer_getattr
class _WorkspaceAttributes(AttributeTemplate):
    key = _WorkspaceType

    def generic_resolve(  # type: ignore[override]
        self, workspace: _WorkspaceType, name: str
    ) -> Any:
        place = workspace.layout.places.get(name)
        return place and types.Array(from_dtype(np.dtype(place.dtype)), len(place.shape), "C")


@lower_getattr_generic(_WorkspaceType)
def _get_array(context: Any, builder: Any, workspace: Any, value: Any, name: str) -> Any:
    """The array `name` where its layout says, with constants for what does not change."""
    place = workspace.layout.places[name]
    made = cgutils.create_struct_proxy(workspace)(context, builder, value=value)
    word = context.get_value_type(types.intp)

    def product(number: int, names: tuple[str, ...]) -> Any:
        total = word(number)
        for size in names:
            total = builder.mul(total, getattr(made, size))
        return total

    offset = word(place.offset)
    for number, names in place.behind:
        offset = builder.add(offset, product(number, names))
    itemsize = np.dtype(place.dtype).itemsize
    shape: list[Any] = []
    strides: list[Any] = []
    number, names = itemsize, ()
    for size in reversed(place.shape):
        strides.insert(0, product(number, names))
        if isinstance(size, str):
            shape.insert(0, getattr(made, size))
            names = (*names, size)
        else:
            shape.insert(0, word(size))
            number *= size
    kind = types.Array(from_dtype(np.dtype(place.dtype)), len(place.shape), "C")
    array = make_array(kind)(context, builder)
    data = builder.gep(made.block, [offset])
    populate_array(
        array,
        data=builder.bitcast(data, array.data.type),
        shape=shape,
        strides=strides,
        itemsize=itemsize,
        meminfo=None,
    )
    return array._getvalue()
