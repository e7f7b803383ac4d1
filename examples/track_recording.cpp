// Gives a recorded drive, a dataset folder or a rosbag, to the estimator. Prints the pose of the base in the map at
// every image, as known at the time, in the TUM format: t x y z qx qy qz qw.
#include <planar_vslam/io/recording.h>
#include <planar_vslam/io/run_session.h>
#include <planar_vslam/pipeline/estimator.h>

#include <cstdio>
#include <memory>
#include <string>

namespace pv = planar_vslam;

int Fail(const std::string& message) {
  std::fprintf(stderr, "%s\n", message.c_str());
  return 1;
}

void Print(const pv::FrameReport& frame) {
  if (!frame.T_map_base.has_value()) return;  // waiting_for says what is missing
  const Eigen::Vector3d& t = frame.T_map_base->translation;
  const Eigen::Quaterniond& q = frame.T_map_base->rotation;
  std::printf("%.6f %.4f %.4f %.4f %.6f %.6f %.6f %.6f\n", frame.stamp.Seconds(), t.x(), t.y(), t.z(), q.x(), q.y(),
              q.z(), q.w());
}

int main(int argc, char** argv) {
  if (argc != 2) return Fail("usage: track_recording FOLDER_OR_BAG");
  const pv::Expected<std::unique_ptr<pv::Recording>> recording = pv::OpenRecording(argv[1], {});
  if (!recording.ok()) return Fail(recording.error().message);
  const pv::RecordingInfo& info = (*recording)->info();
  pv::Estimator estimator({pv::PipelineOptions{}, info.camera, info.has_base_transform, info.has_odometry});
  const pv::Expected<pv::RunResult> result = pv::RunSession(**recording, estimator, {});
  if (!result.ok()) return Fail(result.error().message);
  for (const pv::FrameReport& frame : result->frames) Print(frame);
  return 0;
}
