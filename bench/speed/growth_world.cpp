#include "growth_world.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "planar_vslam/feature/orb_extractor.h"
#include "planar_vslam/geometry/angles.h"
#include "planar_vslam/map/map_edit.h"

namespace planar_vslam {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kHalfRoom = 3.0;         // m
constexpr double kCircle = 1.2;           // m, radius
constexpr int kFramesPerCircle = 120;     // 3 degrees each
constexpr int kFramesBetweenRooms = 96;   // 6.25 cm each
constexpr double kFarthest = 4.5;         // m, from which points are seen
constexpr double kSteepest = 0.2;         // cosine at the wall
constexpr std::size_t kMostInView = 600;  // points of a frame
constexpr double kPixelNoise = 0.6;       // px at octave 0
constexpr double kPointNoise = 0.003;     // m
constexpr double kFlippedBits = 0.04;     // share

// On the circle round `center`, counterclockwise.
Rigid2 OnCircle(const Eigen::Vector2d& center, double heading) {
  return {center + kCircle * Eigen::Vector2d(std::sin(heading), -std::cos(heading)), heading};
}

Descriptor RandomDescriptor(std::mt19937_64& generator) { return {generator(), generator(), generator(), generator()}; }

Descriptor Flipped(Descriptor descriptor, std::mt19937_64& generator) {
  std::poisson_distribution<int> count(kFlippedBits * 256);
  for (int i = count(generator); i > 0; --i) {
    const std::uint64_t bit = generator() % 256;
    descriptor[bit / 64] ^= std::uint64_t{1} << (bit % 64);
  }
  return descriptor;
}

}  // namespace

std::optional<Growth> GrowthOf(const std::string& name) {
  if (name == "rooms") return Growth::kRooms;
  if (name == "laps") return Growth::kLaps;
  return std::nullopt;
}

GrowthWorld::GrowthWorld(Growth growth, int frames) {
  if (growth == Growth::kRooms) {
    DriveThroughRooms(frames);
  } else {
    DriveLaps(frames);
  }
}

CameraModel GrowthWorld::Camera() {
  CameraModel camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 500.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  return camera;
}

Rigid3 GrowthWorld::CameraMount() {
  Eigen::Matrix3d R_base_camera;
  R_base_camera.col(0) = Eigen::Vector3d(-1.0, 0.0, 0.0);  // image x: backward
  R_base_camera.col(1) = Eigen::Vector3d(0.0, 0.0, -1.0);  // image y: down
  R_base_camera.col(2) = Eigen::Vector3d(0.0, -1.0, 0.0);  // optical axis: right
  return {R_base_camera, Eigen::Vector3d(0.0, 0.0, 1.0)};
}

void GrowthWorld::AddWalls(const Eigen::Vector2d& center, int points_per_wall, unsigned seed) {
  constexpr double kLowest = 0.1, kHighest = 2.2;  // m
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> along(-kHalfRoom, kHalfRoom), up(kLowest, kHighest);
  for (int wall = 0; wall < 4; ++wall) {
    const Eigen::Matrix2d turned = Eigen::Rotation2Dd(wall * kPi / 2.0).toRotationMatrix();
    const Eigen::Vector2d inward = turned * Eigen::Vector2d(-1.0, 0.0);
    for (int i = 0; i < points_per_wall; ++i) {
      const Eigen::Vector2d p = center + turned * Eigen::Vector2d(kHalfRoom, along(generator));
      const double height = up(generator);
      points_.push_back({{p.x(), p.y(), height}, {inward.x(), inward.y(), 0.0}, RandomDescriptor(generator)});
    }
  }
  group_begin_.push_back(points_.size());
}

void GrowthWorld::DriveThroughRooms(int frames) {
  constexpr int kPointsPerWall = 600;
  Eigen::Vector2d center(0.0, 0.0);
  int quarter = 0;                  // heading of the way in, in quarter turns from east
  int leg = 1, left = 1, legs = 0;  // of the spiral: 1, 1, 2, 2, 3, ... rooms
  for (int room = 0; static_cast<int>(path_.size()) <= frames; ++room) {
    AddWalls(center, kPointsPerWall, static_cast<unsigned>(room));
    const bool corner = left == 0;
    if (corner) {
      if (++legs % 2 == 0) ++leg;
      left = leg;
    }
    --left;
    const int first = std::max(room - 1, 0), last = room + 1;
    const double step = 2.0 * kPi / kFramesPerCircle;
    const int circling = kFramesPerCircle + (corner ? kFramesPerCircle / 4 : 0);
    for (int i = 0; i < circling; ++i) {
      path_.push_back({OnCircle(center, WrapAngle(quarter * kPi / 2.0 + step * i)), first, last});
    }
    quarter += corner ? 1 : 0;
    const double heading = WrapAngle(quarter * kPi / 2.0);
    const Eigen::Vector2d ahead(std::cos(heading), std::sin(heading));
    for (int i = 0; i < kFramesBetweenRooms; ++i) {
      const double way = 2.0 * kHalfRoom * i / kFramesBetweenRooms;
      path_.push_back({{OnCircle(center, heading).translation + way * ahead, heading}, first, last});
    }
    center += 2.0 * kHalfRoom * ahead;
  }
  AddWalls(center, kPointsPerWall, static_cast<unsigned>(group_begin_.size()));
}

