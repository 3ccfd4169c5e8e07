"""No include runs up the layers or in a circle, and no layer looks into another's private headers.

usage: layers.py ROOT      reads ROOT/include and ROOT/src; prints a line for each finding, exit status 1 if any
"""
import os
import re
import sys

MAY_INCLUDE = {
    "port": set(),  # include/mellin/port.h: C, beside core
    "core": {"port"},
    "grid": {"core", "port"},
    "spectral": {"core", "grid", "port"},
    "mapping": {"core", "grid", "port"},
    "store": {"core", "grid", "port"},
    "graph": {"core", "port"},
    "collection": {"core", "grid", "spectral", "store", "graph", "port"},
    "slam": {"core", "grid", "spectral", "mapping", "store", "graph", "collection", "port"},
}

# Of the libraries linked, and of the standard one: what has no place in headers that firmware reads, and what has none
# anywhere, since it brings heap, streams, locale, threads or the host.
PRIVATE_LIBRARIES = r"kiss_fft.*|Eigen/.*"
FORBIDDEN_STANDARD = set("""
any barrier codecvt condition_variable deque exception filesystem forward_list fstream functional future iomanip ios
iosfwd iostream istream latch list locale map memory memory_resource mutex ostream queue regex set shared_mutex sstream
stack stdexcept streambuf string strstream thread typeindex typeinfo unordered_map unordered_set vector
stdio.h cstdio stdlib.h cstdlib time.h ctime chrono random
""".split())

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
SOURCES = (".h", ".hpp", ".inc", ".c", ".cpp")


def layer_of(path):
    """The layer of a path relative to the root; None where the layout has no such place."""
    if path == "include/mellin/port.h":
        return "port"
    for top in ("include/mellin/", "src/"):
        if path.startswith(top):
            inner = path[len(top):].split("/")
            layer = inner[0] if len(inner) > 1 else "slam"
            return layer if layer in MAY_INCLUDE and layer != "port" else None
    return None


def files(root):
    for top in ("include", "src"):
        for folder, folders, names in os.walk(os.path.join(root, top)):
            folders.sort()
            for name in sorted(names):
                if name.endswith(SOURCES):
                    yield os.path.relpath(os.path.join(folder, name), root)


def resolve(root, path, target):
    """The file of the tree that an include means; None where it is not of the tree."""
    for base in (os.path.dirname(path), "include", "src"):
        candidate = os.path.normpath(os.path.join(base, target))
        if os.path.exists(os.path.join(root, candidate)):
            return candidate
    return None


def check_outside(path, target, quoted):
    if path.startswith("include/") and re.fullmatch(PRIVATE_LIBRARIES, target):
        return f"{path}: a public header includes {target}"
    if target in FORBIDDEN_STANDARD:
        return f"{path}: includes <{target}>"
    if quoted and not re.fullmatch(PRIVATE_LIBRARIES, target):
        return f"{path}: no such file: {target}"
    return None


def check_inside(path, layer, target):
    other = layer_of(target)
    if other is None:
        return f"{path}: {target} lies outside the layers"
    if other != layer and other not in MAY_INCLUDE[layer]:
        return f"{path}: {layer} must not include {other} ({target})"
    if target.startswith("src/") and path.startswith("include/"):
        return f"{path}: a public header includes a private one ({target})"
    if target.startswith("src/") and other != layer:
        return f"{path}: {target} is private to {other}"
    return None


def circles(includes):
    """Each circle among the files once, as the path that closes it."""
    done, found = set(), []

    def visit(path, trail):
        if path in trail:
            found.append(" -> ".join(trail[trail.index(path):] + [path]))
        elif path not in done:
            for target in includes.get(path, []):
                visit(target, trail + [path])
            done.add(path)

    for path in includes:
        visit(path, [])
    return found


def findings(root):
    includes, found = {}, []
    for path in files(root):
        layer = layer_of(path)
        if layer is None:
            found.append(f"{path}: in no layer")
            continue
        includes[path] = []
        with open(os.path.join(root, path), encoding="utf-8") as file:
            for bracket, target in INCLUDE.findall(file.read()):
                inside = resolve(root, path, target)
                if inside:
                    includes[path].append(inside)
                found.append(check_inside(path, layer, inside) if inside else check_outside(path, target, bracket == '"'))
    found += ["in a circle: " + circle for circle in circles(includes)]
    return len(includes), [finding for finding in found if finding]


def main():
    count, found = findings(sys.argv[1])
    print("\n".join(found + [f"{count} files, {len(found)} findings"]))
    return 1 if found or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
