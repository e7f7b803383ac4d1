#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <string>

#include "support/support.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

struct Outcome {
  int exit_code = -1;
  std::string errors;  // stderr
};

// Runs the executable with arguments as one would type them.
Outcome RunCommand(const std::string& arguments) {
  const std::string command = "'" + test::Executable() + "' " + arguments + " 2>&1 >/dev/null";
  Outcome outcome;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return outcome;
  std::array<char, 256> buffer{};
  while (fgets(buffer.data(), buffer.size(), pipe) != nullptr) outcome.errors += buffer.data();
  const int status = pclose(pipe);
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

void ExpectBadInput(const std::string& arguments, const std::vector<std::string>& named) {
  const Outcome outcome = RunCommand(arguments);
  EXPECT_EQ(outcome.exit_code, 2) << arguments << "\n" << outcome.errors;
  EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << arguments << "\n" << outcome.errors;
  for (const std::string& word : named) {
    EXPECT_NE(outcome.errors.find(word), std::string::npos) << "'" << word << "' not in: " << outcome.errors;
  }
}

class RunErrorsTest : public ::testing::Test {
 protected:
  // A recording of two grey images, without odometry.
  RunErrorsTest() : input_((folder_.path() / "drive").string()), out_((folder_.path() / "out").string()) {
    fs::create_directories(input_);
    Write("drive/calibration.yaml", "camera: {width: 64, height: 48, fx: 60, fy: 60, cx: 32, cy: 24}\n");
    Write("drive/images.csv", "1.0,a.pgm\n2.0,b.pgm\n");
    for (const char* name : {"drive/a.pgm", "drive/b.pgm"}) Write(name, "P5\n64 48\n255\n" + std::string(64 * 48, 'x'));
  }
  std::string Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.path() / name) << text;
    return (folder_.path() / name).string();
  }
  std::string Run(const std::string& more) const { return "run " + input_ + " --out " + out_ + " " + more; }

  test::TemporaryFolder folder_;
  std::string input_, out_;
};

