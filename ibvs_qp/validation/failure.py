"""Name of a failure inside a step, for `Command.rejected`."""

from __future__ import annotations

#: The interpreter's own attributes: those of an exception or of its type may be replaced by code that raises.
_trace_of = BaseException.__dict__["__traceback__"].__get__
_name_of = type.__dict__["__name__"].__get__
#: Longest name of an exception's type [characters].
_LONGEST_NAME = 40


def type_name(value: object) -> str:
    """Name of a value's type, cut; never raises."""
    return _name_of(type(value))[:_LONGEST_NAME]


def raised(where: str, error: BaseException) -> str:
    """Type and line of an exception; never raises, and has no text of the exception, which may be a caller's."""
    trace = _trace_of(error)
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    place = "" if trace is None else f" in {trace.tb_frame.f_code.co_name}, line {trace.tb_lineno}"
    return f"{where}: {type_name(error)}{place}"
