"""What the objects of a static library refer to and define: nothing of the heap, exceptions, RTTI, streams or libm's
transcendental functions, no state of their own, and nothing outside a short list of what a freestanding program has.
Sections are looked at beside symbols: what is writable, or runs before main(), need not have a name.

usage: symbols.py --nm NM --objdump OBJDUMP ARCHIVE [--expect KIND…]

Prints a line for each finding; exit status 1 if there is any. With --expect the archive is a bad one, and the exit
status is 0 if each of the kinds named was found in it.
"""
import argparse
import re
import sys

from binutils import sections, symbols

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
    ("static constructor", r"_GLOBAL__sub_I_.*|_GLOBAL__I_.*|__cxx_global_var_init.*|(__cxa_|__aeabi_)?atexit|__cxa_thread_atexit"),
    ("libm transcendental", rf"(__)?({TRANSCENDENTAL})[fl]?(_finite)?"),
]

# All that the library may ask of its surroundings: what a compiler may call by itself, and exact arithmetic.
ALLOWED = "|".join([
    r"mem(cpy|move|set|cmp)|strlen|strcmp",
    r"sqrtf?|fabsf?|floorf?|ceilf?|truncf?|rintf?|nearbyintf?|fmodf?|fminf?|fmaxf?|fmaf?|copysignf?|ldexpf?|frexpf?",
    r"__aeabi_([dfilu]|ui|ul|[cd][df]|mem|lasr|llsl|llsr).*|__gnu_[fdh]2[fdh].*",
    r"__(add|sub|mul|div|mod|udiv|umod|neg|cmp|ucmp|eq|ne|lt|le|gt|ge|unord|ashl|ashr|lshr|float|fix|extend|trunc|popcount|c[lt]z).*[sdt][if]\d?",
    r"__stack_chk_(fail|guard)|_GLOBAL_OFFSET_TABLE_|__cxa_pure_virtual",
])

UNDEFINED = "Uvw"
WRITABLE_CLASS = "DdBbSsGgCc"  # nm's: initialised data, zeroed data, both again for small objects, common
WRITABLE_SECTION = r"\.(t?data|t?bss|sdata|sbss|ldata|lbss)(\..*)?|\*COM\*"
CONSTANT_SECTION = r"\.data\.rel\.ro(\..*)?"  # constants that hold addresses, in position-independent code
START_SECTION = r"\.(preinit_array|init_array|ctors|init|fini_array|dtors|fini)(\..*)?"


def kind_of(name):
    return next((kind for kind, pattern in FORBIDDEN if re.fullmatch(pattern, name)), None)


def section_findings(all_sections):
    for section in all_sections:
        if section.size == 0 or re.fullmatch(CONSTANT_SECTION, section.name):
            continue
        if re.fullmatch(START_SECTION, section.name):
            yield section.member, "start section", section.name
        elif "READONLY" not in section.flags:
            yield section.member, "writable section", section.name


def symbol_findings(all_symbols):
    defined = {symbol.name for symbol in all_symbols if symbol.kind not in UNDEFINED}
    for member, name, kind, _, section in all_symbols:
        bad = kind_of(name)
        if bad:
            yield member, bad, name
        elif kind in UNDEFINED:
            if name not in defined and not re.fullmatch(ALLOWED, name):
                yield member, "not allowed", name
        elif is_writable(kind, section):
            yield member, "writable global", name


def is_writable(kind, section):
    if re.fullmatch(CONSTANT_SECTION, section):
        return False
    return kind in WRITABLE_CLASS or re.fullmatch(WRITABLE_SECTION, section) is not None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--nm", default="nm")
    parser.add_argument("--objdump", default="objdump")
    parser.add_argument("archive")
    parser.add_argument("--expect", nargs="+")
    arguments = parser.parse_args()
    all_symbols = list(symbols(arguments.nm, arguments.archive))
    all_sections = list(sections(arguments.objdump, arguments.archive))
    found = sorted({*symbol_findings(all_symbols), *section_findings(all_sections)})
    for member, kind, name in found:
        print(f"{member}: {kind}: {name}")
    if arguments.expect:
        unseen = set(arguments.expect) - {kind for _, kind, _ in found}
        print("not found though there: " + ", ".join(sorted(unseen)) if unseen else "all that is bad was found")
        return 1 if unseen else 0
    objects = len({symbol.member for symbol in all_symbols})
    print(f"{objects} objects, {len(all_symbols)} symbols, {len(all_sections)} sections, {len(found)} findings")
    return 1 if found or not all_symbols or not all_sections else 0


if __name__ == "__main__":
    sys.exit(main())
