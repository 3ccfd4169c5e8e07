"""The deepest stack of each public entry point, summed over the call graph.

usage: stack.py --fft-header FILE --limits FILE [--record | --path NAME] TARGET OBJECT…

Prints entry point -> bytes. Exit status 1 where one needs more than was recorded and the head-room, where a function
calls itself (but for KissFFT's kf_work), a frame grows at run time, or a call through a pointer cannot be resolved.

What the sum holds:
- each function's own frame by GCC's account, the deepest chain of calls; a tail call counts as a call;
- calls through pointers, by the source's line: a virtual function is every virtual function of that name; a callback
  inside the library is every function of that signature, a kernel every one of that name; the port's functions and observers (OF_CALLER) are the
  caller's own and count as nothing;
- OUTSIDE bytes, an allowance, for whatever is not compiled here: memcpy and its like, sqrt, and the arithmetic that
  the processor lacks; of those the compiler tells nothing (stack_high_water.py holds the sum to what an image used).
  On Linux the dynamic linker may come on top, once, at the first call of each;
- kf_work as often as a transform has factors. kiss_fft.c takes fours first, then twos, threes, fives, and recurses once
  a factor; the most that a side has which fft2.hpp takes is computed here.
Interrupts are the firmware's.
"""
import argparse
import functools
import math
import pathlib
import re
import sys

import record
from call_graph import CallGraph, symbol

OUTSIDE = 256
HEAD_ROOM = 8  # an eighth of what was recorded …
HEAD_ROOM_BYTES = 64  # … and this, for other versions of the compiler

# pose() and covariance() of Slam are inline: what runs is the mapper's.
CPP_ENTRY = re.compile(
    r"mellin::(?:Slam::(create|add|work|begin_flush|new_session|map_pose)|ParticleMapper::(pose|covariance))\(")
CPP_ENTRIES = 8
C_ENTRY = re.compile(r"^mellin_\w+$")
OURS = re.compile(r"(_Z\w*6mellin|mellin_)")

OF_CALLER = {"read", "program", "erase", "sync", "now_us", "fill", "write", "seen", "frozen", "visitor"}
CALLBACKS = {
    "decided": r"\(void\*, const mellin::PendingLink&, mellin::EdgeId\)",
    "relative": r"\(void\*, mellin::NodeId, mellin::NodeId, mellin::RelativePose&\)",
    "share_scans": r"\(void\*, const mellin::LoopHypothesis&, const mellin::LoopHypothesis&\)",
    # The kernels of src/spectral/kernels.hpp: of each vector unit the function of that name.
    **{name: rf"mellin::{{anonymous}}::{name}\(" for name in
       ("lines", "forward_rows", "inverse_rows", "inverse_rows_search", "whiten", "cross", "turned_run")},
}
RECURSIVE = "kf_work"


class Refused(Exception):
    """Something that has no bound."""


