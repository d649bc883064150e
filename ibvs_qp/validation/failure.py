"""Name of a failure inside a step, for `Command.rejected`."""

from __future__ import annotations


def raised(where: str, error: BaseException) -> str:
    """What was raised and in which line; no text of the exception, which may be anything of a caller's."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    place = "" if trace is None else f" in {trace.tb_frame.f_code.co_name}, line {trace.tb_lineno}"
    return f"{where}: {type(error).__name__}{place}"
