"""Control of stack.py: small call graphs with known sums, and each thing that has no bound has to be refused.

usage: stack_control.py COMPILER FOLDER      COMPILER is a GCC, which describes a source of this control in FOLDER
"""
import pathlib
import subprocess
import sys

from call_graph import CallGraph, base_name
from stack import OUTSIDE, Bounds, Refused, Resolver, factors, most_factors, over_limit, read_graph

HEADER = pathlib.Path(__file__).resolve().parents[3] / "include/mellin/spectral/fft2.hpp"

SOURCE = r"""
void use(volatile char*);
struct Base { virtual int step() = 0; };
struct Small : Base { int step() override; };
struct Large : Base { int step() override; };
int Small::step() { volatile char space[100]; use(space); return 1; }
int Large::step() { volatile char space[3000]; use(space); return 2; }
int by_table(Base* base) { volatile char space[500]; use(space); return base->step() + space[1]; }
int by_caller(int (*read)(int)) { return read(1) + 1; }
int by_unknown(int (*mystery)(int)) { return mystery(1) + 2; }
void grows(int n) { volatile char space[n]; use(space); }
int ackermann(int m, int n) { return m == 0 ? n + 1 : n == 0 ? ackermann(m - 1, 1) : ackermann(m - 1, ackermann(m, n - 1)); }
"""


def graph_of(stack, calls):
    graph = CallGraph()
    graph.stack = dict(stack)
    graph.label = {name: f"void {name}()" for name in stack}
    graph.calls = {name: set(callees) for name, callees in calls.items()}
    return graph


def refusal(work):
    try:
        return work() and None
    except Refused as refused:
        return str(refused)


def check(what, good):
    print(f"{'ok' if good else 'WRONG'}: {what}")
    return good


def sums():
    chain = graph_of({"a": 10, "b": 20, "c": 400}, {"a": "bc", "b": ["memcpy"]})
    yield check("the deeper of two callees", Bounds(chain, 1).of("a") == 10 + 400)
    chain.stack["c"] = 100
    yield check("what is not compiled here", Bounds(chain, 1).of("a") == 10 + 20 + OUTSIDE)
    fft = graph_of({"kiss_fft": 8, "kf_work": 50, "leaf": 7}, {"kiss_fft": ["kf_work"], "kf_work": ["kf_work", "leaf"]})
    yield check("kf_work as often as it recurses", Bounds(fft, 6).of("kiss_fft") == 8 + 6 * 50 + 7)
    circle = graph_of({"a": 1, "b": 1}, {"a": "b", "b": "a"})
    yield check("a circle is refused", "recursion" in (refusal(lambda: Bounds(circle, 6).of("a")) or ""))
    absent = graph_of({"a": 1}, {"a": ["_ZN6mellin4noneEv"]})
    yield check("ours without a graph is refused", "no call graph" in (refusal(lambda: Bounds(absent, 6).of("a")) or ""))


def transform():
    # By hand: fours first, so that 1024 = 4^5; 3^6 = 729 and 4 * 3^5 = 972 have six, 2 * 3^6 is too long.
    yield check("factors", factors(1024) == [4] * 5 and factors(90) == [2, 3, 3, 5] and factors(48) == [4, 4, 3])
    yield check("most factors", most_factors(HEADER) == 6)


def names():
    yield check("a member's name", base_name("virtual bool ns::Matcher<4>::step(int (*)(void*)) const") == "step")
    yield check("an operator's name", base_name("ns::Line& ns::Line::operator<<(const char*)") == "operator<<")
    lambda_name = "static void ns::M::judge()::<lambda(void*, int)>::_FUN(void*, int)"
    yield check("a lambda's name", base_name(lambda_name) == "_FUN")


def limits():
    recorded = {"f": {"bytes": 800}}
    yield check("within the head-room", not list(over_limit({"f": {"bytes": 964}}, recorded)))
    yield check("over the head-room", len(list(over_limit({"f": {"bytes": 965}}, recorded))) == 1)
    yield check("not recorded", len(list(over_limit({"g": {"bytes": 1}}, recorded))) == 1)


def compiled(compiler, folder):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    source, compiled_to = folder / "control.cpp", folder / "control.o"
    source.write_text(SOURCE)
    subprocess.run([compiler, "-O2", "-w", "-fno-rtti", "-fno-exceptions", "-fcallgraph-info=su,da", "-c", source, "-o",
                    compiled_to], check=True)
    graph = read_graph([compiled_to])
    of = {graph.name(title): title for title in graph.stack}
    unknown = graph.indirect.pop(of["by_unknown"])
    Resolver(graph).resolve(of_caller=set())
    bounds = Bounds(graph, 1)
    large = bounds.of(of["by_table"])
    yield check(f"a virtual call is the largest of its functions: {large}", 3500 + OUTSIDE <= large <= 4000 + OUTSIDE)
    yield check("the caller's functions are the caller's", bounds.of(of["by_caller"]) < OUTSIDE)
    yield check("a growing frame is refused", "grows" in (refusal(lambda: bounds.of(of["grows"])) or ""))
    yield check("recursion is refused", "recursion" in (refusal(lambda: bounds.of(of["ackermann"])) or ""))
    graph.indirect = {of["by_unknown"]: unknown}
    resolving = refusal(lambda: Resolver(graph).resolve(of_caller=set()))
    yield check("an unknown call is refused", "not known" in (resolving or ""))
    yield check("a missing graph is refused", "missing" in (refusal(lambda: read_graph([folder / "other.o"])) or ""))


if __name__ == "__main__":
    results = [*sums(), *transform(), *names(), *limits(), *compiled(*sys.argv[1:])]
    sys.exit(0 if all(results) else 1)