def most_factors(fft_header):
    """The deepest recursion of kf_work: the most factors of any length that the header's transform takes."""
    limits = re.search(r"side < (\d+) \|\| side > (\d+)", pathlib.Path(fft_header).read_text())
    if limits is None:
        raise Refused(f"{fft_header} no longer says which sides it takes")
    low, high = int(limits[1]), int(limits[2])
    # Rows are real transforms, over a complex one of half the length; columns complex ones of the whole.
    return max(len(factors(n)) for n in range(low // 2, high + 1) if set(factors(n)) <= {2, 3, 4, 5})


def factors(n):
    """As kf_factor() of kiss_fft.c takes them."""
    found, p, root = [], 4, math.isqrt(n)
    while n > 1:
        while n % p:
            p = {4: 2, 2: 3}.get(p, p + 2)
            p = n if p > root else p
        found.append(p)
        n //= p
    return found


def called_names(location):
    """What is called in the line of a call; GCC's column may name the call around the one that is meant."""
    path, line, _ = location.split("\n")[0].rsplit(":", 2)
    text = pathlib.Path(path).read_text().splitlines()[int(line) - 1]
    return re.findall(r"(\w+)\(", text)


class Resolver:
    """Puts edges in the place of calls through pointers. Where the compiler has merged two equal functions, the line is
    that of one; since the types of what they call are equal too, so is what is found here."""

    def __init__(self, graph):
        self.graph = graph
        self.virtual = {}  # {name: {title}}
        for title in graph.stack:
            if re.match(r"(constexpr )?virtual ", graph.declaration(title)):
                self.virtual.setdefault(graph.name(title), set()).add(title)

    def targets(self, name):
        if name in CALLBACKS:
            return {t for t in self.graph.stack if re.search(CALLBACKS[name], self.graph.declaration(t))}
        return self.virtual.get(name, set())

    def resolve(self, of_caller):
        """`of_caller`: what a name of OF_CALLER may run; empty where that is for others to count."""
        for caller, locations in self.graph.indirect.items():
            for location in locations:
                names = called_names(location) if location else []
                found = set().union(*(of_caller if name in OF_CALLER else self.targets(name) for name in names))
                if not found and OF_CALLER.isdisjoint(names):
                    raise Refused(f"{self.graph.declaration(caller)} calls through a pointer at {location or 'an unknown place'}: "
                                  "what that may be is not known")
                self.graph.calls.setdefault(caller, set()).update(found)


class Bounds:
    def __init__(self, graph, depth):
        self.graph = graph
        self.depth = depth
        self.cost = functools.lru_cache(maxsize=None)(self._cost)

    def of(self, entry):
        """Bytes of the deepest chain of calls from `entry`. Refused: it has no bound."""
        for component in self.graph.components(entry):
            self._check(component)
        return self.cost(entry)

    def _check(self, component):
        titles = sorted(component)
        for title in titles:
            if title not in self.graph.stack and OURS.match(symbol(title)):
                raise Refused(f"{title} has no call graph")
        grow = component & self.graph.unbounded
        if grow:
            raise Refused(f"the frame of {self.graph.declaration(min(grow))} grows at run time")
        calls_itself = len(titles) > 1 or titles[0] in self.graph.calls.get(titles[0], ())
        if calls_itself and not all(self._recursive(title) for title in titles):
            raise Refused("recursion: " + ", ".join(self.graph.declaration(title) for title in titles))

    def _recursive(self, title):
        return re.fullmatch(rf"{RECURSIVE}(\.\w+)*", symbol(title)) is not None

    def _cost(self, title):
        """A recursive function's frames together; then its deepest callee."""
        if title not in self.graph.stack:
            return OUTSIDE
        times = self.depth if self._recursive(title) else 1
        return times * self.graph.stack[title] + max(map(self.cost, self._callees(title)), default=0)

    def _callees(self, title):
        return {c for c in self.graph.calls.get(title, ()) if not (self._recursive(title) and self._recursive(c))}

    def path(self, title):
        while title is not None:
            yield title
            title = max(sorted(self._callees(title)), key=self.cost, default=None)


def entry_points(graph):
    """{name: title}"""
    found = {}
    for title in sorted(graph.stack):
        declared = CPP_ENTRY.search(graph.declaration(title))
        if declared:
            found["Slam::" + (declared[1] or declared[2])] = title
        elif C_ENTRY.match(title) and "c_interface.cpp:" in graph.label[title]:
            found[title] = title
    if sum(name.startswith("Slam::") for name in found) != CPP_ENTRIES or len(found) == CPP_ENTRIES:
        raise Refused("entry points are missing: " + ", ".join(found))
    return found


def read_graph(objects):
    """The graph of what these objects were compiled from."""
    graph = CallGraph()
    for compiled in map(pathlib.Path, objects):
        described = compiled.with_suffix(".ci")
        if not described.exists():
            raise Refused(f"{described} is missing: was it compiled with -fcallgraph-info=su,da?")
        graph.read(described)
    graph.join_constructors()
    return graph


def over_limit(table, recorded):
    for name, numbers in table.items():
        if name not in recorded:
            yield f"{name} is not recorded"
            continue
        limit = recorded[name]["bytes"] + recorded[name]["bytes"] // HEAD_ROOM + HEAD_ROOM_BYTES
        if numbers["bytes"] > limit:
            yield f"{name} needs {numbers['bytes']} bytes; {recorded[name]['bytes']} were recorded, the limit is {limit}"


def parse():
    parser = argparse.ArgumentParser()
    parser.add_argument("--fft-header", required=True, help="says which lengths the transform takes")
    parser.add_argument("--limits", required=True, help="what was recorded, of all targets")
    parser.add_argument("--record", action="store_true", help="record instead of comparing")
    parser.add_argument("--path", help="print the deepest chain of calls of one entry point instead")
    parser.add_argument("target")
    parser.add_argument("objects", nargs="+")
    return parser.parse_args()


def main():
    arguments = parse()
    graph = read_graph(arguments.objects)
    Resolver(graph).resolve(of_caller=set())
    bounds = Bounds(graph, most_factors(arguments.fft_header))
    entries = entry_points(graph)
    if arguments.path:
        for title in bounds.path(entries[arguments.path]):
            print(f"{graph.stack.get(title, OUTSIDE):7} {graph.declaration(title)}")
        return 0
    table = {name: {"bytes": bounds.of(title)} for name, title in entries.items()}
    # Whatever else of the library a program calls by itself.
    table["any_function"] = {"bytes": max(bounds.of(title) for title in sorted(graph.stack))}
    record.show(arguments.target, table)
    if arguments.record:
        record.write(arguments.limits, arguments.target, table)
        return 0
    findings = list(over_limit(table, record.read(arguments.limits, arguments.target)))
    print(*findings, sep="\n")
    return 1 if findings else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Refused as refused:
        sys.exit(f"stack.py: {refused}")
