// One who takes part in a domain, with keys or without ("-").
//   domain_member DOMAIN KEYS publish SOURCE SECONDS [DELAY]   60 surfaces a second, from DELAY seconds after it joined
//   on domain_member DOMAIN KEYS listen SECONDS [DELAY]           prints "SOURCE COUNT" for each source that it heard
// Ends with 3 when it is not let in, or may not write.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/dds/reader.hpp"
#include "daemon/dds/writer.hpp"

namespace {

using namespace perimap;
using Clock = std::chrono::steady_clock;

constexpr int kRefused = 3;

int refused(const Error& error) {
  (void)std::fprintf(stderr, "%s\n", error.message.c_str());
  return kRefused;
}

void wait(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

int publish(const dds::Participant& participant, const std::string& source, double seconds, double delay) {
  auto writer = dds::Writer<perimap_Surface>::create(participant);
  if (!writer) return refused(writer.error());
  wait(delay);
  perimap_Surface surface{};
  (void)std::snprintf(surface.source, sizeof surface.source, "%s", source.c_str());
  (void)std::snprintf(surface.stream, sizeof surface.stream, "frame");
  surface.run_id[0] = static_cast<std::uint8_t>(source.size());
  std::vector<perimap_SurfaceFeature> features(200);
  surface.features = {200, 200, features.data(), false};
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  while (Clock::now() < end) {
    ++surface.sample_sequence;
    if (writer->write(surface) < 0) return kRefused;
    std::this_thread::sleep_for(std::chrono::milliseconds(16));
  }
  std::printf("heard by %d\n", writer->matched_readers());
  return 0;
}

int listen(const dds::Participant& participant, double seconds, double delay) {
  auto reader = dds::Reader<perimap_Surface>::create(participant);
  if (!reader) return refused(reader.error());
  wait(delay);
  std::map<std::string, int> heard;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  while (Clock::now() < end) {
    const auto loan = reader->take();
    if (!loan) return refused(loan.error());
    for (std::size_t i = 0; i < loan->size(); ++i) {
      if (loan->sample(i) != nullptr) ++heard[loan->sample(i)->source];
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  for (const auto& [source, count] : heard) std::printf("%s %d\n", source.c_str(), count);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) return 2;
  const std::string keys = argv[2];
  const bool publishes = std::string(argv[3]) == "publish";
  auto participant = dds::Participant::create(
      {std::atoi(argv[1]), keys == "-" ? std::nullopt : std::optional<std::filesystem::path>(keys)});
  if (!participant) return refused(participant.error());
  const int after = publishes ? 6 : 5;
  const double delay = argc > after ? std::atof(argv[after]) : 0.0;
  return publishes ? publish(*participant, argv[4], std::atof(argv[5]), delay)
                   : listen(*participant, std::atof(argv[4]), delay);
}
