// The commented default configuration file.
#include <fmt/format.h>

#include "option_list.h"

namespace planar_vslam {
namespace {

constexpr const char* kHead =
    "# Every key with its default. A configuration needs only the keys it changes; `--set key=value` overrides one of\n"
    "# them (`--set tracker.min_inliers=30`). Angles are in degrees and say so in their name. Defaults marked "
    "(fitted)\n"
    "# were chosen while looking at drives of BENCHMARK.md. `planar_vslam config` writes this file.\n";
constexpr int kCommentColumn = 37;

std::string SectionHead(const OptionSection& section) {
  std::string head = "\n# ";
  for (const char c : section.comment) head += c == '\n' ? std::string("\n# ") : std::string(1, c);
  return head + "\n" + section.name + ":\n";
}

std::string Line(const OptionEntry& entry) {
  const std::string value = entry.get();
  const std::string setting =
      fmt::format("{}{}: {}", entry.section.empty() ? "" : "  ", entry.name, value.empty() ? "\"\"" : value);
  return fmt::format("{:<{}}# {}\n", setting + " ", kCommentColumn, entry.comment);
}

}  // namespace

std::string DefaultConfiguration() {
  PipelineOptions options;
  const OptionList list(&options);
  std::string text = std::string(kHead) + "\n";
  std::string section;
  for (const OptionEntry& entry : list.entries()) {
    if (entry.section != section) {
      section = entry.section;
      for (const OptionSection& known : list.sections()) {
        if (known.name == section) text += SectionHead(known);
      }
    }
    text += Line(entry);
  }
  return text;
}

}  // namespace planar_vslam
