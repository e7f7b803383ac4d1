#include "planar_vslam/localize/sight_match.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "planar_vslam/feature/hamming.h"

namespace planar_vslam {
namespace {

constexpr double kLeastCosViewAngle = 0.5;  // as predicted_view.cpp has it
constexpr double kDistanceSlack = 1.25;
constexpr int kAlike = 80;  // bits, as when a tracked map is searched
constexpr double kRatio = 0.8;
constexpr double kNear = 0.1;  // m, in front of the camera

// A landmark that was found in a view.
struct Sight {
  Eigen::Vector3d p_map;
  Eigen::Vector2d pixel;
  double scale;          // of the keypoint's octave
  std::size_t view;      // of those looked at
  std::size_t landmark;  // in the table
};

// What comes of a look.
struct Looked {
  Agreement agreement;
  bool listed = false;               // whether the rest is asked for
  std::vector<std::size_t> visible;  // landmarks in the table, once for each view that should show them
  std::vector<Sight> sights;
};

double HalfDiagonalCosine(const CameraModel& camera) {
  const double x = std::max(camera.cx, camera.width - camera.cx) / camera.fx;
  const double y = std::max(camera.cy, camera.height - camera.cy) / camera.fy;
  return 1.0 / std::sqrt(1.0 + x * x + y * y);
}

// Looks for all landmarks of a table in one view.
class Looker {
 public:
  Looker(const LandmarkTable& table, const std::vector<SightView>& views, std::size_t index, const Rigid2& T_map_base,
         const SightWindow& window)
      : table_(table),
        view_(views[index]),
        index_(index),
        T_camera_map_((Embed3(T_map_base * view_.T_now_base) * view_.view.T_base_camera).Inverse()),
        center_(T_camera_map_.Inverse().translation),
        rotation_(T_camera_map_.rotation.toRotationMatrix()),
        heading_(1U << LandmarkTable::SectorOf(std::atan2(rotation_(2, 1), rotation_(2, 0)))),
        farthest_cosine_(HalfDiagonalCosine(view_.view.camera)),
        window_(window),
        taken_(view_.view.features->keypoints.size(), false) {}

  // Whether one of them may be in view.
  bool MaySee(const LandmarkGroup& group) const {
    if ((group.headings & heading_) == 0) return false;
    const Eigen::Vector3d p = rotation_ * (group.center - center_);
    const double distance = p.norm();
    if (distance - group.radius > kDistanceSlack * group.max_distance) return false;
    if (distance <= group.radius) return true;
    // The cone around the image, wider by what the group takes of the view.
    const double sine = group.radius / distance, cosine = std::sqrt(1.0 - sine * sine);
    const double limit = farthest_cosine_ * cosine - std::sqrt(1.0 - farthest_cosine_ * farthest_cosine_) * sine;
    return sine >= farthest_cosine_ || p.z() >= limit * distance;
  }

  void LookFor(std::size_t index, Looked* looked) {
    const TableLandmark& landmark = table_.landmarks()[index];
    if ((landmark.headings & heading_) == 0) return;
    const Eigen::Vector3d ray = landmark.p_map - center_;
    const double distance2 = ray.squaredNorm();
    const double farthest = kDistanceSlack * landmark.max_distance, nearest = landmark.min_distance / kDistanceSlack;
    if (distance2 > farthest * farthest || distance2 < nearest * nearest) return;
    const Eigen::Vector3d p = rotation_ * ray;
    if (p.z() <= kNear) return;
    const CameraModel& camera = view_.view.camera;
    const Eigen::Vector2d pixel = camera.ProjectUndistorted(p);
    if (pixel.x() < 0.0 || pixel.y() < 0.0 || pixel.x() >= camera.width || pixel.y() >= camera.height) return;
    const double distance = std::sqrt(distance2);
    if (ray.dot(landmark.view_direction) < kLeastCosViewAngle * distance) return;
    ++looked->agreement.visible;
    if (looked->listed) looked->visible.push_back(index);
    const int found = Find(index, pixel.cast<float>(), OctaveAt(landmark.max_distance / distance));
    if (found < 0) return;
    ++looked->agreement.found;
    taken_[static_cast<std::size_t>(found)] = true;
    if (!looked->listed) return;
    const Keypoint& keypoint = view_.view.features->keypoints[static_cast<std::size_t>(found)];
    looked->sights.push_back({landmark.p_map, keypoint.pixel.cast<double>(),
                              table_.octave_scales()[static_cast<std::size_t>(keypoint.octave)], index_, index});
  }

