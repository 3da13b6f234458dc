#!/usr/bin/env python3
"""F1 of public beat detectors on the records of docs/evidence/ecg.md, for the table "Public detectors beside it".

Not part of the product, and nothing of it is needed to build or test it. The detectors are run as their authors
published them, from checkouts of wfdb-python, py-ecg-detectors and BioSPPy; NumPy, SciPy, pandas and PyWavelets are
Debian's (python3-numpy, python3-scipy, python3-pandas, python3-pywt).

    public_detectors.py RECORDS --wfdb DIR --ecg-detectors DIR --biosppy DIR [--only NAME] [--records 100,105]

RECORDS holds NNN_ch0_200perMV_360Hz.i16.gz and NNN_beats.csv. Scored like the detector of the project: whole records,
150 ms, one to one, nearest first, 207 outside its flutter (gaps of more than 4 s in the reference). Many of them tell
another point of the QRS complex than its peak, so all times of a record are first shifted by their median distance to
the nearest reference beat; the detector of the project is not.
"""
import argparse
import gzip
import importlib
import importlib.util
import pathlib
import sys
import types

import numpy as np

PARTS = {
    "development": "100 105 106 109 115 119 122 123 203 205 207 208 209 220 230".split(),
    "aside": "112 118 124 201 215 223".split(),
}
RATE_HZ = 360
WINDOW_S = 0.150


def stand_in(name, **members):
    """A module that is imported for what is not used here."""
    module = types.ModuleType(name)
    module.__dict__.update(members)
    module.__path__ = []
    sys.modules[name] = module
    return module


def load(name, path):
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def of_wfdb(folder):
    stand_in("wfdb")
    stand_in("wfdb.io")
    stand_in("wfdb.io.annotation", Annotation=object)
    stand_in("wfdb.io.record", Record=object)
    stand_in("wfdb.processing")
    processing = pathlib.Path(folder) / "wfdb" / "processing"
    load("wfdb.processing.basic", processing / "basic.py")
    load("wfdb.processing.peaks", processing / "peaks.py")
    qrs = load("wfdb.processing.qrs", processing / "qrs.py")

    def gqrs(mV):
        return qrs.gqrs_detect(d_sig=np.round(mV * 200).astype("int64"), fs=RATE_HZ, adc_gain=200.0, adc_zero=0)

    return {"XQRS (wfdb-python)": lambda mV: qrs.xqrs_detect(mV, RATE_HZ, verbose=False), "GQRS (wfdb-python)": gqrs}


def of_ecg_detectors(folder):
    stand_in("ecgtemplates")
    detectors = load("ecgdetectors", pathlib.Path(folder) / "ecgdetectors.py").Detectors(RATE_HZ)
    names = {
        "Pan & Tompkins (py-ecg-detectors)": detectors.pan_tompkins_detector,
        "Hamilton (py-ecg-detectors)": detectors.hamilton_detector,
        "Christov (py-ecg-detectors)": detectors.christov_detector,
        "Engzee (py-ecg-detectors)": detectors.engzee_detector,
        "two averages, Elgendi (py-ecg-detectors)": detectors.two_average_detector,
        "wavelets, Kalidas & Tamil (py-ecg-detectors)": detectors.swt_detector,
        "WQRS (py-ecg-detectors)": detectors.wqrs_detector,
    }
    return {name: (lambda mV, f=f: f(1e-3 * mV)) for name, f in names.items()}


