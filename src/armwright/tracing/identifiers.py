"""Identifiers for the text of other languages, made of names that users have chosen."""

import re
from collections.abc import Iterable

# Names longer than this are cut: C99 promises to tell 63 letters apart.
_LONGEST = 48
_C = (
    "auto break case char const continue default do double else enum extern float for goto if inline int long register "
    "restrict return short signed sizeof static struct switch typedef union unsigned void volatile while"
)
_CPP = (
    "alignas alignof and and_eq asm bitand bitor bool catch char16_t char32_t char8_t class co_await co_return "
    "co_yield compl concept const_cast consteval constexpr constinit decltype delete dynamic_cast explicit "
    "export false friend mutable namespace new noexcept not not_eq nullptr operator or or_eq private protected "
    "public reinterpret_cast requires static_assert static_cast template this thread_local throw true try "
    "typeid typename using virtual wchar_t xor xor_eq"
)
# What the text itself uses, and macros of the headers that it includes, or that are often included beside it.
_OURS = (
    "Real armwright detail fma fabs fabsf sqrt sqrtf sinf cosf atan2f rintf memcpy uint64_t NAN INFINITY HUGE_VAL "
    "HUGE_VALF EOF NULL stdin stdout stderr main linux unix std rows row status tile all near far small interface "
    "min max"
)
_RESERVED = frozenset(f"{_C} {_CPP} {_OURS}".split())
# What values are called in the text.
_VALUE = re.compile(r"v\d+")


def identifier(name: str, taken: Iterable[str] = (), *, otherwise: str = "x") -> str:
    """Return an identifier of C and C++ for a name: letters and digits of ASCII, other characters as an underscore.

    Args:
        name: any text.
        taken: identifiers that it must differ from; a number tells it apart.
        otherwise: what it is called, or begins with, where the name has no letter to begin with.
    """
    # No underscore at an end, and no two together: such identifiers belong to the compiler.
    letters = re.sub(r"[^A-Za-z0-9]+", "_", name)[:_LONGEST].strip("_")
    if not letters or letters[0].isdigit():
        letters = f"{otherwise}_{letters}".strip("_")
    taken, result, number = _RESERVED.union(taken), letters, 1
    while result in taken or _VALUE.fullmatch(result):
        number += 1
        result = f"{letters}_{number}"
    return result
