#include "include_rules.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <optional>
#include <regex>
#include <set>

namespace planar_vslam::test {
namespace {

namespace fs = std::filesystem;

// The graph: what a module may include beside itself, and through those whatever they may include.
const std::map<std::string, std::set<std::string>>& Graph() {
  static const std::map<std::string, std::set<std::string>> graph{
      {"geometry", {}},
      {"sensor", {"geometry"}},
      {"feature", {"sensor"}},
      {"planar", {"sensor"}},
      {"map", {"feature", "planar"}},
      {"optimize", {"map"}},
      {"recognition", {"optimize"}},
      {"frontend", {"recognition"}},
      {"backend", {"recognition"}},
      {"localize", {"recognition"}},
      {"mapping2d", {"geometry"}},
      {"navigate", {"sensor", "mapping2d"}},
      {"pipeline", {"frontend", "backend", "localize", "mapping2d"}},
      {"io", {"pipeline"}},
      {"sim", {"sensor"}},
      {"cli", {"io", "sim"}},
      {"ros", {"io", "sim", "navigate"}},
  };
  return graph;
}

bool MayInclude(const std::string& from, const std::string& to) {
  if (from == to) return true;
  const auto& next = Graph().at(from);
  return std::any_of(next.begin(), next.end(), [&to](const std::string& module) { return MayInclude(module, to); });
}

struct Include {
  std::size_t line = 0;
  std::string name;  // as written
};

std::vector<Include> IncludesOf(const SourceFile& file) {
  static const std::regex pattern(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
  std::vector<Include> includes;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    std::smatch match;
    if (std::regex_search(file.lines[i], match, pattern)) includes.push_back({i + 1, match[1].str()});
  }
  return includes;
}

std::string At(const SourceFile& file, std::size_t line) { return file.path + ":" + std::to_string(line) + ": "; }

bool StartsWith(const std::string& text, const std::string& prefix) { return text.rfind(prefix, 0) == 0; }

// "src/map/x.cpp", "include/planar_vslam/map/x.h" -> "map"; "planar/src/x.cpp" -> "planar"; nothing for other places.
std::optional<std::string> ModuleOf(const std::string& path) {
  static const std::regex pattern("^(?:src/|include/planar_vslam/|(?=planar/|mapping2d/))([a-z0-9_]+)/.*");
  std::smatch match;
  if (!std::regex_match(path, match, pattern)) return std::nullopt;
  if (Graph().count(match[1].str()) == 0) return std::nullopt;
  return match[1].str();
}

// "planar_vslam/State.h" is generated from msg/ or srv/: our headers lie in the folder of their module.
bool IsGeneratedMessage(const std::string& include) {
  return StartsWith(include, "planar_vslam/") && std::count(include.begin(), include.end(), '/') == 1;
}

// The file of ours that an include means: beside the includer, or a public header.
std::optional<std::string> Resolve(const SourceFile& file, const std::string& include,
                                   const std::set<std::string>& paths) {
  const std::string beside = (fs::path(file.path).parent_path() / include).lexically_normal().generic_string();
  for (const std::string& candidate :
       {beside, "include/" + include, "planar/include/" + include, "mapping2d/include/" + include}) {
    if (paths.count(candidate) != 0) return candidate;
  }
  return std::nullopt;
}

std::set<std::string> PathsOf(const std::vector<SourceFile>& files) {
  std::set<std::string> paths;
  for (const SourceFile& file : files) paths.insert(file.path);
  return paths;
}

// What is wrong with one include as far as modules go; empty when nothing is.
std::string ModuleProblem(const SourceFile& file, const std::string& module, const std::string& include,
                          const std::set<std::string>& paths) {
  const std::optional<std::string> target = Resolve(file, include, paths);
  if (!target.has_value()) {
    const bool missing = StartsWith(include, "planar_vslam/") && !IsGeneratedMessage(include);
    return missing ? "no such header: " + include : "";
  }
  const std::optional<std::string> target_module = ModuleOf(*target);
  if (!target_module.has_value()) return "";  // the target is reported itself
  if (!MayInclude(module, *target_module)) return module + " may not include " + *target_module + " (" + include + ")";
  if (module != *target_module && !StartsWith(include, "planar_vslam/"))
    return include + " is private to " + *target_module;
  return "";
}

bool IsRos(const std::string& include) {
  static const std::regex pattern(
      "^(ros|roscpp|[a-z0-9_]+_msgs|std_srvs|tf|tf2[a-z_]*|rosbag|rostest|image_transport|camera_info_manager|cv_"
      "bridge|"
      "nodelet|pluginlib|actionlib|message_filters|diagnostic_updater|dynamic_reconfigure|laser_geometry|nav_core|"
      "costmap_2d|pcl_ros|pcl_conversions)/.*");
  return std::regex_match(include, pattern) || IsGeneratedMessage(include);
}

// The bag reader: rosbag, message definitions and the stamps inside them, without a running ROS.
bool IsBagReading(const std::string& include) {
  static const std::regex pattern("^(rosbag/.*|[a-z0-9_]+_msgs/.*|ros/(time|duration)\\.h)$");
  return std::regex_match(include, pattern);
}

std::string RimProblem(const std::string& path, const std::string& include) {
  if (IsRos(include) && !StartsWith(path, "src/ros/")) {
    if (!StartsWith(path, "src/io/")) return "ROS header " + include + " outside src/ros";
    if (!IsBagReading(include)) return "ROS header " + include + " is more than reading bags needs";
  }
  if (StartsWith(include, "pcl/") && !StartsWith(path, "mapping2d/src/")) {
    return "PCL header " + include + " outside mapping2d/src";
  }
  return "";
}

// Depth-first walk over includes; a header met again on the way down closes a cycle.
class CycleSearch {
 public:
  explicit CycleSearch(const std::vector<SourceFile>& files) : paths_(PathsOf(files)) {
    for (const SourceFile& file : files) files_[file.path] = &file;
  }

