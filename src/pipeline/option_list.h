#pragma once
// PipelineOptions as a list of entries that are set from text and shown as text: a visitor of its fields.
#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "planar_vslam/pipeline/options.h"

namespace planar_vslam {

struct OptionEntry {
  std::string section;                          // empty at the top level
  std::string name;                             // within the section
  std::string comment;                          // unit and meaning
  std::string expected;                         // "an integer"
  std::function<bool(const std::string&)> set;  // false: the text is no such value
  std::function<std::string()> get;

  std::string key() const { return section.empty() ? name : section + "." + name; }
};

struct OptionSection {
  std::string name;
  std::string comment;  // lines
};

class OptionList {
 public:
  // The list refers to `options`, which has to outlive it.
  explicit OptionList(PipelineOptions* options) { PipelineOptions::Visit(*options, *this); }

  const std::vector<OptionEntry>& entries() const { return entries_; }
  const std::vector<OptionSection>& sections() const { return sections_; }
  const OptionEntry* Find(const std::string& key) const;
  // The known key that is spelt most like `key`; empty where none is.
  std::string Nearest(const std::string& key) const;

  // The visitor.
  void Section(const char* name, const char* comment) { sections_.push_back({name, comment}); }
  void operator()(const char* name, double& value, const Unit& unit, const Bound& bound, const char* text,
                  Origin origin = Origin::kStated);
  void operator()(const char* name, int& value, const Unit& unit, const Bound& bound, const char* text,
                  Origin origin = Origin::kStated);
  void operator()(const char* name, bool& value, const char* text);
  void operator()(const char* name, std::string& value, const char* text);
  template <class E>
  void operator()(const char* name, E& value, const Choices<E>& choices, const char* text) {
    OptionEntry& entry = Add(name, text);
    for (std::size_t i = 0; i < choices.size(); ++i) {
      entry.expected += (i == 0 ? "" : i + 1 == choices.size() ? " or " : ", ") + std::string(choices[i].first);
    }
    entry.set = [&value, choices](const std::string& given) {
      const auto it =
          std::find_if(choices.begin(), choices.end(), [&given](const auto& c) { return given == c.first; });
      if (it != choices.end()) value = it->second;
      return it != choices.end();
    };
    entry.get = [&value, choices] {
      const auto it =
          std::find_if(choices.begin(), choices.end(), [&value](const auto& c) { return c.second == value; });
      return std::string(it->first);
    };
  }

 private:
  OptionEntry& Add(const char* name, std::string comment);

  std::vector<OptionEntry> entries_;
  std::vector<OptionSection> sections_;
};

}  // namespace planar_vslam
