#include "drivers/standins/procedure/procedure_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "drivers/standins/procedure/procedure_draw.hpp"
#include "drivers/standins/procedure/procedure_keys.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

std::string error_of(const std::string& text) {
  const auto procedure = parse_procedure(text, "p.toml");
  return procedure ? "accepted" : procedure.error().message;
}

std::string event(const std::string& lines) { return "version = 1\n[[event]]\n" + lines; }

TEST(ProcedureText, ReadsEventsInTheirUnitsAndPutsThemInOrderOfTime) {
  const auto procedure = parse_procedure(
      "version = 1\n"
      "[[event]]\nkind = \"fogged\"\nat_s = 50\nfor_s = 4\ndensity = 1.5\n"
      "[[event]]\nkind = \"retraction\"\nat_s = 20.5\nfor_s = 2\nshift_mm = [6, -1.5, 0]\n",
      "p.toml");
  ASSERT_TRUE(procedure) << procedure.error().message;
  ASSERT_EQ(procedure->events.size(), 2U);
  const ProcedureEvent& first = procedure->events[0];
  EXPECT_EQ(first.at, milliseconds(20500));
  EXPECT_EQ(first.length, seconds(2));
  ASSERT_TRUE(std::holds_alternative<Retraction>(first.what));
  EXPECT_EQ(std::get<Retraction>(first.what).shift_mm, Vector3d(6.0, -1.5, 0.0));
  EXPECT_EQ(std::get<Retraction>(first.what).turn_deg, 0.0);
  EXPECT_EQ(std::get<Fogged>(procedure->events[1].what).density, 1.5);
}

TEST(ProcedureText, AFileWithNothingButItsVersionIsAProcedureInWhichNothingHappens) {
  const auto procedure = parse_procedure("version = 1\n", "p.toml");
  ASSERT_TRUE(procedure) << procedure.error().message;
  EXPECT_TRUE(procedure->empty());
}

TEST(ProcedureText, EveryKindIsReadBackAsItWasWritten) {
  Procedure procedure;
  for (std::size_t kind = 0; kind < kEventKinds.size(); ++kind) {
    ProcedureEvent event{seconds(10 * kind), milliseconds(2300), happening_of(kind)};
    std::visit(
        [](auto& what) {
          visit_keys(what, [](const ProcedureKey& key, auto& value) {
            if constexpr (std::is_same_v<std::decay_t<decltype(value)>, double>) {
              value = 0.7 * key.most + 0.3 * key.least;
            } else {
              value.setConstant(0.6 * key.most);
            }
          });
        },
        event.what);
    procedure.events.push_back(event);
  }
  const std::string text = to_toml(procedure);
  const auto again = parse_procedure(text, "p.toml");
  ASSERT_TRUE(again) << again.error().message << "\n" << text;
  EXPECT_EQ(to_toml(*again), text);
  ASSERT_EQ(again->events.size(), kEventKinds.size());
  for (std::size_t i = 0; i < procedure.events.size(); ++i) {
    EXPECT_EQ(again->events[i].at, procedure.events[i].at);
    EXPECT_EQ(again->events[i].length, procedure.events[i].length);
    EXPECT_EQ(words_of(again->events[i]), words_of(procedure.events[i]));
    EXPECT_EQ(again->events[i].what.index(), i) << "kEventKinds is not in the order of Happening";
  }
}

TEST(ProcedureText, SaysWhichKeyOfWhichLineIsWrongAndWhatIsExpected) {
  struct Case {
    std::string text;
    std::string message;
  };
  const std::string when = "at_s = 1\nfor_s = 1\n";
  const std::vector<Case> cases = {
      {"", "p.toml:1:1: key 'version': expected 1, got nothing"},
      {"version = 2\n", "p.toml:1:11: key 'version': expected 1, got 2"},
      {"version = 1\nevents = 3\n",
       "key 'events': expected one of version, event, got an unknown key; did you mean 'event'?"},
      {"version = 1\nevent = 3\n", "p.toml:2:9: key 'event': expected tables [[event]], got 3"},
      {"version = 1\nevent = [1, 2]\n", "expected tables [[event]], got [1, 2]"},
      {"version = 1\n[event]\nkind = \"dent\"\n", "expected tables [[event]], got a table"},
      {event(when), "key 'event[1].kind': expected one of retraction, table-tilt"},
      {event(when + "kind = 3\n"), "p.toml:5:8: key 'event[1].kind': expected one of"},
      {event(when + "kind = \"retracton\"\n"), "got \"retracton\"; did you mean 'retraction'?"},
      {event("kind = \"dent\"\nfor_s = 1\n"), "key 'event[1].at_s': expected a number, 0 to 7200, got nothing"},
      {event("kind = \"dent\"\nat_s = 1\n"), "key 'event[1].for_s': expected a number, 0.05 to 7200, got nothing"},
      {event("kind = \"dent\"\nat_s = -1\nfor_s = 1\n"),
       "p.toml:4:8: key 'event[1].at_s': expected a number, 0 to 7200, got -1"},
      {event("kind = \"dent\"\nat_s = \"soon\"\nfor_s = 1\n"), "got \"soon\""},
      {event("kind = \"dent\"\nat_s = nan\nfor_s = 1\n"), "key 'event[1].at_s'"},
      {event("kind = \"dent\"\nat_s = inf\nfor_s = 1\n"), "key 'event[1].at_s'"},
      {event("kind = \"dent\"\nat_s = 1\nfor_s = 0\n"), "key 'event[1].for_s'"},
      {event(when + "kind = \"dent\"\ndepth = 3\n"),
       "key 'event[1].depth': expected one of kind, at_s, for_s, place_mm, depth_mm, radius_mm, got an unknown key; "
       "did you mean 'depth_mm'?"},
      {event(when + "kind = \"dent\"\nradius_mm = 0\n"), "key 'event[1].radius_mm': expected a number, 1 to 60, got 0"},
      {event(when + "kind = \"dent\"\nplace_mm = [1, 2, 3]\n"),
       "key 'event[1].place_mm': expected [2 numbers, each -60 to 60], got [1, 2, 3]"},
      {event(when + "kind = \"dent\"\nplace_mm = [1, 61]\n"), "key 'event[1].place_mm'"},
      {event(when + "kind = \"dent\"\nplace_mm = [1, \"a\"]\n"), "key 'event[1].place_mm'"},
      {event(when + "kind = \"dent\"\nplace_mm = 4\n"), "got 4"},
      {event(when + "kind = \"withdrawn\"\ndensity = 1\n"), "key 'event[1].density'"},
      {event(when + "kind = \"camera-delay\"\nto_ms = 101\n"), "expected a number, -100 to 100, got 101"},
      {event(when + "kind = \"retraction\"\n") + "[[event]]\nkind = \"retraction\"\nat_s = 1.5\nfor_s = 1\n",
       "p.toml:6:1: key 'event[2].at_s': expected at least 2, when event[1] of its kind has ended, got 1.5"},
      {event(when + "kind = \"withdrawn\"\n") + "[[event]]\nkind = \"wiped\"\nat_s = 1.5\nfor_s = 1\n",
       "key 'event[2].at_s'"},
      {"version = 1\n[[event\n", "p.toml:2:"},
      {"version = 1\nevent.\xE3\x80\x81 = 1\n", "a letter beyond ASCII"},
      {std::string(70000, '\n'), "expected at most 65536 bytes of TOML, got 70000"},
  };
  for (const Case& wrong : cases)
    EXPECT_THAT(error_of(wrong.text), HasSubstr(wrong.message)) << wrong.text.substr(0, 200);
}

