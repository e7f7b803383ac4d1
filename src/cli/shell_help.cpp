// What shells know of the commands: completion for bash and a manual page, both out of the descriptions that --help
// prints.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "commands.h"

namespace planar_vslam {
namespace {

// A command by the words that call it: "", "run", "map info".
using Visit = std::function<void(const std::string& words, const CLI::App& command)>;

bool IsShown(const CLI::App* command) { return !command->get_group().empty(); }

void ForEachCommand(const CLI::App& command, const std::string& words, const Visit& visit) {
  visit(words, command);
  for (const CLI::App* below : command.get_subcommands([](const CLI::App* each) { return IsShown(each); })) {
    if (below->get_name().empty()) continue;  // a group of options
    ForEachCommand(*below, words.empty() ? below->get_name() : words + " " + below->get_name(), visit);
  }
}

// Those of its groups, too, but --help, which all of them have.
std::vector<const CLI::Option*> OptionsOf(const CLI::App& command) {
  std::vector<const CLI::Option*> options =
      command.get_options([&command](const CLI::Option* each) { return each != command.get_help_ptr(); });
  for (const CLI::App* group : command.get_subcommands([](const CLI::App* each) { return each->get_name().empty(); })) {
    for (const CLI::Option* option : OptionsOf(*group)) options.push_back(option);
  }
  return options;
}

std::string NamesOfOptions(const CLI::App& command) {
  std::string names = "--help";
  for (const CLI::Option* option : OptionsOf(command)) {
    for (const std::string& name : option->get_lnames()) names += " --" + name;
  }
  return names;
}

std::string NamesOfCommands(const CLI::App& command) {
  std::string names;
  for (const CLI::App* below : command.get_subcommands([](const CLI::App* each) { return IsShown(each); })) {
    if (!below->get_name().empty()) names += (names.empty() ? "" : " ") + below->get_name();
  }
  return names;
}

// Words that begin a command choose it; then come its commands, its options behind a dash, and file names for the rest.
constexpr const char* kComplete = R"(  local word=${COMP_WORDS[COMP_CWORD]} command="" next i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    next="${command:+$command }${COMP_WORDS[i]}"
    [[ -n ${options[$next]+known} ]] && command=$next
  done
  local choices=${commands[${command:-top}]}
  [[ $word == -* ]] && choices=${options[${command:-top}]}
  COMPREPLY=($(compgen -W "$choices" -- "$word"))
}
complete -o default -F _planar_vslam planar_vslam
)";

std::string BashCompletion(const CLI::App& app) {
  std::string options, commands;
  ForEachCommand(app, "", [&](const std::string& words, const CLI::App& command) {
    const std::string key = words.empty() ? "top" : words;
    options += fmt::format("    [\"{}\"]=\"{}\"\n", key, NamesOfOptions(command));
    commands += fmt::format("    [\"{}\"]=\"{}\"\n", key, NamesOfCommands(command));
  });
  return fmt::format(
      "# bash completion for planar_vslam, written by `planar_vslam shell completion`\n"
      "_planar_vslam() {{\n  local -A options=(\n{}  )\n  local -A commands=(\n{}  )\n{}",
      options, commands, kComplete);
}

// Text as roff takes it literally, one paragraph a line.
std::string Roff(const std::string& text) {
  std::string roff;
  for (const char character : text) {
    const bool starts_line = roff.empty() || roff.back() == '\n';
    if (starts_line && (character == '.' || character == '\'')) roff += "\\&";
    if (character == '\n') roff += "\n.br";
    if (character == '-') {
      roff += "\\-";
    } else if (character == '\\') {
      roff += "\\e";
    } else {
      roff += character;
    }
  }
  return roff;
}

std::string RoffOf(const CLI::Option& option) {
  std::string value = option.get_type_name();
  if (value == "BOOLEAN") value.clear();
  const std::string name = option.get_name(true, true);
  const std::string given = option.get_default_str();
  return fmt::format(".TP\n\\fB{}\\fR{}{}\n{}{}\n", Roff(name), value.empty() ? "" : " ", Roff(value),
                     Roff(option.get_description()), given.empty() ? "" : Roff(fmt::format(" [{}]", given)));
}

std::string ManualPage(const CLI::App& app, const std::string& version) {
  std::string page = fmt::format(
      ".TH PLANAR_VSLAM 1 \"\" \"{}\"\n.SH NAME\nplanar_vslam \\- {}\n.SH SYNOPSIS\n.B planar_vslam\n.I command\n"
      "[options]\n.SH DESCRIPTION\nEvery command explains itself after \\-\\-help. Messages go to stderr, one line "
      "each. Exit code 0 is success, 1 a failure, 2 bad "
      "arguments or input that cannot be read.\n.SH COMMANDS\n",
      Roff(version), Roff(app.get_description()));
  ForEachCommand(app, "", [&page](const std::string& words, const CLI::App& command) {
    if (words.empty()) return;
    page += fmt::format(".SS planar_vslam {}\n{}\n", Roff(words), Roff(command.get_description()));
    for (const CLI::Option* option : OptionsOf(command)) {
      if (!option->get_group().empty()) page += RoffOf(*option);
    }
  });
  return page;
}

}  // namespace

void AddShell(CLI::App& app, const std::string& version) {
  CLI::App* command = app.add_subcommand("shell", "Print what a shell is to know of these commands");
  command->require_subcommand(1);
  command->add_subcommand("completion", "Completion for bash, to be sourced")->callback([&app] {
    std::fputs(BashCompletion(app).c_str(), stdout);
  });
  command->add_subcommand("manual", "A page for man")->callback([&app, version] {
    std::fputs(ManualPage(app, version).c_str(), stdout);
  });
}

}  // namespace planar_vslam
