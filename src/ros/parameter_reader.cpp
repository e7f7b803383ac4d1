#include "parameter_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

namespace planar_vslam::ros_face {

bool ParseList(const std::string& text, std::vector<std::string>* words) {
  if (text.size() < 2 || text.front() != '[' || text.back() != ']') return false;
  words->clear();
  std::istringstream list(text.substr(1, text.size() - 2));
  for (std::string word; std::getline(list, word, ',');) {
    const std::size_t begin = word.find_first_not_of(' ');
    if (begin == std::string::npos) return false;
    words->push_back(word.substr(begin, word.find_last_not_of(' ') - begin + 1));
  }
  return true;
}

void ParameterReader::RequirePositive(const std::string& name, double value) {
  if (!(value > 0.0)) Report(name, fmt::format("is {}; expected a number over 0", value));
}

void ParameterReader::RefuseUnknown() {
  std::vector<std::string> names;
  node_.getParamNames(names);
  std::sort(names.begin(), names.end());
  const std::string own = node_.getNamespace() + "/";
  for (const std::string& name : names) {
    if (name.rfind(own, 0) != 0) continue;
    const std::string key = name.substr(own.size());
    if (key.find('/') != std::string::npos || std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    problems_->push_back(fmt::format("{}: no such parameter; expected one of {}", name, fmt::join(known_, ", ")));
  }
}

void ParameterReader::Report(const std::string& name, const std::string& message) {
  problems_->push_back(fmt::format("{}: {}", node_.resolveName(name), message));
}

}  // namespace planar_vslam::ros_face
