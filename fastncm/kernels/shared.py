"""Named tuples of arrays, handed on by one pointer.

Numba hands a named tuple to a function field by field, and an array as seven numbers: the problem
alone is a hundred arguments of every call, which cost the compiler more than what the function
does. `share` puts the tuple into memory once, where compiled code comes in; what is read of it
later is loaded from there. It never changes, and LLVM is told so.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    models,
    register_model,
)

from fastncm.kernels.cache import JIT_OFF


class _SharedType(types.Type):
    """A named tuple in memory."""

    def __init__(self, record: Any):
        self.record = record
        super().__init__(name=f"Shared({record})")


@register_model(_SharedType)
class _SharedModel(models.PrimitiveModel):
    def __init__(self, manager: Any, shared: _SharedType):
        value = manager.lookup(shared.record).get_value_type()
        super().__init__(manager, shared, value.as_pointer())


def _share_in_compiled_code() -> Any:
    @intrinsic
    def share(typing: Any, record: Any) -> Any:
        def put(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return cgutils.alloca_once_value(builder, arguments[0])

        return _SharedType(record)(record), put

    return share


#: A named tuple with the same fields, which are not to be replaced. To be called where compiled
#: code comes in from Python.
share: Any = (lambda record: record) if JIT_OFF else _share_in_compiled_code()


@infer_getattr
class _SharedAttributes(AttributeTemplate):
    key = _SharedType

    def generic_resolve(  # type: ignore[override]
        self, shared: _SharedType, name: str
    ) -> Any:
        if name not in shared.record.fields:
            return None
        field = shared.record[shared.record.fields.index(name)]
        return _SharedType(field) if isinstance(field, types.BaseNamedTuple) else field


@lower_getattr_generic(_SharedType)
def _get_field(context: Any, builder: Any, shared: Any, value: Any, name: str) -> Any:
    index = shared.record.fields.index(name)
    place = cgutils.gep_inbounds(builder, value, 0, index)
    if isinstance(shared.record[index], types.BaseNamedTuple):
        return place
    return _load(builder, place)


def _load(builder: Any, place: Any) -> Any:
    """What is at `place`, number by number: LLVM splits whole arrays only late, and forgets then
    that nothing changes."""
    kind = place.type.pointee
    if isinstance(kind, ir.LiteralStructType | ir.ArrayType):
        whole = ir.Constant(kind, ir.Undefined)
        count = len(kind.elements) if isinstance(kind, ir.LiteralStructType) else kind.count
        for i in range(count):
            part = _load(builder, cgutils.gep_inbounds(builder, place, 0, i))
            whole = builder.insert_value(whole, part, i)
        return whole
    number = builder.load(place)
    number.set_metadata("invariant.load", builder.module.add_metadata([]))
    return number
