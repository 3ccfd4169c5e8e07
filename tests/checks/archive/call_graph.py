"""The call graph of a program with the stack of each function, as GCC writes it beside its objects
(-fcallgraph-info=su,da): files in VCG format, one a translation unit."""
import pathlib
import re

FIELD = re.compile(r'(title|label|sourcename|targetname) ?: "([^"]*)"')
STACK = re.compile(r"\\n(\d+) bytes \((static|dynamic|dynamic,bounded|bounded)\)")
INDIRECT = "__indirect_call"


class CallGraph:
    def __init__(self):
        self.stack = {}  # bytes of a function's own frame, where its code was seen
        self.label = {}  # of these: "declaration\nfile:line:column\n…"
        self.calls = {}  # {caller: {callee}}
        self.indirect = {}  # {caller: {"file:line:column"}}
        self.unbounded = set()  # whose frames grow at run time

    def read(self, path):
        """Adds a translation unit. Static and inline functions are named with their files, so that equal names do
        not meet."""
        for line in pathlib.Path(path).read_text().splitlines():
            fields = dict(FIELD.findall(line))
            if line.startswith("node:"):
                self._node(fields["title"], fields["label"])
            elif line.startswith("edge:"):
                caller, callee = fields["sourcename"], fields["targetname"]
                if callee == INDIRECT:
                    self.indirect.setdefault(caller, set()).add(fields.get("label", ""))
                else:
                    self.calls.setdefault(caller, set()).add(callee)

    def join_constructors(self):
        """A complete object's constructor (C1) is mostly another name of the base object's (C2), which alone is
        described. Call it when all is read."""
        for callees in self.calls.values():
            for callee in sorted(callees):
                base = re.sub(r"([CD])1(?=E)", r"\g<1>2", callee)
                if callee not in self.stack and base in self.stack:
                    callees.remove(callee)
                    callees.add(base)

    def _node(self, title, label):
        found = STACK.search(label)
        if found is None:
            return  # only called here
        self.stack[title] = max(self.stack.get(title, 0), int(found[1]))
        self.label[title] = label.replace("\\n", "\n")
        if found[2] == "dynamic":
            self.unbounded.add(title)

    def name(self, title):
        """The function's name without scope, signature and the suffix of a clone: `step`, `operator<<`."""
        return base_name(self.declaration(title))

    def declaration(self, title):
        return self.label[title].split("\n")[0] if title in self.label else title

    def components(self, start):
        """Strongly connected components that `start` reaches, callees before callers (Tarjan 1972)."""
        order, low, on_path, path, found = {}, {}, set(), [], []

        def visit(node):
            order[node] = low[node] = len(order)
            path.append(node)
            on_path.add(node)
            for callee in self.calls.get(node, ()):
                if callee not in order:
                    visit(callee)
                    low[node] = min(low[node], low[callee])
                elif callee in on_path:
                    low[node] = min(low[node], order[callee])
            if low[node] == order[node]:
                component = set()
                while node not in component:
                    component.add(path.pop())
                on_path.difference_update(component)
                found.append(component)

        visit(start)
        return found


def symbol(title):
    """The linker's name; those of static and inline functions stand behind the file's."""
    return title.rsplit(":", 1)[-1]


def base_name(declaration):
    """The name in a declaration as GCC prints it: what stands before the list of parameters."""
    head = re.sub(r" \[with .*\]$", "", declaration)
    end = head.rfind(")")
    depth = 0
    for start in range(end, -1, -1):
        depth += {")": 1, "(": -1}.get(head[start], 0)
        if depth == 0:
            break
    found = re.search(r"(operator\W+|[~\w.]+)$", head[:start]) if end >= 0 else None
    return found[1] if found else head
