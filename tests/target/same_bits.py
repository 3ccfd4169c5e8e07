#!/usr/bin/env python3
"""Maps the same scans on a board and on this machine and holds the hashes of trajectory, graph and flash image together.

usage: same_bits.py --host BUILD --board BOARD --image MAP.elf --work DIR [--log LOG] [--scans N] [--run "key=value …"]…

BUILD is the host preset's folder (its mellin and map.elf are used). Without --log the simulated building of seed 1 is
mapped. Each --run is a mapping of its own; the trajectories of different runs have to differ, or the comparison would
show little. The boards' own report is printed, for the cost and the memory that it tells.
"""
import argparse
import pathlib
import shutil
import subprocess
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[2]


def call(*command):
    words = [str(word) for word in command]
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        sys.exit(f"FAILED: {' '.join(words)}\nended with {done.returncode}:\n{done.stdout}")
    return done.stdout


def hashes(report):
    found = dict(line.split()[1:] for line in report.splitlines() if line.startswith("hash "))
    if sorted(found) != ["flash", "graph", "trajectory"]:
        sys.exit(f"FAILED: no hashes in the report:\n{report}")
    return found


def scans_of(arguments, folder):
    mellin = arguments.host / "bin" / "mellin"
    if not mellin.exists():
        sys.exit(f"FAILED: {mellin} is not there: build the host preset first")
    log = arguments.log
    if log is None:
        call(mellin, "sim", "-o", folder, "--seed", 1, "--loops", 1)
        log = folder / "sim-0.log"
    scans = folder / "log.scans"
    call(mellin, "record", log, "-o", scans, *(["--scans", arguments.scans] if arguments.scans else []))
    return scans


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--host", type=pathlib.Path, required=True)
    parser.add_argument("--board", required=True)
    parser.add_argument("--image", type=pathlib.Path, required=True)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--log", type=pathlib.Path)
    parser.add_argument("--scans", type=int)
    parser.add_argument("--run", action="append", default=[])
    arguments = parser.parse_args()
    if arguments.log is not None and not arguments.log.exists():
        print("skipped: no data")
        return
    shutil.rmtree(arguments.work, ignore_errors=True)
    arguments.work.mkdir(parents=True)
    scans = scans_of(arguments, arguments.work)
    trajectories = []
    for number, run in enumerate(arguments.run or [""]):
        here, there = (arguments.work / f"{where}-{number}" for where in ("host", "board"))
        here.mkdir()
        there.mkdir()
        expected = hashes(call(arguments.host / "bin" / "map.elf", scans, here, *run.split()))
        report = call(SOURCE / "port" / "run.sh", arguments.board, arguments.image, scans, there, *run.split())
        print(f"{arguments.board} {run}\n{report}")
        if hashes(report) != expected:
            sys.exit(f"FAILED: on this machine the hashes are {expected}")
        for name in ("live.tum", "trajectory.tum", "graph.g2o"):
            if (here / name).read_bytes() != (there / name).read_bytes():
                sys.exit(f"FAILED: {name} differs, its hash does not")
        trajectories.append(expected["trajectory"])
    if len(set(trajectories)) != len(trajectories):
        sys.exit(f"FAILED: different runs gave the same trajectory: {trajectories}")


if __name__ == "__main__":
    main()