  std::vector<std::string> Run() {
    for (const auto& [path, file] : files_) Visit(*file);
    return violations_;
  }

 private:
  void Visit(const SourceFile& file) {
    if (!visited_.insert(file.path).second) return;
    way_.push_back(file.path);
    for (const Include& include : IncludesOf(file)) {
      const std::optional<std::string> target = Resolve(file, include.name, paths_);
      if (!target.has_value()) continue;
      const auto start = std::find(way_.begin(), way_.end(), *target);
      if (start != way_.end()) {
        std::string cycle;
        for (auto it = start; it != way_.end(); ++it) cycle += *it + " -> ";
        violations_.push_back(At(file, include.line) + "header cycle " + cycle + *target);
      } else {
        Visit(*files_.at(*target));
      }
    }
    way_.pop_back();
  }

  std::set<std::string> paths_;
  std::map<std::string, const SourceFile*> files_;
  std::set<std::string> visited_;
  std::vector<std::string> way_;
  std::vector<std::string> violations_;
};

SourceFile ReadSource(const fs::path& root, const fs::path& path) {
  SourceFile file{path.lexically_relative(root).generic_string(), {}};
  std::ifstream stream(path);
  for (std::string line; std::getline(stream, line);) file.lines.push_back(line);
  return file;
}

bool HasEnding(const fs::path& path, const std::vector<std::string>& endings) {
  const std::string name = path.filename().string();
  return std::any_of(endings.begin(), endings.end(), [&name](const std::string& ending) {
    return name.size() >= ending.size() && name.compare(name.size() - ending.size(), ending.size(), ending) == 0;
  });
}

}  // namespace

std::vector<SourceFile> ReadSources(const fs::path& root, const std::vector<std::string>& folders,
                                    const std::vector<std::string>& endings) {
  std::vector<SourceFile> files;
  for (const std::string& folder : folders) {
    if (fs::is_regular_file(root / folder)) files.push_back(ReadSource(root, root / folder));
    if (!fs::is_directory(root / folder)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      if (entry.is_regular_file() && HasEnding(entry.path(), endings)) files.push_back(ReadSource(root, entry.path()));
    }
  }
  std::sort(files.begin(), files.end(), [](const SourceFile& a, const SourceFile& b) { return a.path < b.path; });
  return files;
}

std::vector<std::string> ModuleViolations(const std::vector<SourceFile>& files) {
  const std::set<std::string> paths = PathsOf(files);
  std::vector<std::string> violations;
  for (const SourceFile& file : files) {
    const std::optional<std::string> module = ModuleOf(file.path);
    if (!module.has_value()) {
      violations.push_back(At(file, 1) + "lies in no module of the architecture");
      continue;
    }
    for (const Include& include : IncludesOf(file)) {
      const std::string problem = ModuleProblem(file, *module, include.name, paths);
      if (!problem.empty()) violations.push_back(At(file, include.line) + problem);
    }
  }
  return violations;
}

std::vector<std::string> RimViolations(const std::vector<SourceFile>& files) {
  std::vector<std::string> violations;
  for (const SourceFile& file : files) {
    for (const Include& include : IncludesOf(file)) {
      const std::string problem = RimProblem(file.path, include.name);
      if (!problem.empty()) violations.push_back(At(file, include.line) + problem);
    }
  }
  return violations;
}

std::vector<std::string> CycleViolations(const std::vector<SourceFile>& files) { return CycleSearch(files).Run(); }

std::vector<std::string> LengthViolations(const std::vector<SourceFile>& files) {
  std::vector<std::string> violations;
  for (const SourceFile& file : files) {
    if (file.lines.size() <= kMaxLines) continue;
    violations.push_back(At(file, kMaxLines + 1) + std::to_string(file.lines.size()) + " lines, at most " +
                         std::to_string(kMaxLines) + " can be read in one sitting");
  }
  return violations;
}

std::vector<std::string> FlagViolations(const std::vector<SourceFile>& cmake_files) {
  static const std::regex pattern("-(march=native|mtune=native|ffast-math|Ofast|funsafe-math-optimizations)");
  std::vector<std::string> violations;
  for (const SourceFile& file : cmake_files) {
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string code = file.lines[i].substr(0, file.lines[i].find('#'));
      std::smatch match;
      if (std::regex_search(code, match, pattern))
        violations.push_back(At(file, i + 1) + "compiler flag " + match[0].str());
    }
  }
  return violations;
}

}  // namespace planar_vslam::test
