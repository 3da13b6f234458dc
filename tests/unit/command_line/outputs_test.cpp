#include "daemon/command_line/outputs.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace perimap {
namespace {

class Outputs : public testing::Test {
 protected:
  Outputs() {
    std::string name = testing::TempDir() + "outputs-XXXXXX";
    folder_ = mkdtemp(name.data());
    std::ofstream(in("read")) << "text";
    std::filesystem::create_symlink(in("read"), in("link"));
  }
  ~Outputs() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] std::string in(const std::string& name) const { return folder_ + "/" + name; }

  std::string folder_;
};

TEST_F(Outputs, MustNotBeWhatIsReadByAnyName) {
  for (const char* name : {"read", "link", "../read"}) {
    const std::string file = name[0] == '.' ? folder_ + "/x/" + name : in(name);
    const auto apart = check_apart({{"--json", file}}, {{"the recording itself", in("read")}});
    ASSERT_FALSE(apart) << file;
    EXPECT_EQ(apart.error().message, "--json: is the recording itself");
  }
  EXPECT_TRUE(check_apart({{"--json", in("other")}, {"--csv", ""}}, {{"the recording itself", in("read")}}));
  EXPECT_TRUE(check_apart({{"--json", "/dev/null"}}, {{"the recording itself", "/dev/null"}}));
}

TEST_F(Outputs, MustNotBeEachOther) {
  const auto apart = check_apart({{"--csv", in("a")}, {"--video", in("./a")}}, {});
  ASSERT_FALSE(apart);
  EXPECT_EQ(apart.error().message, "--video: is the file of --csv");
}

TEST_F(Outputs, ThatCannotBeWrittenAreNamedWithTheirOption) {
  const auto able = check_writable({{"--json", ""}, {"--html", in("none/a.html")}});
  ASSERT_FALSE(able);
  EXPECT_EQ(able.error().message, "--html: " + in("none/a.html") + ": cannot be written: No such file or directory");
  EXPECT_TRUE(check_writable({{"--json", in("a.json")}}));
  EXPECT_FALSE(std::filesystem::exists(in("a.json")));
}

}  // namespace
}  // namespace perimap