def of_biosppy(folder):
    # Its pictures are not wanted, nor what they need.
    for name in ("matplotlib", "matplotlib.pyplot", "biosppy.plotting", "biosppy.inter_plotting"):
        stand_in(name)
    stand_in("biosppy.inter_plotting.ecg")
    sys.modules["biosppy.inter_plotting"].ecg = None
    package = stand_in("biosppy", plotting=None)
    package.__path__ = [str(pathlib.Path(folder) / "biosppy")]
    stand_in("biosppy.signals").__path__ = [str(pathlib.Path(folder) / "biosppy" / "signals")]
    tools = importlib.import_module("biosppy.signals.tools")
    ecg = importlib.import_module("biosppy.signals.ecg")

    def band_passed(mV):
        # As its own pipeline prepares the signal.
        return tools.filter_signal(signal=mV, ftype="FIR", band="bandpass", order=int(0.3 * RATE_HZ),
                                   frequency=[3, 45], sampling_rate=RATE_HZ)[0]

    def hamilton(mV):
        filtered = band_passed(mV)
        peaks = ecg.hamilton_segmenter(signal=filtered, sampling_rate=RATE_HZ)[0]
        return ecg.correct_rpeaks(signal=filtered, rpeaks=peaks, sampling_rate=RATE_HZ, tol=0.05)[0]

    return {"Hamilton with correction (BioSPPy)": hamilton}


def matches(reference_s, found_s):
    pairs = []
    for i, t in enumerate(reference_s):
        for j in range(*np.searchsorted(found_s, [t - WINDOW_S, t + WINDOW_S])):
            pairs.append((abs(found_s[j] - t), i, j))
    used_i, used_j = set(), set()
    for _, i, j in sorted(pairs):
        if i not in used_i and j not in used_j:
            used_i.add(i)
            used_j.add(j)
    return len(used_i)


def f1(record, reference_s, found_s):
    found_s = np.sort(np.asarray(found_s, float))
    if len(found_s) == 0:
        return 0.0
    nearest = reference_s[np.clip(np.searchsorted(reference_s, found_s), 1, len(reference_s) - 1)]
    before = reference_s[np.clip(np.searchsorted(reference_s, found_s), 1, len(reference_s) - 1) - 1]
    off = np.where(abs(found_s - nearest) < abs(found_s - before), found_s - nearest, found_s - before)
    found_s = found_s - np.median(off[abs(off) < 0.3]) if np.any(abs(off) < 0.3) else found_s
    if record == "207":
        gaps = [(a + 0.3, b - 0.3) for a, b in zip(reference_s, reference_s[1:]) if b - a > 4]
        gaps.append((reference_s[-1] + 0.3, 1e9))
        found_s = np.array([t for t in found_s if not any(a < t < b for a, b in gaps)])
    return 200.0 * matches(reference_s, found_s) / (len(reference_s) + len(found_s))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--wfdb")
    parser.add_argument("--ecg-detectors")
    parser.add_argument("--biosppy")
    parser.add_argument("--only")
    parser.add_argument("--records")
    options = parser.parse_args()
    detectors = {}
    for folder, load_them in ((options.wfdb, of_wfdb), (options.ecg_detectors, of_ecg_detectors),
                              (options.biosppy, of_biosppy)):
        if folder:
            detectors.update(load_them(folder))
    chosen = options.records.split(",") if options.records else sum(PARTS.values(), [])
    folder = pathlib.Path(options.folder)
    leads = {}
    for record in chosen:
        raw = gzip.decompress((folder / f"{record}_ch0_200perMV_360Hz.i16.gz").read_bytes())
        beats = (folder / f"{record}_beats.csv").read_text().split("\n")[1:]
        leads[record] = (np.frombuffer(raw, "<i2") / 200.0, np.array([float(b.split(",")[0]) for b in beats if b]))
    for name, detect in detectors.items():
        if options.only and options.only not in name:
            continue
        scores = {}
        for record, (mV, reference_s) in leads.items():
            try:
                scores[record] = f1(record, reference_s, np.asarray(detect(mV.copy())) / RATE_HZ)
            except Exception as error:  # what another's detector cannot take is no beat found
                print(f"{name}, {record}: {error}", file=sys.stderr)
                scores[record] = 0.0
        cells = []
        for records in PARTS.values():
            counted = [scores[r] for r in records if r in scores and r != "207"]
            lowest = min(((scores[r], r) for r in records if r in scores and r != "207"), default=(0.0, "-"))
            cells.append(f"{np.mean(counted) if counted else 0:.2f} | {lowest[0]:.2f} ({lowest[1]})")
        print(f"| {name} | {' | '.join(cells)} |", flush=True)
        print("  " + ", ".join(f"{r} {s:.2f}" for r, s in scores.items()), file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
