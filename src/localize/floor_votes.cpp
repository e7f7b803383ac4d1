#include "planar_vslam/localize/floor_votes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "planar_vslam/feature/hamming.h"
#include "planar_vslam/localize/pose_search.h"

namespace planar_vslam {
namespace {

constexpr double kCell = 0.15;  // m
constexpr int kHeadings = 120;  // of 3 degrees
constexpr double kReach = 1.5;  // m around places that were driven

// Cells of the floor near places that were driven, numbered; times headings.
class Votes {
 public:
  explicit Votes(const std::vector<Eigen::Vector2d>& driven) {
    Eigen::Vector2d least = driven.front(), most = driven.front();
    for (const Eigen::Vector2d& p : driven) least = least.cwiseMin(p), most = most.cwiseMax(p);
    origin_ = least - Eigen::Vector2d::Constant(kReach);
    const Eigen::Vector2d size = most - least + Eigen::Vector2d::Constant(2.0 * kReach);
    columns_ = static_cast<int>(size.x() / kCell) + 1, rows_ = static_cast<int>(size.y() / kCell) + 1;
    number_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), -1);
    for (const Eigen::Vector2d& p : driven) NumberAround(p);
    const std::size_t cells = static_cast<std::size_t>(kHeadings) * places_.size();
    votes_.assign(cells, 0.0F);
    voter_.assign(cells, -1);
  }

  // At most one vote of a voter counts in a cell.
  void Vote(const Eigen::Vector2d& p_map, int heading, float weight, std::int32_t voter) {
    const Eigen::Vector2d cell = (p_map - origin_) / kCell;
    const std::int32_t place = Number(static_cast<int>(std::floor(cell.x())), static_cast<int>(std::floor(cell.y())));
    if (place < 0) return;
    const std::size_t i = Index(heading, place);
    if (voter_[i] == voter) return;
    voter_[i] = voter;
    votes_[i] += weight;
  }

  std::vector<Rigid2> Best(std::size_t limit) const {
    constexpr std::size_t kLookedAt = 4000;  // cells
    const std::vector<float> sums = Sums();
    std::vector<std::size_t> order(sums.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const std::size_t count = std::min(order.size(), kLookedAt);
    const auto better = [&sums](std::size_t a, std::size_t b) {
      return sums[a] != sums[b] ? sums[a] > sums[b] : a < b;
    };
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(), better);
    std::vector<Rigid2> best;
    for (std::size_t k = 0; k < count && best.size() < limit && sums[order[k]] > 0.0F; ++k) {
      const Rigid2 T_map_base = CornerOf(order[k]);
      const auto is_same = [&T_map_base](const Rigid2& other) { return IsSamePlace(other, T_map_base); };
      if (std::none_of(best.begin(), best.end(), is_same)) best.push_back(T_map_base);
    }
    return best;
  }

 private:
  void NumberAround(const Eigen::Vector2d& p) {
    const int reach = static_cast<int>(kReach / kCell);
    const Eigen::Vector2d cell = (p - origin_) / kCell;
    const int column = static_cast<int>(cell.x()), row = static_cast<int>(cell.y());
    for (int dy = -reach; dy <= reach; ++dy) {
      for (int dx = -reach; dx <= reach; ++dx) {
        if (dx * dx + dy * dy > reach * reach || column + dx < 0 || column + dx >= columns_ || row + dy < 0 ||
            row + dy >= rows_)
          continue;
        std::int32_t& number = number_[Cell(column + dx, row + dy)];
        if (number >= 0) continue;
        number = static_cast<std::int32_t>(places_.size());
        places_.emplace_back(column + dx, row + dy);
      }
    }
  }

  std::size_t Cell(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
  }
  std::int32_t Number(int column, int row) const {
    if (column < 0 || row < 0 || column >= columns_ || row >= rows_) return -1;
    return number_[Cell(column, row)];
  }
  std::size_t Index(int heading, std::int32_t place) const {
    return static_cast<std::size_t>(heading) * places_.size() + static_cast<std::size_t>(place);
  }

