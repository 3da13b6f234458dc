#!/usr/bin/env python3
"""Whether the unit tests of the ECG side notice a constant that is a third more or less, for docs/evidence/ecg.md.

Copies the detector's and the classer's sources to a folder, where each constant asks the environment what it is; builds
them there with their tests, once; then runs the tests for each of the constants that are drawn. Needs g++, Eigen and
GoogleTest (deploy/install-packages.sh).

    ecg_mutations.py FOLDER --seed N [--draws 20] [--names a:b,c:d]

Fast tests first; those that take seconds only where none of the fast ones notices. What sizes an array cannot be asked
for and is left out.
"""
import argparse
import concurrent.futures
import os
import pathlib
import random
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
MUTATED = """rhythm_scatter beat_classer beat_confidence beat_decision beat_kinds beat_levels beat_path candidate_finder
ecg_filter ecg_levels ecg_line lead_agreement lead_pair line_disturbances qrs_candidate qrs_clusters qrs_evidence qrs_shape r_peak_detector
recent_complexes r_peak_detector_settings ventricular_evidence rhythm_monitor rr_predictor""".split()
BESIDE = """sample_rate cardiac_clock cardiac_clock_tracker ectopic_rhythm end_trust cycle_posterior phase_law law_choice
r_trigger""".split()
NOT_TESTED_BY = {"r_peak_detector_settings", "beat_levels", "rhythm_monitor"}  # tested in files of other names
MORE_TESTS = "beat_disturbance_test beat_finder_test sample_rate_test cardiac_clock_test made_lead made_lead_test " \
             "lead_disturbances disturbed_lead_test".split()
SIZES = {"kClusters", "kCapacity", "kMost", "kQueue", "kSeen", "kWindows", "kHistory", "kPending", "kKinds", "kTemplates",
         "kRhythm", "kQuietHistory", "kMaxSpikeHalf", "kWindow", "kChangedAfter", "kPulled"}
SLOW = "*DisturbedLead*:MadeLeads*:*MadeEcg*"
HEADER = """#pragma once
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <type_traits>
template <class T>
T mutated(const char* name, T value) {
  static const char* const which = std::getenv("MUTATED");
  if (which == nullptr || std::strcmp(which, name) != 0) return value;
  const double factor = std::atof(std::getenv("FACTOR"));
  if constexpr (std::is_same_v<T, double>) return value * factor;
  else if constexpr (std::is_same_v<T, int>) {
    const int changed = static_cast<int>(std::lround(value * factor));
    return changed != value ? changed : factor > 1.0 ? value + 1 : value - 1;
  } else return T(static_cast<long>(static_cast<double>(value.count()) * factor));
}
"""


def instrumented(stem, text, names):
    """The source, in which each constant asks; their names are added to `names`."""
    def ask(kind, name, value):
        names.add(f"{stem}:{name}")
        return f'mutated<{kind}>("{stem}:{name}", {value.strip()})'

    def constant(m):
        static, kind, name, value = m.groups()
        if name in SIZES or name == "kNever" or (static and kind == "int"):
            return m.group(0)
        return f"{'inline static ' if static else ''}const {kind} {name} = {ask(kind, name, value)};"

    def setting(m):
        return f"  {m.group(1)} {m.group(2)} = {ask(*m.groups())};"

    changed = re.sub(r"(static )?constexpr (double|int|Duration) (k\w+)\s*=\s*([^;{}]+);", constant, text)
    if stem == "r_peak_detector_settings":
        changed = re.sub(r"^  (double|int|Duration) (\w+)\s*=\s*([^;{}]+);", setting, changed, flags=re.M)
    if "struct EcgLineSettings" in changed:
        begin = changed.index("struct EcgLineSettings")
        end = changed.index("};", begin)
        changed = changed[:begin] + re.sub(r"^  (double|int|Duration) (\w+)\s*=\s*([^;{}]+);", setting,
                                           changed[begin:end], flags=re.M) + changed[end:]
    if "kFittedWeights{" in changed:
        begin = changed.index("kFittedWeights{")
        parts = changed[begin:].split("},", 1)
        for which, part in enumerate(parts):
            of = ("complex", "beat")[which]
            parts[which] = re.sub(r"(-?[0-9.]*[1-9][0-9.]*),\s*// (k\w+)",
                                  lambda m: ask("double", f"{of}.{m.group(2)}", m.group(1)) + ",", part)
        changed = changed[:begin] + "},".join(parts)
    return changed if changed == text else changed.replace("#include", '#include "mutated.hpp"\n#include', 1)


def build(folder):
    names = set()
    core = folder / "core" / "phase"
    core.mkdir(parents=True, exist_ok=True)
    (folder / "mutated.hpp").write_text(HEADER)
    for stem in MUTATED:
        for source in (ROOT / "core" / "phase").glob(stem + ".?pp"):
            (core / source.name).write_text(instrumented(stem, source.read_text(), names))
    tests = ROOT / "tests" / "unit" / "phase"
    sources = [core / f"{stem}.cpp" for stem in MUTATED if (core / f"{stem}.cpp").exists()]
    sources += [ROOT / "core" / "phase" / f"{stem}.cpp" for stem in BESIDE]
    sources += [tests / f"{stem}_test.cpp" for stem in MUTATED if stem not in NOT_TESTED_BY]
    sources += [tests / f"{stem}.cpp" for stem in MORE_TESTS]

    def compiled(source):
        target = folder / (source.stem + ".o")
        subprocess.run(["g++", "-O0" if "test" in source.stem else "-O2", "-std=c++20", f"-I{folder}", f"-I{ROOT}",
                        f"-I{tests}", "-isystem", "/usr/include/eigen3", "-ffp-contract=off",
                        f'-DPERIMAP_TEST_DATA="{ROOT}/tests/data"', "-c", str(source), "-o", str(target)], check=True)
        return str(target)

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = list(pool.map(compiled, sources))
    program = folder / "tests"
    subprocess.run(["g++", "-o", str(program), *objects, "-lgtest", "-lgmock", "-lgtest_main", "-lpthread"], check=True)
    return program, sorted(names)


def noticed_by(program, name, factor):
    """The test that fails; none where none does."""
    environment = dict(os.environ, MUTATED=name, FACTOR=str(factor), GTEST_BRIEF="1")
    for which in ("-" + SLOW, SLOW):
        run = subprocess.run([str(program), "--gtest_fail_fast", "--gtest_filter=" + which], env=environment,
                             capture_output=True, text=True)
        if run.returncode != 0:
            failed = re.search(r"\[  FAILED  \] ([\w./]+)", run.stdout)
            return failed.group(1) if failed else "the program's end"
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--names", help="these instead of drawn ones, each either way")
    options = parser.parse_args()
    program, names = build(options.folder.resolve())
    print(f"{len(names)} constants", file=sys.stderr)
    if noticed_by(program, "none", 1.0):
        sys.exit("the tests fail with nothing changed")
    draw = random.Random(options.seed)
    drawn = [(name, draw.choice([0.67, 1.33])) for name in draw.sample(names, options.draws)]
    if options.names:
        drawn = [(name, factor) for name in options.names.split(",") for factor in (0.67, 1.33)]
    print("| constant | times | noticed by |\n|---|---|---|")
    for name, factor in drawn:
        print(f"| `{name}` | {factor} | {noticed_by(program, name, factor) or 'none'} |", flush=True)


if __name__ == "__main__":
    main()
