#!/usr/bin/env python3
"""perimapd_start.py RECORDING PERIMAPD [PERIMAPD...] [--times N]: how long each perimapd takes from its start until it is
ready, as it tells a service manager: its threads run, and it publishes. The programs take turns. Times in ms."""
import argparse
import os
import signal
import socket
import statistics
import subprocess
import tempfile
import time

CYCLONE = ('<CycloneDDS><Domain Id="any"><General><Interfaces><NetworkInterface name="lo"/></Interfaces>'
           '<AllowMulticast>false</AllowMulticast></General><Discovery><Tag>perimapd-start-{}</Tag></Discovery>'
           '</Domain></CycloneDDS>')


def start(program, configuration, folder):
    address = os.path.join(folder, "notify")
    if os.path.exists(address):
        os.unlink(address)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(address)
        manager.settimeout(60)
        environment = dict(os.environ, NOTIFY_SOCKET=address, CYCLONEDDS_URI=CYCLONE.format(os.getpid()))
        begun = time.monotonic()
        daemon = subprocess.Popen([program, "-c", configuration], env=environment, stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL)
        try:
            while "READY=1" not in manager.recv(65536).decode().split("\n"):
                pass
            return 1e3 * (time.monotonic() - begun)
        finally:
            daemon.send_signal(signal.SIGTERM)
            daemon.wait()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording")
    parser.add_argument("programs", nargs="+")
    parser.add_argument("--times", type=int, default=20)
    given = parser.parse_args()
    times = {program: [] for program in given.programs}
    with tempfile.TemporaryDirectory() as folder:
        configuration = os.path.join(folder, "perimapd.toml")
        with open(configuration, "w", encoding="utf-8") as file:
            file.write(f'version = 1\n[replay]\nrecording = "{os.path.abspath(given.recording)}"\n[dds]\ndomain = 99\n')
        for _ in range(given.times):
            for program in given.programs:
                times[program].append(start(program, configuration, folder))
    for program, taken in times.items():
        taken.sort()
        print(f"{program}: least {taken[0]:.1f}, median {statistics.median(taken):.1f}, most {taken[-1]:.1f}, {len(taken)} starts")


if __name__ == "__main__":
    main()
