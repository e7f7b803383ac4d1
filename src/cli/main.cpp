#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>

#include "commands.h"

namespace planar_vslam {

int Fail(int exit_code, const std::string& message) {
  std::string line = message;
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::fprintf(stderr, "planar_vslam: %s\n", line.c_str());
  return exit_code;
}

namespace {

int Main(int argc, char** argv) {
  CLI::App app("Visual SLAM fused with wheel odometry for robots on a floor", "planar_vslam");
  app.set_version_flag("--version", "planar_vslam " PV_VERSION);
  int exit_code = kExitSuccess;
  AddRun(app, &exit_code);
  AddConfig(app, &exit_code);
  AddCalibrate(app, &exit_code);
  AddDoctor(app, &exit_code);
  AddReport(app, &exit_code);
  AddEvaluate(app, &exit_code);
  AddGrid(app, &exit_code);
  AddGridScore(app, &exit_code);
  AddSimulate(app, &exit_code);
  AddMap(app, &exit_code);
  AddShell(app, "planar_vslam " PV_VERSION);
  app.require_subcommand(0, 1);  // an unknown command is then named as unexpected, not reported as a missing one
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool only_help = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success);
    return only_help ? app.exit(error) : Fail(kExitBadInput, std::string(error.what()) + " (--help explains)");
  } catch (const std::exception& error) {
    return Fail(kExitFailure, error.what());
  }
  if (app.get_subcommands().empty()) return Fail(kExitBadInput, "no command given; expected one (--help lists them)");
  return exit_code;
}

}  // namespace
}  // namespace planar_vslam

int main(int argc, char** argv) { return planar_vslam::Main(argc, argv); }
