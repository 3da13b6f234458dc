#include "daemon/evaluation/bench/subscriber.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "daemon/dds/reader.hpp"
#include "daemon/dds/wait_set.hpp"

namespace perimap::bench {
namespace {

constexpr const char* kReady = "ready";

void wait_for_the_end_of_input() {
  std::array<char, 64> bytes{};
  for (;;) {
    const ssize_t n = read(STDIN_FILENO, bytes.data(), bytes.size());
    if (n == 0 || (n < 0 && errno != EINTR)) return;
  }
}

}  // namespace

Expected<void> subscribe_until_input_ends(const dds::Membership& membership, const std::string& stream,
                                          Duration pause) {
  auto participant = dds::Participant::create(membership);
  if (!participant) return tl::unexpected(participant.error());
  auto reader = dds::Reader<perimap_Surface>::create(*participant);
  if (!reader) return tl::unexpected(reader.error());
  auto wait_set = dds::WaitSet::create(*participant);
  if (!wait_set) return tl::unexpected(wait_set.error());
  if (auto attached = wait_set->attach(reader->condition()); !attached) return attached;

  std::vector<Receipt> receipts;
  receipts.reserve(std::size_t{1} << 20U);
  Expected<void> result;
  {
    std::jthread receiving([&] {
      pthread_setname_np(pthread_self(), "receive");
      while (wait_set->wait()) {
        const Instant now = MonotonicClock::now();
        const auto loan = reader->take();
        if (!loan) {
          result = tl::unexpected(loan.error());
          return;
        }
        for (std::size_t i = 0; i < loan->size(); ++i) {
          const perimap_Surface* sample = loan->sample(i);
          if (sample != nullptr && sample->stream == stream) receipts.push_back({sample->sample_sequence, now});
        }
        if (pause > Duration(0)) std::this_thread::sleep_for(pause);
      }
    });
    fmt::print("{}\n", kReady);
    (void)std::fflush(stdout);
    wait_for_the_end_of_input();
    wait_set->stop();
  }
  if (!result) return result;
  for (const Receipt& receipt : receipts) fmt::print("{} {}\n", receipt.sequence, to_ns(receipt.time));
  (void)std::fflush(stdout);
  return {};
}

Expected<Receipt> parse_receipt(const std::string& line) {
  Receipt receipt;
  std::int64_t ns = 0;
  const char* end = line.data() + line.size();
  const auto sequence = std::from_chars(line.data(), end, receipt.sequence);
  if (sequence.ec == std::errc() && sequence.ptr != end && *sequence.ptr == ' ') {
    const auto time = std::from_chars(sequence.ptr + 1, end, ns);
    if (time.ec == std::errc() && time.ptr == end) {
      receipt.time = from_ns(ns);
      return receipt;
    }
  }
  return fail(fmt::format("subscriber: expected a sequence number and a time, got '{}'", line));
}

Expected<Subscriber> Subscriber::start(const dds::Membership& membership, ReleaseStream stream, Duration pause) {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) return fail("/proc/self/exe: " + error.message());
  std::vector<std::string> arguments = {
      kSubscriberCommand,
      "--domain",
      std::to_string(membership.domain),
      "--stream",
      std::string(name_of(stream)),
      "--pause-ms",
      std::to_string(std::chrono::duration_cast<std::chrono::milliseconds>(pause).count())};
  if (membership.security) arguments.insert(arguments.end(), {"--security", membership.security->string()});
  auto child = ChildProcess::start(program.string(), arguments);
  if (!child) return tl::unexpected(child.error());
  const auto line = child->read_line();
  if (!line || *line != kReady) {
    child->close_input();
    return fail(fmt::format("subscriber: ended with {} before it received anything", child->wait()));
  }
  return Subscriber(std::move(*child));
}

Expected<std::vector<Receipt>> Subscriber::finish() {
  child_.close_input();
  std::vector<Receipt> receipts;
  for (const std::string& line : child_.read_lines()) {
    const auto receipt = parse_receipt(line);
    if (!receipt) return tl::unexpected(receipt.error());
    receipts.push_back(*receipt);
  }
  if (const int code = child_.wait(); code != 0) return fail(fmt::format("subscriber: ended with {}", code));
  return receipts;
}

}  // namespace perimap::bench
