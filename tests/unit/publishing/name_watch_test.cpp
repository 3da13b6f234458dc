#include "daemon/publishing/name_watch.hpp"

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

#include "daemon/dds/bounded_string.hpp"
#include "daemon/publishing/dds_publication.hpp"

namespace perimap {
namespace {

constexpr int kDomain = 118;

// Two programs of one domain, on this host alone.
class TwoPrograms : public ::testing::Test {
 protected:
  TwoPrograms() : default_(spdlog::default_logger()) {
    const std::string uri =
        "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo'/></Interfaces>"
        "<AllowMulticast>false</AllowMulticast></General><Discovery><Tag>perimap-names-" +
        std::to_string(::getpid()) + "</Tag></Discovery></Domain></CycloneDDS>";
    setenv("CYCLONEDDS_URI", uri.c_str(), 1);
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("", std::make_shared<spdlog::sinks::ostream_sink_mt>(log_)));
  }
  ~TwoPrograms() override { spdlog::set_default_logger(default_); }

  static std::unique_ptr<DdsPublication> program(const std::string& source) {
    DdsSettings settings;
    settings.membership = kDomain;
    settings.identity = {source, ReleaseStream::kFrame, "tracker", new_run_id()};
    auto made = DdsPublication::create(settings);
    if (!made) throw std::runtime_error(made.error().message);
    return std::move(*made);
  }
  template <class Message>
  static Message of(const std::string& source) {
    Message message{};
    dds::assign(message.source, source);
    return message;
  }
  // As the status thread does; whether it ever said that there is another.
  static bool looks(DdsPublication& program, const std::string& source) {
    bool another = false;
    for (int i = 0; i < 20 && !another; ++i) {
      program.phase(of<perimap_Phase>(source));
      another = program.another_publisher();
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return another;
  }
  [[nodiscard]] std::string log() const { return log_.str(); }

 private:
  std::ostringstream log_;
  std::shared_ptr<spdlog::logger> default_;
};

TEST_F(TwoPrograms, OfOneNameEachHearsTheOtherByAnyTopicAndSaysSo) {
  const auto first = program("theatre 2");
  const auto second = program("theatre 2");
  EXPECT_FALSE(looks(*first, "theatre 2")) << "what it writes itself is no other";
  second->surface(of<perimap_Surface>("theatre 2"));
  EXPECT_TRUE(looks(*first, "theatre 2"));
  EXPECT_NE(log().find("TWO PUBLISHERS: another program publishes as source 'theatre 2'"), std::string::npos) << log();
  EXPECT_TRUE(looks(*second, "theatre 2")) << "by the phases that the first one wrote meanwhile";
}

TEST_F(TwoPrograms, AForgedModelAloneIsNoticed) {
  const auto first = program("theatre 2");
  const auto forger = program("");
  forger->surface_model(of<perimap_SurfaceModel>("theatre 2"));
  EXPECT_TRUE(looks(*first, "theatre 2"));
}

TEST_F(TwoPrograms, OfDifferentNamesAreNoneOfEachOthersBusiness) {
  const auto first = program("theatre 2");
  const auto second = program("theatre 3");
  second->surface(of<perimap_Surface>("theatre 3"));
  second->surface_model(of<perimap_SurfaceModel>("theatre 3"));
  EXPECT_FALSE(looks(*first, "theatre 2"));
  EXPECT_EQ(log(), "");
}

TEST_F(TwoPrograms, WhenTheOtherHasGoneThatIsToldToo) {
  const auto first = program("theatre 2");
  {
    const auto second = program("theatre 2");
    second->status(of<perimap_Status>("theatre 2"));
    ASSERT_TRUE(looks(*first, "theatre 2"));
  }
  for (int i = 0; i < 40 && first->another_publisher(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    first->phase(of<perimap_Phase>("theatre 2"));
  }
  EXPECT_FALSE(first->another_publisher());
  EXPECT_NE(log().find("nobody else publishes as source 'theatre 2' any more"), std::string::npos) << log();
}

}  // namespace
}  // namespace perimap
