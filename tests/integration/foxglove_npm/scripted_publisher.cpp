// scripted_publisher DOMAIN: a perimapd that is good, degraded, invalid, good again and then silent, until it is ended.
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "scripted_perimapd.hpp"

int main(int argc, char** argv) {
  using namespace std::chrono_literals;
  using perimap::test::ScriptedPerimapd;
  if (argc != 2) {
    std::fputs("usage: scripted_publisher DOMAIN\n", stderr);
    return 2;
  }
  ScriptedPerimapd perimapd;
  perimapd.open(std::atoi(argv[1]));
  std::this_thread::sleep_for(8s);
  perimapd.play({perimap_SURFACE_DEGRADED, perimap_SURFACE_REASON_POSE_MISSING, false});
  std::this_thread::sleep_for(1s);
  perimapd.play({perimap_SURFACE_INVALID, perimap_SURFACE_REASON_PHASE_LOST});
  std::this_thread::sleep_for(2s);
  perimapd.play({});
  std::this_thread::sleep_for(2s);
  perimapd.play({.silent = true});
  for (;;) std::this_thread::sleep_for(1s);
}
