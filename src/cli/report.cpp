#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "planar_vslam/io/report_page.h"

namespace planar_vslam {
namespace {

struct ReportArguments {
  std::filesystem::path folder, out, truth, odometry;
};

int Report(const ReportArguments& arguments) {
  ReportInput input;
  input.folder = arguments.folder;
  if (!arguments.truth.empty()) input.truth = arguments.truth;
  if (!arguments.odometry.empty()) input.odometry = arguments.odometry;
  const std::filesystem::path page = arguments.out.empty() ? arguments.folder / "report.html" : arguments.out;
  const Expected<bool> written = WriteReportPage(input, page);
  if (!written.ok()) return Fail(kExitBadInput, written.error().message);
  fmt::print("{}\n", page.string());
  return kExitSuccess;
}

}  // namespace

void AddReport(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<ReportArguments>();
  CLI::App* command = app.add_subcommand("report", "One HTML page of what a run left in its folder");
  command->add_option("folder", arguments->folder, "The folder of `run --out`")->required();
  command->add_option("--out", arguments->out, "The page; DIR/report.html where it is not given");
  command->add_option("--groundtruth", arguments->truth, "Drawn beside it: TUM trajectory of the base");
  command->add_option("--odometry", arguments->odometry, "Drawn beside it: TUM trajectory of the wheels alone");
  command->callback([arguments, exit_code] { *exit_code = Report(*arguments); });
}

}  // namespace planar_vslam