TEST(ProcedureText, TellsAllThatIsWrongInTheOrderOfTheFile) {
  const std::string message =
      error_of(event("kind = \"dent\"\nat_s = -1\nfor_s = 0\n") + "[[event]]\nkind = \"nothing\"\n");
  const auto at = message.find("event[1].at_s"), length = message.find("event[1].for_s"),
             kind = message.find("event[2]");
  EXPECT_LT(at, length);
  EXPECT_LT(length, kind);
  EXPECT_NE(kind, std::string::npos) << message;
}

TEST(ProcedureText, WhatPressesOnOnePlaceMayDoSoAtTheSameTimeAsWhatMovesAll) {
  const auto procedure = parse_procedure(
      event("kind = \"retraction\"\nat_s = 1\nfor_s = 5\n") + "[[event]]\nkind = \"dent\"\nat_s = 2\nfor_s = 1\n",
      "p.toml");
  EXPECT_TRUE(procedure) << procedure.error().message;
}

TEST(ProcedureText, EveryProcedureThatIsShippedIsOne) {
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(PERIMAP_PROCEDURES)) {
    const auto procedure = load_procedure(entry.path());
    EXPECT_TRUE(procedure) << procedure.error().message;
    EXPECT_FALSE(procedure && procedure->empty()) << entry.path();
    ++files;
  }
  EXPECT_GE(files, 6U);
}

TEST(DrawnProcedures, AreTheSameForTheSameSeedAndOthersForAnother) {
  ProcedureDrawing drawing;
  drawing.seed = 7;
  const std::string first = to_toml(draw_procedure(drawing));
  EXPECT_EQ(to_toml(draw_procedure(drawing)), first);
  drawing.seed = 8;
  EXPECT_NE(to_toml(draw_procedure(drawing)), first);
}

TEST(DrawnProcedures, CanBeReadBackAndLeaveTimeBetweenTheirEvents) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    ProcedureDrawing drawing;
    drawing.seed = seed;
    drawing.electromagnetic = seed % 2 == 0;
    drawing.turns_scope = seed % 3 == 0;
    drawing.duration = std::chrono::minutes(seed % 4 == 0 ? 60 : 20);
    const Procedure procedure = draw_procedure(drawing);
    const auto again = parse_procedure(to_toml(procedure), "p.toml");
    ASSERT_TRUE(again) << seed << ": " << again.error().message;
    ASSERT_EQ(to_toml(*again), to_toml(procedure)) << seed;
    ASSERT_GE(procedure.events.size(), 10U);
    EXPECT_GE(procedure.events.front().at, seconds(40));
    EXPECT_LE(procedure.events.back().end(), drawing.duration - seconds(20));
    EXPECT_EQ(procedure.has<Metal>(), drawing.electromagnetic && procedure.has<Metal>());
    for (std::size_t i = 1; i < procedure.events.size(); ++i) {
      EXPECT_GE(procedure.events[i].at, procedure.events[i - 1].end() + milliseconds(19990)) << seed;
    }
  }
}

TEST(DrawnProcedures, HaveEachKindBeforeOneComesAgain) {
  ProcedureDrawing drawing;
  drawing.duration = std::chrono::hours(1);
  drawing.electromagnetic = true;
  drawing.turns_scope = true;
  const Procedure procedure = draw_procedure(drawing);
  // A delay is one kind of two; with that, every kind has a turn.
  const std::size_t deck = kEventKinds.size() - 1;
  ASSERT_GE(procedure.events.size(), deck);
  for (std::size_t i = 0; i < deck; ++i) {
    for (std::size_t j = 0; j < i; ++j) EXPECT_NE(procedure.events[i].what.index(), procedure.events[j].what.index());
  }
}

}  // namespace
}  // namespace perimap
