"""What the objects of a static library refer to and define: nothing of the heap, exceptions, RTTI, streams or libm's
transcendental functions, no state of their own, and nothing outside a short list of what a freestanding program has.

usage: symbols.py --nm NM ARCHIVE [--expect KIND…]

Prints a line for each finding; exit status 1 if there is any. With --expect the archive is a bad one, and the exit
status is 0 if each of the kinds named was found in it.
"""
import argparse
import re
import subprocess
import sys

TRANSCENDENTAL = (
    "a?sinh?|a?cosh?|a?tanh?|atan2|sincos|exp|exp2|exp10|expm1|log|log2|log10|log1p|pow|cbrt|hypot|erfc?|[lt]gamma"
)

# First match names the kind.
FORBIDDEN = [
    ("heap", r"(malloc|calloc|realloc|reallocarray|free|aligned_alloc|posix_memalign|strdup)"),
    ("heap", r"_Zn[wa].*|_Zd[la].*"),
    ("exceptions", r"__cxa_(throw|rethrow|allocate_exception|begin_catch|end_catch).*|__gxx_personality.*|_Unwind_.*"),
    ("exceptions", r"_ZSt\d+__throw_.*|_ZSt9terminatev"),
    ("rtti", r"_ZT[IS].*|__dynamic_cast|__cxa_bad_(cast|typeid)"),
    ("iostream", r".*(ios_base|basic_[io]?stream|basic_streambuf|St6locale).*"),
    ("guarded static", r"_ZGV.*|__cxa_guard_.*"),
    ("static constructor", r"_GLOBAL__sub_I_.*|_GLOBAL__I_.*|__cxx_global_var_init.*|(__cxa_)?atexit|__cxa_thread_atexit"),
    ("libm transcendental", rf"(__)?({TRANSCENDENTAL})[fl]?(_finite)?"),
]

# All that the library may ask of its surroundings: what a compiler may call by itself, and exact arithmetic.
ALLOWED = "|".join([
    r"mem(cpy|move|set|cmp)|strlen|strcmp",
    r"sqrtf?|fabsf?|floorf?|ceilf?|truncf?|rintf?|nearbyintf?|fmodf?|fminf?|fmaxf?|fmaf?|copysignf?|ldexpf?|frexpf?",
    r"__(aeabi|gnu)_.*|__(add|sub|mul|div|mod|udiv|umod|neg|cmp|ucmp|ashl|ashr|lshr|float|fix|popcount|c[lt]z).*[sdt][if]\d?",
    r"__stack_chk_(fail|guard)|_GLOBAL_OFFSET_TABLE_|__cxa_pure_virtual",
])

WRITABLE_SECTION = r"\.(t?data|t?bss|sdata|sbss|ldata|lbss)(\..*)?|\*COM\*"
CONSTANT_SECTION = r"\.data\.rel\.ro(\..*)?"  # constants that hold addresses, in position-independent code


def kind_of(name):
    return next((kind for kind, pattern in FORBIDDEN if re.fullmatch(pattern, name)), None)


def symbols(nm, archive):
    """(object, name, class, section) of each symbol."""
    listing = subprocess.run([nm, "--format=sysv", archive], check=True, capture_output=True, text=True).stdout
    member = ""
    for line in listing.splitlines():
        opened = re.match(r"(?:Symbols|Undefined symbols) from .*\[(.*)\]:", line)
        if opened:
            member = opened.group(1)
        fields = [field.strip() for field in line.split("|")]
        if len(fields) == 7 and fields[0] != "Name":
            yield member, fields[0], fields[2], fields[6]


def findings(all_symbols):
    defined = {name for _, name, kind, _ in all_symbols if kind not in "Uvw"}
    for member, name, kind, section in all_symbols:
        bad = kind_of(name)
        if bad:
            yield member, bad, name
        elif kind in "Uvw":
            if name not in defined and not re.fullmatch(ALLOWED, name):
                yield member, "not allowed", name
        elif re.fullmatch(WRITABLE_SECTION, section) and not re.fullmatch(CONSTANT_SECTION, section):
            yield member, "writable global", name


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--nm", default="nm")
    parser.add_argument("archive")
    parser.add_argument("--expect", nargs="+")
    arguments = parser.parse_args()
    all_symbols = list(symbols(arguments.nm, arguments.archive))
    found = sorted(set(findings(all_symbols)))
    for member, kind, name in found:
        print(f"{member}: {kind}: {name}")
    if arguments.expect:
        unseen = set(arguments.expect) - {kind for _, kind, _ in found}
        print("not found though there: " + ", ".join(sorted(unseen)) if unseen else "all that is bad was found")
        return 1 if unseen else 0
    print(f"{len({member for member, *_ in all_symbols})} objects, {len(all_symbols)} symbols, {len(found)} findings")
    return 1 if found or not all_symbols else 0


if __name__ == "__main__":
    sys.exit(main())
