"""What the library takes on a target: code, constants and data of each module, and the memory of each profile.

usage: sizes.py --objdump OBJDUMP --nm NM --sources DIR --profiles OBJECT --recorded FILE [--record] TARGET ARCHIVE

Prints the table in bytes. Exit status 1 where a module's code or constants have grown by more than a twentieth and 512
bytes over what was recorded, data has grown at all, or a profile needs more memory.

A module is a folder of src; KissFFT is one more. Constants include what unwinds the stack where the target keeps that.
Functions that several objects hold, of which the linker keeps one, count for the first. It is the whole archive: a
program links what it uses.
"""
import argparse
import pathlib
import re
import sys

import record
from binutils import sections, symbols
from symbols import CONSTANT_SECTION

SHARE = 20  # a twentieth …
SLACK_BYTES = 512  # … and this may come without a word
PROFILE = re.compile(r"mellin_ram_(\w+)")
COLUMNS = ("code", "rodata", "data")


def modules(sources):
    """{source file: folder}. The archive keeps file names only, so that no two may be equal."""
    found = {}
    for path in sorted(pathlib.Path(sources).rglob("*.cpp")):
        if path.name in found:
            sys.exit(f"sizes.py: two sources are called {path.name}")
        found[path.name] = path.relative_to(sources).parts[0]
    return found


def module_of(member, of_source):
    source = re.sub(r"\.o(bj)?$", "", member)
    if source.startswith("kiss_"):
        return "kissfft"
    if source not in of_source:
        sys.exit(f"sizes.py: {member} belongs to no module")
    return of_source[source]


def column_of(section):
    if "CODE" in section.flags:
        return "code"
    return "rodata" if "READONLY" in section.flags or re.fullmatch(CONSTANT_SECTION, section.name) else "data"


def module_sizes(objdump, archive, of_source):
    table = {module: dict.fromkeys(COLUMNS, 0) for module in [*sorted(set(of_source.values())), "kissfft"]}
    shared = set()  # sections that the linker keeps once
    for section in sections(objdump, archive):
        if section.shared and section.name in shared:
            continue
        if section.shared:
            shared.add(section.name)
        table[module_of(section.member, of_source)][column_of(section)] += section.size
    table["all"] = {column: sum(row[column] for row in table.values()) for column in COLUMNS}
    return table


def profile_sizes(nm, profiles):
    """{profile: bytes}"""
    named = ((PROFILE.fullmatch(symbol.name), symbol.size) for symbol in symbols(nm, profiles))
    return {profile[1]: size for profile, size in named if profile}


def growth(table, recorded):
    for row, columns in table.items():
        if row not in recorded:
            yield f"{row} is not recorded"
            continue
        for column, now in columns.items():
            before = recorded[row][column]
            free = max(before // SHARE, SLACK_BYTES) if column in ("code", "rodata") else 0
            if now > before + free:
                yield f"{row}: {column} has grown from {before} to {now} bytes; the limit is {before + free}"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--nm", default="nm")
    parser.add_argument("--objdump", default="objdump")
    parser.add_argument("--sources", required=True, help="src")
    parser.add_argument("--profiles", required=True, help="the object of profile_bytes.cpp")
    parser.add_argument("--recorded", required=True, help="the table, of all targets")
    parser.add_argument("--record", action="store_true", help="record instead of comparing")
    parser.add_argument("target")
    parser.add_argument("archive")
    arguments = parser.parse_args()

    table = module_sizes(arguments.objdump, arguments.archive, modules(arguments.sources))
    for profile, size in profile_sizes(arguments.nm, arguments.profiles).items():
        table[f"ram_{profile}"] = {"code": 0, "rodata": 0, "data": size}
    record.show(arguments.target, table)
    if arguments.record:
        record.write(arguments.recorded, arguments.target, table)
        return 0
    findings = list(growth(table, record.read(arguments.recorded, arguments.target)))
    print(*findings, sep="\n")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