void GrowthWorld::DriveLaps(int frames) {
  constexpr int kPointsPerWall = 300;  // that come with a lap and go after the next
  const Eigen::Vector2d center(0.0, 0.0);
  AddWalls(center, kPointsPerWall, 0);
  for (int lap = 0; static_cast<int>(path_.size()) <= frames; ++lap) {
    AddWalls(center, kPointsPerWall, static_cast<unsigned>(lap + 1));
    for (int i = 0; i < kFramesPerCircle; ++i) {
      path_.push_back({OnCircle(center, WrapAngle(2.0 * kPi * i / kFramesPerCircle)), lap, lap + 1});
    }
  }
}

std::vector<OdometryReading> GrowthWorld::Odometry(int from, int to) const {
  std::vector<OdometryReading> readings;
  for (int frame = from; frame <= to; ++frame) readings.push_back({StampOf(frame), PoseOf(frame)});
  return readings;
}

GrowthWorld::View GrowthWorld::ViewOf(int frame) const {
  const Step& step = path_[static_cast<std::size_t>(frame)];
  const Rigid3 T_map_camera = Embed3(step.T_map_base) * CameraMount(), T_camera_map = T_map_camera.Inverse();
  const CameraModel camera = Camera();
  const std::vector<double> scales = OrbOptions{}.ScaleFactors();
  std::mt19937_64 generator(static_cast<unsigned>(frame));
  std::normal_distribution<double> normal;
  auto features = std::make_shared<FrameFeatures>();
  View view;
  features->keypoints.reserve(kKeypoints);
  features->descriptors.reserve(kKeypoints);
  const auto add = [&](const Eigen::Vector2d& pixel, int octave, const Descriptor& descriptor) {
    Keypoint keypoint;
    keypoint.pixel = keypoint.raw_pixel = pixel.cast<float>();
    keypoint.octave = octave;
    features->keypoints.push_back(keypoint);
    features->descriptors.push_back(descriptor);
  };
  const std::size_t begin = group_begin_[static_cast<std::size_t>(step.first_group)];
  const std::size_t end = group_begin_[static_cast<std::size_t>(step.last_group) + 1];
  for (std::size_t number = begin; number < end && view.points.size() < kMostInView; ++number) {
    const WallPoint& point = points_[number];
    const Eigen::Vector3d ray = T_map_camera.translation - point.p_map, p = T_camera_map * point.p_map;
    const double distance = ray.norm();
    if (p.z() < 0.2 || distance > kFarthest || ray.dot(point.normal) < kSteepest * distance) continue;
    const double level = std::log(kFarthest / distance) / std::log(OrbOptions{}.scale_factor);  // nearer is larger
    const int octave = std::clamp(static_cast<int>(level), 0, static_cast<int>(scales.size()) - 1);
    const double sigma = kPixelNoise * scales[static_cast<std::size_t>(octave)];
    const Eigen::Vector2d noise(normal(generator), normal(generator));
    const Eigen::Vector2d u = camera.ProjectUndistorted(p) + sigma * noise;
    if (u.x() < 0.0 || u.y() < 0.0 || u.x() >= camera.width || u.y() >= camera.height) continue;
    add(u, octave, Flipped(point.descriptor, generator));
    view.points.emplace_back(number);
  }
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  while (view.points.size() < kKeypoints) {
    const Eigen::Vector2d u(camera.width * unit(generator), camera.height * unit(generator));
    const int octave = static_cast<int>(static_cast<double>(scales.size()) * unit(generator));
    add(u, octave, RandomDescriptor(generator));
    view.points.emplace_back(std::nullopt);
  }
  features->grid = ImageGrid(features->keypoints);
  view.features = std::move(features);
  return view;
}

Map GrowthWorld::MapOf(int keyframes, const OdometryNoise& noise) const {
  MapEdit edit;
  std::map<std::size_t, std::vector<Observation>> observations;  // by point
  for (int k = 0; k < keyframes; ++k) {
    const KeyframeId id{static_cast<std::uint32_t>(k)};
    const int frame = k * kFramesPerKeyframe;
    const View view = ViewOf(frame);
    for (std::size_t i = 0; i < view.points.size(); ++i) {
      if (view.points[i].has_value()) observations[*view.points[i]].push_back({id, static_cast<std::uint32_t>(i)});
    }
    Keyframe keyframe{StampOf(frame), Embed3(PoseOf(frame)), CameraMount(), view.features, {}, {}};
    keyframe.landmarks.resize(kKeypoints);
    if (k > 0) {
      const KeyframeId before{id.value - 1};
      keyframe.odometry_link = MotionLink{before, Preintegrate(Odometry(frame - kFramesPerKeyframe, frame), noise)};
    }
    edit.emplace_back(AddKeyframe{id, std::move(keyframe)});
  }
  constexpr std::uint32_t kOftenSeen = 10;
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  std::vector<std::pair<KeyframeId, Landmark>> landmarks;  // in the order of their creation
  for (auto& [number, seen] : observations) {
    if (seen.size() < 2) continue;
    const Eigen::Vector3d off(normal(generator), normal(generator), normal(generator));
    Landmark landmark;
    landmark.p_map = Point(number) + kPointNoise * off;
    landmark.created_by = seen[1].keyframe;
    landmark.observations = std::move(seen);
    landmark.predicted_visible = landmark.found = kOftenSeen;
    landmarks.emplace_back(landmark.created_by, std::move(landmark));
  }
  std::stable_sort(landmarks.begin(), landmarks.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    edit.emplace_back(AddLandmark{LandmarkId{static_cast<std::uint32_t>(i)}, std::move(landmarks[i].second)});
  }
  Map map;
  map.metric = true;
  map.octave_scales = OrbOptions{}.ScaleFactors();
  return Apply(std::move(map), edit);
}

}  // namespace planar_vslam
