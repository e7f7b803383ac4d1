#pragma once
// The subcommands of the planar_vslam executable. Each adds itself to the application; when it is the one asked for, it
// runs while the arguments are parsed and leaves its exit code.
#include <string>

namespace CLI {
class App;
}

namespace planar_vslam {

// Exit codes of every subcommand.
constexpr int kExitSuccess = 0;
constexpr int kExitFailure = 1;   // the input was fine, the work was not
constexpr int kExitBadInput = 2;  // bad arguments or unreadable input

void AddRun(CLI::App& app, int* exit_code);
void AddConfig(CLI::App& app, int* exit_code);
void AddCalibrate(CLI::App& app, int* exit_code);
void AddDoctor(CLI::App& app, int* exit_code);
void AddReport(CLI::App& app, int* exit_code);
void AddEvaluate(CLI::App& app, int* exit_code);
void AddGrid(CLI::App& app, int* exit_code);
void AddGridScore(CLI::App& app, int* exit_code);
void AddSimulate(CLI::App& app, int* exit_code);
void AddMap(CLI::App& app, int* exit_code);
// Of `map`.
void AddMapMerge(CLI::App& map, int* exit_code);
// After all others, which it describes.
void AddShell(CLI::App& app, const std::string& version);

// "planar_vslam: message" as one line on stderr; returns `exit_code`.
int Fail(int exit_code, const std::string& message);

}  // namespace planar_vslam