  // Over 2 x 2 x 2 cells, of which each is the first: right votes fall on both sides of a border.
  std::vector<float> Sums() const {
    std::vector<float> sums(votes_.size(), 0.0F);
    for (std::size_t place = 0; place < places_.size(); ++place) {
      for (const auto& [dx, dy] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
        const std::int32_t other = Number(places_[place].x() + dx, places_[place].y() + dy);
        if (other < 0) continue;
        for (int heading = 0; heading < kHeadings; ++heading)
          sums[Index(heading, static_cast<std::int32_t>(place))] +=
              votes_[Index(heading, other)] + votes_[Index((heading + 1) % kHeadings, other)];
      }
    }
    return sums;
  }

  Rigid2 CornerOf(std::size_t index) const {
    const std::size_t heading = index / places_.size();
    const Eigen::Vector2i& place = places_[index % places_.size()];
    return {origin_ + kCell * (place.cast<double>() + Eigen::Vector2d::Ones()),
            WrapAngle(static_cast<double>(heading + 1) * 2.0 * M_PI / kHeadings)};
  }

  Eigen::Vector2d origin_;
  int columns_ = 0, rows_ = 0;
  std::vector<std::int32_t> number_;     // of each cell; -1 where nobody drove
  std::vector<Eigen::Vector2i> places_;  // by number: column, row
  std::vector<float> votes_;             // by heading and number
  std::vector<std::int32_t> voter_;      // the last one, likewise
};

// How far a landmark may be on the floor, m, and in which direction from the base.
struct Range {
  double least = 0.0, most = -1.0;
  Eigen::Vector3d ray_base = Eigen::Vector3d::Zero();  // unit

  bool empty() const { return least > most; }
};

Range RangeOf(const TableLandmark& landmark, const Keypoint& keypoint, double scale, const CameraView& view) {
  constexpr double kPixels = 2.0;                   // at octave 0
  constexpr double kTilt = 0.004;                   // rad: a robot sways
  constexpr double kHeight = 0.03;                  // m, of landmark and camera
  constexpr double kLarger = 1.45, kSmaller = 1.2;  // two octaves: a landmark's distances are those of its first view
  Range range;
  range.ray_base = (view.T_base_camera.rotation * view.camera.Ray(keypoint.pixel.cast<double>())).normalized();
  const double level = range.ray_base.head<2>().norm();
  range.least = level * std::max(landmark.max_distance / (scale * kLarger), landmark.min_distance / kSmaller);
  range.most = level * std::min(landmark.max_distance * kSmaller / scale, landmark.max_distance * kSmaller);
  const double height = landmark.p_map.z() - view.T_base_camera.translation.z();
  const double nearest = std::abs(height) - kHeight, farthest = std::abs(height) + kHeight;
  const double slope = range.ray_base.z() / std::max(level, 1e-6) * (height < 0.0 ? -1.0 : 1.0);
  const double sigma = std::hypot(kPixels * scale / view.camera.fx, kTilt);
  if (slope + sigma > 0.0) {
    if (nearest > 0.0) range.least = std::max(range.least, nearest / (slope + sigma));
    if (slope - sigma > 0.0) range.most = std::min(range.most, farthest / (slope - sigma));
  } else if (nearest > 0.0) {
    range.most = -1.0;  // on the other side of the horizon
  }
  return range;
}

// Of a view, for each heading of the robot now: cosine and sine of the heading that the view had, and where the camera
// was from there.
struct Turned {
  Eigen::Vector2d direction, camera_to_now;
};

std::vector<Turned> TurnedBy(const SightView& view) {
  const Rigid2 T_base_now = view.T_now_base.Inverse();
  const Eigen::Vector2d camera_to_now = T_base_now.translation - view.view.T_base_camera.translation.head<2>();
  std::vector<Turned> turned;
  for (int heading = 0; heading < kHeadings; ++heading) {
    const Eigen::Rotation2Dd of_view((heading + 0.5) * 2.0 * M_PI / kHeadings - T_base_now.angle);
    turned.push_back({of_view * Eigen::Vector2d::UnitX(), of_view * camera_to_now});
  }
  return turned;
}

