// What the black box is told, and what is in it afterwards.
#include "daemon/black_box/black_box.hpp"

#include <gmock/gmock.h>

#include <map>
#include <thread>

#include "daemon/black_box/entry_text.hpp"
#include "written_log.hpp"

namespace perimap::black_box::test {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

class Telling : public WrittenLog {
 protected:
  Telling() {
    settings_.folder = folder_;
    settings_.program = "perimapd test";
    settings_.identity.source = "a";
    settings_.maximum_features = 2;
  }
  // Of everything that `tell` has told until it returns.
  template <class Tell>
  std::map<EntryKind, std::vector<std::string>> written(const Tell& tell) {
    BlackBox box(settings_);
    std::thread writer([&box] { box.run(); });
    tell(box);
    box.stop();
    writer.join();
    std::map<EntryKind, std::vector<std::string>> entries;
    const auto found =
        verify(settings_.folder, [&](const Entry& entry) { entries[entry.kind].push_back(json_of(entry)); });
    EXPECT_TRUE(found && found->whole());
    return entries;
  }
  static perimap_Surface surface(perimap_SurfaceState state) {
    perimap_Surface sample{};
    std::snprintf(sample.stream, sizeof sample.stream, "frame");
    sample.state = state;
    return sample;
  }

  BlackBoxSettings settings_;
};

TEST_F(Telling, EverySurfaceIsKeptAndAChangeOfItsStateIsAnEvent) {
  auto entries = written([](BlackBox& box) {
    for (int i = 0; i < 5; ++i) box.surface(surface(perimap_SURFACE_GOOD));
    for (int i = 0; i < 3; ++i) box.surface(surface(perimap_SURFACE_DEGRADED));
  });
  EXPECT_EQ(entries[EntryKind::kSurface].size(), 8U);
  EXPECT_THAT(entries[EntryKind::kEvent], Contains(HasSubstr("surface of stream frame is degraded")));
  EXPECT_EQ(entries[EntryKind::kEvent].size(), 3U) << "that it has begun, and two states";
  EXPECT_TRUE(entries[EntryKind::kLost].empty());
}

TEST_F(Telling, ACommandIsAnEventUnlessItOnlyAsks) {
  auto entries = written([](BlackBox& box) {
    box.command("status", true, "much");
    box.command("new-patient", true, "the map is cleared\n");
  });
  EXPECT_EQ(entries[EntryKind::kCommand].size(), 2U);
  EXPECT_THAT(entries[EntryKind::kCommand], Contains(HasSubstr("the map is cleared")));
  EXPECT_THAT(entries[EntryKind::kEvent], Contains(HasSubstr("command new-patient")));
  EXPECT_THAT(entries[EntryKind::kEvent], ::testing::Not(Contains(HasSubstr("command status"))));
}

TEST_F(Telling, WhatFoundNoRoomIsCounted) {
  perimap_Surface large = surface(perimap_SURFACE_GOOD);
  large.features._length = 3;
  auto entries = written([&](BlackBox& box) { box.surface(large); });
  EXPECT_THAT(entries[EntryKind::kLost], Contains(HasSubstr("\"no_room\":1")));
}

TEST_F(Telling, OfAFolderThatIsNotThereTheRestIsToldOnceItIs) {
  settings_.folder = folder_ / "later";
  auto entries = written([&](BlackBox& box) {
    box.configuration("a = 1\n");
    box.log_line("info", "lost");
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    std::filesystem::create_directory(folder_);
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    box.log_line("info", "told");
  });
  EXPECT_THAT(entries[EntryKind::kConfiguration], Contains(HasSubstr("a = 1")));
  EXPECT_THAT(entries[EntryKind::kLog], Contains(HasSubstr("info: told")));
  EXPECT_THAT(entries[EntryKind::kLost], Contains(HasSubstr("\"not_written\":2")));
}

}  // namespace
}  // namespace perimap::black_box::test
