"""Control of layers.py: small trees, each with one fault that has to be found, and one without."""
import os
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import layers

CORE = {"include/mellin/port.h": "", "include/mellin/core/a.hpp": '#include "mellin/port.h"\n#include <cstdint>\n'}

CASES = [
    ("good", None, {
        "include/mellin/slam.hpp": '#include "mellin/grid/b.hpp"', "include/mellin/grid/b.hpp": '#include "mellin/core/a.hpp"',
        "src/grid/b.cpp": '#include "mellin/grid/b.hpp"\n#include "grid/own.hpp"\n#include <Eigen/Core>', "src/grid/own.hpp": "",
        "src/spectral/f.cpp": '#include "kiss_fft.h"'}),
    ("core to grid", "core must not include grid",
     {"src/core/a.cpp": '#include "mellin/grid/b.hpp"', "include/mellin/grid/b.hpp": ""}),
    ("by a relative path", "core must not include grid",
     {"include/mellin/core/c.hpp": '#  include "../grid/b.hpp"', "include/mellin/grid/b.hpp": ""}),
    ("with angle brackets", "core must not include grid",
     {"src/core/a.cpp": "#include <mellin/grid/b.hpp>", "include/mellin/grid/b.hpp": ""}),
    ("side by side", "graph must not include grid",
     {"src/graph/g.cpp": '#include "mellin/grid/b.hpp"', "include/mellin/grid/b.hpp": ""}),
    ("to the facade", "collection must not include slam",
     {"src/collection/c.cpp": '#include "mellin/config.hpp"', "include/mellin/config.hpp": ""}),
    ("the port's header upwards", "port must not include core", {"include/mellin/port.h": '#include "mellin/core/a.hpp"'}),
    ("private to another", "private to grid", {"src/spectral/f.cpp": '#include "grid/own.hpp"', "src/grid/own.hpp": ""}),
    ("public to private", "includes a private one",
     {"include/mellin/grid/b.hpp": '#include "grid/own.hpp"', "src/grid/own.hpp": ""}),
    ("public to a library", "public header includes Eigen", {"include/mellin/graph/g.hpp": "#include <Eigen/Core>"}),
    ("forbidden standard header", "includes <vector>", {"src/grid/b.cpp": "#include <vector>"}),
    ("missing", "no such file", {"src/grid/b.cpp": '#include "grid/none.hpp"'}),
    ("unknown layer", "in no layer", {"src/util/u.cpp": ""}),
    ("in a circle", "in a circle",
     {"include/mellin/grid/b.hpp": '#include "mellin/grid/c.hpp"', "include/mellin/grid/c.hpp": '#include "mellin/grid/b.hpp"'}),
]


def found_in(tree):
    with tempfile.TemporaryDirectory() as root:
        for path, text in {**CORE, **tree}.items():
            os.makedirs(os.path.join(root, os.path.dirname(path)), exist_ok=True)
            with open(os.path.join(root, path), "w", encoding="utf-8") as file:
                file.write(text)
        return layers.findings(root)[1]


def main():
    failed = 0
    for name, expected, tree in CASES:
        found = found_in(tree)
        right = not found if expected is None else any(expected in line for line in found)
        failed += not right
        print(f"{'ok' if right else 'FAILED'}: {name}: {found}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
