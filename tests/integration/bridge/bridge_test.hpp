// What the tests of `perimap bridge` have in common.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include "bridge_program.hpp"
#include "scripted_perimapd.hpp"

namespace perimap::test {

// A folder, and a DDS domain in which test runs on one host do not hear each other; the program is not started yet.
class BridgeTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string folder = (std::filesystem::temp_directory_path() / "perimap-bridge-XXXXXX").string();
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    folder_ = folder;
    domain_ = 20 + static_cast<int>(getpid() % 100);
    const std::string uri = "file://" PERIMAP_CYCLONEDDS_XML ",<CycloneDDS><Domain><Discovery><Tag>" +
                            folder_.filename().string() + "</Tag></Discovery></Domain></CycloneDDS>";
    setenv("CYCLONEDDS_URI", uri.c_str(), 1);
    program_ = std::make_unique<BridgeProgram>((folder_ / "log").string());
  }
  void TearDown() override {
    program_.reset();
    std::filesystem::remove_all(folder_);
  }

  std::filesystem::path folder_;
  int domain_ = 0;
  std::unique_ptr<BridgeProgram> program_;
  ScriptedPerimapd perimapd_;
};

}  // namespace perimap::test
