#include "yaml_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace planar_vslam::sim {

void YamlErrors::Report(const YAML::Mark& mark, const std::string& key, const std::string& message) {
  if (first_.has_value()) return;
  const std::string line = mark.is_null() ? "" : fmt::format(":{}", mark.line + 1);  // Mark counts from 0
  const std::string field = key.empty() ? "" : key + ": ";
  first_ = fmt::format("{}{}: {}{}", file_, line, field, message);
}

YamlFields::YamlFields(const YAML::Node& node, std::string path, YamlErrors* errors)
    : node_(node.IsMap() ? node : YAML::Node(YAML::NodeType::Map)), path_(std::move(path)), errors_(errors) {
  if (!node.IsMap()) errors_->Report(node.Mark(), path_, "expected a map of keys");
}

bool YamlFields::Has(const std::string& key) const { return node_[key].IsDefined(); }

void YamlFields::Require(const std::string& key) {
  known_.insert(key);
  if (!Has(key)) errors_->Report(node_.Mark(), PathOf(key), "is missing");
}

YAML::Node YamlFields::Child(const std::string& key) {
  known_.insert(key);
  return node_[key];
}

std::optional<double> YamlFields::Number(const YAML::Node& node, const std::string& key) {
  double value = 0.0;
  if (node.IsScalar() && YAML::convert<double>::decode(node, value) && std::isfinite(value)) return value;
  errors_->Report(node.Mark(), PathOf(key), "expected a finite number");
  return std::nullopt;
}

void YamlFields::Read(const std::string& key, double* value) {
  const YAML::Node node = Child(key);
  if (node.IsDefined()) *value = Number(node, key).value_or(*value);
}

void YamlFields::Read(const std::string& key, int* value) {
  const YAML::Node node = Child(key);
  if (!node.IsDefined() || (node.IsScalar() && YAML::convert<int>::decode(node, *value))) return;
  errors_->Report(node.Mark(), PathOf(key), "expected a whole number");
}

void YamlFields::Read(const std::string& key, std::string* value) {
  const YAML::Node node = Child(key);
  if (!node.IsDefined()) return;
  if (!node.IsScalar()) return errors_->Report(node.Mark(), PathOf(key), "expected a word");
  *value = node.Scalar();
}

void YamlFields::Read(const std::string& key, bool* value) {
  const YAML::Node node = Child(key);
  if (!node.IsDefined() || (node.IsScalar() && YAML::convert<bool>::decode(node, *value))) return;
  errors_->Report(node.Mark(), PathOf(key), "expected true or false");
}

std::vector<double> YamlFields::ListOf(const YAML::Node& node, const std::string& key, std::size_t count,
                                       const std::string& expected) {
  std::vector<double> numbers;
  const bool right = node.IsSequence() && node.size() == count &&
                     YAML::convert<std::vector<double>>::decode(node, numbers) &&
                     std::all_of(numbers.begin(), numbers.end(), [](double number) { return std::isfinite(number); });
  if (right) return numbers;
  errors_->Report(node.Mark(), PathOf(key), expected);
  return {};
}

std::vector<double> YamlFields::Numbers(const std::string& key, std::size_t count) {
  const YAML::Node node = Child(key);
  std::vector<double> numbers;
  if (!node.IsDefined()) return numbers;
  if (!node.IsSequence() || node.size() != count) {
    errors_->Report(node.Mark(), PathOf(key), fmt::format("expected a list of {} numbers", count));
    return numbers;
  }
  for (const YAML::Node& item : node) {
    const std::optional<double> number = Number(item, key);
    if (!number.has_value()) return {};
    numbers.push_back(*number);
  }
  return numbers;
}

std::optional<int> YamlFields::Choice(const std::string& key, const std::vector<std::string>& names) {
  const YAML::Node node = Child(key);
  if (!node.IsDefined()) return std::nullopt;
  for (std::size_t i = 0; node.IsScalar() && i < names.size(); ++i) {
    if (node.Scalar() == names[i]) return static_cast<int>(i);
  }
  errors_->Report(node.Mark(), PathOf(key), fmt::format("expected one of {}", fmt::join(names, ", ")));
  return std::nullopt;
}

std::vector<YAML::Node> YamlFields::Items(const std::string& key) {
  const YAML::Node node = Child(key);
  std::vector<YAML::Node> items;
  if (!node.IsDefined()) return items;
  if (!node.IsSequence()) errors_->Report(node.Mark(), PathOf(key), "expected a list");
  for (std::size_t i = 0; node.IsSequence() && i < node.size(); ++i) items.push_back(node[i]);
  return items;
}

void YamlFields::Finish() {
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) {
      errors_->Report(entry.first.Mark(), path_, "expected words as keys");
      continue;
    }
    const std::string& key = entry.first.Scalar();
    if (known_.count(key) == 0) {
      errors_->Report(entry.first.Mark(), PathOf(key),
                      fmt::format("unknown key; expected one of {}", fmt::join(known_, ", ")));
    }
    if (!seen.insert(key).second) errors_->Report(entry.first.Mark(), PathOf(key), "is given twice");
  }
}

}  // namespace planar_vslam::sim
