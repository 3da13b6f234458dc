#include "daemon/publishing/dds_publication.hpp"

#include <dds/dds.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "counted_allocations.hpp"

namespace perimap {
namespace {

using ::testing::HasSubstr;

constexpr int kDomain = 119;

// A publication on this host alone whose surfaces can not be written any more, and what is logged of it.
class FailingWrites : public ::testing::Test {
 protected:
  FailingWrites() : default_(spdlog::default_logger()) {
    const std::string uri =
        "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo'/></Interfaces>"
        "<AllowMulticast>false</AllowMulticast></General><Discovery><Tag>perimap-unit-" +
        std::to_string(::getpid()) + "</Tag></Discovery></Domain></CycloneDDS>";
    setenv("CYCLONEDDS_URI", uri.c_str(), 1);
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("", std::make_shared<spdlog::sinks::ostream_sink_mt>(log_)));
  }
  ~FailingWrites() override { spdlog::set_default_logger(default_); }

  std::unique_ptr<DdsPublication> publication(Duration writes_well_after) {
    DdsSettings settings;
    settings.membership = kDomain;
    settings.writes_well_after = writes_well_after;
    auto made = DdsPublication::create(settings);
    if (!made) throw std::runtime_error(made.error().message);
    return std::move(*made);
  }
  static void delete_the_surface_writer() {
    dds_entity_t participant = 0;
    ASSERT_EQ(dds_lookup_participant(kDomain, &participant, 1), 1);
    std::vector<dds_entity_t> children(32);
    children.resize(static_cast<std::size_t>(dds_get_children(participant, children.data(), children.size())));
    for (const dds_entity_t child : children) {
      std::vector<dds_entity_t> writers(8);
      const dds_return_t n = dds_get_children(child, writers.data(), writers.size());
      for (dds_return_t i = 0; i < n; ++i) {
        const dds_entity_t writer = writers[static_cast<std::size_t>(i)];
        std::vector<char> name(64);
        if (dds_get_name(dds_get_topic(writer), name.data(), name.size()) < 0) continue;
        if (std::string(name.data()) == dds::topic_of<perimap_Surface>().name) dds_delete(writer);
      }
    }
  }
  [[nodiscard]] std::string log() const { return log_.str(); }

 private:
  std::ostringstream log_;
  std::shared_ptr<spdlog::logger> default_;
};

TEST_F(FailingWrites, AreCountedByThePublisherThreadWhichNeitherLogsNorAllocates) {
  const auto publishing = publication(std::chrono::hours(1));
  const perimap_Surface surface{};
  publishing->surface(surface);
  ASSERT_EQ(publishing->failures(), 0U);
  delete_the_surface_writer();
  EXPECT_EQ(test::allocations_of([&] {
              for (int i = 0; i < 3; ++i) publishing->surface(surface);
            }),
            0);
  EXPECT_EQ(publishing->failures(), 3U);
  EXPECT_EQ(log(), "");
}

TEST_F(FailingWrites, AreLoggedOnceByTheStatusThreadAndAtTheirEndWithTheirNumber) {
  const auto publishing = publication(Duration(0));
  const perimap_Surface surface{};
  const perimap_Status status{};
  delete_the_surface_writer();
  publishing->status(status);
  EXPECT_EQ(log(), "");
  for (int i = 0; i < 3; ++i) {
    publishing->surface(surface);
    publishing->surface(surface);
    publishing->status(status);
  }
  const std::string begun = log();
  EXPECT_THAT(begun, HasSubstr("DDS writes fail: "));
  EXPECT_EQ(begun.find("DDS writes fail", begun.find("DDS writes fail") + 1), std::string::npos);
  EXPECT_EQ(begun.find("again"), std::string::npos);
  publishing->status(status);
  EXPECT_THAT(log(), HasSubstr("DDS writes succeed again; 6 failed"));
}

// A reader that asks for more than `topic` offers.
class WrongReader {
 public:
  WrongReader() {
    participant_ = dds_create_participant(kDomain, nullptr, nullptr);
    const auto& description = dds::topic_of<perimap_Surface>();
    const dds_entity_t topic =
        dds_create_topic(participant_, description.descriptor, description.name, nullptr, nullptr);
    dds_qos_t* qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, 0);
    EXPECT_GT(dds_create_reader(participant_, topic, qos, nullptr), 0);
    dds_delete_qos(qos);
  }
  WrongReader(const WrongReader&) = delete;
  WrongReader& operator=(const WrongReader&) = delete;
  ~WrongReader() { dds_delete(participant_); }

 private:
  dds_entity_t participant_ = 0;
};

// FailingWrites has the log.
using ReadersThatGetNothing = FailingWrites;

TEST_F(ReadersThatGetNothing, AreToldOnceWithWhatDoesNotFit) {
  const auto publishing = publication(std::chrono::hours(1));
  const perimap_Status status{};
  publishing->status(status);
  EXPECT_EQ(log(), "");
  const WrongReader reader;
  for (int i = 0; i < 200 && log().empty(); ++i) {
    publishing->status(status);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_THAT(log(), HasSubstr("a reader of perimap/surface gets nothing: it asks for a reliable topic"));
  const std::string told = log();
  const WrongReader another;
  publishing->status(status);
  EXPECT_EQ(log(), told) << "once a minute";
}

TEST(ReaderWatchTest, SaysAgainAfterAMinuteHowManyCame) {
  std::ostringstream log;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
  ReaderWatch watch;
  const Instant begin = from_ns(0) + std::chrono::hours(1);
  watch.look("topic", {0, DDS_INVALID_QOS_POLICY_ID}, begin);
  EXPECT_EQ(log.str(), "");
  watch.look("topic", {1, DDS_DATA_REPRESENTATION_QOS_POLICY_ID}, begin);
  EXPECT_THAT(log.str(), HasSubstr("a reader of topic gets nothing: it reads another representation"));
  watch.look("topic", {4, DDS_DATA_REPRESENTATION_QOS_POLICY_ID}, begin + std::chrono::seconds(59));
  EXPECT_THAT(log.str(), testing::Not(HasSubstr("3 readers")));
  watch.look("topic", {4, DDS_DEADLINE_QOS_POLICY_ID}, begin + std::chrono::seconds(60));
  EXPECT_THAT(log.str(), HasSubstr("3 readers of topic get nothing: it asks for samples more often"));
  spdlog::set_default_logger(before);
}

}  // namespace
}  // namespace perimap
