"""What nm and objdump say of an object or a static library."""
import re
import subprocess
from typing import NamedTuple


class Symbol(NamedTuple):
    member: str  # the object in the library
    name: str
    kind: str  # nm's letter
    size: int
    section: str


class Section(NamedTuple):
    """One that is in memory when the program runs."""

    member: str
    name: str
    size: int
    flags: frozenset  # objdump's words

    @property
    def shared(self):
        """Other objects may hold it as well; the linker keeps one."""
        return any(flag.startswith("LINK_ONCE") for flag in self.flags)


def symbols(nm, path):
    member = ""
    for line in output(nm, "--format=sysv", path):
        opened = re.match(r"(?:Symbols|Undefined symbols) from .*\[(.*)\]:", line)
        if opened:
            member = opened[1]
        fields = [field.strip() for field in line.split("|")]
        if len(fields) == 7 and fields[0] != "Name":
            yield Symbol(member, fields[0], fields[2], int(fields[4] or "0", 16), fields[6])


def sections(objdump, path):
    member = ""
    for line in output(objdump, "-h", "-w", path):
        opened = re.match(r"(\S+):\s+file format", line)
        if opened:
            member = opened[1]
        fields = line.split(None, 7)
        if len(fields) == 8 and fields[0].isdigit() and "ALLOC" in fields[7]:
            yield Section(member, fields[1], int(fields[2], 16), frozenset(fields[7].replace(",", "").split()))


def output(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
