#pragma once
// Strict reading of YAML maps: every key is asked for by name, the rest is an error. The first error wins.
#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace planar_vslam::sim {

// Collects the first error as one line "FILE:LINE: key: message".
class YamlErrors {
 public:
  explicit YamlErrors(std::string file) : file_(std::move(file)) {}
  void Report(const YAML::Mark& mark, const std::string& key, const std::string& message);
  const std::optional<std::string>& first() const { return first_; }

 private:
  std::string file_;
  std::optional<std::string> first_;
};

// The fields of one map. `path` is the map's own key in the file ("objects[2]"), empty for the whole file.
class YamlFields {
 public:
  YamlFields(const YAML::Node& node, std::string path, YamlErrors* errors);

  bool Has(const std::string& key) const;
  // An absent key keeps the default the target holds, unless it is required.
  void Require(const std::string& key);
  void Read(const std::string& key, double* value);
  void Read(const std::string& key, int* value);
  void Read(const std::string& key, std::string* value);
  void Read(const std::string& key, bool* value);
  template <int N>
  void Read(const std::string& key, Eigen::Matrix<double, N, 1>* value) {
    const std::vector<double> numbers = Numbers(key, N);
    for (std::size_t i = 0; i < numbers.size(); ++i) (*value)[static_cast<Eigen::Index>(i)] = numbers[i];
  }
  // One of `names`, as its index.
  template <class Enum>
  void ReadEnum(const std::string& key, const std::vector<std::string>& names, Enum* value) {
    const std::optional<int> index = Choice(key, names);
    if (index.has_value()) *value = static_cast<Enum>(*index);
  }
  // `count` numbers; empty when absent or wrong.
  std::vector<double> Numbers(const std::string& key, std::size_t count);
  // `count` finite numbers of a node that stands under `key`; empty, and an error, when it is anything else.
  std::vector<double> ListOf(const YAML::Node& node, const std::string& key, std::size_t count,
                             const std::string& expected);
  // The node of a key (undefined when absent), for nested maps and sequences; marks the key as known.
  YAML::Node Child(const std::string& key);
  // The items of a sequence; none when absent.
  std::vector<YAML::Node> Items(const std::string& key);
  // Reports keys that were never asked for, and keys given twice.
  void Finish();

  std::string PathOf(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }
  YamlErrors* errors() const { return errors_; }

 private:
  std::optional<double> Number(const YAML::Node& node, const std::string& key);
  std::optional<int> Choice(const std::string& key, const std::vector<std::string>& names);

  const YAML::Node node_;
  std::string path_;
  YamlErrors* errors_;
  std::set<std::string> known_;
};

}  // namespace planar_vslam::sim
