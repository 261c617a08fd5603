#!/usr/bin/env python3
"""Shows that each guard is needed: spoils one branch at a time, and the named test must go red.

A spoiled source file is compiled into a library of its own, which is loaded in front of the real one. So one mutant costs one
file. The table (test/mutants_table.py of a package) follows the code. An entry whose text is not found exactly once is an error. So is
a branch of a guarded file without an entry, and without a reason why it needs none.
usage: mutants.py --package DIR --tests DIR --prefix WORD --include DIR … [--some N] [--only WORD]
"""
import argparse
import importlib.util
import os
import re
import subprocess
import sys
import tempfile

SECONDS = 120  # of processor time for a mutant's test: one that takes more hangs
BRANCH = re.compile(r"\bif \(|\bwhile \(| \? |std::min\(|std::max\(|std::clamp\(")


def load(package):
    spec = importlib.util.spec_from_file_location("mutants_table", os.path.join(package, "test", "mutants_table.py"))
    table = importlib.util.module_from_spec(spec)
    sys.dont_write_bytecode = True
    spec.loader.exec_module(table)
    return table


def read(package, file):
    with open(os.path.join(package, file), encoding="utf-8") as f:
        return f.read()


def without_mutants(package, table):
    """Branches of guarded files that no entry touches and no reason excuses, and reasons for what is not there."""
    wrong = []
    for file in table.GUARDED:
        source = read(package, file)
        touched = set()
        for text in [m[1] for m in table.MUTANTS if m[0] == file] + [text for f, text, _ in table.ARGUED if f == file]:
            at = source.find(text)
            if at < 0:
                wrong.append(f"{file}: not found: {text.strip()}")
            first = source.count("\n", 0, at)
            touched.update(range(first, first + text.rstrip("\n").count("\n") + 1))
        for number, line in enumerate(source.splitlines()):
            if BRANCH.search(line.split("//")[0]) and number not in touched:
                wrong.append(f"{file}:{number + 1}: no mutant of this branch: {line.strip()}")
    return wrong


def red(args, package, table, entry, folder):
    """Whether the named test goes red; None and a sentence where the entry itself is wrong."""
    file, text, other, program, wanted = entry
    source = read(package, file)
    if source.count(text) != 1:
        return None, f"found {source.count(text)} times, must be once"
    flags = []
    spoiled = os.path.join(folder, os.path.basename(file))
    if file.endswith(".h"):  # in front of the real header, for the one source file that is made of it
        spoiled = os.path.join(folder, file[len("include/"):])
        os.makedirs(os.path.dirname(spoiled))
        flags = ["-I", folder]
    with open(spoiled, "w", encoding="utf-8") as f:
        f.write(source.replace(text, other))
    unit = spoiled if file.endswith(".cpp") else os.path.join(package, table.USER[file])
    library = os.path.join(folder, "libmutant.so")
    include = [os.path.join(package, "include"), *(d for group in args.include for d in group.split(";") if d)]
    # O1: half the time of O2, the same branches.
    done = subprocess.run([args.compiler, "-std=c++17", "-O1", "-fPIC", "-w", "-ffp-contract=off", *flags,
                           *(w for d in include for w in ("-I", d)), "-shared", unit, "-o", library],
                          capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return None, "does not compile: " + (done.stderr.splitlines() or ["?"])[0]
    # Reduced counts must do, and within the time: a test cut off at its full count would pass for a red one.
    environment = {k: v for k, v in os.environ.items() if k != "VEST_FULL"}
    # Judged by processor time: beside other work a test takes longer, and is not red for it.
    try:
        run = subprocess.run(["prlimit", f"--cpu={SECONDS}", os.path.join(args.tests, args.prefix + program),
                              "--gtest_filter=" + wanted], env={**environment, "LD_PRELOAD": library}, capture_output=True,
                             text=True, timeout=20 * SECONDS, check=False)
    except subprocess.TimeoutExpired:
        return True, ""
    if "Running 0 tests" in run.stdout:
        return None, "no test is called " + wanted
    return run.returncode != 0, ""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--package", required=True, help="source folder of the package")
    parser.add_argument("--tests", required=True, help="folder of its test programs")
    parser.add_argument("--prefix", required=True, help="how their names begin")
    parser.add_argument("--include", nargs="+", default=[], help="include folders")
    parser.add_argument("--compiler", default="c++")
    parser.add_argument("--some", type=int, default=0, help="only so many, spread over the table; 0: all")
    parser.add_argument("--only", default="", help="only entries that hold this word in file or text")
    args = parser.parse_args()
    package = os.path.abspath(args.package)
    table = load(package)
    entries = [m for m in table.MUTANTS if args.only in m[0] or args.only in m[1]]
    if args.some:
        entries = entries[:: max(1, len(entries) // args.some)][: args.some]
    broken = without_mutants(package, table)
    survived = []
    for number, entry in enumerate(entries, 1):
        file, text, other, _, wanted = entry
        label = f"{file}: {text.strip().splitlines()[0]} -> {other.strip().splitlines()[0] if other.strip() else '(gone)'}"
        with tempfile.TemporaryDirectory() as folder:
            killed, why = red(args, package, table, entry, folder)
        if killed is None:
            broken.append(f"{label}: {why}")
        elif not killed:
            survived.append(label)
        print(f"{number:3} {'BROKEN' if killed is None else 'red' if killed else 'SURVIVED':8} {label}  [{wanted}]", flush=True)
    whole = len(table.MUTANTS)
    print(f"count: {len(entries)} of {whole} mutants (mutants.{os.path.basename(package)})")
    for line in broken:
        print("BROKEN ENTRY " + line)
    print(f"mutants: {len(entries)} tried, {len(survived)} survived, {len(broken)} entries broken, {len(table.ARGUED)} branches argued")
    return 1 if survived or broken else 0


if __name__ == "__main__":
    sys.exit(main())
