#pragma once
// The private parameters of a node, with everything that is wrong with them.
#include <ros/node_handle.h>

#include <string>
#include <type_traits>
#include <vector>

namespace planar_vslam::ros_face {

// "[a, b]" as rosrun passes a list on: words between brackets and commas. False where it is none.
bool ParseList(const std::string& text, std::vector<std::string>* words);

// Reads the parameters of one node and remembers which there are.
class ParameterReader {
 public:
  // Problems are appended, one line each.
  ParameterReader(const ros::NodeHandle& node, std::vector<std::string>* problems) : node_(node), problems_(problems) {}

  // A parameter that is not set leaves `value` as it is.
  template <class T>
  void Read(const std::string& name, const char* expected, T* value) {
    known_.push_back(name);
    if (!node_.hasParam(name) || node_.getParam(name, *value)) return;
    if constexpr (std::is_same_v<T, std::vector<std::string>>) {
      std::string text;
      if (node_.getParam(name, text) && ParseList(text, value)) return;
    }
    Report(name, std::string("wrong type; expected ") + expected);
  }
  // One that may be there.
  void Ignore(const std::string& name) { known_.push_back(name); }
  void RequirePositive(const std::string& name, double value);
  // A misspelt parameter must not be a default in disguise. Deeper names belong to plugins.
  void RefuseUnknown();
  void Report(const std::string& name, const std::string& message);

 private:
  const ros::NodeHandle& node_;
  std::vector<std::string>* problems_;
  std::vector<std::string> known_;
};

}  // namespace planar_vslam::ros_face
