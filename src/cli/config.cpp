// `planar_vslam config`: the default configuration, and what is wrong with one's own.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "planar_vslam/pipeline/options.h"

namespace planar_vslam {
namespace {

int Check(const std::filesystem::path& file) {
  const std::vector<std::string> problems = FileProblems(file);
  for (const std::string& problem : problems) Fail(kExitBadInput, fmt::format("{}: {}", file.string(), problem));
  if (!problems.empty()) return kExitBadInput;
  std::fputs(fmt::format("{}: no problems\n", file.string()).c_str(), stdout);
  return kExitSuccess;
}

}  // namespace

void AddConfig(CLI::App& app, int* exit_code) {
  auto file = std::make_shared<std::filesystem::path>();
  CLI::App* command = app.add_subcommand("config", "Print the commented default configuration");
  command->require_subcommand(0, 1);
  CLI::App* check = command->add_subcommand("check", "Name every problem of a configuration file");
  check->add_option("file", *file, "Configuration, YAML")->required();
  check->callback([file, exit_code] { *exit_code = Check(*file); });
  command->callback([command] {
    if (command->get_subcommands().empty()) std::fputs(DefaultConfiguration().c_str(), stdout);
  });
}

}  // namespace planar_vslam
