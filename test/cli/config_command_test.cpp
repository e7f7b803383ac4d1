// `planar_vslam config` and `config check`.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <string>

#include "support/support.h"

namespace planar_vslam {
namespace {

struct Outcome {
  int exit_code = -1;
  std::string output;
};

// `redirect` says which of the streams is read.
Outcome RunCommand(const std::string& arguments, const std::string& redirect) {
  const std::string command = std::string("'") + test::Executable() + "' " + arguments + " " + redirect;
  Outcome outcome;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return outcome;
  std::array<char, 256> buffer{};
  while (fgets(buffer.data(), buffer.size(), pipe) != nullptr) outcome.output += buffer.data();
  const int status = pclose(pipe);
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

Outcome OutputOf(const std::string& arguments) { return RunCommand(arguments, "2>/dev/null"); }
Outcome ErrorsOf(const std::string& arguments) { return RunCommand(arguments, "2>&1 >/dev/null"); }

class ConfigCommandTest : public ::testing::Test {
 protected:
  std::string Write(const std::string& text) const {
    const std::string file = (folder_.path() / "my.yaml").string();
    std::ofstream(file) << text;
    return file;
  }
  test::TemporaryFolder folder_;
};

TEST_F(ConfigCommandTest, PrintsTheDefaultFile) {
  const Outcome outcome = OutputOf("config");
  EXPECT_EQ(outcome.exit_code, 0);
  std::ifstream in(test::SourceFolder() / "config/default.yaml");
  const std::string file((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  EXPECT_EQ(outcome.output, file);
}

TEST_F(ConfigCommandTest, WhatItPrintsIsFine) {
  EXPECT_EQ(OutputOf("config check " + Write(OutputOf("config").output)).exit_code, 0);
}

TEST_F(ConfigCommandTest, CheckNamesEveryProblemInALineOfItsOwn) {
  const std::string file = Write("mapper: {windwo: 7, min_parallax_deg: 0}\nodometry: maybe\n");
  const Outcome outcome = ErrorsOf("config check " + file);
  EXPECT_EQ(outcome.exit_code, 2);
  const std::string start = "planar_vslam: " + file + ": ";
  EXPECT_EQ(outcome.output, start + "mapper.windwo is unknown; did you mean mapper.window?\n" + start +
                                "odometry is 'maybe'; expected auto, required or off\n" + start +
                                "mapper.min_parallax_deg is 0; expected more than 0 deg and less than 90 deg\n");
}

TEST_F(ConfigCommandTest, CheckWantsAFile) {
  EXPECT_EQ(ErrorsOf("config check").exit_code, 2);
  const Outcome outcome = ErrorsOf("config check /nowhere/my.yaml");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.output.find("/nowhere/my.yaml: cannot be read"), std::string::npos) << outcome.output;
}

}  // namespace
}  // namespace planar_vslam
