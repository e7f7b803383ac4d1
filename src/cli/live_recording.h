#pragma once
// Topics of a running system as a recording. The command line knows no ROS: another executable listens for it.
#include <filesystem>
#include <optional>
#include <utility>

#include "planar_vslam/geometry/expected.h"

namespace planar_vslam {

// A bag in a folder of its own, removed with the object.
class LiveRecording {
 public:
  // Listens for so many seconds, or until interrupted. Nothing where the listener has said on stderr why it cannot.
  static Expected<std::optional<LiveRecording>> Listen(double seconds);
  LiveRecording(LiveRecording&& other) noexcept : folder_(std::exchange(other.folder_, {})) {}
  LiveRecording& operator=(LiveRecording&&) = delete;
  ~LiveRecording();
  std::filesystem::path bag() const { return folder_ / "live.bag"; }

 private:
  explicit LiveRecording(std::filesystem::path folder) : folder_(std::move(folder)) {}
  std::filesystem::path folder_;
};

}  // namespace planar_vslam