 private:
  int OctaveAt(double ratio) const {
    int octave = 0;
    const int last = static_cast<int>(table_.octave_scales().size()) - 1;
    while (octave < last && ratio > table_.octave_scales()[static_cast<std::size_t>(octave)]) ++octave;
    return octave;
  }

  // The keypoint that shows the landmark; -1 where none does, or two might.
  int Find(std::size_t landmark, const Eigen::Vector2f& pixel, int octave) {
    const FrameFeatures& features = *view_.view.features;
    const auto radius = static_cast<float>(window_.At(table_.octave_scales()[static_cast<std::size_t>(octave)]));
    indices_.clear();
    features.grid.Search(features.keypoints, pixel, radius, std::max(0, octave - 1), octave + 1, &indices_);
    indices_.erase(
        std::remove_if(indices_.begin(), indices_.end(), [this](int i) { return taken_[static_cast<std::size_t>(i)]; }),
        indices_.end());
    if (indices_.empty()) return -1;
    HammingDistances(table_.descriptors()[landmark], features.descriptors, indices_, &distances_);
    Candidate best, second;
    for (std::size_t k = 0; k < indices_.size(); ++k) {
      const Candidate candidate{indices_[k], distances_[k],
                                features.keypoints[static_cast<std::size_t>(indices_[k])].octave};
      if (candidate.distance < best.distance) {
        second = best;
        best = candidate;
      } else if (candidate.distance < second.distance) {
        second = candidate;
      }
    }
    if (best.distance > kAlike) return -1;
    // A point is often detected in two octaves.
    return best.octave == second.octave && best.distance > kRatio * second.distance ? -1 : best.index;
  }

  struct Candidate {
    int index = -1, distance = 257, octave = -1;
  };

  const LandmarkTable& table_;
  const SightView& view_;
  std::size_t index_;  // of the view
  Rigid3 T_camera_map_;
  Eigen::Vector3d center_;
  Eigen::Matrix3d rotation_;
  std::uint32_t heading_;   // bit of its sector
  double farthest_cosine_;  // of the angle to the corner of the image that is farthest from the axis
  SightWindow window_;
  std::vector<bool> taken_;
  std::vector<int> indices_, distances_;
};

Looked Look(const LandmarkTable& table, const Rigid2& T_map_base, const std::vector<SightView>& views,
            const SightWindow& window, bool listed) {
  Looked looked;
  looked.listed = listed;
  for (std::size_t v = 0; v < views.size(); ++v) {
    Looker looker(table, views, v, T_map_base, window);
    for (const LandmarkGroup& group : table.groups()) {
      if (!looker.MaySee(group)) continue;
      for (std::size_t i = group.begin; i < group.end; ++i) looker.LookFor(i, &looked);
    }
  }
  return looked;
}

// Where a view's camera is from where the robot is now.
struct ViewFromNow {
  explicit ViewFromNow(const SightView& view)
      : camera(&view.view.camera), T_camera_now((Embed3(view.T_now_base) * view.view.T_base_camera).Inverse()) {
    rotation = T_camera_now.rotation.toRotationMatrix();
  }

  const CameraModel* camera;
  Rigid3 T_camera_now;
  Eigen::Matrix3d rotation;
};

// A sum of squares of pixel errors over a right perturbation [x, y, angle], each weighted as Geman and McClure do:
// most matches around a wrong guess are wrong.
struct Normal {
  Eigen::Matrix3d H = Eigen::Matrix3d::Identity();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();

