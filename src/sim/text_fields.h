#pragma once
// Pieces of a world file: keys and values of a map on one line.
#include <fmt/format.h>

#include <Eigen/Core>
#include <string>
#include <vector>

#include "planar_vslam/geometry/angles.h"

namespace planar_vslam::sim {

// Six digits: micrometres in a room of 9 m, a tenth of a millimetre in one of 99 m.
inline std::string TextOf(double number) { return fmt::format("{:.6g}", number == 0.0 ? 0.0 : number); }
inline std::string TextOf(int number) { return fmt::format("{}", number); }
inline std::string TextOf(bool yes) { return yes ? "true" : "false"; }
inline std::string TextOf(const char* text) { return text; }
inline std::string TextOf(const std::string& text) { return text; }
template <int N>
std::string TextOf(const Eigen::Matrix<double, N, 1>& numbers) {
  std::string text;
  for (const double number : numbers) text += (text.empty() ? "" : ", ") + TextOf(number);
  return "[" + text + "]";
}
template <class Item>
std::string TextOf(const std::vector<Item>& items) {
  std::string text;
  for (const Item& item : items) text += (text.empty() ? "" : ", ") + TextOf(item);
  return "[" + text + "]";
}

// "{key: value, ...}"
class FlowMap {
 public:
  template <class Value>
  FlowMap& Add(const char* key, const Value& value) {
    text_ += fmt::format("{}{}: {}", text_.empty() ? "" : ", ", key, TextOf(value));
    return *this;
  }
  FlowMap& AddDegrees(const char* key, double radians) { return Add(key, RadiansToDegrees(radians)); }
  FlowMap& AddMilliseconds(const char* key, double seconds) { return Add(key, 1e3 * seconds); }
  std::string text() const { return "{" + text_ + "}"; }

 private:
  std::string text_;
};
inline std::string TextOf(const FlowMap& map) { return map.text(); }

// "key:" and an item a line; nothing where there are none.
inline std::string TextOfList(const char* key, const std::vector<FlowMap>& items, const std::string& indent = "") {
  if (items.empty()) return "";
  std::string text = fmt::format("{}{}:\n", indent, key);
  for (const FlowMap& item : items) text += fmt::format("{}  - {}\n", indent, item.text());
  return text;
}

}  // namespace planar_vslam::sim
