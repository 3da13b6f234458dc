// Counts the gaps in the sequence numbers of `surface`, with the daemon's own reader.
//
//   cpp_subscriber DOMAIN SAMPLES
//
// Exit code 0 when sequence numbers 0 to SAMPLES - 1 all came, in order; 1 when the writer has gone before that or when
// any is missing.
#include <cinttypes>
#include <cstdio>
#include <cstdlib>

#include "daemon/dds/reader.hpp"
#include "daemon/dds/wait_set.hpp"

namespace perimap {
namespace {

int subscribe(int domain, std::uint64_t samples) {
  auto participant = dds::Participant::create(domain);
  auto reader = participant.and_then([](const auto& p) { return dds::Reader<perimap_Surface>::create(p); });
  auto wait_set = participant.and_then([](const auto& p) { return dds::WaitSet::create(p); });
  if (!reader || !wait_set || !wait_set->attach(reader->condition())) {
    std::fprintf(stderr, "cpp_subscriber: cannot open the topic\n");
    return 1;
  }
  std::uint64_t expected = 0;
  std::uint64_t missing = 0;
  bool writer_gone = false;
  while (expected < samples && !writer_gone && wait_set->wait()) {
    const Expected<dds::Loan<perimap_Surface>> loan = reader->take();
    for (std::size_t i = 0; loan && i < loan->size(); ++i) {
      if (const perimap_Surface* surface = loan->sample(i)) {
        missing += surface->sample_sequence - expected;
        expected = surface->sample_sequence + 1;
      } else {
        writer_gone = true;
      }
    }
  }
  std::printf("cpp_subscriber: %" PRIu64 " of %" PRIu64 " surfaces, %" PRIu64 " missing in between\n",
              expected - missing, samples, missing);
  return expected == samples && missing == 0 ? 0 : 1;
}

}  // namespace
}  // namespace perimap

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "cpp_subscriber DOMAIN SAMPLES\n");
    return 2;
  }
  return perimap::subscribe(std::atoi(argv[1]), std::strtoull(argv[2], nullptr, 10));
}