  // `weight`: 1 where the sight tells all that it shows.
  void Add(const Sight& sight, const ViewFromNow& view, const Rigid2& T_now_map, double scale, double weight) {
    const CameraModel& camera = *view.camera;
    Eigen::Vector3d p_now = sight.p_map;
    p_now.head<2>() = T_now_map * Eigen::Vector2d(sight.p_map.head<2>());
    const Eigen::Vector3d p = view.rotation * p_now + view.T_camera_now.translation;
    if (p.z() <= kNear) return;
    const Eigen::Vector2d error = (camera.ProjectUndistorted(p) - sight.pixel) / sight.scale;
    Eigen::Matrix<double, 2, 3> by_point;
    by_point << camera.fx / p.z(), 0.0, -camera.fx * p.x() / (p.z() * p.z()), 0.0, camera.fy / p.z(),
        -camera.fy * p.y() / (p.z() * p.z());
    Eigen::Matrix3d move;  // of p_now by the perturbation
    move << -1.0, 0.0, p_now.y(), 0.0, -1.0, -p_now.x(), 0.0, 0.0, 0.0;
    const Eigen::Matrix<double, 2, 3> by_pose = by_point * (view.rotation * move) / sight.scale;
    const double root = 1.0 / (1.0 + error.squaredNorm() / (scale * scale));
    H += weight * root * root * by_pose.transpose() * by_pose;
    g -= weight * root * root * by_pose.transpose() * error;
  }
};

// That count as one: landmarks, whose neighbours share what is wrong with them, or sights where each counts.
constexpr double kCorrelated = 9.0;
// Beyond so many, landmarks add nothing: half a pixel, which camera, lens and map leave, is wrong with all of them
// alike.
constexpr double kMostLandmarks = 36.0;

// A landmark that lies wrong does so in all views: what a sight tells is shared among those of its landmark.
std::vector<double> WeightsOf(const std::vector<Sight>& sights, std::size_t landmarks) {
  std::vector<int> count(landmarks, 0);
  for (const Sight& sight : sights) ++count[sight.landmark];
  std::vector<double> weights;
  weights.reserve(sights.size());
  for (const Sight& sight : sights) weights.push_back(1.0 / count[sight.landmark]);
  return weights;
}

// Where the place is without what is found, in units of matches.
struct Prior {
  Rigid2 T_map_base;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
};

// What the sights around a place tell: of a right perturbation there.
struct Descent {
  Eigen::Matrix3d information;
  Eigen::Vector3d best;    // the perturbation that they ask for
  double landmarks = 0.0;  // number
};

// Moves to where most landmarks lie best. Nothing where too few are found.
std::optional<Descent> Descend(const LandmarkTable& table, const Prior& prior, const std::vector<SightView>& views,
                               Rigid2* T_map_base) {
  constexpr std::array<double, 3> kWindows{30.0, 15.0, 8.0};  // px
  constexpr double kScale = 0.4;                              // of the window, of errors that count fully
  constexpr std::size_t kLeast = 6;                           // sights
  constexpr int kSteps = 6;
  constexpr double kStill = 1e-4;  // m or rad, of a step: some hundredths of a pixel
  const std::vector<ViewFromNow> from_now(views.begin(), views.end());
  Descent descent;
  for (const double window : kWindows) {
    const std::vector<Sight> sights = Look(table, *T_map_base, views, {0.0, window}, true).sights;
    if (sights.size() < kLeast) return std::nullopt;
    const std::vector<double> weights = WeightsOf(sights, table.landmarks().size());
    descent.landmarks = std::accumulate(weights.begin(), weights.end(), 0.0);
    for (int step = 0; step < kSteps; ++step) {
      Normal normal;
      const Rigid2 T_now_map = T_map_base->Inverse();
      for (std::size_t i = 0; i < sights.size(); ++i)
        normal.Add(sights[i], from_now[sights[i].view], T_now_map, kScale * window, weights[i]);
      descent.information = normal.H;
      descent.best = normal.H.ldlt().solve(normal.g);
      const Eigen::Vector3d back = prior.information * LogSe2(T_now_map * prior.T_map_base);
      const Eigen::Matrix3d H = normal.H + prior.information;
      const Eigen::Vector3d move = H.ldlt().solve(normal.g + back);
      *T_map_base = *T_map_base * ExpSe2(move);
      descent.best -= move;
      if (move.norm() < kStill) break;
    }
  }
  return descent;
}

// Of what the sights tell alone: their landmarks' errors, and those of odometry between the views and of the camera's
// height.
Eigen::Matrix3d CovarianceOf(const Descent& descent) {
  constexpr double kSigma = 0.06;  // m
  constexpr double kSigmaAngle = DegreesToRadians(0.7);
  const double excess = std::max(1.0, descent.landmarks / kMostLandmarks);
  Eigen::Matrix3d covariance = kCorrelated * excess * descent.information.inverse();
  covariance.diagonal() += Eigen::Vector3d(kSigma, kSigma, kSigmaAngle).cwiseAbs2();
  return covariance;
}

}  // namespace

Agreement Compare(const LandmarkTable& table, const Rigid2& T_map_base, const std::vector<SightView>& views,
                  const SightWindow& window) {
  return Look(table, T_map_base, views, window, false).agreement;
}

AgreementByKind CompareByKind(const LandmarkTable& table, const Rigid2& T_map_base, const std::vector<SightView>& views,
                              const SightWindow& window) {
  const Looked looked = Look(table, T_map_base, views, window, true);
  std::vector<int> visible(table.landmarks().size(), 0), found(table.landmarks().size(), 0);
  for (const std::size_t i : looked.visible) ++visible[i];
  for (const Sight& sight : looked.sights) ++found[sight.landmark];
  AgreementByKind agreement;
  for (std::size_t i = 0; i < visible.size(); ++i) {
    const TableLandmark& landmark = table.landmarks()[i];
    if (visible[i] == 0) continue;
    const double share = static_cast<double>(found[i]) / visible[i];
    if (landmark.unique) agreement.unique.Add(share);
    if (landmark.steady) (landmark.unique ? agreement.steady_unique : agreement.steady_alike).Add(share);
  }
  return agreement;
}

SettledPlace Settle(const LandmarkTable& table, const Rigid2& guess, const std::vector<SightView>& views) {
  SettledPlace place{guess};
  const std::optional<Descent> descent = Descend(table, Prior{guess}, views, &place.T_map_base);
  if (descent.has_value()) place.covariance = CovarianceOf(*descent);
  return place;
}

SettledPlace SettleExpected(const LandmarkTable& table, const SettledPlace& expected,
                            const std::vector<SightView>& views, double share) {
  SettledPlace place = expected;
  place.with_expected = true;
  const Eigen::Matrix3d& P = expected.covariance;
  const Prior prior{expected.T_map_base, kCorrelated / share * P.inverse()};
  const std::optional<Descent> descent = Descend(table, prior, views, &place.T_map_base);
  if (!descent.has_value()) return place;
  // A Kalman update, around where the search ended.
  const Eigen::Vector3d before = LogSe2(place.T_map_base.Inverse() * expected.T_map_base);
  const Eigen::Matrix3d total = P + CovarianceOf(*descent) / share;
  const Eigen::Matrix3d gain = total.ldlt().solve(P).transpose();
  place.T_map_base = place.T_map_base * ExpSe2(before + gain * (descent->best - before));
  const Eigen::Matrix3d reduced = P - gain * P;
  place.covariance = 0.5 * (reduced + reduced.transpose());
  return place;
}

double ShareByChance(const LandmarkTable& table, const Rigid2& T_map_base, const std::vector<SightView>& views) {
  constexpr double kTurn = DegreesToRadians(4.0);  // beyond every window, and much the same landmarks in view
  constexpr SightWindow kWindow{0.0, 6.0};         // px
  constexpr double kPrior = 60.0;                  // landmarks' worth of doubt where few are in view
  double found = 2.0, visible = 0.0;
  for (const double turn : {-kTurn, kTurn}) {
    const Agreement agreement = Compare(table, T_map_base * Rigid2(0.0, 0.0, turn), views, kWindow);
    found += agreement.found, visible += agreement.visible;
  }
  return found / std::max(visible, kPrior);
}

}  // namespace planar_vslam
