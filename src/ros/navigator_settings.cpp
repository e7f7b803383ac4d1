#include "navigator_settings.h"

#include <fmt/format.h>

#include "parameter_reader.h"

namespace planar_vslam::ros_face {
namespace {

// Shown the options' fields, it reads those that are set.
class OptionReader {
 public:
  explicit OptionReader(ParameterReader* reader) : reader_(reader) {}
  void operator()(const char* key, double& value, const Unit& unit, const Bound& /*bound*/, const char* /*text*/) {
    double number = value / unit.size;
    reader_->Read(key, "a number", &number);
    value = number * unit.size;
  }
  void operator()(const char* key, bool& value, const char* /*text*/) { reader_->Read(key, "true or false", &value); }

 private:
  ParameterReader* reader_;
};

void ReadFrame(ParameterReader* reader, const char* key, std::string* frame) {
  reader->Read(key, "a frame", frame);
  if (frame->empty() || frame->front() == '/') reader->Report(key, "is not a frame of tf2: " + *frame);
}

}  // namespace

NavigatorSettings ReadNavigatorSettings(const ros::NodeHandle& node, std::vector<std::string>* problems) {
  constexpr double kFastest = 100.0;  // Hz
  NavigatorSettings settings;
  ParameterReader reader(node, problems);
  ReadFrame(&reader, "map_frame", &settings.map_frame);
  ReadFrame(&reader, "odom_frame", &settings.odom_frame);
  ReadFrame(&reader, "base_frame", &settings.base_frame);
  reader.Read("rate", "a number (Hz)", &settings.rate);
  if (!(settings.rate >= 2.0 && settings.rate <= kFastest))
    reader.Report("rate", fmt::format("is {}; expected 2 to {} Hz", settings.rate, kFastest));
  OptionReader options(&reader);
  NavigateOptions::Visit(settings.options, options);
  reader.RefuseUnknown();
  for (const std::string& problem : settings.options.Problems())
    problems->push_back(node.getNamespace() + "/" + problem);
  return settings;
}

}  // namespace planar_vslam::ros_face
