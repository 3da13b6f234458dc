#include "daemon/command_line/commands.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/command_line/choice.hpp"

namespace perimap {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

struct Ended {
  int code;
  std::string out, error;
};

// A program with two commands and one of commands.
struct Program {
  enum class Kind { kFirst, kSecond };

  int workers = 0;
  bool loudly = false;
  Kind kind = Kind::kFirst;
  std::string input;
  std::string done;  // what was run

  Outcome outcome;

  Ended run(std::vector<const char*> arguments) {
    Commands commands("prog", "1.2", "What it does.", "The end.");
    Command& replay = commands.add("replay", "Replays", [this](const Console& console) {
      done = console.name();
      return outcome;
    });
    replay.add_option("INPUT", input)->required();
    replay.add_option("-w,--workers", workers)->check(Range(1, 4));
    replay.add_option_group("Others").add_flag("--loudly", loudly);
    add_choice(replay, "--kind", kind, {{"first", Kind::kFirst}, {"second", Kind::kSecond}}, "Which one [first]");
    commands.add("report", "Reports", [this](const Console&) { return outcome; });
    commands.add("hidden", "Not for users", [this](const Console&) { return outcome; }).group("");
    Command& ctl = commands.add_group("ctl", "Tells");
    Command& record = commands.add_group(ctl, "record", "Records");
    commands.add(record, "on", "Begins", [this](const Console& console) {
      done = console.name();
      return outcome;
    });
    arguments.insert(arguments.begin(), "prog");
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const int code = commands.run(static_cast<int>(arguments.size()), arguments.data());
    Ended ended{code, testing::internal::GetCapturedStdout(), testing::internal::GetCapturedStderr()};
    return ended;
  }
};

TEST(Commands, WhatIsTypedIsDoneAndEndsWith0) {
  Program program;
  const Ended ended = program.run({"replay", "heart.mcap", "-w", "3", "--kind", "second"});
  EXPECT_EQ(ended.code, 0);
  EXPECT_EQ(ended.error, "");
  EXPECT_EQ(program.done, "prog replay");
  EXPECT_EQ(program.input, "heart.mcap");
  EXPECT_EQ(program.workers, 3);
  EXPECT_EQ(program.kind, Program::Kind::kSecond);
  EXPECT_EQ(program.run({"ctl", "record", "on"}).code, 0);
  EXPECT_EQ(program.done, "prog ctl record on");
}

TEST(Commands, WhatIsRefusedIsToldWithTheProgramsNameAndItsExitCode) {
  Program program;
  program.outcome = refuse("heart.mcap: cannot be read");
  Ended ended = program.run({"replay", "x"});
  EXPECT_EQ(ended.code, 1);
  EXPECT_EQ(ended.error, "prog replay: heart.mcap: cannot be read\n");
  EXPECT_EQ(ended.out, "");
  program.outcome = refuse("a.toml:1:1: wrong\na.toml:2:1: wrong, too", ExitCode::kWrongUsage);
  ended = program.run({"ctl", "record", "on"});
  EXPECT_EQ(ended.code, 2);
  EXPECT_EQ(ended.error, "prog ctl record on: a.toml:1:1: wrong\nprog ctl record on: a.toml:2:1: wrong, too\n");
  program.outcome = refuse("");
  ended = program.run({"replay", "x"});
  EXPECT_EQ(ended.code, 1);
  EXPECT_EQ(ended.error, "");
}

TEST(Commands, AMisspeltCommandIsToldWhichOneWasMeant) {
  Program program;
  Ended ended = program.run({"repaly", "heart.mcap", "--workers", "3"});
  EXPECT_EQ(ended.code, 2);
  EXPECT_THAT(ended.error, StartsWith("prog: 'repaly': is no command; did you mean 'replay'?\nprog: prog --help "));
  EXPECT_THAT(program.run({"ctl", "recrod", "on"}).error,
              StartsWith("prog ctl: 'recrod': is no command; did you mean 'record'?\nprog ctl: prog ctl --help "));
  EXPECT_THAT(program.run({"ctl", "record", "no"}).error,
              StartsWith("prog ctl record: 'no': is no command; did you mean 'on'?\n"));
  EXPECT_THAT(program.run({"hiden"}).error, StartsWith("prog: 'hiden': is no command\n"));
  EXPECT_EQ(program.done, "");
}

TEST(Commands, AMisspeltOptionIsToldWhichOneWasMeant) {
  Program program;
  Ended ended = program.run({"replay", "heart.mcap", "--wokers=3", "--xyz"});
  EXPECT_EQ(ended.code, 2);
  EXPECT_THAT(ended.error, StartsWith("prog replay: --wokers=3: is no option; did you mean '--workers'?\n"
                                      "prog replay: --xyz: is no option\n"));
  // Nor that its value is one argument too many; another is.
  ended = program.run({"replay", "heart.mcap", "--wokers", "3", "4"});
  EXPECT_THAT(ended.error, ::testing::Not(HasSubstr("'3'")));
  EXPECT_THAT(ended.error, HasSubstr("prog replay: '4': is one argument too many\n"));
  EXPECT_THAT(program.run({"replay", "heart.mcap", "--wokers=3", "4"}).error, HasSubstr("'4': is one"));
  EXPECT_THAT(program.run({"replay", "x", "--loudy"}).error, HasSubstr("did you mean '--loudly'?"));
  // What is missing because of it need not be told.
  EXPECT_THAT(program.run({"replay", "--lodly"}).error, ::testing::Not(HasSubstr("required")));
  EXPECT_EQ(program.done, "");
}

TEST(Commands, WhatElseIsWrongIsToldWithTheCommandsName) {
  Program program;
  for (const auto& [arguments, told] : std::vector<std::pair<std::vector<const char*>, const char*>>{
           {{}, "prog: A subcommand is required\n"},
           {{"replay"}, "prog replay: INPUT is required\n"},
           {{"replay", "a", "b"}, "prog replay: 'b': is one argument too many\n"},
           {{"replay", "a", "--workers", "9"}, "prog replay: --workers: Value 9 not in range"},
           {{"replay", "a", "--kind", "third"}, "prog replay: --kind: third not in {first,second}"}}) {
    const Ended ended = program.run(arguments);
    EXPECT_EQ(ended.code, 2) << told;
    EXPECT_THAT(ended.error, StartsWith(told));
    EXPECT_EQ(ended.out, "");
  }
}

TEST(Commands, HelpAndVersionGoToStandardOutputAndEndWith0) {
  Program program;
  Ended ended = program.run({"--help"});
  EXPECT_EQ(ended.code, 0);
  EXPECT_THAT(ended.out, HasSubstr("replay"));
  EXPECT_THAT(ended.out, ::testing::Not(HasSubstr("hidden")));
  ended = program.run({"replay", "--help"});
  EXPECT_EQ(ended.code, 0);
  EXPECT_THAT(ended.out, HasSubstr("--kind TEXT:{first,second}"));
  EXPECT_EQ(program.run({"--version"}).out, "prog 1.2\n");
}

}  // namespace
}  // namespace perimap
