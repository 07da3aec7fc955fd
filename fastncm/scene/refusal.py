"""How a bad value or a misspelt name is put into words, in one place."""

from collections.abc import Iterable
from difflib import get_close_matches

from fastncm.errors import SceneError

LONGEST_VALUE = 60  # characters of an offending value that are shown


def refusal(name: str, value: object, expected: str, case: int | None = None) -> SceneError:
    """The error "name = value (case i): must be expected"; `case` is None outside tables."""
    item = getattr(value, "item", None)
    shown = repr(item() if callable(item) and getattr(value, "ndim", 0) == 0 else value)
    if len(shown) > LONGEST_VALUE:
        shown = shown[:LONGEST_VALUE] + "..."
    where = "" if case is None else f" (case {case})"
    return SceneError(f"{name} = {shown}{where}: must be {expected}", name=name)


def nearest(word: str, known: Iterable[str]) -> str:
    """The sentence that points to the right name: the nearest one, or all of them."""
    names = list(known)
    by_tail = {name.rpartition(".")[2]: name for name in names}
    close = get_close_matches(word, names, n=1)
    if not close:
        close = [by_tail[tail] for tail in get_close_matches(word.rpartition(".")[2], by_tail, n=1)]
    return f"did you mean '{close[0]}'?" if close else f"known: {', '.join(names)}"


def unknown(word: str, known: Iterable[str], kind: str = "name") -> SceneError:
    """The error for a word that is none of `known`."""
    return SceneError(f"unknown {kind} '{word}'; {nearest(word, known)}", name=word)
