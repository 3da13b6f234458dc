#!/usr/bin/env python3
"""files_compile_alone.py BUILD JOBS FOLDER...: every source below the FOLDERs compiles by itself.

Each command of BUILD/compile_commands.json is run with -fsyntax-only, so that nothing is written: BUILD must compile no
files together and precompile no headers, and have what the IDL compiler makes. Prints "[n/m]" as it goes, and what the
compiler says of each file that does not. Exit code 1 when one does not, or when there is none.
"""
import concurrent.futures
import json
import os
import pathlib
import shlex
import subprocess
import sys


def syntax_only(entry):
    """The words of the entry's command, with nothing to write and no optimisation, which syntax does not need."""
    words = shlex.split(entry["command"])
    if os.path.basename(words[0]) in ("ccache", "sccache"):
        words = words[1:]
    kept = []
    skip = False
    for word in words:
        if skip:
            skip = False
        elif word in ("-o", "-MF", "-MT"):
            skip = True
        elif word not in ("-c", "-MD", "-O1", "-O2", "-O3"):
            kept.append(word)
    return [*kept, "-fsyntax-only"]


def main():
    build, jobs = sys.argv[1], int(sys.argv[2])
    folders = [pathlib.Path(folder).resolve() for folder in sys.argv[3:]]
    with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as file:
        entries = json.load(file)
    entries = [e for e in entries if any(pathlib.Path(e["file"]).is_relative_to(folder) for folder in folders)]
    if not entries:
        print(f"{build} compiles nothing below {' '.join(map(str, folders))}", file=sys.stderr)
        return 1
    together = [entry["file"] for entry in entries if "/Unity/" in entry["file"]]
    if together:
        print(f"{build} compiles files together: {together[0]}", file=sys.stderr)
        return 1

    def check(entry):
        return subprocess.run(syntax_only(entry), cwd=entry["directory"], capture_output=True, text=True, check=False)

    failed = 0
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for done, (entry, said) in enumerate(zip(entries, pool.map(check, entries)), 1):
            print(f"[{done}/{len(entries)}] {entry['file']}", flush=True)
            if said.returncode != 0:
                failed += 1
                print(said.stderr, flush=True)
    print(f"{failed} of {len(entries)} files do not compile alone")
    return 1 if failed else 0


sys.exit(main())
