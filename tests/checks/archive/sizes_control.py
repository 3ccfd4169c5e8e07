"""Control of sizes.py and its table: what has grown has to be found, and a table read back is the one that was written."""
import pathlib
import sys
import tempfile

import record
from binutils import Section
from sizes import column_of, growth, module_of

BEFORE = {"core": {"code": 20000, "rodata": 1000, "data": 0}, "ram_micro": {"code": 0, "rodata": 0, "data": 1000000}}

# Growth by row, column and bytes, and whether it has to be found.
CASES = [
    ("core", "code", 1000, False),  # a twentieth
    ("core", "code", 1001, True),
    ("core", "code", -5000, False),
    ("core", "rodata", 512, False),  # over a twentieth, but few
    ("core", "rodata", 513, True),
    ("core", "data", 1, True),
    ("ram_micro", "data", 8, True),
    ("ram_micro", "data", -8, False),
]


def growths():
    for row, column, bytes_more, expected in CASES:
        after = {name: dict(columns) for name, columns in BEFORE.items()}
        after[row][column] += bytes_more
        yield f"{row} {column} {bytes_more:+}", bool(list(growth(after, BEFORE))) == expected
    yield "a module that is not recorded", len(list(growth({"new": BEFORE["core"]}, BEFORE))) == 1


def tables():
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "table.txt"
        path.write_text("# A comment.\n# columns: target row code rodata data\nother core 1 2 3\n")
        record.write(path, "board", {"gone": BEFORE["core"]})
        record.write(path, "board", BEFORE)
        yield "written and read", record.read(path, "board") == BEFORE
        yield "other targets stay", record.read(path, "other") == {"core": {"code": 1, "rodata": 2, "data": 3}}
        yield "comments stay", path.read_text().startswith("# A comment.\n")
        yield "a target without lines", record.read(path, "none") == {}


def sorting():
    of_source = {"ray.cpp": "grid"}
    yield "an object's module", module_of("ray.cpp.obj", of_source) == "grid" == module_of("ray.cpp.o", of_source)
    yield "KissFFT's", module_of("kiss_fftr.c.o", of_source) == "kissfft"
    columns = [
        (".text.f", {"ALLOC", "READONLY", "CODE"}, "code"),
        (".rodata.f", {"ALLOC", "READONLY", "DATA"}, "rodata"),
        (".data.rel.ro.local", {"ALLOC", "DATA"}, "rodata"),
        (".data", {"ALLOC", "DATA"}, "data"),
        (".bss", {"ALLOC"}, "data"),
    ]
    for name, flags, column in columns:
        yield name, column_of(Section("ray.cpp.o", name, 1, frozenset(flags))) == column


if __name__ == "__main__":
    results = [*growths(), *tables(), *sorting()]
    for what, good in results:
        print(f"{'ok' if good else 'WRONG'}: {what}")
    sys.exit(0 if all(good for _, good in results) else 1)
