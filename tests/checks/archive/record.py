"""Tables of recorded numbers: a line for each target and row, with what was measured when the line was recorded.

    # columns: target row code rodata
    cortex-m7 core 4711 815
"""
import pathlib


def read(path, target):
    """{row: {column: number}} of one target; empty where nothing is recorded."""
    table = {}
    path = pathlib.Path(path)
    for line in path.read_text().splitlines() if path.exists() else []:
        if line.startswith("# columns: target row "):
            columns = line.split()[4:]
        elif line and not line.startswith("#"):
            of, row, *numbers = line.split()
            if of == target:
                table[row] = dict(zip(columns, map(int, numbers)))
    return table


def write(path, target, table):
    """Replaces the lines of one target, and leaves comments and other targets as they are."""
    path = pathlib.Path(path)
    lines = path.read_text().splitlines()
    kept = [line for line in lines if not line.split()[:1] == [target]]
    comments = [line for line in kept if line.startswith("#")]
    numbers = [line for line in kept if line and not line.startswith("#")]
    numbers += [" ".join([target, row, *map(str, columns.values())]) for row, columns in table.items()]
    numbers.sort(key=lambda line: line.split()[0])  # stable: the rows stay in their order
    path.write_text("\n".join(comments + numbers) + "\n")


def show(target, table):
    """Prints the table with its numbers aligned."""
    columns = list(next(iter(table.values())))
    width = max(len(row) for row in [*table, target])
    print(f"{target:{width}}" + "".join(f"{column:>14}" for column in columns))
    for row, numbers in table.items():
        print(f"{row:{width}}" + "".join(f"{numbers[column]:14,}" for column in columns))
