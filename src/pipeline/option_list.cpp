#include "option_list.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <numeric>
#include <optional>

namespace planar_vslam {
namespace {

template <class T>
std::optional<T> Parsed(const std::string& text) {
  try {
    return YAML::Load(text).as<T>();
  } catch (const YAML::Exception&) {
    return std::nullopt;
  }
}

std::string Comment(const Unit& unit, const char* text, Origin origin) {
  std::string comment = unit.name;
  if (!comment.empty() && *text != '\0') comment += ", ";
  comment += text;
  return origin == Origin::kFitted ? comment + " (fitted)" : comment;
}

// Letters to insert, erase, replace, or swap with the next one, to make one word of the other.
int Distance(const std::string& a, const std::string& b) {
  std::vector<int> before, above(b.size() + 1), row(b.size() + 1);
  std::iota(above.begin(), above.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before = above;
    above = row;
  }
  return above.back();
}

}  // namespace

OptionEntry& OptionList::Add(const char* name, std::string comment) {
  OptionEntry entry;
  if (!sections_.empty()) entry.section = sections_.back().name;
  entry.name = name;
  entry.comment = std::move(comment);
  entries_.push_back(std::move(entry));
  return entries_.back();
}

void OptionList::operator()(const char* name, double& value, const Unit& unit, const Bound& /*bound*/, const char* text,
                            Origin origin) {
  OptionEntry& entry = Add(name, Comment(unit, text, origin));
  entry.expected = "a number";
  const double size = unit.size;
  entry.set = [&value, size](const std::string& given) {
    const std::optional<double> number = Parsed<double>(given);
    if (number.has_value()) value = *number * size;
    return number.has_value();
  };
  entry.get = [&value, size] { return fmt::format("{:.9g}", value / size); };
}

void OptionList::operator()(const char* name, int& value, const Unit& unit, const Bound& /*bound*/, const char* text,
                            Origin origin) {
  OptionEntry& entry = Add(name, Comment(unit, text, origin));
  entry.expected = "an integer";
  entry.set = [&value](const std::string& given) {
    const std::optional<int> number = Parsed<int>(given);
    if (number.has_value()) value = *number;
    return number.has_value();
  };
  entry.get = [&value] { return fmt::format("{}", value); };
}

void OptionList::operator()(const char* name, bool& value, const char* text) {
  OptionEntry& entry = Add(name, text);
  entry.expected = "true or false";
  entry.set = [&value](const std::string& given) {
    const std::optional<bool> answer = Parsed<bool>(given);
    if (answer.has_value()) value = *answer;
    return answer.has_value();
  };
  entry.get = [&value] { return value ? "true" : "false"; };
}

void OptionList::operator()(const char* name, std::string& value, const char* text) {
  OptionEntry& entry = Add(name, text);
  entry.expected = "a text";
  entry.set = [&value](const std::string& given) {
    value = given;
    return true;
  };
  entry.get = [&value] { return value; };
}

const OptionEntry* OptionList::Find(const std::string& key) const {
  const auto it =
      std::find_if(entries_.begin(), entries_.end(), [&key](const OptionEntry& e) { return e.key() == key; });
  return it == entries_.end() ? nullptr : &*it;
}

std::string OptionList::Nearest(const std::string& key) const {
  int least = static_cast<int>(key.size() / 2);  // a word of which half is wrong is another word
  std::string nearest;
  for (const OptionEntry& entry : entries_) {
    const int distance = Distance(key, entry.key());
    if (distance >= least) continue;
    least = distance;
    nearest = entry.key();
  }
  return nearest;
}

}  // namespace planar_vslam
