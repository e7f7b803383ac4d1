#include "planar_vslam/pipeline/options.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <set>

#include "option_list.h"

namespace planar_vslam {
namespace {

// Keys that were, and what they are now.
constexpr std::pair<const char*, const char*> kRenamed[] = {
    {"bundle.pixel_sigma", "pixel_sigma"},
    {"scale.wheel_sigma", "systematic.wheels"},
    {"scale.laser_sigma", "systematic.laser"},
};

std::string UnknownKey(const OptionList& list, const std::string& key) {
  const auto is_key = [&key](const OptionSection& section) { return section.name == key; };
  if (std::any_of(list.sections().begin(), list.sections().end(), is_key)) {
    return fmt::format("{} is a section; expected keys in it", key);
  }
  for (const auto& [before, now] : kRenamed) {
    if (key == before) return fmt::format("{} was renamed to {}", key, now);
  }
  const std::string nearest = list.Nearest(key);
  return nearest.empty() ? fmt::format("{} is unknown; `planar_vslam config` prints the known keys", key)
                         : fmt::format("{} is unknown; did you mean {}?", key, nearest);
}

// Sets one key; a message says what is wrong, empty when nothing is.
std::string SetField(const OptionList& list, const std::string& key, const std::string& text) {
  const OptionEntry* entry = list.Find(key);
  if (entry == nullptr) return UnknownKey(list, key);
  return entry->set(text) ? "" : fmt::format("{} is '{}'; expected {}", key, text, entry->expected);
}

// Sets the keys of a file, and remembers what was wrong.
class NodeReader {
 public:
  explicit NodeReader(PipelineOptions* options) : list_(options) {}

  void Read(const YAML::Node& node, const std::string& prefix = "") {
    for (const auto& entry : node) {
      const std::string key = prefix + entry.first.as<std::string>();
      if (entry.second.IsMap()) {
        Read(entry.second, key + ".");
        continue;
      }
      const std::string problem = Use(key, entry.second);
      if (!problem.empty()) problems_.push_back(problem);
    }
  }
  const std::vector<std::string>& problems() const { return problems_; }

 private:
  std::string Use(const std::string& key, const YAML::Node& value) {
    if (!seen_.insert(key).second) return fmt::format("{} stands twice; expected it once", key);
    if (value.IsSequence()) return fmt::format("{} is a list; expected a single value", key);
    return SetField(list_, key, value.IsNull() ? "" : value.Scalar());
  }

  OptionList list_;
  std::set<std::string> seen_;
  std::vector<std::string> problems_;
};

// The file over the defaults, as far as it can be read; returns what cannot.
std::vector<std::string> ReadFile(const std::filesystem::path& path, PipelineOptions* options) {
  const std::string unreadable = "cannot be read; expected a YAML configuration file";
  if (!std::filesystem::is_regular_file(path)) return {unreadable};
  NodeReader reader(options);
  try {
    const YAML::Node root = YAML::LoadFile(path.string());
    if (root.IsNull()) return {};
    if (!root.IsMap()) return {"expected a map of keys"};
    reader.Read(root);
  } catch (const YAML::BadFile&) {
    return {unreadable};
  } catch (const YAML::Exception& e) {
    return {fmt::format("line {}: not valid YAML: {}", e.mark.line + 1, e.msg)};
  }
  return reader.problems();
}

void Append(const std::vector<std::string>& more, std::vector<std::string>* all) {
  all->insert(all->end(), more.begin(), more.end());
}

}  // namespace

std::vector<std::string> PipelineOptions::Problems() const {
  std::vector<std::string> all = ProblemsOf(*this);
  if (initializer.mode == InitializationMode::kOdometry && odometry == OdometryUse::kOff) {
    all.emplace_back("init is odometry while odometry is off; expected init visual, or odometry auto");
  }
  return all;
}

Expected<PipelineOptions> LoadOptions(const std::filesystem::path& path) {
  PipelineOptions options;
  std::vector<std::string> problems = ReadFile(path, &options);
  if (problems.empty()) return options;
  Append(options.Problems(), &problems);
  return Error{fmt::format("{}: {}", path.string(), fmt::join(problems, "; "))};
}

Expected<PipelineOptions> SetOption(PipelineOptions options, const std::string& assignment) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos) return Error{fmt::format("--set {}: expected key=value", assignment)};
  const OptionList list(&options);
  const std::string problem = SetField(list, assignment.substr(0, equals), assignment.substr(equals + 1));
  if (!problem.empty()) return Error{fmt::format("--set {}: {}", assignment, problem)};
  return options;
}

PipelineOptions CollectOptions(const std::filesystem::path& file, const std::vector<std::string>& assignments,
                               std::vector<std::string>* problems) {
  PipelineOptions options;
  if (!file.empty()) {
    for (const std::string& problem : ReadFile(file, &options)) {
      problems->push_back(fmt::format("{}: {}", file.string(), problem));
    }
  }
  for (const std::string& assignment : assignments) {
    const Expected<PipelineOptions> changed = SetOption(options, assignment);
    if (changed.ok()) {
      options = *changed;
    } else {
      problems->push_back(changed.error().message);
    }
  }
  Append(options.Problems(), problems);
  return options;
}

std::vector<std::string> FileProblems(const std::filesystem::path& path) {
  PipelineOptions options;
  std::vector<std::string> problems = ReadFile(path, &options);
  Append(options.Problems(), &problems);
  return problems;
}

std::vector<std::pair<std::string, std::string>> OptionValues(const PipelineOptions& options) {
  PipelineOptions copy = options;
  std::vector<std::pair<std::string, std::string>> values;
  const OptionList list(&copy);
  for (const OptionEntry& entry : list.entries()) values.emplace_back(entry.key(), entry.get());
  return values;
}

}  // namespace planar_vslam
