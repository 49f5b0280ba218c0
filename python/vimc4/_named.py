"""Which function or object a driver is, in words that are the same in every process."""

from __future__ import annotations

import copyreg
import functools
import hashlib
import types
from typing import Any, Callable, NamedTuple

LONGEST = 240
"""So many characters of a name are shown; a digest stands for what is behind them."""

MOST = 1_000
"""An object of more parts than these is not taken apart."""

PLAIN = (type(None), bool, int, float, complex, str, bytes, type(...), type(NotImplemented))


class Named(NamedTuple):
    """A driver by its name and by what it carries."""

    text: str
    unclear: str | None
    """What it carries of which nothing can be said, such as a lock or an open file."""


def named(drive: Callable[..., object]) -> Named:
    """What tells a driver from others: its name, and by their values the arguments of a partial, the attributes
    of an object, and what a function that is made in another takes from there. Not what its text says."""
    teller = _Teller()
    text = teller.tell(drive)
    if len(text) > LONGEST:
        text = f"{text[:LONGEST]}… ({hashlib.sha256(text.encode()).hexdigest()[:16]})"
    return Named(text, teller.unclear)


class _Teller:
    def __init__(self) -> None:
        self.unclear: str | None = None
        self._around: list[int] = []
        self._parts = 0

    def tell(self, value: Any) -> str:
        self._parts += 1
        if type(value) in PLAIN:
            return repr(value)
        if id(value) in self._around:
            return "…"
        if self._parts > MOST or len(self._around) > 50:
            return self._nothing_of(value)
        self._around.append(id(value))
        try:
            return self._inside(value)
        finally:
            self._around.pop()

    def _inside(self, value: Any) -> str:
        if isinstance(value, types.ModuleType):
            return value.__name__
        if isinstance(value, types.FunctionType):
            return self._function(value)
        if isinstance(value, (types.MethodType, types.BuiltinMethodType)):
            of = value.__self__
            if of is None or isinstance(of, types.ModuleType):
                return _name(value)
            method = value.__func__ if isinstance(value, types.MethodType) else value
            return f"{_name(method)} of {self.tell(of)}"
        if isinstance(value, type):
            return _name(value)
        if isinstance(value, functools.partial):
            return self.tell(value.func) + self._given(value.args, value.keywords)
        if type(value) in (list, tuple):
            return f"[{', '.join(map(self.tell, value))}]"
        if type(value) in (set, frozenset):
            return f"{{{', '.join(sorted(map(self.tell, value)))}}}"
        if type(value) is dict:
            return f"{{{', '.join(f'{self.tell(key)}: {self.tell(one)}' for key, one in value.items())}}}"
        return self._object(value)

    def _function(self, function: types.FunctionType) -> str:
        name = _name(function)
        if "<" not in name:
            # There is one of this name in its module.
            return name
        code = function.__code__
        if function.__name__ == "<lambda>":
            name += f" in line {code.co_firstlineno}"
        carried: dict[str, Any] = {}
        usual = function.__defaults__ or ()
        carried |= zip(code.co_varnames[code.co_argcount - len(usual) : code.co_argcount], usual)
        carried |= function.__kwdefaults__ or {}
        for free, cell in zip(code.co_freevars, function.__closure__ or ()):
            try:
                carried[free] = cell.cell_contents
            except ValueError:
                # It has no value yet.
                pass
        return name + (self._given((), carried) if carried else "")

    def _object(self, value: Any) -> str:
        """An object is what `pickle` would keep of it."""
        try:
            reduce = copyreg.dispatch_table.get(type(value))
            kept = value.__reduce_ex__(4) if reduce is None else reduce(value)
            if isinstance(kept, str):
                return f"{type(value).__module__}.{kept}"
            make, args, state, items, pairs = (*kept, None, None, None)[:5]
            keywords: dict[str, Any] = {}
            if make is getattr(copyreg, "__newobj__"):
                make, *args = args
            elif make is getattr(copyreg, "__newobj_ex__"):
                make, args, keywords = args
            match state:
                case None:
                    pass
                case dict():
                    keywords = keywords | state
                case (None | dict() as attributes, dict() as slots):
                    keywords = keywords | (attributes or {}) | slots
                case _:
                    keywords = keywords | {"state": state}
            more = [*([list(items)] if items else []), *([dict(pairs)] if pairs else [])]
            return self.tell(make) + self._given((*args, *more), keywords)
        except Exception:
            return self._nothing_of(value)

    def _given(self, args: Any, keywords: dict[str, Any]) -> str:
        given = [*map(self.tell, args), *(f"{name}={self.tell(one)}" for name, one in keywords.items())]
        return f"({', '.join(given)})"

    def _nothing_of(self, value: Any) -> str:
        self.unclear = self.unclear or f"an object of the class {_name(type(value))}"
        return f"<{_name(type(value))}>"


def _name(of: Any) -> str:
    # Some of those that are built in say no module.
    module, name = getattr(of, "__module__", None), of.__qualname__
    return f"{module}.{name}" if module else str(name)