TEST_F(RunErrorsTest, TheRecordingItselfIsFine) {
  const Outcome outcome = RunCommand(Run("--quiet"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.errors;
  EXPECT_TRUE(fs::exists(out_));
}

TEST_F(RunErrorsTest, NamesAMissingInput) {
  ExpectBadInput("run /nowhere/drive.bag --out " + out_, {"/nowhere/drive.bag"});
  EXPECT_FALSE(fs::exists(out_)) << "nothing is written for input that cannot be read";
}

TEST_F(RunErrorsTest, NamesAFolderThatIsNoRecording) {
  fs::create_directories(folder_.path() / "empty");
  ExpectBadInput("run " + (folder_.path() / "empty").string() + " --out " + out_, {"empty", "images.csv"});
}

TEST_F(RunErrorsTest, NamesAFileThatIsNoBag) {
  const std::string file = Write("notes.bag", "not a bag\n");
  ExpectBadInput("run " + file + " --out " + out_, {"notes.bag"});
}

TEST_F(RunErrorsTest, NamesAnUnknownKeyOfSet) {
  ExpectBadInput(Run("--set tracker.min_inlier=3"), {"--set", "tracker.min_inlier"});
  ExpectBadInput(Run("--set tracker.min_inliers"), {"tracker.min_inliers", "key=value"});
  ExpectBadInput(Run("--set tracker.min_inliers=few"), {"tracker.min_inliers", "few"});
}

TEST_F(RunErrorsTest, NamesAValueOutOfRange) { ExpectBadInput(Run("--set mapper.window=0"), {"mapper", "window"}); }

TEST_F(RunErrorsTest, NamesWhatASavedMapIsWantedFor) {
  ExpectBadInput(Run("--mode localization"), {"--mode localization", "--map FILE"});
  ExpectBadInput(Run("--mode flying"), {"mode", "flying", "localization", "mapping"});
  ExpectBadInput(Run("--map /nowhere/hall.pvm"), {"/nowhere/hall.pvm", "expected"});
  const std::string file = Write("notes.pvm", "not a map\n");
  ExpectBadInput(Run("--map " + file), {"notes.pvm", "not a saved map"});
}

TEST_F(RunErrorsTest, NamesAMisspeltKeyOfAConfiguration) {
  const std::string config = Write("my.yaml", "tracker:\n  min_inliners: 30\n");
  ExpectBadInput(Run("--config " + config), {config, "tracker.min_inliners"});
}

TEST_F(RunErrorsTest, NamesTheLineOfBadYaml) {
  const std::string config = Write("bad.yaml", "tracker: {min_inliers: 30\norb: [\n");
  ExpectBadInput(Run("--config " + config), {config + ":", "YAML"});
}

TEST_F(RunErrorsTest, NamesAMissingConfiguration) {
  ExpectBadInput(Run("--config /nowhere/my.yaml"), {"/nowhere/my.yaml"});
}

TEST_F(RunErrorsTest, SaysThatOdometryIsRequired) {
  ExpectBadInput(Run("--set odometry=required"), {input_, "odometry"});
}

TEST_F(RunErrorsTest, NamesAMissingOdometryFile) {
  ExpectBadInput(Run("--odometry /nowhere/odometry.csv"), {"/nowhere/odometry.csv"});
}

TEST_F(RunErrorsTest, NamesAnOutputFolderThatCannotBeCreated) {
  const std::string blocked = Write("file", "in the way") + "/out";
  ExpectBadInput("run " + input_ + " --out " + blocked, {blocked});
}

TEST_F(RunErrorsTest, AMapsNameNeedsNoFolder) {
  const Outcome outcome = RunCommand(Run("--save-map lab.pvm"));
  EXPECT_EQ(outcome.exit_code, 1) << "two grey images make no map";
  EXPECT_NE(outcome.errors.find("lab.pvm: not saved"), std::string::npos) << outcome.errors;
}

TEST_F(RunErrorsTest, NamesBadArguments) {
  ExpectBadInput("run " + input_, {"--out"});
  ExpectBadInput("run --out " + out_, {"input"});
  ExpectBadInput(Run("--rate -2"), {"--rate"});
  ExpectBadInput(Run("--fast"), {"--fast"});
}

TEST(CommandErrors, NameAnUnknownCommand) { ExpectBadInput("fly", {"fly", "--help"}); }

TEST(CommandErrors, AskForACommand) { ExpectBadInput("", {"command", "--help"}); }

TEST(CommandErrors, EvaluateShiftsPosesAndCovariancesAlike) {
  const test::TemporaryFolder folder;
  const auto file = [&folder](const char* name) { return (folder.path() / name).string(); };
  std::ofstream estimate(file("e.txt")), truth(file("t.txt")), covariances(file("c.csv"));
  covariances << "t,xx,xy,xh,yy,yh,hh\n";
  for (int i = 0; i < 5; ++i) {
    estimate << 1000 + i << " " << i << " 0 0 0 0 0 1\n";
    truth << i << " " << i << " 0 0 0 0 0 1\n";
    covariances << 1000 + i << ",1e-4,0,0,1e-4,0,1e-4\n";
  }
  estimate.close(), truth.close(), covariances.close();
  const Outcome outcome = RunCommand("evaluate --time-offset -1000 --estimate " + file("e.txt") + " --groundtruth " +
                                     file("t.txt") + " --consistency " + file("c.csv"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.errors;
}

TEST(CommandErrors, EvaluateNamesWhatItCannotPlaceOrDraw) {
  const test::TemporaryFolder folder;
  const std::string poses = (folder.path() / "poses.txt").string();
  std::ofstream(poses) << "0 0 0 0 0 0 0 1\n0.1 1 0 0 0 0 0 1\n0.2 2 0 0 0 0 0 1\n0.3 2 1 0 0 0 0 1\n";
  const std::string evaluate = "evaluate --estimate " + poses + " --groundtruth " + poses + " ";
  const std::string plot = "--plot " + (folder.path() / "plot.svg").string();
  EXPECT_EQ(RunCommand(evaluate + "--transform=0,0,0 " + plot + " --beside " + poses).exit_code, 0);
  ExpectBadInput(evaluate + "--transform=0,nan,0", {"--transform", "finite"});
  ExpectBadInput(evaluate + "--transform=0,0", {"--transform"});
  ExpectBadInput(evaluate + "--transform=0,0,0 --align se2", {"--transform", "--align"});
  ExpectBadInput(evaluate + "--grid map.yaml", {"--grid", "--plot"});
  ExpectBadInput(evaluate + plot + " --grid /nowhere/map.yaml", {"/nowhere/map.yaml"});
  ExpectBadInput(evaluate + plot + " --beside /nowhere/odometry.txt", {"/nowhere/odometry.txt"});
}

TEST(CommandErrors, SimulateNamesWhatItDoesNotKnow) {
  const test::TemporaryFolder folder;
  const std::string out = " --out " + (folder.path() / "drive").string();
  ExpectBadInput("simulate castle" + out, {"castle", "expected a world file"});
  ExpectBadInput("simulate sample_lab --drive detour" + out, {"detour", "expected mapping, repeat or reverse"});
  ExpectBadInput("simulate sample_lab --variant fog" + out, {"fog", "expected one of"});
  ExpectBadInput("simulate sample_lab", {"--out"});
}

TEST(CommandErrors, HelpIsNoError) {
  for (const char* arguments : {"--help", "run --help"}) {
    const Outcome outcome = RunCommand(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << arguments;
    EXPECT_EQ(outcome.errors, "") << arguments;
  }
}

}  // namespace
}  // namespace planar_vslam