// All places from which the match may have been seen.
void VoteAround(const TableLandmark& landmark, const Range& range, const std::vector<Turned>& turned, float weight,
                std::int32_t voter, Votes* votes) {
  constexpr double kLeastCosViewAngle = 0.5;
  const double level = range.ray_base.head<2>().norm();
  const int steps = std::max(1, static_cast<int>(std::ceil((range.most - range.least) / (0.5 * kCell))));
  const Eigen::Vector2d ahead = range.ray_base.head<2>() / std::max(level, 1e-6);
  for (int heading = 0; heading < kHeadings; ++heading) {
    const auto& [direction, camera_to_now] = turned[static_cast<std::size_t>(heading)];
    const Eigen::Vector2d u(direction.x() * ahead.x() - direction.y() * ahead.y(),
                            direction.y() * ahead.x() + direction.x() * ahead.y());
    const double cosine =
        level * landmark.view_direction.head<2>().dot(u) + landmark.view_direction.z() * range.ray_base.z();
    if (cosine < kLeastCosViewAngle) continue;
    const Eigen::Vector2d from = landmark.p_map.head<2>() + camera_to_now;
    for (int i = 0; i <= steps; ++i)
      votes->Vote(from - (range.least + (range.most - range.least) * i / steps) * u, heading, weight, voter);
  }
}

float WeightOf(int distance) {
  constexpr double kSurely = 35.0, kHardly = 80.0;  // bits
  return static_cast<float>(std::clamp(2.0 * (kHardly - distance) / (kHardly - kSurely), 0.1, 2.0));
}

}  // namespace

std::vector<LikelyMatch> FindLikelyMatches(const LandmarkTable& table, const FrameFeatures& features) {
  constexpr int kAlike = 50;  // bits
  constexpr int kMost = 3;    // of one keypoint or landmark: things that are everywhere tell of no place
  std::vector<LikelyMatch> all, kept;
  std::vector<int> distances;
  for (std::size_t k = 0; k < features.keypoints.size(); ++k) {
    const std::vector<int>& candidates = table.TurnedLike(features.keypoints[k].angle);
    if (candidates.empty()) continue;
    HammingDistances(features.descriptors[k], table.descriptors(), candidates, &distances);
    for (std::size_t i = 0; i < candidates.size(); ++i)
      if (distances[i] <= kAlike) all.push_back({static_cast<int>(k), candidates[i], distances[i]});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const LikelyMatch& a, const LikelyMatch& b) { return a.distance < b.distance; });
  std::vector<int> of_keypoint(features.keypoints.size(), 0), of_landmark(table.landmarks().size(), 0);
  for (const LikelyMatch& match : all) {
    int& keypoints = of_keypoint[static_cast<std::size_t>(match.keypoint)];
    int& landmarks = of_landmark[static_cast<std::size_t>(match.landmark)];
    if (keypoints >= kMost || landmarks >= kMost) continue;
    ++keypoints, ++landmarks;
    kept.push_back(match);
  }
  std::stable_sort(kept.begin(), kept.end(),
                   [](const LikelyMatch& a, const LikelyMatch& b) { return a.keypoint < b.keypoint; });
  return kept;
}

std::vector<Rigid2> VotedPlaces(const LandmarkTable& table, const std::vector<SightView>& views,
                                const std::vector<std::vector<LikelyMatch>>& matches, std::size_t limit) {
  if (table.empty() || table.driven().empty()) return {};
  Votes votes(table.driven());
  std::int32_t voter = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const std::vector<Turned> turned = TurnedBy(views[v]);
    int last = -1;
    for (const LikelyMatch& match : matches[v]) {
      if (match.keypoint != last) ++voter;
      last = match.keypoint;
      const TableLandmark& landmark = table.landmarks()[static_cast<std::size_t>(match.landmark)];
      const Keypoint& keypoint = views[v].view.features->keypoints[static_cast<std::size_t>(match.keypoint)];
      const double scale = table.octave_scales()[static_cast<std::size_t>(keypoint.octave)];
      const Range range = RangeOf(landmark, keypoint, scale, views[v].view);
      if (!range.empty()) VoteAround(landmark, range, turned, WeightOf(match.distance), voter, &votes);
    }
  }
  return votes.Best(limit);
}

}  // namespace planar_vslam
