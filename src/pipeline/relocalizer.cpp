#include "planar_vslam/pipeline/relocalizer.h"

#include <Eigen/Cholesky>

#include "planar_vslam/geometry/chi_square.h"

namespace planar_vslam {
namespace {

constexpr int kNiceness = 5;   // tracking comes first
constexpr int kPatience = 20;  // frames during which the robot is taken to be about where odometry says

// What odometry predicts, corrected by what was measured: a Kalman update. Where odometry is farther off than it says,
// what it missed is part of its covariance first.
PlanarFix Merged(const PlanarFix& predicted, const PlanarFix& measured) {
  const Eigen::Vector3d off = LogSe2(predicted.T_map_base.Inverse() * measured.T_map_base);
  Eigen::Matrix3d P = predicted.covariance;
  const Eigen::Matrix3d innovation = P + measured.covariance;
  if (off.dot(innovation.ldlt().solve(off)) > kChi2ThreeDof999) P += off * off.transpose();
  const Eigen::Matrix3d total = P + measured.covariance;
  const Eigen::Matrix3d gain = total.ldlt().solve(P).transpose();
  const Eigen::Matrix3d reduced = P - gain * P;
  return {predicted.T_map_base * ExpSe2(gain * off), 0.5 * (reduced + reduced.transpose())};
}

}  // namespace

PlanarFix Moved(const PlanarFix& from, const PlanarMotion& step) {
  const Eigen::Matrix3d adjoint = AdjointSe2(step.T_i_j.Inverse());
  return {from.T_map_base * step.T_i_j, adjoint * from.covariance * adjoint.transpose() + step.covariance};
}

Relocalizer::Relocalizer(const RelocalizerOptions& options)
    : options_(options), drift_(options.systematic), executor_(MakeExecutor(options.schedule, kNiceness)) {}

void Relocalizer::UseSweeps(const Map& map) {
  map_laser_ = options_.laser == LaserLocalize::kAuto ? LaserOf(map, options_.scan_match) : MapLaser{};
}

void Relocalizer::OnGivenPose() {
  finder_.reset();
  unconfirmed_ = 0;
  drift_.Forget();
}

PlanarFix Relocalizer::WithDrift(PlanarFix fix) const {
  fix.covariance += drift_.Covariance();
  return fix;
}

std::optional<PlanarFix> Relocalizer::Find(const PlaceQuery& query) {
  const bool localized = query.last.has_value();
  const bool lost = unconfirmed_ >= kPatience && !query.map_grows;
  if (query.step.has_value() && localized && !query.map_grows) drift_.Move(query.step->T_i_j);
  if (!query.step.has_value() || !query.map->metric || (localized && !lost)) {
    finder_.reset();
    return std::nullopt;
  }
  if (!finder_.has_value()) {
    if (searched_.map != query.map) {
      const auto prepare = [map = query.map] { return std::make_shared<SightMap>(map); };
      searched_ = {query.map, Submit(executor_.get(), prepare).share()};
    }
    finder_.emplace(map_laser_.field, localized, searched_.sights, SightSearch(searched_.sights, executor_.get()));
  }
  finder_->Add(query.packet, query.step->T_i_j);
  const std::optional<SettledPlace> found = finder_->Found();
  if (!found.has_value()) return std::nullopt;
  const PlanarFix place{found->T_map_base, found->covariance};
  if (finder_->ByLaser()) {
    OnGivenPose();
    return place;
  }
  // Until the camera follows from there, the images of the last metres go on to tell.
  unconfirmed_ = kPatience;
  const bool merge = localized && !found->with_expected;
  const PlanarFix merged = merge ? Merged(WithDrift(Moved(*query.last, *query.step)), place) : place;
  drift_.Forget();
  return merged;
}

bool Relocalizer::ViewMayJump() const { return !finder_.has_value() || finder_->ByLaser() || !options_.has_floor; }

std::optional<PlanarFix> Relocalizer::FixByLaser(const FramePacket& packet, const PlanarFix& predicted) const {
  return LaserTracker(map_laser_).Fix(packet, predicted.T_map_base, predicted.covariance);
}

void Relocalizer::AddView(const CameraView& view, const std::vector<Placement>& seen,
                          const std::optional<PlanarFix>& predicted) {
  if (!finder_.has_value() || !(finder_->ByLaser() || options_.has_floor)) return;
  std::optional<SettledPlace> expected;
  if (predicted.has_value()) expected = SettledPlace{predicted->T_map_base, WithDrift(*predicted).covariance};
  finder_->AddView(view, seen, expected);
}

bool Relocalizer::Contradicts(const Rigid3& T_map_base) const {
  return finder_.has_value() && finder_->Contradicts(T_map_base);
}

void Relocalizer::Note(Timestamp stamp, bool by_camera, bool by_laser) {
  if (by_laser) fixed_ = stamp;
  const bool confirmed = by_camera || IsFixed(stamp);
  unconfirmed_ = confirmed ? 0 : unconfirmed_ + 1;
  if (confirmed) drift_.Forget();
}

bool Relocalizer::IsFixed(Timestamp stamp) const {
  constexpr double kBetweenSweeps = 0.3;  // s: a laser turns more slowly than images come
  return fixed_.has_value() && SecondsBetween(*fixed_, stamp) < kBetweenSweeps;
}

}  // namespace planar_vslam
