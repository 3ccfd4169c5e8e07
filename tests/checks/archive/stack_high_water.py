"""Holds the sum of stack.py to the truth: a firmware image that paints its stack maps a simulated building, and what it
used must not be more than the sum over the image's own call graph.

usage: stack_high_water.py --fft-header FILE --program MELLIN --folder DIR --run COMMAND… --objects OBJECT…

COMMAND runs port/images/map.cpp; --objects are the library's and the image's. --program is the host's, which makes the
log. Here the port's functions do count: whatever of the image takes a context (void*) first.
"""
import argparse
import pathlib
import re
import subprocess
import sys

from stack import Bounds, Refused, Resolver, most_factors, read_graph

SCANS = 150
START_BYTES = 64  # above its own frame, start.c leaves this unpainted


def bound(arguments):
    graph = read_graph(arguments.objects)
    library = {title for title in graph.stack if "/src/" in graph.label[title] or "/include/mellin/" in graph.label[title]}
    port = {title for title in graph.stack if "(void*" in graph.declaration(title)} - library
    graph.indirect.pop("start", None)  # constructors, before main()
    Resolver(graph).resolve(of_caller=port)
    bounds = Bounds(graph, most_factors(arguments.fft_header))
    return graph.stack["start"] + START_BYTES + bounds.of("main")


def scans(program, folder):
    """A stream for the image, of a loop in the simulated building."""
    subprocess.run([program, "sim", "-o", folder, "--seed", "1", "--loops", "1"], check=True, stdout=subprocess.DEVNULL)
    stream = folder / "scans.bin"
    subprocess.run([program, "record", folder / "sim-0.log", "-o", stream, "--scans", str(SCANS)], check=True,
                   stdout=subprocess.DEVNULL)
    return stream


def used(command):
    """Bytes of stack that the image says it used."""
    # The emulator's semihosting writes to standard error.
    ran = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    output = ran.stdout
    print(output, end="")
    if ran.returncode != 0:
        raise Refused(f"the image ended with status {ran.returncode}")
    found = re.search(r"stack used (\d+) of (\d+) bytes", output)
    submaps = re.search(r"submaps (\d+)", output)
    if found is None or submaps is None or int(submaps[1]) < 2:
        raise Refused("the image did not say how much it used, or mapped too little to tell")
    return int(found[1])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--fft-header", required=True)
    parser.add_argument("--program", required=True)
    parser.add_argument("--folder", required=True, type=pathlib.Path)
    parser.add_argument("--run", nargs="+", required=True)
    parser.add_argument("--objects", nargs="+", required=True)
    arguments = parser.parse_args()
    if not pathlib.Path(arguments.program).exists():
        raise Refused(f"{arguments.program} is missing: build the preset host first")
    arguments.folder.mkdir(parents=True, exist_ok=True)
    most = bound(arguments)
    measured = used([*arguments.run, scans(arguments.program, arguments.folder), arguments.folder])
    print(f"painted high-water mark {measured} bytes, bound {most} bytes")
    return 0 if measured <= most else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Refused as refused:
        sys.exit(f"stack_high_water.py: {refused}")
